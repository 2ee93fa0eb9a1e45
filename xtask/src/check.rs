//! The checks every change must pass.

use crate::process::timed;
use std::process::Command;

/// Formatting, lints, docs, generated code, the default features, tests, documented examples, and dependencies where
/// `cargo deny` is installed; prints the time that they take.
///
/// The tests of [`NEEDS_FFMPEG`] run where the program `ffmpeg` is installed; elsewhere the last lines list them as
/// skipped.
pub(crate) fn test() -> Result<(), String> {
    timed("", all)
}

fn all() -> Result<(), String> {
    ensure_component("rustfmt", "fmt")?;
    ensure_component("clippy", "clippy")?;
    cargo(&["fmt", "--all", "--check"], &[])?;
    cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"], &[])?;
    // What a user builds: the program without the drivers for robots on the network.
    cargo(&["clippy", "--", "-D", "warnings"], &[])?;
    cargo(
        &["doc", "--workspace", "--no-deps", "--document-private-items"],
        &[("RUSTDOCFLAGS", "-D warnings")],
    )?;
    proto(Proto::Check)?;
    cargo(&["test", "--workspace"], &[])?;
    test_with_ffmpeg()?;
    // Installing it takes longer than all tests: `cargo xtask deny` does.
    if cargo_quiet(&["deny", "--version"]) {
        return deny();
    }
    println!(
        "xtask: SKIPPED licences, sources and advisories: `cargo deny` is not installed (`cargo xtask deny` installs it)"
    );
    Ok(())
}

/// The tests that `cargo test` ignores because they start the program `ffmpeg`; a test of the library names them.
const NEEDS_FFMPEG: [&str; 9] = [
    "capture::source::ffmpeg::h264::tests::ffmpeg_and_the_built_in_decoder_give_the_same_frames_and_errors",
    "ffmpeg_decodes_the_codings_that_the_built_in_decoder_does_not",
    "ffmpeg_and_the_built_in_decoder_give_the_same_frames",
    "a_damaged_film_that_only_ffmpeg_decodes_is_an_error",
    "a_film_that_is_played_gives_the_tracks_of_the_original",
    "streams_are_recorded_with_their_times_or_those_of_their_arrival",
    "an_interrupted_recording_is_whole",
    "look_takes_pictures_from_a_stream",
    "a_film_of_a_procedure_has_all_its_parts_and_is_whole_or_absent",
];

/// Runs the tests that need `ffmpeg`, or reports each of them as skipped.
fn test_with_ffmpeg() -> Result<(), String> {
    if Command::new("ffmpeg").arg("-version").output().is_err() {
        println!("xtask: SKIPPED {} tests: the program `ffmpeg` is not installed", NEEDS_FFMPEG.len());
        for test in NEEDS_FFMPEG {
            println!("xtask: SKIPPED {test}");
        }
        return Ok(());
    }
    // Of the workspace, as before: a package by itself has other features, and would be compiled again.
    let tests =
        ["test", "--workspace", "--lib", "--test", "footage", "--test", "recording", "--test", "film_report"];
    cargo(&[&tests[..], &["--", "--ignored", "--exact"], &NEEDS_FFMPEG].concat(), &[])
}

/// What to do with the generated code of the robot's messages.
#[derive(Clone, Copy)]
pub(crate) enum Proto {
    /// Compare it with what `proto/indy.proto` generates today.
    Check,
    /// Write it anew.
    Write,
}

/// Generates the Rust code of the Indy's messages from its proto file, to compare the code in the repository or to write it.
///
/// The generator takes longer to compile than the driver, so its code is kept and the generator is a workspace of its own.
pub(crate) fn proto(what: Proto) -> Result<(), String> {
    const MANIFEST: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/proto/Cargo.toml");
    const TARGET: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/peers");
    const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/breakshot-drivers/proto");
    let flag = match what {
        Proto::Check => "--check",
        Proto::Write => "--write",
    };
    cargo(
        &[
            "run",
            "--quiet",
            "--locked",
            "--manifest-path",
            MANIFEST,
            "--target-dir",
            TARGET,
            "--",
            FOLDER,
            flag,
        ],
        &[],
    )
}

/// Licences, duplicate versions and sources of all dependencies, and advisories where their database can be fetched.
pub(crate) fn deny() -> Result<(), String> {
    if cargo(&["deny", "--version"], &[]).is_err() {
        cargo(&["install", "cargo-deny", "--locked"], &[])?;
    }
    cargo(&["deny", "--workspace", "check", "licenses", "bans", "sources"], &[])?;
    if !cargo_quiet(&["deny", "fetch", "db"]) {
        println!("xtask: SKIPPED advisories: their database cannot be fetched");
        return Ok(());
    }
    cargo(&["deny", "--workspace", "check", "advisories"], &[])
}

/// A toolchain component that some minimal installs leave out.
fn ensure_component(component: &str, subcommand: &str) -> Result<(), String> {
    if cargo_quiet(&[subcommand, "--version"]) {
        return Ok(());
    }
    println!("xtask: installing {component}");
    let installed = Command::new("rustup").args(["component", "add", component]).status();
    match installed {
        Ok(status) if status.success() => Ok(()),
        _ => Err(format!(
            "`cargo {subcommand}` is missing; needed: the {component} component of the toolchain"
        )),
    }
}

fn cargo_quiet(args: &[&str]) -> bool {
    Command::new("cargo").args(args).output().is_ok_and(|output| output.status.success())
}

/// Runs cargo and shows what it does.
pub(crate) fn cargo(args: &[&str], env: &[(&str, &str)]) -> Result<(), String> {
    println!("xtask: cargo {}", args.join(" "));
    let status = Command::new("cargo")
        .args(args)
        .envs(env.iter().copied())
        .status()
        .map_err(|e| format!("cargo cannot be started ({e})"))?;
    if status.success() { Ok(()) } else { Err(format!("`cargo {}` failed ({status})", args.join(" "))) }
}
