//! Elements of SVG, as text.

use std::fmt::Write;

/// Pixels to the right and down.
pub type At = (f64, f64);

/// Width of a character of the font on average, pixels; SVG cannot be asked.
const CHARACTER: f64 = 7.0;

/// About how wide a text is drawn, pixels.
pub fn text_width(text: &str) -> f64 {
    CHARACTER * text.chars().count() as f64
}

/// A drawing that grows.
#[derive(Default)]
pub struct Canvas(String);

impl Canvas {
    /// Everything drawn so far as a file of `width` × `height` pixels.
    pub fn finish(&self, width: f64, height: f64) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"sans-serif\" font-size=\"13\" fill=\"#222\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{}</svg>\n",
            self.0
        )
    }

    /// `style` is a list of attributes.
    pub fn line(&mut self, from: At, to: At, style: &str) {
        self.push(format_args!(
            r#"<line x1="{:.1}" y1="{:.1}" x2="{:.1}" y2="{:.1}" {style}/>"#,
            from.0, from.1, to.0, to.1
        ));
    }

    pub fn rectangle(&mut self, corner: At, size: At, style: &str) {
        self.push(format_args!(
            r#"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}" {style}/>"#,
            corner.0, corner.1, size.0, size.1
        ));
    }

    pub fn dot(&mut self, at: At, style: &str) {
        self.push(format_args!(
            r#"<circle cx="{:.1}" cy="{:.1}" r="3" {style}/>"#,
            at.0, at.1
        ));
    }

    pub fn polyline(&mut self, points: &[At], style: &str) {
        let points = list(points);
        self.push(format_args!(
            r#"<polyline points="{points}" fill="none" {style}/>"#
        ));
    }

    pub fn polygon(&mut self, points: &[At], style: &str) {
        let points = list(points);
        self.push(format_args!(r#"<polygon points="{points}" {style}/>"#));
    }

    /// `style` may hold `text-anchor`, `font-weight`, `transform` and such.
    pub fn text(&mut self, at: At, content: &str, style: &str) {
        let content = escape(content);
        self.push(format_args!(
            r#"<text x="{:.1}" y="{:.1}" {style}>{content}</text>"#,
            at.0, at.1
        ));
    }

    /// What is drawn inside shows nothing outside the rectangle. `id` is unique on a page.
    pub fn clipped(&mut self, id: &str, corner: At, size: At, inside: &Self) {
        self.push(format_args!(r#"<clipPath id="{id}">"#));
        self.rectangle(corner, size, "");
        self.push(format_args!("</clipPath>"));
        self.push(format_args!(
            "<g clip-path=\"url(#{id})\">\n{}</g>",
            inside.0
        ));
    }

    fn push(&mut self, element: std::fmt::Arguments) {
        writeln!(self.0, "{element}").expect("a string takes everything");
    }
}

fn list(points: &[At]) -> String {
    let points: Vec<String> = points
        .iter()
        .map(|(x, y)| format!("{x:.1},{y:.1}"))
        .collect();
    points.join(" ")
}

/// Text that stands for itself in XML and HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
