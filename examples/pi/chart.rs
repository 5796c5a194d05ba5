//! The errors as an SVG of two panels.

use std::fmt::Write;

/// One line of the chart.
pub struct Curve {
    pub name: &'static str,
    /// Drawn dashed.
    pub is_heavy: bool,
    /// Number of needles and typical error.
    pub points: Vec<(u64, f64)>,
}

/// Colours that people with any kind of colour vision can tell apart, one for each curve.
const COLOURS: [&str; 5] = ["#0072b2", "#56b4e9", "#009e73", "#d55e00", "#cc79a7"];

/// Pixels: the whole, a panel, its top.
const SIZE: (f64, f64) = (960.0, 480.0);
const PANEL: (f64, f64) = (380.0, 330.0);
const TOP: f64 = 50.0;

/// Axes of one panel: pixels are linear in the coordinates.
struct Panel {
    left: f64,
    /// Ends of the axes.
    x: (f64, f64),
    y: (f64, f64),
}

impl Panel {
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let part = |value: f64, (from, to): (f64, f64)| (value - from) / (to - from);
        (
            self.left + PANEL.0 * part(x, self.x),
            TOP + PANEL.1 * (1.0 - part(y, self.y)),
        )
    }

    /// Frame, title, ticks of both axes with grid lines, title of the x axis.
    fn axes(&self, title: &str, x: &[(f64, String)], y: &[(f64, String)]) -> String {
        let mut out = String::new();
        let (right, bottom) = (self.left + PANEL.0, TOP + PANEL.1);
        let middle = self.left + PANEL.0 / 2.0;
        for (value, label) in x {
            let px = self.at(*value, self.y.0).0;
            line(&mut out, (px, TOP), (px, bottom), GRID);
            text(&mut out, (px, bottom + 18.0), "middle", label);
        }
        for (value, label) in y {
            let py = self.at(self.x.0, *value).1;
            line(&mut out, (self.left, py), (right, py), GRID);
            text(&mut out, (self.left - 8.0, py + 4.0), "end", label);
        }
        let (w, h, left) = (PANEL.0, PANEL.1, self.left);
        writeln!(
            out,
            r##"<rect x="{left}" y="{TOP}" width="{w}" height="{h}" fill="none" stroke="#444"/>"##
        )
        .expect("a string takes everything");
        text(&mut out, (middle, TOP - 14.0), "middle", title);
        text(&mut out, (middle, bottom + 38.0), "middle", "needles N");
        out
    }
}

const GRID: &str = r##"stroke="#ddd""##;

fn line(out: &mut String, from: (f64, f64), to: (f64, f64), style: &str) {
    writeln!(
        out,
        r#"<line x1="{:.1}" y1="{:.1}" x2="{:.1}" y2="{:.1}" {style}/>"#,
        from.0, from.1, to.0, to.1
    )
    .expect("a string takes everything");
}

fn text(out: &mut String, at: (f64, f64), anchor: &str, content: &str) {
    writeln!(
        out,
        r#"<text x="{:.1}" y="{:.1}" text-anchor="{anchor}">{content}</text>"#,
        at.0, at.1
    )
    .expect("a string takes everything");
}

/// Stroke of a curve.
fn stroke(index: usize, curve: &Curve) -> String {
    let dash = if curve.is_heavy { "6 4" } else { "none" };
    let colour = COLOURS[index];
    format!(r#"stroke="{colour}" stroke-width="2" stroke-dasharray="{dash}""#)
}

/// The curves with the binary logarithm of N along x and `y(N, error)` along y.
fn lines(panel: &Panel, curves: &[Curve], y: impl Fn(f64, f64) -> f64) -> String {
    let mut out = String::new();
    for (index, curve) in curves.iter().enumerate() {
        let points: Vec<String> = curve
            .points
            .iter()
            .map(|&(count, error)| {
                let n = count as f64;
                let (px, py) = panel.at(n.log2(), y(n, error));
                format!("{px:.1},{py:.1}")
            })
            .collect();
        let style = stroke(index, curve);
        let list = points.join(" ");
        writeln!(out, r#"<polyline points="{list}" fill="none" {style}/>"#)
            .expect("a string takes everything");
    }
    out
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

/// Error over N on logarithmic axes, and beside it the error times √N, which a finite
/// variance keeps level. All curves have the same N, at least one.
pub fn draw(curves: &[Curve]) -> String {
    let logs: Vec<f64> = curves[0]
        .points
        .iter()
        .map(|p| (p.0 as f64).log2())
        .collect();
    let x = (logs[0], logs[logs.len() - 1]);
    let x_ticks: Vec<_> = logs
        .iter()
        .step_by(2)
        .map(|&log| (log, power(2, log as i32)))
        .collect();
    let all = || curves.iter().flat_map(|curve| &curve.points);
    let least = all()
        .map(|p| p.1)
        .fold(f64::INFINITY, f64::min)
        .log10()
        .floor();
    let most = all().map(|p| p.1).fold(0.0, f64::max).log10().ceil();
    let left = Panel {
        left: 70.0,
        x,
        y: (least, most),
    };
    let decades: Vec<_> = (least as i32..=most as i32)
        .map(|e| (f64::from(e), power(10, e)))
        .collect();
    let scaled = |n: f64, error: f64| error * n.sqrt();
    let top = all().map(|&(n, e)| scaled(n as f64, e)).fold(0.0, f64::max);
    let right = Panel {
        left: 550.0,
        x,
        y: (0.0, (2.0 * top).ceil() / 2.0),
    };
    let halves: Vec<_> = (0..=(right.y.1 * 2.0) as i32)
        .map(|i| (f64::from(i) / 2.0, format!("{:.1}", f64::from(i) / 2.0)))
        .collect();

    let (w, h) = SIZE;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
         font-family=\"sans-serif\" font-size=\"13\" fill=\"#222\">\n\
         <rect width=\"{w}\" height=\"{h}\" fill=\"#fff\"/>\n"
    );
    out += &left.axes(
        "median |error| of the mean of N needles",
        &x_ticks,
        &decades,
    );
    // Half a decade an octave and a half: 10^(−½) for each factor of 10 in N.
    let fall = 0.5 * (x.1 - x.0) * std::f64::consts::LOG10_2;
    let (from, to) = (left.at(x.0, least + fall), left.at(x.1, least));
    line(
        &mut out,
        from,
        to,
        r##"stroke="#888" stroke-dasharray="2 3""##,
    );
    text(&mut out, (from.0 + 10.0, from.1 + 56.0), "start", "∝ 1/√N");
    out += &lines(&left, curves, |_, error| error.log10());
    out += &right.axes("the same times √N", &x_ticks, &halves);
    out += &lines(&right, curves, scaled);
    legend(&mut out, curves);
    out += "</svg>\n";
    out
}

/// Names below the panels; dashed is explained once.
fn legend(out: &mut String, curves: &[Curve]) {
    let y = SIZE.1 - 34.0;
    for (index, curve) in curves.iter().enumerate() {
        let x = 70.0 + 175.0 * index as f64;
        line(out, (x, y), (x + 34.0, y), &stroke(index, curve));
        text(out, (x + 42.0, y + 4.0), "start", curve.name);
    }
    let note = "Dashed: the detector of heavy tails says that σ is not trustworthy. \
                The last points are medians of few blocks.";
    text(out, (70.0, SIZE.1 - 10.0), "start", note);
}
