//! The errors as a chart of two panels.

use etendue::chart::{Axis, Curve, Panel, Plot, Point, Sheet};

/// Errors of one estimator.
pub struct Errors {
    pub name: &'static str,
    /// Drawn dashed.
    pub is_heavy: bool,
    /// Number of needles and typical error.
    pub points: Vec<(u64, f64)>,
}

/// Error over N on logarithmic axes, and beside it the error times √N, which a finite
/// variance keeps level.
pub fn draw(all: &[Errors]) -> String {
    let curves = |y: fn(f64, f64) -> f64| {
        let curve = |errors: &Errors| {
            let points = errors.points.iter().map(|&(count, error)| {
                let n = count as f64;
                Point::new(n, y(n, error))
            });
            Curve {
                name: errors.name.to_owned(),
                is_dashed: errors.is_heavy,
                points: points.collect(),
            }
        };
        all.iter().map(curve).collect()
    };
    let errors = Plot {
        title: String::from("median |error| of the mean of N needles"),
        x: Axis::log2("needles N"),
        y: Axis::log10("|error|"),
        curves: curves(|_, error| error),
        slope: Some(-0.5),
    };
    let scaled = Plot {
        title: String::from("the same times √N"),
        x: Axis::log2("needles N"),
        y: Axis::linear("|error| √N"),
        curves: curves(|n, error| error * n.sqrt()),
        slope: None,
    };
    let sheet = Sheet {
        panels: vec![Panel::Plot(errors), Panel::Plot(scaled)],
        note: String::from(
            "Dashed: the detector of heavy tails says that σ is not trustworthy. \
             The last points are medians of few blocks.",
        ),
    };
    sheet.svg("pi")
}
