//! Scales of axes, and where their marks stand.

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly, from zero.
    Linear,
    /// By their logarithm, with marks at powers of two.
    Log2,
    /// By their logarithm, with marks at powers of ten, or between them where they are few.
    Log10,
}

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// What it shows, with the unit.
    pub title: String,
    /// How.
    pub scale: Scale,
}

/// Most marks of an axis; with more their labels meet.
const MOST_MARKS: usize = 8;
/// Space beyond the outermost values of a logarithmic axis, as a share of the axis.
const MARGIN: f64 = 0.05;
/// Least span of a logarithmic axis: values that hardly differ shall look so.
const LEAST_DECADES: f64 = 0.5;

/// Powers that are written out.
const SHORT: std::ops::Range<f64> = 0.01..100_000.0;

/// A scale with the range that it shows, in coordinates along the axis.
pub struct Range {
    scale: Scale,
    from: f64,
    to: f64,
}

impl Range {
    /// Holds all the values that the scale can show.
    pub fn of(scale: Scale, values: impl Iterator<Item = f64>) -> Self {
        let shown = values.filter(|v| v.is_finite() && (scale == Scale::Linear || *v > 0.0));
        let coordinates: Vec<f64> = shown.map(|v| coordinate(scale, v)).collect();
        let low = coordinates.iter().copied().fold(f64::INFINITY, f64::min);
        let high = coordinates
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max);
        if coordinates.is_empty() {
            return Self {
                scale,
                from: 0.0,
                to: 1.0,
            };
        }
        if scale == Scale::Linear {
            let step = step(high.max(f64::MIN_POSITIVE), MOST_MARKS);
            return Self {
                scale,
                from: low.min(0.0),
                to: (high / step).ceil() * step,
            };
        }
        let margin = MARGIN * (high - low);
        let missing = (LEAST_DECADES - (high - low)).max(0.0) / 2.0;
        Self {
            scale,
            from: low - margin - missing,
            to: high + margin + missing,
        }
    }

    /// Where a value stands, 0 … 1 along the axis; `None` where a logarithm has no answer.
    pub fn at(&self, value: f64) -> Option<f64> {
        let at = (coordinate(self.scale, value) - self.from) / (self.to - self.from);
        at.is_finite().then_some(at)
    }

    /// Coordinates of the ends.
    pub fn ends(&self) -> (f64, f64) {
        (self.from, self.to)
    }

    /// Places 0 … 1 with labels.
    pub fn marks(&self) -> Vec<(f64, String)> {
        let values = match self.scale {
            Scale::Linear => self.linear_marks(),
            Scale::Log2 => self.powers(2.0),
            Scale::Log10 => {
                let span = self.to - self.from;
                if span > 1.8 {
                    self.powers(10.0)
                } else {
                    let decades = self.from.floor() as i32..=self.to.ceil() as i32;
                    let steps: &[f64] = match span < 0.8 {
                        true => &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0],
                        false => &[1.0, 2.0, 5.0],
                    };
                    let parts = decades.flat_map(|e| steps.iter().map(move |m| (e, m)));
                    parts
                        .map(|(e, m)| {
                            let value = m * 10f64.powi(e);
                            (value, plain(value))
                        })
                        .collect()
                }
            }
        };
        let places = values
            .into_iter()
            .filter_map(|(v, label)| Some((self.at(v)?, label)));
        places
            .filter(|(at, _)| (-1e-9..=1.0 + 1e-9).contains(at))
            .collect()
    }

    fn linear_marks(&self) -> Vec<(f64, String)> {
        let step = step(self.to - self.from, MOST_MARKS);
        let digits = (-step.log10().floor()).max(0.0) as usize;
        (0..=MOST_MARKS * 2)
            .map(|i| (self.from / step).ceil() * step + i as f64 * step)
            .filter(|v| *v <= self.to + step * 1e-6)
            .map(|v| (v, format!("{v:.digits$}")))
            .collect()
    }

    fn powers(&self, base: f64) -> Vec<(f64, String)> {
        let unit = base.log10();
        let (first, last) = (
            (self.from / unit - 1e-9).ceil() as i32,
            (self.to / unit + 1e-9).floor() as i32,
        );
        let count = (last - first + 1).max(1) as usize;
        let marks: Vec<i32> = (first..=last).step_by(count.div_ceil(MOST_MARKS)).collect();
        let is_short = |e: &i32| SHORT.contains(&base.powi(*e)) && (base > 2.0 || *e >= 0);
        let label = |e| match marks.iter().all(is_short) {
            true => plain(base.powi(e)),
            false => power(base as u32, e),
        };
        marks.iter().map(|e| (base.powi(*e), label(*e))).collect()
    }
}

fn coordinate(scale: Scale, value: f64) -> f64 {
    match scale {
        Scale::Linear => value,
        Scale::Log2 | Scale::Log10 => value.log10(),
    }
}

/// A round number that cuts a span into at most so many parts.
fn step(span: f64, parts: usize) -> f64 {
    let rough = span / parts as f64;
    let decade = 10f64.powf(rough.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade);
    let fitting = steps.into_iter().find(|s| *s >= rough * (1.0 - 1e-9));
    fitting.unwrap_or(10.0 * decade)
}

/// A number as people write it: three digits, or as few as it needs.
pub fn plain(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-4..7).contains(&exponent) {
        return format!("{value:.1e}");
    }
    let digits = (2 - exponent).max(0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// `base` to the power of a whole number.
fn power(base: u32, exponent: i32) -> String {
    let digits = exponent.to_string();
    let digits = digits.chars().map(|c| match c {
        '-' => '⁻',
        c => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][c as usize - '0' as usize],
    });
    format!("{base}{}", digits.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, values: &[f64]) -> Vec<String> {
        let marks = Range::of(scale, values.iter().copied()).marks();
        marks.into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn marks_are_round_numbers() {
        let linear = ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0", "1.2"];
        assert_eq!(labels(Scale::Linear, &[0.3, 1.1]), linear);
        assert_eq!(
            labels(Scale::Log10, &[0.1, 1.1]),
            ["0.1", "0.2", "0.5", "1"]
        );
        let narrow = ["0.3", "0.5", "0.7", "1"];
        assert_eq!(labels(Scale::Log10, &[0.3, 1.1]), narrow);
        assert_eq!(labels(Scale::Log10, &[0.02, 40.0]), ["0.1", "1", "10"]);
        let small = ["10⁻³", "10⁻²", "10⁻¹", "10⁰", "10¹"];
        assert_eq!(labels(Scale::Log10, &[0.0012, 40.0]), small);
        let powers = ["1", "2", "4", "8", "16"];
        assert_eq!(labels(Scale::Log2, &[1.0, 16.0]), powers);
        let wide = ["2⁸", "2¹⁰", "2¹²", "2¹⁴", "2¹⁶", "2¹⁸", "2²⁰"];
        assert_eq!(labels(Scale::Log2, &[256.0, 1_048_576.0]), wide);
    }

    #[test]
    fn what_has_no_logarithm_has_no_place() {
        let range = Range::of(Scale::Log10, [0.0, 1.0, 10.0, f64::NAN].into_iter());
        assert_eq!(range.at(0.0), None);
        assert!(range.at(1.0).is_some_and(|at| (0.0..0.1).contains(&at)));
    }
}
