//! All figures on one self-contained HTML page.

use super::{Comparison, Content, Figure, Outcome, Verdict};
use bench_report::html::{document, escaped, picture, table};

const TITLE: &str = "Figures and tables of the thesis, computed";
const INTRODUCTION: &str = "<p>L. Cui, <cite>On the Complex Non-Minimum Phase Zeros in Flexure Mechanisms</cite>. Each figure is drawn \
    from what the <code>bench</code> commands compute, with printed values beside computed ones. Commands run in the folder of this \
    page. A difference is computed minus printed; it agrees within half of the last printed digit, unless a remark gives another \
    tolerance.</p>\n";

/// The page as an HTML document.
pub fn page(figures: &[Figure]) -> String {
    let chapters = chapters(figures);
    let contents: String = chapters.iter().map(|figures| contents(figures)).collect();
    let body: String = chapters.iter().map(|figures| chapter(figures)).collect();
    let summary = summary(figures);
    let body = format!("<h1>{TITLE}</h1>\n{INTRODUCTION}{summary}<nav>\n{contents}</nav>\n{body}");
    document(TITLE, &body)
}

/// How many values agree.
fn summary(figures: &[Figure]) -> String {
    let contents: Vec<&Content> = figures.iter().filter_map(Figure::content).collect();
    let compared = || contents.iter().flat_map(|content| &content.compared);
    let count = |verdict: Verdict| {
        compared()
            .filter(|comparison| comparison.verdict == verdict)
            .count()
    };
    let (agree, differ) = (count(Verdict::Agrees), count(Verdict::Differs));
    let not_computed = figures.len() - contents.len();
    format!(
        "<p class=\"quiet\">{} entries; {not_computed} of them are not computed, with the reason. Of {} printed values and statements \
         {agree} agree and {differ} differ; each that differs has a remark.</p>\n",
        figures.len(),
        agree + differ,
    )
}

/// Figures by chapter.
fn chapters(figures: &[Figure]) -> Vec<&[Figure]> {
    let chapter = |figure: &Figure| figure.entry.chapter();
    figures.chunk_by(|a, b| chapter(a) == chapter(b)).collect()
}

fn contents(figures: &[Figure]) -> String {
    let chapter = figures[0].entry.chapter();
    let items: String = figures.iter().map(item).collect();
    format!("<p>Chapter {chapter}</p>\n<ul>\n{items}</ul>\n")
}

fn item(figure: &Figure) -> String {
    let (id, name, title) = (
        figure.entry.id(),
        figure.entry.name(),
        escaped(figure.entry.title),
    );
    let missing = if figure.content().is_some() {
        ""
    } else {
        " (not computed)"
    };
    format!("<li><a href=\"#{id}\">{name}</a> {title}{missing}</li>\n")
}

fn chapter(figures: &[Figure]) -> String {
    let sections: String = figures.iter().map(section).collect();
    format!(
        "<h2>Chapter {}</h2>\n{sections}",
        figures[0].entry.chapter()
    )
}

fn section(figure: &Figure) -> String {
    let (id, heading) = (figure.entry.id(), escaped(&figure.entry.heading()));
    let body = match &figure.outcome {
        Outcome::NotComputed(reason) => {
            format!("<p class=\"quiet\">Not computed: {}</p>\n", escaped(reason))
        }
        Outcome::Computed { content, .. } => drawing(figure, content) + &facts(content),
    };
    format!("<section id=\"{id}\">\n<h3>{heading}</h3>\n{body}</section>\n")
}

fn drawing(figure: &Figure, content: &Content) -> String {
    match figure.svg() {
        None => format!("<p>{}</p>\n", escaped(&content.drawn)),
        Some(svg) => picture(svg, &figure.entry.heading(), &content.drawn),
    }
}

fn facts(content: &Content) -> String {
    let settings = content.settings.iter().map(|text| fact("Settings", text));
    let assumed = content
        .assumed
        .iter()
        .map(|text| fact("Assumed, not printed in the thesis", text));
    let list: String = settings.chain(assumed).collect();
    let list = if list.is_empty() {
        list
    } else {
        format!("<ul class=\"facts\">\n{list}</ul>\n")
    };
    list + &comparisons(&content.compared) + &commands(&content.commands)
}

fn fact(label: &str, text: &str) -> String {
    format!("<li>{label}: {}</li>\n", escaped(text))
}

fn comparisons(compared: &[Comparison]) -> String {
    if compared.is_empty() {
        return String::new();
    }
    let rows: String = compared.iter().map(comparison).collect();
    table(
        &["Value", "Printed", "Computed", "Difference", "Verdict"],
        &rows,
    )
}

fn comparison(row: &Comparison) -> String {
    let (class, verdict) = match row.verdict {
        Verdict::Agrees => ("", "agrees"),
        Verdict::Differs => (" class=\"differs\"", "differs"),
        Verdict::NotPrinted => ("", ""),
    };
    let remark = match row.remark.as_str() {
        "" => String::new(),
        remark => format!("<br><span class=\"quiet\">{}</span>", escaped(remark)),
    };
    let tolerance = row
        .tolerance
        .map_or(String::new(), |t| format!(" (±{})", short(t)));
    let numbers = [
        &row.printed,
        &row.computed,
        &(row.difference.clone() + &tolerance),
    ];
    let numbers = numbers
        .map(|text| format!("<td class=\"n\">{}</td>", escaped(text)))
        .concat();
    format!(
        "<tr><td>{}{remark}</td>{numbers}<td{class}>{verdict}</td></tr>\n",
        escaped(&row.what)
    )
}

/// A tolerance without trailing zeros.
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
    fn escapes_the_special_characters_of_html() {
        let row = comparison(&Comparison::text("|S| < 1 & more", "<b>", "<b>"));
        assert!(row.contains("|S| &lt; 1 &amp; more") && !row.contains("<b>"));
    }
}
