//! All figures on one page of HTML that needs nothing from elsewhere.

use super::{Comparison, Content, Made, Verdict};
use bench::report::html::{document, escaped, picture, table};

/// The page, as an HTML document.
pub fn page(all: &[Made]) -> String {
    let contents: String = chapters(all)
        .iter()
        .map(|(name, made)| contents(name, made))
        .collect();
    let body: String = chapters(all)
        .iter()
        .map(|(name, made)| chapter(name, made))
        .collect();
    let title = "Figures and tables of the thesis, computed";
    let body = format!(
        "<h1>{title}</h1>\n<p>L. Cui, <cite>On the Complex Non-Minimum Phase Zeros in Flexure Mechanisms</cite>. Each figure under its number, drawn by <code>bench figures</code> from what the other commands compute; printed figures beside ours. Commands run in the folder of this page. A difference is computed less printed; it agrees within half of the last printed digit, unless a remark gives another tolerance.</p>\n{}<nav>\n{contents}</nav>\n{body}",
        summary(all)
    );
    document(title, &body)
}

/// How many figures agree.
fn summary(all: &[Made]) -> String {
    let compared = || {
        all.iter()
            .filter_map(|made| made.outcome.as_ref().ok())
            .flat_map(|(content, _)| &content.compared)
    };
    let count = |verdict: Verdict| {
        compared()
            .filter(|comparison| comparison.verdict == verdict)
            .count()
    };
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
    all.chunk_by(|a, b| chapter(a) == chapter(b))
        .map(|made| (format!("Chapter {}", chapter(&made[0])), made))
        .collect()
}

fn contents(name: &str, all: &[Made]) -> String {
    let item = |made: &Made| {
        let (id, name) = (made.entry.id(), made.entry.name());
        let missing = if made.outcome.is_err() {
            " (not computed)"
        } else {
            ""
        };
        format!(
            "<li><a href=\"#{id}\">{}</a> {}{missing}</li>\n",
            escaped(&name),
            escaped(made.entry.title)
        )
    };
    format!(
        "<p>{}</p>\n<ul>\n{}</ul>\n",
        escaped(name),
        all.iter().map(item).collect::<String>()
    )
}

fn chapter(name: &str, all: &[Made]) -> String {
    format!(
        "<h2>{}</h2>\n{}",
        escaped(name),
        all.iter().map(section).collect::<String>()
    )
}

fn section(made: &Made) -> String {
    let head = format!(
        "<section id=\"{}\">\n<h3>{}</h3>\n",
        made.entry.id(),
        escaped(&made.entry.heading())
    );
    let body = match &made.outcome {
        Err(reason) => format!("<p class=\"quiet\">Not computed: {}</p>\n", escaped(reason)),
        Ok((content, svg)) => {
            figure(&made.entry.heading(), content, svg.as_deref()) + &facts(content)
        }
    };
    format!("{head}{body}</section>\n")
}

fn figure(heading: &str, content: &Content, svg: Option<&str>) -> String {
    match svg {
        None => format!("<p>{}</p>\n", escaped(&content.drawn)),
        Some(svg) => picture(svg, heading, &content.drawn),
    }
}

fn facts(content: &Content) -> String {
    let item = |label: &str, text: &String| format!("<li>{label}: {}</li>\n", escaped(text));
    let settings = content.settings.iter().map(|text| item("Settings", text));
    let assumed = content
        .assumed
        .iter()
        .map(|text| item("Assumed, as the thesis does not print it", text));
    let list: String = settings.chain(assumed).collect();
    let list = if list.is_empty() {
        list
    } else {
        format!("<ul class=\"facts\">\n{list}</ul>\n")
    };
    list + &comparisons(&content.compared) + &commands(&content.commands)
}

fn comparisons(compared: &[Comparison]) -> String {
    if compared.is_empty() {
        return String::new();
    }
    let rows: String = compared.iter().map(comparison).collect();
    table(
        &["Figure", "Printed", "Computed", "Difference", "Verdict"],
        &rows,
    )
}

fn comparison(row: &Comparison) -> String {
    let (class, verdict) = match row.verdict {
        Verdict::Agrees => ("", "agrees"),
        Verdict::Differs => (" class=\"differs\"", "differs"),
        Verdict::NotPrinted => ("", ""),
    };
    let tolerance = row
        .tolerance
        .map_or(String::new(), |t| format!(" (±{})", short(t)));
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
    format!(
        "<pre><code>{}</code></pre>\n",
        escaped(&commands.join("\n"))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_means_something_to_html_is_escaped() {
        let row = Comparison::words("|S| < 1 & more", "<b>", "<b>");
        assert!(
            comparison(&row).contains("|S| &lt; 1 &amp; more") && !comparison(&row).contains("<b>")
        );
    }
}
