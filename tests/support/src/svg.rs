//! A small SVG reader for the charts, in units of the page: a tenth of a pixel.

/// A text with an upper bound of its box, for any usual sans-serif font.
#[derive(Debug)]
pub struct Words {
    pub text: String,
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

/// The points of all elements of a kind (`polyline`, `polygon`) in a colour.
pub fn points(svg: &str, kind: &str, colour: &str) -> Vec<Vec<(f64, f64)>> {
    let elements = svg
        .lines()
        .filter(|line| line.starts_with(&format!("<{kind} ")) && line.contains(colour));
    elements
        .map(|line| {
            attribute(line, "points")
                .unwrap()
                .split_whitespace()
                .map(pair)
                .collect()
        })
        .collect()
}

fn pair(text: &str) -> (f64, f64) {
    let (x, y) = text.split_once(',').unwrap();
    (x.parse().unwrap(), y.parse().unwrap())
}

/// All texts.
pub fn words(svg: &str) -> Vec<Words> {
    let mut lines = svg.lines();
    let mut all = Vec::new();
    while let Some(line) = lines.next() {
        if line.starts_with("<text ") {
            all.push(boxed(line, lines.next().unwrap()));
        }
    }
    all
}

fn boxed(tag: &str, text: &str) -> Words {
    let number = |name| attribute(tag, name).unwrap().parse::<f64>().unwrap();
    let (x, y, size) = (number("x"), number("y"), number("font-size"));
    let width = 0.6 * size * text.chars().count() as f64;
    let before = match attribute(tag, "text-anchor").unwrap() {
        "start" => 0.0,
        "middle" => width / 2.0,
        _ => width,
    };
    let text = text.to_owned();
    if tag.contains("rotate(270") {
        return Words {
            text,
            left: x - size / 2.0,
            right: x + size / 2.0,
            top: y - width + before,
            bottom: y + before,
        };
    }
    let above = match attribute(tag, "dy").unwrap() {
        "0.76em" => 0.0,
        "0.5ex" => size / 2.0,
        _ => size,
    };
    Words {
        text,
        left: x - before,
        right: x - before + width,
        top: y - above,
        bottom: y - above + size,
    }
}

/// Width and height of a page.
pub fn page_size(svg: &str) -> (f64, f64) {
    let view = svg.split("viewBox=\"0 0 ").nth(1);
    let size = view.and_then(|rest| rest.split('"').next());
    pair(&size.expect("a view box").replace(' ', ","))
}

/// The value of an attribute of a tag.
pub fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let from = tag.find(&format!(" {name}=\""))? + name.len() + 3;
    tag[from..].split('"').next()
}
