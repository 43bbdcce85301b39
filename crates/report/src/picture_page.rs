//! A single picture as a page.

use super::html::{document_with_plots, escaped, picture};

/// A picture with its title and a caption.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Title.
    pub title: String,
    /// What it shows.
    pub caption: String,
    /// The SVG document.
    pub svg: String,
}

impl Picture {
    /// The picture on a page of its own, as an HTML document with cursor and zoom.
    pub fn html(&self) -> String {
        let heading = format!("<h1>{}</h1>\n", escaped(&self.title));
        let figure = picture(&self.svg, &self.title, &self.caption);
        document_with_plots(&self.title, &(heading + &figure))
    }
}
