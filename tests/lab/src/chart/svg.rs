//! Elements of an SVG file, and how wide text is.

use std::fmt::Write as _;

/// Colours, light and then dark. The seven of the data are those of Okabe and Ito, darkened (light) or
/// lightened (dark) until each stands out from the page.
const STYLE: &str = "\
text{font:12px system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif;fill:#1f2328}
.title{font-size:17px;font-weight:600}.head{font-size:13px;font-weight:600}.label{font-size:11.5px}
.tick,.muted{fill:#59636e}.tick{font-size:11px}.end{text-anchor:end}.middle{text-anchor:middle}
.page{fill:#ffffff}.grid{stroke:#e3e7ec}.axis{stroke:#8c959f}.leader{stroke:#b4bcc5}
.line{fill:none;stroke-width:2;stroke-linejoin:round;stroke-linecap:round}
.ring{fill:none;stroke-width:2}.band{opacity:.16}.point{stroke:#ffffff;stroke-width:1}
.f0{fill:#0072b2}.f1{fill:#c94f00}.f2{fill:#00805d}.f3{fill:#b3568a}.f4{fill:#9a6700}.f5{fill:#2b8fc7}.f6{fill:#4b535c}
.l0{stroke:#0072b2}.l1{stroke:#c94f00}.l2{stroke:#00805d}.l3{stroke:#b3568a}.l4{stroke:#9a6700}.l5{stroke:#2b8fc7}.l6{stroke:#4b535c}
@media (prefers-color-scheme:dark){
text{fill:#e6edf3}.tick,.muted{fill:#9da7b3}
.page{fill:#0d1117}.grid{stroke:#22282f}.axis{stroke:#6e7681}.leader{stroke:#4a525b}
.band{opacity:.24}.point{stroke:#0d1117}
.f0{fill:#4aa8e0}.f1{fill:#f0803c}.f2{fill:#2fb890}.f3{fill:#dc8fbb}.f4{fill:#e0a92e}.f5{fill:#8fd0f5}.f6{fill:#c3cad2}
.l0{stroke:#4aa8e0}.l1{stroke:#f0803c}.l2{stroke:#2fb890}.l3{stroke:#dc8fbb}.l4{stroke:#e0a92e}.l5{stroke:#8fd0f5}.l6{stroke:#c3cad2}
}";

/// The class of elements of the data with this number: `f` fills with its colour, `l` draws lines in it.
pub(super) fn class(kind: &str, number: usize) -> String {
    const COLORS: usize = 7;
    format!("{kind}{}", number % COLORS)
}

/// A file being written.
pub(super) struct Svg {
    text: String,
}

impl Svg {
    pub(super) fn new(width: f64, height: f64, title: &str, description: &str) -> Self {
        let mut text = String::new();
        // Writing to a string cannot fail; so everywhere below.
        let _ = writeln!(
            text,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\">\n<title>{}</title>\n<desc>{}</desc>\n\
             <style>\n{STYLE}\n</style>\n<rect class=\"page\" width=\"100%\" height=\"100%\" rx=\"8\"/>",
            escaped(title),
            escaped(description)
        );
        Self { text }
    }

    /// An element with lengths in pixels around what it holds.
    fn element(&mut self, name: &str, class: &str, lengths: &[(&str, f64)], inside: &str) {
        let length = |(key, value): &(&str, f64)| format!(" {key}=\"{value:.1}\"");
        let lengths: String = lengths.iter().map(length).collect();
        let _ = writeln!(self.text, "<{name} class=\"{class}\"{lengths}>{inside}</{name}>");
    }

    pub(super) fn text(&mut self, class: &str, x: f64, y: f64, content: &str) {
        self.element("text", class, &[("x", x), ("y", y)], &escaped(content));
    }

    pub(super) fn line(&mut self, class: &str, (x1, y1): (f64, f64), (x2, y2): (f64, f64)) {
        let ends = [("x1", x1), ("y1", y1), ("x2", x2), ("y2", y2)];
        self.element("line", class, &ends, "");
    }

    /// A `polyline` or `polygon` through points; `hint` shows under the pointer.
    pub(super) fn through(&mut self, name: &str, class: &str, points: &[(f64, f64)], hint: &str) {
        let points: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let (points, hint) = (points.join(" "), hinted(hint));
        let _ = writeln!(
            self.text,
            "<{name} class=\"{class}\" points=\"{points}\">{hint}</{name}>"
        );
    }

    pub(super) fn circle(&mut self, class: &str, (x, y): (f64, f64), radius: f64, hint: &str) {
        let lengths = [("cx", x), ("cy", y), ("r", radius)];
        self.element("circle", class, &lengths, &hinted(hint));
    }

    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

fn hinted(hint: &str) -> String {
    if hint.is_empty() {
        return String::new();
    }
    format!("<title>{}</title>", escaped(hint))
}

/// Text as XML content; characters that XML cannot hold are left out.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => {}
            c => out.push(c),
        }
    }
    out
}

/// About how wide text is in pixels in a sans-serif font of `size` pixels; rather too wide.
fn text_width(text: &str, size: f64) -> f64 {
    let ems = text.chars().map(|character| match character {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' => 0.3,
        'f' | 't' | 'r' | ' ' | '-' | '(' | ')' | '/' | 'I' => 0.38,
        'm' | 'w' | 'M' | 'W' | '%' | '@' => 0.9,
        c if c.is_uppercase() => 0.7,
        _ => 0.59,
    });
    size * ems.sum::<f64>()
}

/// Width of the widest of some texts, as [`text_width`].
pub(super) fn widest<'a>(texts: impl IntoIterator<Item = &'a String>, size: f64) -> f64 {
    let widths = texts.into_iter().map(|text| text_width(text, size));
    widths.fold(0.0, f64::max)
}

/// Text in lines of at most about `width` pixels; a word that is longer has a line of its own.
pub(super) fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(line, size) + text_width(word, size) + 0.4 * size <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Text cut to about `width` pixels.
pub(super) fn shortened(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_owned();
    }
    let mut short = text.to_owned();
    while text_width(&short, size) + size > width && short.pop().is_some() {}
    short + "\u{2026}"
}
