//! Charts as SVG. Draws what it is given and measures nothing.

mod axis;
mod bars;
mod plot;
mod svg;

pub use axis::{Axis, Scale, plain};
pub use bars::{Bar, Bars};
pub use plot::{Curve, Plot, Point};
pub use svg::escape;

use svg::{At, Canvas, text_width};

/// Colours that people with any kind of colour vision can tell apart (Okabe and Ito's).
const COLOURS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#444444",
];
/// Width of a panel with its labels, pixels.
const WIDTH: f64 = 480.0;
/// Height of a row of the legend, pixels.
const LEGEND_ROW: f64 = 22.0;
const GREY: &str = r##"stroke="#888" stroke-dasharray="2 4""##;

/// One chart of a sheet.
pub enum Panel {
    /// Curves over an axis.
    Plot(Plot),
    /// Bars beside each other.
    Bars(Bars),
}

impl Panel {
    fn height(&self) -> f64 {
        match self {
            Self::Plot(_) => plot::HEIGHT,
            Self::Bars(bars) => bars.height(),
        }
    }

    /// Names of what it shows, each with whether its line is dashed.
    fn names(&self) -> Vec<(&str, bool)> {
        match self {
            Self::Plot(plot) => plot
                .curves
                .iter()
                .map(|c| (c.name.as_str(), c.is_dashed))
                .collect(),
            Self::Bars(bars) => bars.bars.iter().map(|b| (b.name.as_str(), false)).collect(),
        }
    }
}

/// Panels beside and below each other with one legend.
pub struct Sheet {
    /// In rows from the left.
    pub panels: Vec<Panel>,
    /// A line of text below everything.
    pub note: String,
}

/// Panels in a row.
const COLUMNS: usize = 2;

impl Sheet {
    /// The picture. `id` tells it from others on the same page.
    pub fn svg(&self, id: &str) -> String {
        let mut names: Vec<(&str, bool)> = Vec::new();
        for (name, dashed) in self.panels.iter().flat_map(Panel::names) {
            if !name.is_empty() && !names.iter().any(|n| n.0 == name) {
                names.push((name, dashed));
            }
        }
        let index = |name: &str| names.iter().position(|n| n.0 == name).unwrap_or(0);
        let mut canvas = Canvas::default();
        let columns = self.panels.len().clamp(1, COLUMNS);
        let width = WIDTH * columns as f64;
        let mut top = 0.0;
        for (row, panels) in self.panels.chunks(columns).enumerate() {
            for (column, panel) in panels.iter().enumerate() {
                let corner = (WIDTH * column as f64, top);
                let colour = |name: &str| COLOURS[index(name) % COLOURS.len()];
                match panel {
                    Panel::Plot(plot) => {
                        let clip = format!("{id}-{}", row * columns + column);
                        plot.draw(&mut canvas, corner, &clip, &colour);
                    }
                    Panel::Bars(bars) => bars.draw(&mut canvas, corner, &colour),
                }
            }
            top += panels.iter().map(Panel::height).fold(0.0, f64::max);
        }
        let mut slopes: Vec<f64> = Vec::new();
        for panel in &self.panels {
            if let Panel::Plot(Plot { slope: Some(s), .. }) = panel {
                if !slopes.contains(s) {
                    slopes.push(*s);
                }
            }
        }
        top = legend(&mut canvas, (width, top), &names, &slopes);
        if !self.note.is_empty() {
            canvas.text((24.0, top + 14.0), &self.note, r##"fill="#555""##);
            top += LEGEND_ROW;
        }
        canvas.finish(width, top + 10.0)
    }
}

/// A row or more below `top`, as wide as `at.0`; returns where it ends.
fn legend(canvas: &mut Canvas, (width, top): At, names: &[(&str, bool)], slopes: &[f64]) -> f64 {
    let slopes: Vec<String> = slopes
        .iter()
        .map(|s| s.to_string().replace('-', "−").replace("0.5", "½"))
        .collect();
    let guide = (!slopes.is_empty()).then(|| format!("slope {}", slopes.join(" or ")));
    let lines = names
        .iter()
        .enumerate()
        .map(|(i, (name, dashed))| (*name, stroke(COLOURS[i % COLOURS.len()], *dashed)));
    let entries: Vec<(&str, String)> = lines
        .chain(guide.iter().map(|g| (g.as_str(), GREY.to_owned())))
        .collect();
    let longest = entries.iter().map(|e| text_width(e.0)).fold(0.0, f64::max);
    let cell = longest + 60.0;
    let columns = (((width - 24.0) / cell) as usize).max(1);
    for (i, (name, style)) in entries.iter().enumerate() {
        let x = 24.0 + cell * (i % columns) as f64;
        let y = top + LEGEND_ROW * (0.5 + (i / columns) as f64);
        canvas.line((x, y), (x + 30.0, y), style);
        canvas.text((x + 38.0, y + 4.5), name, "");
    }
    top + LEGEND_ROW * entries.len().div_ceil(columns) as f64
}

fn stroke(colour: &str, is_dashed: bool) -> String {
    let dash = if is_dashed {
        r#" stroke-dasharray="6 4""#
    } else {
        ""
    };
    format!(r#"stroke="{colour}" stroke-width="2"{dash}"#)
}
