//! Elements of an SVG file, and how wide text is.

use std::fmt::Write as _;

/// Colours, light and then dark. The seven of the data are those of Okabe and Ito, darkened (light) or
/// lightened (dark) until each stands out from the page.
const STYLE: &str = "\
text{font:12px system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif;fill:#1f2328}
.title{font-size:17px;font-weight:600}.head{font-size:13px;font-weight:600}.label{font-size:11.5px}
.tick,.muted{fill:#59636e}.tick{font-size:11px}.end{text-anchor:end}.middle{text-anchor:middle}
.page{fill:#ffffff}.grid{stroke:#e3e7ec}.axis{stroke:#8c959f}.leader{stroke:#b4bcc5}
.mark{stroke:#59636e;stroke-dasharray:4 3}.line{fill:none;stroke-width:2;stroke-linejoin:round;stroke-linecap:round}
.ring{fill:none;stroke-width:2}.band{opacity:.16}.point{stroke:#ffffff;stroke-width:1}
.f0{fill:#0072b2}.f1{fill:#c94f00}.f2{fill:#00805d}.f3{fill:#b3568a}.f4{fill:#9a6700}.f5{fill:#2b8fc7}.f6{fill:#4b535c}
.l0{stroke:#0072b2}.l1{stroke:#c94f00}.l2{stroke:#00805d}.l3{stroke:#b3568a}.l4{stroke:#9a6700}.l5{stroke:#2b8fc7}.l6{stroke:#4b535c}
@media (prefers-color-scheme:dark){
text{fill:#e6edf3}.tick,.muted{fill:#9da7b3}
.page{fill:#0d1117}.grid{stroke:#22282f}.axis{stroke:#6e7681}.leader{stroke:#4a525b}.mark{stroke:#9da7b3}
.band{opacity:.24}.point{stroke:#0d1117}
.f0{fill:#4aa8e0}.f1{fill:#f0803c}.f2{fill:#2fb890}.f3{fill:#dc8fbb}.f4{fill:#e0a92e}.f5{fill:#8fd0f5}.f6{fill:#c3cad2}
.l0{stroke:#4aa8e0}.l1{stroke:#f0803c}.l2{stroke:#2fb890}.l3{stroke:#dc8fbb}.l4{stroke:#e0a92e}.l5{stroke:#8fd0f5}.l6{stroke:#c3cad2}
}";

/// Number of colours of data; classes `f0`, ... fill with them and `l0`, ... draw lines in them.
pub(super) const COLORS: usize = 7;

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

    pub(super) fn text(&mut self, class: &str, x: f64, y: f64, content: &str) {
        let _ = writeln!(
            self.text,
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\">{}</text>",
            escaped(content)
        );
    }

    pub(super) fn line(&mut self, class: &str, from: (f64, f64), to: (f64, f64)) {
        let _ = writeln!(
            self.text,
            "<line class=\"{class}\" x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"/>",
            from.0, from.1, to.0, to.1
        );
    }

    /// A line through points.
    pub(super) fn polyline(&mut self, class: &str, points: &[(f64, f64)]) {
        let _ = writeln!(
            self.text,
            "<polyline class=\"{class}\" points=\"{}\"/>",
            listed(points)
        );
    }

    /// A filled outline; `hint` shows under the pointer.
    pub(super) fn polygon(&mut self, class: &str, points: &[(f64, f64)], hint: &str) {
        let (points, hint) = (listed(points), hinted(hint));
        let _ = writeln!(
            self.text,
            "<polygon class=\"{class}\" points=\"{points}\">{hint}</polygon>"
        );
    }

    pub(super) fn circle(&mut self, class: &str, center: (f64, f64), radius: f64, hint: &str) {
        let ((x, y), hint) = (center, hinted(hint));
        let _ = writeln!(
            self.text,
            "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\">{hint}</circle>"
        );
    }

    pub(super) fn rectangle(&mut self, class: &str, corner: (f64, f64), size: (f64, f64), hint: &str) {
        let ((x, y), (width, height), hint) = (corner, size, hinted(hint));
        let _ = writeln!(
            self.text,
            "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" \
             rx=\"1.5\">{hint}</rect>"
        );
    }

    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

fn listed(points: &[(f64, f64)]) -> String {
    let texts: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    texts.join(" ")
}

fn hinted(hint: &str) -> String {
    if hint.is_empty() {
        String::new()
    } else {
        format!("<title>{}</title>", escaped(hint))
    }
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
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let ems = text.chars().map(|character| match character {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' => 0.3,
        'f' | 't' | 'r' | ' ' | '-' | '(' | ')' | '/' | 'I' => 0.38,
        'm' | 'w' | 'M' | 'W' | '%' | '@' => 0.9,
        c if c.is_uppercase() => 0.7,
        _ => 0.59,
    });
    size * ems.sum::<f64>()
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
    let mut short = String::new();
    for character in text.chars() {
        short.push(character);
        if text_width(&short, size) + size > width {
            break;
        }
    }
    short.push('\u{2026}');
    short
}
