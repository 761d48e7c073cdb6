//! What the page is made of: in the binary, so that it needs no file and no network when it runs.

use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};

use crate::error::Problem;

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const PICTURE: &str = "image/svg+xml";

macro_rules! assets {
    ($($name:literal: $kind:expr),* $(,)?) => {
        &[$(($name, $kind, include_str!(concat!("../assets/", $name)))),*]
    };
}

/// Path, kind and text.
const ASSETS: &[(&str, &str, &str)] = assets![
    "index.html": HTML,
    "login.html": HTML,
    "plant.html": HTML,
    "page.css": STYLE,
    "ladder.css": STYLE,
    "login.js": SCRIPT,
    "plant.js": SCRIPT,
    "page.js": SCRIPT,
    "address.js": SCRIPT,
    "ask.js": SCRIPT,
    "banner.js": SCRIPT,
    "chips.js": SCRIPT,
    "kept.js": SCRIPT,
    "element.js": SCRIPT,
    "theme.js": SCRIPT,
    "time.js": SCRIPT,
    "cluster.js": SCRIPT,
    "overview.js": SCRIPT,
    "picture.js": SCRIPT,
    "sources.js": SCRIPT,
    "legend.js": SCRIPT,
    "tour.js": SCRIPT,
    "operate.js": SCRIPT,
    "reads.js": SCRIPT,
    "ladder.js": SCRIPT,
    "who.js": SCRIPT,
    "why.js": SCRIPT,
    "zone.js": SCRIPT,
    "values.js": SCRIPT,
    "signals.js": SCRIPT,
    "points.js": SCRIPT,
    "trends.js": SCRIPT,
    "download.js": SCRIPT,
    "bands.js": SCRIPT,
    "lanes.js": SCRIPT,
    "alarms.js": SCRIPT,
    "events.js": SCRIPT,
    "commands.js": SCRIPT,
    "compare.js": SCRIPT,
    "icon.svg": PICTURE,
    "vendor/uPlot.iife.min.js": SCRIPT,
    "vendor/uPlot.min.css": STYLE,
];

/// Assets that need no login.
pub(crate) const BEFORE_LOGIN: &[&str] = &["/login.html", "/login.js", "/page.css", "/icon.svg"];

/// The asset of a path such as `page.js`.
pub(crate) fn asset(path: &str) -> Response {
    let path = if path.is_empty() { "index.html" } else { path };
    match ASSETS.iter().find(|(name, _, _)| *name == path) {
        Some((_, kind, text)) => {
            // Another version of the program may serve the same page next.
            ([(CONTENT_TYPE, *kind), (CACHE_CONTROL, "no-cache")], *text).into_response()
        }
        None => Problem::unknown(format!("the page has nothing at /{path}")).into_response(),
    }
}
