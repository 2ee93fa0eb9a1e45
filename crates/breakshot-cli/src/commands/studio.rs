//! `breakshot studio`: the page for the browser of this machine.

use crate::Outcome;
use crate::studio_args::StudioArgs;
use breakshot::{Error, Result};
use breakshot_studio::Server;
use std::io::Write;
use std::process::{Command, Stdio};
use tempfile::NamedTempFile;

/// Serves the page until the program is ended.
pub(crate) fn run(args: &StudioArgs) -> Result<Outcome> {
    let server = Server::bind(&args.folder, args.port)?;
    println!(
        "Open this link in a browser on this machine; it works once. End with Ctrl+C.\n{}",
        server.link()
    );
    std::io::stdout().flush().map_err(|source| Error::Write { path: "stdout".into(), source })?;
    // The file leads to the link; it is removed when the program ends.
    let _opened = if args.no_open { None } else { opened(&server.link()) };
    server.serve()?;
    Ok(Outcome::Done)
}

/// Opens a link in the user's browser; none if that is not possible. The link has a secret, which other users could read among the
/// arguments of programs: the browser is given a file instead, which only this user can read.
fn opened(link: &str) -> Option<NamedTempFile> {
    let mut file = tempfile::Builder::new().prefix("breakshot-studio-").suffix(".html").tempfile().ok()?;
    write!(file, "<!DOCTYPE html><meta http-equiv=\"refresh\" content=\"0; url={link}\">").ok()?;
    let program = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let mut command = Command::new(program);
    command.arg(file.path()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut browser = command.spawn().ok()?;
    std::thread::spawn(move || browser.wait());
    Some(file)
}
