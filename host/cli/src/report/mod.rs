//! A report: one self-contained HTML page of facts and pictures, without scripts and without anything from the network.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

const STYLE: &str = include_str!("style.css");

/// How the pictures are to be read; the same in every report.
const CONVENTIONS: [&str; 4] = [
    "Intensity is s0, the full power of the light: what the camera would have seen without a polarizer. The degree of \
     linear polarization, DoLP, is the polarized share of it: 0 is unpolarized, 1 is fully polarized.",
    "The angle of linear polarization, AoLP, is the direction in which the light swings, as seen in the picture: 0\u{b0} is \
     horizontal, 45\u{b0} points to the upper right, 90\u{b0} is vertical, counter-clockwise; 180\u{b0} is 0\u{b0} again, \
     so its colors go round in a circle. Where DoLP is near 0 the angle is noise, whatever its color; the picture of both \
     together shows such places dark.",
    "In terms of Stokes components: s1 > 0 is horizontal, s2 > 0 points to the upper right, \
     AoLP = \u{bd} atan2(s2, s1), DoLP = \u{221a}(s1\u{b2} + s2\u{b2}) / s0. Pixel rows run down, but angles are taken \
     with y up.",
    "Light reflected by a smooth surface of glass, water, paint or plastic is polarized perpendicular to the plane of \
     incidence: a wet floor or a pond is horizontal, near 0\u{b0} or 180\u{b0}. Flags tell which pixels not to trust: \
     saturated samples are left out of the fit, never clipped in.",
];

/// A page in the making.
pub(crate) struct Report {
    title: String,
    lead: String,
    warnings: Vec<String>,
    facts: Vec<(String, String)>,
    figures: Vec<Figure>,
}

/// A picture with its caption.
pub(crate) struct Figure {
    /// A few words above the caption.
    pub(crate) title: String,
    /// A sentence or two.
    pub(crate) caption: String,
    /// The picture: the bytes of a PNG file.
    pub(crate) png: Vec<u8>,
}

impl Report {
    /// A page with a title and a sentence under it. All text is plain: it is escaped here.
    pub(crate) fn new(title: impl Into<String>, lead: impl Into<String>) -> Self {
        let (warnings, facts, figures) = (Vec::new(), Vec::new(), Vec::new());
        Self { title: title.into(), lead: lead.into(), warnings, facts, figures }
    }

    /// Adds a line to the table of facts.
    pub(crate) fn fact(&mut self, name: impl Into<String>, value: impl Into<String>) {
        self.facts.push((name.into(), value.into()));
    }

    /// Adds a warning, above the pictures.
    pub(crate) fn warning(&mut self, text: impl Into<String>) {
        self.warnings.push(text.into());
    }

    /// Adds a picture.
    pub(crate) fn figure(&mut self, figure: Figure) {
        self.figures.push(figure);
    }

    /// The whole page.
    pub(crate) fn to_html(&self) -> String {
        let title = escape(&self.title);
        let each = |items: &[String], tag: &str| -> String {
            items.iter().map(|text| format!("{}{}</p>\n", tag, escape(text))).collect()
        };
        let warnings = each(&self.warnings, "<p class=\"warning\" role=\"note\">");
        let facts: String = self
            .facts
            .iter()
            .map(|(name, value)| {
                format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escape(name), escape(value))
            })
            .collect();
        let figures: String = self.figures.iter().map(Figure::to_html).collect();
        let how = each(&CONVENTIONS.map(String::from), "<p>");
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
             <style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<header>\n<h1>{title}</h1>\n\
             <p class=\"lead\">{lead}</p>\n</header>\n{warnings}<h2>Pictures</h2>\n\
             <div class=\"pictures\">\n{figures}</div>\n<h2>Facts</h2>\n<table>\n<tbody>\n{facts}</tbody>\n</table>\n\
             <h2>How to read these pictures</h2>\n<div class=\"how\">\n{how}</div>\n\
             <footer>Made by brewster {version}.</footer>\n</main>\n</body>\n</html>\n",
            lead = escape(&self.lead),
            version = env!("CARGO_PKG_VERSION"),
        )
    }
}

impl Figure {
    fn to_html(&self) -> String {
        let (title, caption) = (escape(&self.title), escape(&self.caption));
        let data = STANDARD.encode(&self.png);
        format!(
            "<figure>\n<img src=\"data:image/png;base64,{data}\" alt=\"{title}\">\n\
             <figcaption><strong>{title}</strong>{caption}</figcaption>\n</figure>\n"
        )
    }
}

/// Text as HTML, in elements and in quoted attributes.
fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            other => safe.push(other),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    /// File names are other people's text.
    #[test]
    fn no_text_becomes_markup_and_nothing_comes_from_outside() {
        let evil = "<script src=\"http://x\">'&amp;\"</script>";
        let mut report = Report::new(evil, evil);
        report.fact(evil, evil);
        report.warning(evil);
        report.figure(Figure { title: evil.into(), caption: evil.into(), png: b"\x89PNG".to_vec() });
        let html = report.to_html();
        assert!(!html.contains("<script") && !html.contains(evil));
        assert_eq!(
            html.matches("&lt;script src=&quot;http://x&quot;&gt;&#39;&amp;amp;&quot;&lt;/script&gt;").count(),
            9
        );
        assert!(html.contains("data:image/png;base64,iVBORw=="));
        for outside in [" href=", "url(", "@import", "src=\"h"] {
            assert!(!html.contains(outside), "{outside}");
        }
    }
}
