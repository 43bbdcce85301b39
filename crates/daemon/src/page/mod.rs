//! The files of the live page, embedded in the program. They load nothing from other hosts.

/// A file of the page.
#[derive(Clone, Copy, Debug)]
pub struct PageFile {
    /// Its name.
    pub name: &'static str,
    /// Its media type.
    pub media_type: &'static str,
    /// Its content.
    pub text: &'static str,
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// A line for each file.
macro_rules! files {
    ($($name:literal: $media_type:expr),* $(,)?) => {
        &[$(PageFile { name: $name, media_type: $media_type, text: include_str!($name) }),*]
    };
}

/// All files.
const FILES: &[PageFile] = files! {
    "index.html": HTML,
    "page.css": CSS,
    "main.js": SCRIPT,
    "connection.js": SCRIPT,
    "dialogs.js": SCRIPT,
    "drawing.js": SCRIPT,
    "frequency_axis.js": SCRIPT,
    "held.js": SCRIPT,
    "keys.js": SCRIPT,
    "lease.js": SCRIPT,
    "motion.js": SCRIPT,
    "recordings.js": SCRIPT,
    "response.js": SCRIPT,
    "run_form.js": SCRIPT,
    "samples.js": SCRIPT,
    "scope.js": SCRIPT,
    "spectrum.js": SCRIPT,
    "stop.js": SCRIPT,
    "timing.js": SCRIPT,
};

/// The file with a name.
pub fn find(name: &str) -> Option<&'static PageFile> {
    FILES.iter().find(|file| file.name == name)
}
