//! Tables, as HTML and as Markdown.

use etendue::chart::escape;

/// A table with its title.
pub struct Table {
    pub title: &'static str,
    pub head: Vec<&'static str>,
    /// The first so many columns hold text, the others numbers.
    pub texts: usize,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Nothing where there are no rows.
    pub fn html(&self) -> String {
        if self.rows.is_empty() {
            return String::new();
        }
        let row = |cells: &[&str], tag: &str| {
            let cell = |(i, cell): (usize, &&str)| {
                let class = if i < self.texts { "" } else { " class=\"n\"" };
                format!("<{tag}{class}>{}</{tag}>", escape(cell))
            };
            let cells: String = cells.iter().enumerate().map(cell).collect();
            format!("<tr>{cells}</tr>\n")
        };
        let head = row(&self.head, "th");
        let body = self.rows.iter();
        let body: String = body.map(|cells| row(&text(cells), "td")).collect();
        let title = escape(self.title);
        format!("<h3>{title}</h3>\n<table>\n{head}{body}</table>\n")
    }

    /// Nothing where there are no rows.
    pub fn markdown(&self) -> String {
        if self.rows.is_empty() {
            return String::new();
        }
        let row = |cells: &[&str]| {
            let cells: Vec<String> = cells.iter().map(|c| c.replace('|', "\\|")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let marks: Vec<&str> = (0..self.head.len())
            .map(|i| if i < self.texts { "---" } else { "---:" })
            .collect();
        let rows = self.rows.iter();
        let rows: String = rows.map(|cells| row(&text(cells))).collect();
        let (head, marks) = (row(&self.head), row(&marks));
        format!("### {}\n\n{head}{marks}{rows}\n", self.title)
    }
}

fn text(cells: &[String]) -> Vec<&str> {
    cells.iter().map(String::as_str).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_cannot_break_out_of_a_table() {
        let table = Table {
            title: "t",
            head: vec!["a", "b"],
            texts: 1,
            rows: vec![vec![String::from("<x>|"), String::from("1")]],
        };
        assert!(table.markdown().contains("| <x>\\| | 1 |"));
        assert!(
            table
                .html()
                .contains("<td>&lt;x&gt;|</td><td class=\"n\">1</td>")
        );
    }
}
