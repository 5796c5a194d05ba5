//! Curves with bands over two axes.

use super::axis::{Axis, Range, Scale};
use super::svg::{At, Canvas};
use super::{GREY, WIDTH, stroke};

/// Height of a panel with its labels, pixels.
pub const HEIGHT: f64 = 390.0;
/// The area of the axes: distances from the edges of the panel, pixels.
const LEFT: f64 = 86.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 62.0;
/// Points are marked where there are not too many.
const MOST_DOTS: usize = 24;
const GRID: &str = r##"stroke="#e4e4e4""##;

/// A point with the range in which its value lay; `low` = `high` draws no band.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Along the horizontal axis.
    pub x: f64,
    /// Along the vertical axis.
    pub y: f64,
    /// Lower end of the band.
    pub low: f64,
    /// Upper end of the band.
    pub high: f64,
}

impl Point {
    /// A point without a band.
    pub fn new(x: f64, y: f64) -> Self {
        Self {
            x,
            y,
            low: y,
            high: y,
        }
    }
}

/// A line through points.
pub struct Curve {
    /// For the legend; the same name has the same colour in all panels.
    pub name: String,
    /// Drawn dashed.
    pub is_dashed: bool,
    /// From left to right.
    pub points: Vec<Point>,
}

/// Curves over two axes.
pub struct Plot {
    /// Above the axes.
    pub title: String,
    /// Horizontal.
    pub x: Axis,
    /// Vertical.
    pub y: Axis,
    /// What is drawn.
    pub curves: Vec<Curve>,
    /// Slope of faint guides on logarithmic axes.
    pub slope: Option<f64>,
}

impl Plot {
    /// Draws the panel whose corner is given.
    pub(super) fn draw<'a>(
        &self,
        canvas: &mut Canvas,
        corner: At,
        clip: &str,
        colour: &dyn Fn(&str) -> &'a str,
    ) {
        let points = || self.curves.iter().flat_map(|c| &c.points);
        let x = Range::of(self.x.scale, points().map(|p| p.x));
        let y = Range::of(self.y.scale, points().flat_map(|p| [p.y, p.low, p.high]));
        let origin = (corner.0 + LEFT, corner.1 + TOP);
        let size = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
        self.axes(canvas, origin, size, (&x, &y));
        let place = |px: f64, py: f64| {
            let (at_x, at_y) = (x.at(px)?, y.at(py)?);
            Some((origin.0 + size.0 * at_x, origin.1 + size.1 * (1.0 - at_y)))
        };
        let mut inside = Canvas::default();
        if let Some(slope) = self.slope {
            guides(&mut inside, slope, origin, size, (&x, &y));
        }
        for curve in &self.curves {
            band(&mut inside, curve, colour(&curve.name), &place);
        }
        for curve in &self.curves {
            let colour = colour(&curve.name);
            let placed = curve.points.iter().filter_map(|p| place(p.x, p.y));
            let placed: Vec<At> = placed.collect();
            inside.polyline(&placed, &stroke(colour, curve.is_dashed));
            if placed.len() <= MOST_DOTS {
                for at in placed {
                    inside.dot(at, &format!(r#"fill="{colour}""#));
                }
            }
        }
        canvas.clipped(clip, origin, size, &inside);
    }

    /// Frame, title, marks with grid lines, titles of the axes.
    fn axes(&self, canvas: &mut Canvas, origin: At, size: At, (x, y): (&Range, &Range)) {
        let (right, bottom) = (origin.0 + size.0, origin.1 + size.1);
        for (at, label) in x.marks() {
            let px = origin.0 + size.0 * at;
            canvas.line((px, origin.1), (px, bottom), GRID);
            canvas.text((px, bottom + 19.0), &label, MIDDLE);
        }
        for (at, label) in y.marks() {
            let py = bottom - size.1 * at;
            canvas.line((origin.0, py), (right, py), GRID);
            canvas.text((origin.0 - 8.0, py + 4.5), &label, r#"text-anchor="end""#);
        }
        canvas.rectangle(origin, size, r##"fill="none" stroke="#666""##);
        let middle = (origin.0 + size.0 / 2.0, origin.1 + size.1 / 2.0);
        let bold = format!(r#"{MIDDLE} font-weight="bold""#);
        canvas.text((middle.0, origin.1 - 16.0), &self.title, &bold);
        canvas.text((middle.0, bottom + 42.0), &self.x.title, MIDDLE);
        let side = (origin.0 - 64.0, middle.1);
        let turned = format!(
            r#"{MIDDLE} transform="rotate(-90 {:.1} {:.1})""#,
            side.0, side.1
        );
        canvas.text(side, &self.y.title, &turned);
    }
}

const MIDDLE: &str = r#"text-anchor="middle""#;

/// The range of a curve's values, filled.
fn band(canvas: &mut Canvas, curve: &Curve, colour: &str, place: &dyn Fn(f64, f64) -> Option<At>) {
    if curve.points.iter().all(|p| p.low == p.high) {
        return;
    }
    let upper = curve.points.iter().filter_map(|p| place(p.x, p.high));
    let lower = curve.points.iter().rev();
    let lower = lower.filter_map(|p| place(p.x, p.low));
    let outline: Vec<At> = upper.chain(lower).collect();
    canvas.polygon(&outline, &format!(r#"fill="{colour}" fill-opacity="0.18""#));
}

/// Faint lines of the slope, a decade apart, over the whole panel.
fn guides(canvas: &mut Canvas, slope: f64, origin: At, size: At, (x, y): (&Range, &Range)) {
    let ((x0, x1), (y0, y1)) = (x.ends(), y.ends());
    let rise = slope * (x1 - x0);
    // From below the panel to above it, whatever the sign of the slope.
    let first = (y0 - rise.abs()).floor() as i32;
    let last = (y1 + rise.abs()).ceil() as i32;
    for decade in first..=last {
        let start = f64::from(decade);
        let height = |v: f64| origin.1 + size.1 * (1.0 - (v - y0) / (y1 - y0));
        let from = (origin.0, height(start));
        let to = (origin.0 + size.0, height(start + rise));
        canvas.line(from, to, GREY);
    }
}

impl Axis {
    /// Powers of ten.
    pub fn log10(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            scale: Scale::Log10,
        }
    }

    /// Powers of two.
    pub fn log2(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            scale: Scale::Log2,
        }
    }

    /// From zero.
    pub fn linear(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            scale: Scale::Linear,
        }
    }
}
