//! The files of the page, part of the program.

use crate::http::response::Response;

macro_rules! assets {
    ($($file:literal: $kind:literal),* $(,)?) => {
        [$((concat!("/", $file), $kind, include_bytes!(concat!("../assets/", $file)).as_slice())),*]
    };
}

const HTML: &str = "text/html; charset=utf-8";
const INDEX: &[u8] = include_bytes!("../assets/index.html");

/// Palette and drawing style of `report.html`: the page has the same.
const REPORT_STYLE: &[u8] = include_bytes!("../assets/report.css");

/// Path, media type and content of each file.
const FILES: [(&str, &str, &[u8]); 42] = assets![
    "studio.css": "text/css; charset=utf-8",
    "icon.svg": "image/svg+xml",
    "app.js": "text/javascript; charset=utf-8",
    "server.js": "text/javascript; charset=utf-8",
    "changes.js": "text/javascript; charset=utf-8",
    "elements.js": "text/javascript; charset=utf-8",
    "keys.js": "text/javascript; charset=utf-8",
    "table.js": "text/javascript; charset=utf-8",
    "motion.js": "text/javascript; charset=utf-8",
    "outlines.js": "text/javascript; charset=utf-8",
    "playback.js": "text/javascript; charset=utf-8",
    "timeline.js": "text/javascript; charset=utf-8",
    "learned.js": "text/javascript; charset=utf-8",
    "films/view.js": "text/javascript; charset=utf-8",
    "films/edit.js": "text/javascript; charset=utf-8",
    "films/frames.js": "text/javascript; charset=utf-8",
    "films/plots.js": "text/javascript; charset=utf-8",
    "films/starts.js": "text/javascript; charset=utf-8",
    "pile/areas.js": "text/javascript; charset=utf-8",
    "pile/view.js": "text/javascript; charset=utf-8",
    "pile/objects.js": "text/javascript; charset=utf-8",
    "pile/drag.js": "text/javascript; charset=utf-8",
    "pile/strike.js": "text/javascript; charset=utf-8",
    "pile/player.js": "text/javascript; charset=utf-8",
    "pile/plan.js": "text/javascript; charset=utf-8",
    "pile/forecast.js": "text/javascript; charset=utf-8",
    "pile/map.js": "text/javascript; charset=utf-8",
    "pile/new.js": "text/javascript; charset=utf-8",
    "pile/goal.js": "text/javascript; charset=utf-8",
    "pile/picture.js": "text/javascript; charset=utf-8",
    "compare/view.js": "text/javascript; charset=utf-8",
    "compare/film.js": "text/javascript; charset=utf-8",
    "compare/table.js": "text/javascript; charset=utf-8",
    "compare/distances.js": "text/javascript; charset=utf-8",
    "compare/findings.js": "text/javascript; charset=utf-8",
    "compare/new.js": "text/javascript; charset=utf-8",
    "cell/view.js": "text/javascript; charset=utf-8",
    "cell/picture.js": "text/javascript; charset=utf-8",
    "cell/tags.js": "text/javascript; charset=utf-8",
    "robot/view.js": "text/javascript; charset=utf-8",
    "robot/arm.js": "text/javascript; charset=utf-8",
    "robot/speeds.js": "text/javascript; charset=utf-8",
];

/// The file at this path; none if the page has no such file.
pub(crate) fn page(path: &str) -> Option<Response> {
    if path == "/" {
        return Some(Response::new(HTML, INDEX.to_vec()));
    }
    if path == "/report.css" {
        return Some(Response::new("text/css; charset=utf-8", REPORT_STYLE.to_vec()));
    }
    let (_, kind, content) = FILES.iter().find(|(known, ..)| *known == path)?;
    Some(Response::new(kind, content.to_vec()))
}
