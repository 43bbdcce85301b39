//! All figures on one page of HTML that needs nothing from elsewhere.

use super::{Comparison, Content, Made, Verdict};

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#222;--quiet:#5f5f5f;--paper:#fff;--line:#d0d0d0;--code:#f3f3f1;--link:#00588a;--bad:#b04a00}
@media (prefers-color-scheme:dark){:root{--ink:#e6e6e6;--quiet:#a8a8a8;--paper:#16181b;--line:#3c4046;--code:#22262b;--link:#7cc0ee;--bad:#ffb066}}
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
figure svg{display:block;width:100%;height:auto;background:#fff;border-radius:4px}
figcaption,.quiet{color:var(--quiet);font-size:.95rem}
table{border-collapse:collapse;width:100%;font-size:.92rem;margin:1rem 0}
th,td{border-bottom:1px solid var(--line);padding:.3rem .6rem;text-align:left;vertical-align:top}
td.n{font-variant-numeric:tabular-nums}
.differs{color:var(--bad);font-weight:600}
pre{background:var(--code);padding:.6rem .8rem;overflow-x:auto;font-size:.85rem;white-space:pre-wrap;overflow-wrap:anywhere}
ul.facts{padding-left:1.2rem;font-size:.95rem}
@media (max-width:700px){nav ul{columns:1}}
";

/// The page, as an HTML document.
pub fn page(all: &[Made]) -> String {
    let contents: String = chapters(all).iter().map(|(name, made)| contents(name, made)).collect();
    let body: String = chapters(all).iter().map(|(name, made)| chapter(name, made)).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>Figures and tables of the thesis, computed</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>Figures and tables of the thesis, computed</h1>\n<p>L. Cui, <cite>On the Complex Non-Minimum Phase Zeros in Flexure Mechanisms</cite>. Each figure under its number, drawn by <code>bench figures</code> from what the other commands compute; printed figures beside ours. Commands run in the folder of this page. A difference is computed less printed; it agrees within half of the last printed digit, unless a remark gives another tolerance.</p>\n{}<nav>\n{contents}</nav>\n{body}</body>\n</html>\n",
        summary(all)
    )
}

/// How many figures agree.
fn summary(all: &[Made]) -> String {
    let compared =
        || all.iter().filter_map(|made| made.outcome.as_ref().ok()).flat_map(|(content, _)| &content.compared);
    let count = |verdict: Verdict| compared().filter(|comparison| comparison.verdict == verdict).count();
    let none = all.iter().filter(|made| made.outcome.is_err()).count();
    format!(
        "<p class=\"quiet\">{} entries, {none} of them listed with the reason why they are not computed. Of {} printed figures and statements {} agree and {} differ; each that differs says why.</p>\n",
        all.len(),
        count(Verdict::Agrees) + count(Verdict::Differs),
        count(Verdict::Agrees),
        count(Verdict::Differs)
    )
}

/// Entries by chapter, in their order.
fn chapters(all: &[Made]) -> Vec<(String, &[Made])> {
    let chapter = |made: &Made| made.entry.chapter();
    all.chunk_by(|a, b| chapter(a) == chapter(b)).map(|made| (format!("Chapter {}", chapter(&made[0])), made)).collect()
}

fn contents(name: &str, all: &[Made]) -> String {
    let item = |made: &Made| {
        let (id, name) = (made.entry.id(), made.entry.name());
        let missing = if made.outcome.is_err() { " (not computed)" } else { "" };
        format!("<li><a href=\"#{id}\">{}</a> {}{missing}</li>\n", escaped(&name), escaped(made.entry.title))
    };
    format!("<p>{}</p>\n<ul>\n{}</ul>\n", escaped(name), all.iter().map(item).collect::<String>())
}

fn chapter(name: &str, all: &[Made]) -> String {
    format!("<h2>{}</h2>\n{}", escaped(name), all.iter().map(section).collect::<String>())
}

fn section(made: &Made) -> String {
    let head = format!("<section id=\"{}\">\n<h3>{}</h3>\n", made.entry.id(), escaped(&made.entry.heading()));
    let body = match &made.outcome {
        Err(reason) => format!("<p class=\"quiet\">Not computed: {}</p>\n", escaped(reason)),
        Ok((content, svg)) => figure(&made.entry.heading(), content, svg.as_deref()) + &facts(content),
    };
    format!("{head}{body}</section>\n")
}

fn figure(heading: &str, content: &Content, svg: Option<&str>) -> String {
    let drawn = escaped(&content.drawn);
    match svg {
        None => format!("<p>{drawn}</p>\n"),
        Some(svg) => {
            let label = format!("<svg role=\"img\" aria-label=\"{}\" ", escaped(heading));
            let svg = svg.replacen("<svg ", &label, 1);
            format!("<figure>\n{}\n<figcaption>{drawn}</figcaption>\n</figure>\n", svg.trim_end())
        }
    }
}

fn facts(content: &Content) -> String {
    let item = |label: &str, text: &String| format!("<li>{label}: {}</li>\n", escaped(text));
    let settings = content.settings.iter().map(|text| item("Settings", text));
    let assumed = content.assumed.iter().map(|text| item("Assumed, as the thesis does not print it", text));
    let list: String = settings.chain(assumed).collect();
    let list = if list.is_empty() { list } else { format!("<ul class=\"facts\">\n{list}</ul>\n") };
    list + &comparisons(&content.compared) + &commands(&content.commands)
}

fn comparisons(compared: &[Comparison]) -> String {
    if compared.is_empty() {
        return String::new();
    }
    let rows: String = compared.iter().map(comparison).collect();
    format!(
        "<table>\n<thead><tr><th>Figure</th><th>Printed</th><th>Computed</th><th>Difference</th><th>Verdict</th></tr></thead>\n<tbody>\n{rows}</tbody>\n</table>\n"
    )
}

fn comparison(row: &Comparison) -> String {
    let (class, verdict) = match row.verdict {
        Verdict::Agrees => ("", "agrees"),
        Verdict::Differs => (" class=\"differs\"", "differs"),
        Verdict::NotPrinted => ("", ""),
    };
    let tolerance = row.tolerance.map_or(String::new(), |t| format!(" (±{})", short(t)));
    let remark = if row.remark.is_empty() {
        String::new()
    } else {
        format!("<br><span class=\"quiet\">{}</span>", escaped(&row.remark))
    };
    format!(
        "<tr><td>{}{remark}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}{}</td><td{class}>{verdict}</td></tr>\n",
        escaped(&row.what),
        escaped(&row.printed),
        escaped(&row.computed),
        escaped(&row.difference),
        escaped(&tolerance)
    )
}

/// A tolerance in as few digits as it has.
fn short(tolerance: f64) -> String {
    let text = format!("{tolerance:.8}");
    text.trim_end_matches('0').trim_end_matches('.').into()
}

fn commands(commands: &[String]) -> String {
    if commands.is_empty() {
        return String::new();
    }
    format!("<pre><code>{}</code></pre>\n", escaped(&commands.join("\n")))
}

/// Text that means nothing to HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;").replace('\'', "&#39;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_means_something_to_html_is_escaped() {
        assert_eq!(escaped("<a href=\"x\">'&'"), "&lt;a href=&quot;x&quot;&gt;&#39;&amp;&#39;");
        let row = Comparison::words("|S| < 1 & more", "<b>", "<b>");
        assert!(comparison(&row).contains("|S| &lt; 1 &amp; more") && !comparison(&row).contains("<b>"));
    }
}
