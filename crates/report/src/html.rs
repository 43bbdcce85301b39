//! Self-contained HTML pages, in light and dark mode, for wide and narrow screens.

use super::chart::dark_style;

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#222;--quiet:#5f5f5f;--paper:#fff;--line:#d0d0d0;--code:#f3f3f1;--link:#00588a;--bad:#b04a00;--good:#1f7a4d}
@media screen and (prefers-color-scheme:dark){:root{--ink:#e6e6e6;--quiet:#a8a8a8;--paper:#16181b;--line:#3c4046;--code:#22262b;--link:#7cc0ee;--bad:#ffb066;--good:#6fd3a2}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:1080px;padding:1.5rem;background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,sans-serif}
h1,h2,h3{line-height:1.25}
h2{margin-top:3rem;border-bottom:1px solid var(--line)}
h3{margin-top:2.5rem}
a{color:var(--link)}
nav ul{columns:2;padding-left:1.2rem;margin:.3rem 0 1rem}
nav li{break-inside:avoid;font-size:.92rem}
nav p{margin:.6rem 0 0;font-weight:600}
figure{margin:1rem 0}
figure svg{display:block;width:100%;height:auto;background:var(--paper);border-radius:4px}
figcaption,.quiet{color:var(--quiet);font-size:.95rem}
table{border-collapse:collapse;width:100%;font-size:.92rem;margin:1rem 0}
th,td{border-bottom:1px solid var(--line);padding:.3rem .6rem;text-align:left;vertical-align:top}
td.n{font-variant-numeric:tabular-nums;white-space:nowrap}
.differs{color:var(--bad);font-weight:600}
pre{background:var(--code);padding:.6rem .8rem;overflow-x:auto;font-size:.85rem;white-space:pre-wrap;overflow-wrap:anywhere}
ul.facts{padding-left:1.2rem;font-size:.95rem}
.verdict{font-size:1.15rem;border-left:.35rem solid var(--quiet);padding:.2rem 0 .2rem 1rem}
.verdict.detected{border-color:var(--bad)}
.verdict.excluded{border-color:var(--good)}
.verdict strong{font-size:1.4rem}
.wide{overflow-x:auto}
dl{display:grid;grid-template-columns:fit-content(50%) 1fr;gap:.2rem 1.2rem;font-size:.95rem}
dt{color:var(--quiet)}
dd{margin:0;overflow-wrap:anywhere}
@media (max-width:700px){
body{padding:.8rem}
nav ul{columns:1}
dl{grid-template-columns:1fr;gap:0}
dd{margin-bottom:.5rem}
figure{overflow-x:auto}
figure svg{min-width:640px}
}
@page{margin:14mm}
@media print{
:root{color-scheme:light}
body{max-width:none;padding:0;font-size:10.5pt}
h1,h2,h3,.quiet{break-after:avoid}
h2{margin-top:1.5rem}
figure,tr,dt,.verdict{break-inside:avoid}
dd{break-before:avoid}
thead{display:table-header-group}
figure{overflow:visible}
figure svg{min-width:0;max-height:225mm}
.wide{overflow:visible}
table{font-size:9pt}
pre{font-size:7.5pt;background:none;overflow:visible}
details:not([open]),.readout,[role=status]{display:none}
section:has(>details:not([open])){display:none}
}
";

/// Cursor readout and zoom of the plots: `attachPlots(root)` attaches to all plots below an element.
pub const PLOT_SCRIPT: &str = include_str!("plot.js");

/// A page with a title and a body of HTML.
pub fn document(title: &str, body: &str) -> String {
    let title = escaped(title);
    let body = with_one_style(body);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    )
}

/// A page whose plots have a cursor readout and zoom.
pub fn document_with_plots(title: &str, body: &str) -> String {
    let script = without_comments(PLOT_SCRIPT);
    document(title, &format!("{body}<script>\n{script}</script>\n"))
}

/// The style of the charts applies to the whole page: the first chart has it, the others need none.
fn with_one_style(body: &str) -> String {
    let style = dark_style();
    match body.split_once(&style) {
        Some((before, after)) => format!("{before}{style}{}", after.replace(&style, "")),
        None => body.into(),
    }
}

/// A script without indentation and without its lines of comment.
fn without_comments(script: &str) -> String {
    let lines = script.lines().map(str::trim_start);
    let code = lines.filter(|line| !line.is_empty() && !line.starts_with("//"));
    code.flat_map(|line| [line, "\n"]).collect()
}

/// A section with a heading; `body` is HTML.
pub fn section(heading: &str, body: &str) -> String {
    let heading = escaped(heading);
    format!("<section>\n<h2>{heading}</h2>\n{body}</section>\n")
}

/// A paragraph of secondary importance.
pub fn note(text: &str) -> String {
    format!("<p class=\"quiet\">{}</p>\n", escaped(text))
}

/// An SVG with a description for screen readers, and a caption.
pub fn picture(svg: &str, description: &str, caption: &str) -> String {
    let labelled = format!("<svg role=\"img\" aria-label=\"{}\" ", escaped(description));
    let svg = svg.replacen("<svg ", &labelled, 1);
    let caption = escaped(caption);
    format!(
        "<figure>\n{}\n<figcaption>{caption}</figcaption>\n</figure>\n",
        svg.trim_end()
    )
}

/// A table. The rows are HTML; [`Table`](crate::table::Table) makes them of text.
pub fn table(columns: &[&str], rows: &str) -> String {
    let columns: String = columns
        .iter()
        .map(|cell| format!("<th>{}</th>", escaped(cell)))
        .collect();
    format!(
        "<div class=\"wide\"><table>\n<thead><tr>{columns}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n"
    )
}

/// A list of names and values.
pub fn facts(pairs: &[(String, String)]) -> String {
    let pairs = pairs.iter();
    let pairs: String = pairs
        .map(|(name, value)| format!("<dt>{}</dt><dd>{}</dd>\n", escaped(name), escaped(value)))
        .collect();
    format!("<dl>\n{pairs}</dl>\n")
}

/// Text with the special characters of HTML and XML escaped. A control character, which XML does not allow, becomes U+FFFD.
pub fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\'' => escaped += "&#39;",
            '\t' | '\n' | '\r' => escaped.push(character),
            '\0'..='\x1f' | '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            _ => escaped.push(character),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The characters are those of XML 1.0, section 2.2.
    #[test]
    fn replaces_characters_that_xml_does_not_allow() {
        assert_eq!(
            escaped("a\0b\x1bc\u{ffff}\td\u{85}µ😀"),
            "a\u{fffd}b\u{fffd}c\u{fffd}\td\u{85}µ😀"
        );
    }

    #[test]
    fn escapes_the_special_characters_of_html() {
        assert_eq!(
            escaped("<a href=\"x\">'&'"),
            "&lt;a href=&quot;x&quot;&gt;&#39;&amp;&#39;"
        );
        let all = document("<t>", &picture("<svg x=\"1\"/>", "\"<l>", "<c>"));
        for raw in ["<t>", "<l>", "<c>", "<h>", "\"\""] {
            assert!(!all.contains(raw), "{raw}: {all}");
        }
    }
}
