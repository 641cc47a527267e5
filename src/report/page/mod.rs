//! `report.html`: one page that holds everything about a shot and needs no other file.
//!
//! No request to anywhere, which its security policy holds the browser to; its own script plays the
//! footage beside the animated rig, and the page can be read without it. It prints, follows the reader's light or dark preference,
//! and can be read aloud. Whatever comes from outside (names, paths, prose) is escaped by the
//! template engine; plots are [`Svg`](super::plots::Svg) values, which only our own drawing code
//! can make, and pictures go in as data addresses.

mod data;

use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Serde, Value};
use minijinja::{Environment, UndefinedBehavior};

pub use data::{
    AnimationSummary, Asked, ComponentRow, FeetSummary, FileHash, Finding, FootRow, Footage, Grade,
    KeyRow, KeySummary, PageData, Pictures, Player, Plots, Setting, StripFrame, VerdictSummary,
    WeightSummary,
};

use crate::error::{Error, Result};

const TEMPLATE: &str = include_str!("report.html.jinja");
/// What goes in as it is: the style, and the player (reading of glTF, drawing of the rig, playing).
const PARTS: [(&str, &str); 4] = [
    ("style", include_str!("report.css")),
    ("gltf_script", include_str!("gltf.js")),
    ("viewer_script", include_str!("viewer.js")),
    ("player_script", include_str!("player.js")),
];
/// Ends in `.html`, by which the engine knows to escape.
const NAME: &str = "report.html";

/// The page as UTF-8 text. Every section whose data is missing says which command makes it.
///
/// # Errors
/// [`Error::Drawing`] when the template cannot be filled, which is a defect of the template and
/// not of the data.
pub fn page(data: &PageData) -> Result<String> {
    render(data).map_err(|e| Error::Drawing {
        what: "the report page".to_owned(),
        reason: format!("{e:#}"),
    })
}

fn render(data: &PageData) -> std::result::Result<String, minijinja::Error> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_filter("fixed", fixed);
    environment.add_filter("percent", |share: f64| format!("{} %", fixed(100.0 * share, 1)));
    for (name, text) in PARTS {
        environment.add_global(name, Value::from_safe_string(text.to_owned()));
    }
    environment.add_template(NAME, TEMPLATE)?;
    environment.get_template(NAME)?.render(Serde(data))
}

/// A number with fixed decimals and a true minus sign; a dash where there is no number.
fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| c == '0' || c == '.') => zero.to_owned(),
        Some(positive) => format!("−{positive}"),
        None => text,
    }
}
