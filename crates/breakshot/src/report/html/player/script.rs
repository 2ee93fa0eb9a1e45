//! The script of the players, and what the page permits to run.

use crate::encoding::integrity;

/// The modules of the script, each after those that it uses; all but the last are those of the studio.
const MODULES: [&str; 6] = [
    include_str!("elements.js"),
    include_str!("keys.js"),
    include_str!("outlines.js"),
    include_str!("playback.js"),
    include_str!("timeline.js"),
    include_str!("player.js"),
];

/// The style of the players.
pub(in crate::report::html) const PLAYER_CSS: &str = include_str!("player.css");

/// The modules as one: without imports and exports. A module's names are the page's.
fn script() -> String {
    let line = |line: &str| {
        (!line.starts_with("import ")).then(|| line.strip_prefix("export ").unwrap_or(line).to_owned() + "\n")
    };
    // A browser takes the first and the last line as comments, a parser of XML what is between them as text.
    let code: String = MODULES.iter().flat_map(|module| module.lines()).filter_map(line).collect();
    format!("\n//<![CDATA[\n{code}//]]>\n")
}

/// What a page with this style may load and run, as the value of its `Content-Security-Policy`: the style, the script of the players if it
/// has any, and images that it contains.
pub(in crate::report::html) fn content_security_policy(style: &str, has_players: bool) -> String {
    let script = if has_players { format!("'{}'", integrity(&script())) } else { "'none'".into() };
    let style = integrity(style);
    format!(
        "default-src 'none'; img-src data:; style-src '{style}'; script-src {script}; base-uri 'none'; form-action 'none'"
    )
}

/// The list of keys, and the script that makes the players of a page work.
pub(in crate::report::html) fn scripts() -> String {
    format!(
        "<dialog id=\"keys\" aria-labelledby=\"keys-title\">\n<div class=\"bar\"><h2 id=\"keys-title\">Keys</h2>\
         <button type=\"button\" id=\"close-keys\">Close</button></div>\n<div id=\"key-list\"></div>\n</dialog>\n\
         <script type=\"module\">{}</script>\n",
        script()
    )
}
