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

/// The modules as one, each in a function that returns what it exports: the names of its imports are those of the exports.
fn script() -> String {
    let modules: String = MODULES.iter().map(|module| as_function(module)).collect();
    // A browser takes the first and the last line as comments, a parser of XML what is between them as text.
    format!("\n//<![CDATA[\n{modules}//]]>\n")
}

fn as_function(module: &str) -> String {
    let lines = module.lines().filter(|line| !line.starts_with("import "));
    let code: String =
        lines.map(|line| line.strip_prefix("export ").unwrap_or(line).to_owned() + "\n").collect();
    let exports = exports(module).join(", ");
    format!("const {{ {exports} }} = (() => {{\n{code}return {{ {exports} }};\n}})();\n")
}

/// The names that a module exports: each stands in a line of its own, as `export class Name`.
fn exports(module: &str) -> Vec<&str> {
    let declared = module.lines().filter_map(|line| line.strip_prefix("export ")?.split_once(' '));
    declared.map(|(_, rest)| rest.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default()).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_import_of_a_module_is_an_export_of_an_earlier_one() {
        for (k, module) in MODULES.iter().enumerate() {
            let earlier: Vec<&str> = MODULES[..k].iter().flat_map(|module| exports(module)).collect();
            for line in module.lines().filter(|line| line.contains("import ")) {
                let names = line.strip_prefix("import { ").and_then(|rest| rest.split_once(" } from \"/"));
                let (names, from) = names.expect("an import of names in one line");
                assert!(from.ends_with(".js\";"), "{line}");
                for name in names.split(", ") {
                    assert!(
                        earlier.contains(&name),
                        "module {k} imports `{name}`, which no module before it exports"
                    );
                }
            }
        }
        let all: Vec<&str> = MODULES.iter().flat_map(|module| exports(module)).collect();
        for (k, name) in all.iter().enumerate() {
            assert!(!name.is_empty() && !all[..k].contains(name), "`{name}` is exported twice");
        }
    }

    #[test]
    fn the_script_has_no_imports_and_ends_no_element() {
        let script = script();
        assert!(script.lines().all(|line| !line.starts_with("import ") && !line.starts_with("export ")));
        for end in ["</script", "<!--"] {
            assert!(!script.contains(end), "the script holds `{end}`");
        }
        assert_eq!(script.matches("]]>").count(), 1, "a parser of XML takes the first `]]>` as the end");
        for outside in ["http://", "https://", "fetch(", "import("] {
            let script = script.replace("http://www.w3.org/2000/svg", "");
            assert!(!script.contains(outside), "the script refers to something else: `{outside}`");
        }
    }

    #[test]
    fn the_policy_permits_the_script_and_the_style_of_the_page_alone() {
        let policy = content_security_policy("p { color: red }", true);
        assert!(policy.contains(&format!("script-src '{}'", integrity(&script()))), "{policy}");
        assert!(policy.contains(&format!("style-src '{}'", integrity("p { color: red }"))), "{policy}");
        assert!(policy.starts_with("default-src 'none'; ") && !policy.contains("unsafe"), "{policy}");
        assert!(content_security_policy("", false).contains("script-src 'none'"));
    }
}
