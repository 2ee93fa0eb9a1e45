//! `cargo xtask dist`: a static program with its documents as an archive, and a trial of it where nothing else is installed.

use crate::check::cargo;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The target whose programs need nothing of the system, and the one whose C library is linked into the program.
const MUSL: &str = "x86_64-unknown-linux-musl";
const GNU: &str = "x86_64-unknown-linux-gnu";
/// Where the archives are.
const FOLDER: &str = "target/dist";
/// What lies beside the program in the archive.
const DOCUMENTS: [&str; 7] =
    ["README.md", "CHANGELOG.md", "SECURITY.md", "ARCHITECTURE.md", "LICENSE-MIT", "LICENSE-APACHE", "docs"];
/// The crates that are published, in the order of their dependencies.
const PUBLISHED: [&str; 4] = ["breakshot", "breakshot-drivers", "breakshot-studio", "breakshot-cli"];

/// `cargo xtask dist` with these words.
pub(crate) fn run(words: &[&str]) -> Result<(), String> {
    match words {
        [] => dist(),
        ["--try", folder] => {
            let (archive, name) = archive(target());
            tried_in(&archive, &name, Path::new(folder), folder)
        }
        ["--publish"] => publish(),
        other => Err(format!("`dist` has no {}", other.join(" "))),
    }
}

/// Builds the archive and its checksum, and tries the program in an empty folder as its root.
fn dist() -> Result<(), String> {
    let target = target();
    let program = built(target)?;
    let (archive, name) = archive(target);
    let staged = Path::new(FOLDER).join(&name);
    if staged.exists() {
        fs::remove_dir_all(&staged).map_err(|e| format!("{}: {e}", staged.display()))?;
    }
    fs::create_dir_all(&staged).map_err(|e| format!("{}: {e}", staged.display()))?;
    started(Command::new("cp").arg("-rL").args(DOCUMENTS).arg(&program).arg(&staged))?;
    started(Command::new(&program).arg("manual").arg(&staged).stdout(Stdio::null()))?;
    crate::sbom::run(&[&staged.join("breakshot.cdx.json").display().to_string()])?;
    // The same files give the same bytes: sorted, with the time of the last commit, without the user's name.
    let time = printed(Command::new("git").args(["log", "-1", "--format=%ct"]))?;
    let tar = ["--sort=name", "--owner=0", "--group=0", "--numeric-owner", "--mode=u+rwX,go+rX,go-w"];
    let plain = archive.with_extension("");
    started(
        Command::new("tar")
            .args(tar)
            .arg(format!("--mtime=@{}", time.trim()))
            .args(["-C", FOLDER, "-cf"])
            .arg(&plain)
            .arg(&name),
    )?;
    started(Command::new("gzip").args(["-n", "-9", "-f"]).arg(&plain))?;
    let file = archive.file_name().unwrap_or_default();
    let sums = printed(Command::new("sha256sum").arg(file).current_dir(FOLDER))?;
    let sums_path = Path::new(FOLDER).join("SHA256SUMS");
    fs::write(&sums_path, &sums).map_err(|e| format!("{}: {e}", sums_path.display()))?;
    started(Command::new("sha256sum").args(["--check", "--quiet", "SHA256SUMS"]).current_dir(FOLDER))?;
    let bytes = |path: &Path| fs::metadata(path).map_or(0, |data| data.len()) as f64 / 1e6;
    let (program_mb, archive_mb) = (bytes(&program), bytes(&archive));
    println!("xtask: {} ({archive_mb:.1} MB; the program {program_mb:.1} MB)\n{sums}", archive.display());
    let empty = tempfile::tempdir().map_err(|e| e.to_string())?;
    tried_in(&archive, &name, empty.path(), "an empty folder")
}

/// The path of the archive, and the name of the folder in it.
fn archive(target: &str) -> (PathBuf, String) {
    let name = format!("breakshot-{}-{target}", env!("CARGO_PKG_VERSION"));
    (Path::new(FOLDER).join(format!("{name}.tar.gz")), name)
}

/// The target that is built: the static one if its standard library is or can be installed.
fn target() -> &'static str {
    let installed = || {
        let folder = printed(Command::new("rustc").args(["--print", "target-libdir", "--target", MUSL]));
        folder.is_ok_and(|folder| Path::new(folder.trim()).is_dir())
    };
    if !installed() {
        println!("xtask: installing the target {MUSL}");
        // A toolchain that comes from a distribution has no rustup.
        drop(Command::new("rustup").args(["target", "add", MUSL]).status());
    }
    if installed() {
        return MUSL;
    }
    println!("xtask: {MUSL} is not installed; the program is built for {GNU} with its C library linked in");
    GNU
}

/// Builds the program with everything that it can have, and gives its path.
fn built(target: &str) -> Result<PathBuf, String> {
    let arguments =
        ["build", "--release", "--locked", "--package", "breakshot-cli", "--features", "network,manual"];
    cargo(
        &[&arguments[..], &["--target", target]].concat(),
        &[("RUSTFLAGS", "-C target-feature=+crt-static")],
    )?;
    Ok(crate::example::target().join(target).join("release/breakshot"))
}

/// Unpacks the archive into a folder, and runs the program with that folder as the root: its version, and the whole example.
fn tried_in(archive: &Path, name: &str, root: &Path, called: &str) -> Result<(), String> {
    started(Command::new("tar").arg("-xzf").arg(archive).arg("-C").arg(root))?;
    let program = format!("/{name}/breakshot");
    let inside = |arguments: &[&str]| -> Result<String, String> {
        let mut command = Command::new("unshare");
        command
            .args(["--map-root-user", "--root"])
            .arg(root)
            .args(["--wd", "/"])
            .arg(&program)
            .args(arguments);
        // Nothing of this machine's settings is there.
        command.env_clear();
        if let Some(path) = std::env::var_os("PATH") {
            command.env("PATH", path);
        }
        printed(&mut command)
    };
    let version = inside(&["--version"])?;
    let wanted = format!("breakshot {}", env!("CARGO_PKG_VERSION"));
    if version.trim() != wanted {
        return Err(format!("`breakshot --version` printed `{}`; needed: `{wanted}`", version.trim()));
    }
    let demo = inside(&["demo", "-o", "/breakshot-demo"])?;
    let report = root.join("breakshot-demo/report.html");
    if !report.is_file() {
        return Err(format!("`breakshot demo` wrote no {}:\n{demo}", report.display()));
    }
    println!("xtask: in {called}: {}, and its demo ({} lines)", version.trim(), demo.lines().count());
    Ok(())
}

/// Packages the crates that are published, builds each from its package, and stops before the upload.
fn publish() -> Result<(), String> {
    let packages = PUBLISHED.iter().flat_map(|name| ["--package", name]).collect::<Vec<_>>();
    cargo(&[&["publish", "--dry-run", "--locked"], &packages[..]].concat(), &[])
}

/// Runs a program that must succeed.
fn started(command: &mut Command) -> Result<(), String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let status = command.status().map_err(|e| format!("{name} cannot be started ({e})"))?;
    if status.success() { Ok(()) } else { Err(format!("{name} failed ({status})")) }
}

/// What a program prints, which must succeed.
fn printed(command: &mut Command) -> Result<String, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(|e| format!("{name} cannot be started ({e})"))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if output.status.success() {
        Ok(text(&output.stdout))
    } else {
        Err(format!("{name} failed ({}): {}", output.status, text(&output.stderr)))
    }
}
