//! The bill of materials of the programs: `CycloneDX` 1.5 from `cargo metadata` and the lock file.

use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

/// The packages whose dependencies are listed: the programs and the library, not their tests and tasks.
const ROOTS: [&str; 4] = ["breakshot-cli", "breakshot-drivers", "breakshot-studio", "breakshot-py"];

/// Writes the bill of materials to the file of these words, or to the usual one.
pub(crate) fn run(words: &[&str]) -> Result<(), String> {
    match words {
        [] => write("target/breakshot.cdx.json".as_ref()),
        [file] => write(file.as_ref()),
        _ => Err("needed: sbom [FILE]".into()),
    }
}

fn write(file: &Path) -> Result<(), String> {
    let metadata = Command::new("cargo").args(["metadata", "--format-version", "1", "--locked"]).output();
    let metadata = metadata.map_err(|e| format!("cargo cannot be started ({e})"))?;
    if !metadata.status.success() {
        return Err(format!("cargo metadata: {}", String::from_utf8_lossy(&metadata.stderr)));
    }
    let metadata: Value = serde_json::from_slice(&metadata.stdout).map_err(|e| e.to_string())?;
    let lock = std::fs::read_to_string("Cargo.lock").map_err(|e| format!("Cargo.lock: {e}"))?;
    let bill = bill(&metadata, &checksums(&lock))?;
    let text = serde_json::to_string_pretty(&bill).map_err(|e| e.to_string())?;
    breakshot::files::write_whole(file, (text + "\n").as_bytes()).map_err(|e| e.to_string())?;
    let count = bill["components"].as_array().map_or(0, Vec::len);
    println!("xtask: {} lists {count} crates", file.display());
    Ok(())
}

/// The checksums of the lock file, by name and version.
fn checksums(lock: &str) -> BTreeMap<(String, String), String> {
    let value = |block: &str, key: &str| {
        let line = block.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = \""));
        line.and_then(|rest| rest.strip_suffix('"')).map(str::to_owned)
    };
    let entry =
        |block: &str| Some(((value(block, "name")?, value(block, "version")?), value(block, "checksum")?));
    lock.split("[[package]]").filter_map(entry).collect()
}

fn bill(metadata: &Value, checksums: &BTreeMap<(String, String), String>) -> Result<Value, String> {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let packages: BTreeMap<String, Value> =
        list(&metadata["packages"]).into_iter().map(|package| (text(&package["id"]), package)).collect();
    let nodes: BTreeMap<String, Value> =
        list(&metadata["resolve"]["nodes"]).into_iter().map(|node| (text(&node["id"]), node)).collect();
    // The dependencies that are built into the programs: not those of tests and build scripts.
    let built = |node: &Value| -> Vec<String> {
        let is_built = |dep: &Value| list(&dep["dep_kinds"]).iter().any(|kind| kind["kind"].is_null());
        list(&node["deps"]).iter().filter(|dep| is_built(dep)).map(|dep| text(&dep["pkg"])).collect()
    };
    let is_root = |package: &&Value| ROOTS.contains(&package["name"].as_str().unwrap_or_default());
    let mut waiting: Vec<String> =
        packages.values().filter(is_root).map(|package| text(&package["id"])).collect();
    let mut found = BTreeSet::new();
    while let Some(id) = waiting.pop() {
        if found.insert(id.clone()) {
            let node = nodes.get(&id).ok_or_else(|| format!("cargo metadata has no `{id}`"))?;
            waiting.extend(built(node));
        }
    }
    let purl = |id: &str| {
        let package = &packages[id];
        format!("pkg:cargo/{}@{}", text(&package["name"]), text(&package["version"]))
    };
    let component = |id: &String| {
        let package = &packages[id];
        let (name, version) = (text(&package["name"]), text(&package["version"]));
        let mut component = json!({
            "type": "library", "bom-ref": purl(id), "purl": purl(id), "name": name, "version": version,
            "licenses": [{ "expression": package["license"] }],
        });
        if let Some(checksum) = checksums.get(&(name, version)) {
            component["hashes"] = json!([{ "alg": "SHA-256", "content": checksum }]);
        }
        component
    };
    let dependency = |id: &String| {
        let on: BTreeSet<String> = built(&nodes[id]).iter().map(|id| purl(id)).collect();
        json!({ "ref": purl(id), "dependsOn": on })
    };
    Ok(json!({
        "bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
        "metadata": { "component": { "type": "application", "name": "breakshot", "version": env!("CARGO_PKG_VERSION") } },
        "components": found.iter().map(component).collect::<Vec<_>>(),
        "dependencies": found.iter().map(dependency).collect::<Vec<_>>(),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bill_lists_what_is_built_with_its_checksum_and_nothing_else() {
        let package = |name: &str| json!({ "id": name, "name": name, "version": "1.0.0", "license": "MIT" });
        let dep = |name: &str, kind: Value| json!({ "pkg": name, "dep_kinds": [{ "kind": kind }] });
        let metadata = json!({
            "packages": [package("breakshot-cli"), package("used"), package("for_tests"), package("xtask")],
            "resolve": { "nodes": [
                { "id": "breakshot-cli", "deps": [dep("used", Value::Null), dep("for_tests", json!("dev"))] },
                { "id": "used", "deps": [] }, { "id": "for_tests", "deps": [] }, { "id": "xtask", "deps": [] },
            ] },
        });
        let lock = "[[package]]\nname = \"used\"\nversion = \"1.0.0\"\nchecksum = \"ab12\"\n";
        let bill = bill(&metadata, &checksums(lock)).expect("a bill");
        let names: Vec<&str> = bill["components"]
            .as_array()
            .expect("a list")
            .iter()
            .filter_map(|c| c["name"].as_str())
            .collect();
        assert_eq!(names, ["breakshot-cli", "used"]);
        assert_eq!(bill["components"][1]["hashes"][0]["content"], "ab12");
    }
}
