//! Bars in groups.

use super::WIDTH;
use super::axis::plain;
use super::svg::{At, Canvas};

/// Height of a bar, its distance to the next, and the space above a group with its label, pixels.
const BAR: f64 = 16.0;
const STEP: f64 = 20.0;
const GROUP: f64 = 26.0;
const TOP: f64 = 44.0;
const LEFT: f64 = 24.0;
/// Space at the right for the longest value, pixels.
const VALUE: f64 = 76.0;

/// A value with the range in which it lay.
pub struct Bar {
    /// What it belongs to; bars of a group follow each other.
    pub group: String,
    /// For the legend; the same name has the same colour in all panels.
    pub name: String,
    /// Its length; not negative.
    pub value: f64,
    /// Lower end of the range.
    pub low: f64,
    /// Upper end of the range.
    pub high: f64,
}

/// Bars from the left, one below the other.
pub struct Bars {
    /// Above the bars, with the unit.
    pub title: String,
    /// From the top.
    pub bars: Vec<Bar>,
    /// Bars of a group stand in one row, each where the one before ends.
    pub is_stacked: bool,
}

impl Bars {
    fn groups(&self) -> impl Iterator<Item = &[Bar]> {
        self.bars.chunk_by(|a, b| a.group == b.group)
    }

    /// Height of the panel, pixels.
    pub(super) fn height(&self) -> f64 {
        let rows = match self.is_stacked {
            true => self.groups().count(),
            false => self.bars.len(),
        };
        TOP + GROUP * self.groups().count() as f64 + STEP * rows as f64 + 20.0
    }

    /// Draws the panel whose corner is given.
    pub(super) fn draw<'a>(
        &self,
        canvas: &mut Canvas,
        corner: At,
        colour: &dyn Fn(&str) -> &'a str,
    ) {
        let style = r#"text-anchor="middle" font-weight="bold""#;
        let title = (corner.0 + WIDTH / 2.0, corner.1 + TOP - 16.0);
        canvas.text(title, &self.title, style);
        let most = match self.is_stacked {
            true => {
                let sums = self.groups().map(|g| g.iter().map(|b| b.value).sum());
                sums.fold(0.0, f64::max)
            }
            false => self.bars.iter().map(|b| b.high).fold(0.0, f64::max),
        };
        let left = corner.0 + LEFT;
        let length = |value: f64| match most > 0.0 {
            true => (WIDTH - LEFT - VALUE) * value / most,
            false => 0.0,
        };
        let mut y = corner.1 + TOP;
        for group in self.groups() {
            canvas.text((left, y + 16.0), &group[0].group, r##"fill="#555""##);
            y += GROUP;
            if self.is_stacked {
                self.stack(canvas, (left, y), group, &length, colour);
                y += STEP;
                continue;
            }
            for bar in group {
                let fill = format!(r#"fill="{}" fill-opacity="0.8""#, colour(&bar.name));
                canvas.rectangle((left, y), (length(bar.value), BAR), &fill);
                let middle = y + BAR / 2.0;
                let ends = (left + length(bar.low), left + length(bar.high));
                if bar.low < bar.high {
                    let style = r##"stroke="#222" stroke-width="1.5""##;
                    canvas.line((ends.0, middle), (ends.1, middle), style);
                }
                let end = ends.1.max(left + length(bar.value));
                canvas.text((end + 6.0, middle + 4.5), &plain(bar.value), "");
                y += STEP;
            }
        }
    }

    /// Draws one row of bars, each with its value inside.
    fn stack<'a>(
        &self,
        canvas: &mut Canvas,
        (left, y): At,
        group: &[Bar],
        length: &dyn Fn(f64) -> f64,
        colour: &dyn Fn(&str) -> &'a str,
    ) {
        let mut x = left;
        for bar in group {
            let width = length(bar.value);
            let fill = format!(r#"fill="{}" fill-opacity="0.8""#, colour(&bar.name));
            canvas.rectangle((x, y), (width, BAR), &fill);
            let style = r##"text-anchor="middle" fill="#fff""##;
            if width > 40.0 {
                let text = format!(
                    "{} ± {}",
                    plain(bar.value),
                    plain(0.5 * (bar.high - bar.low))
                );
                let text = match bar.low < bar.high && width > 80.0 {
                    true => text,
                    false => plain(bar.value),
                };
                canvas.text((x + width / 2.0, y + BAR / 2.0 + 4.5), &text, style);
            }
            x += width;
        }
    }
}
