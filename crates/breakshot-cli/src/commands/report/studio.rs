//! `breakshot studio`: the page for the browser of this machine.

use crate::Outcome;
use crate::commands::capture::init::TEMPLATES;
use crate::studio_args::StudioArgs;
use breakshot::{Error, Result};
use breakshot_studio::Server;
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Serves the page until the program is ended.
pub(crate) fn run(args: &StudioArgs) -> Result<Outcome> {
    let server = Server::bind(&args.folder, args.port, TEMPLATES)?;
    println!(
        "Open this link in a browser on this machine; it works once. End with Ctrl+C.\n{}",
        server.link()
    );
    std::io::stdout().flush().map_err(|source| Error::Write { path: "stdout".into(), source })?;
    if !args.no_open {
        open(&server.link());
    }
    server.serve()?;
    Ok(Outcome::Done)
}

/// Time for the browser to read the file that leads to the link.
const READING_TIME: Duration = Duration::from_secs(20);

/// Opens a link in the user's browser if that is possible. The link has a secret, which other users could read among the arguments of
/// programs: the browser is given a file instead, which only this user can read and which is removed soon.
fn open(link: &str) -> Option<()> {
    let mut file = tempfile::Builder::new().prefix("breakshot-studio-").suffix(".html").tempfile().ok()?;
    write!(file, "<!DOCTYPE html><meta http-equiv=\"refresh\" content=\"0; url={link}\">").ok()?;
    let program = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let mut command = Command::new(program);
    command.arg(file.path()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut browser = command.spawn().ok()?;
    std::thread::spawn(move || {
        std::thread::sleep(READING_TIME);
        drop(file);
        browser.wait()
    });
    Some(())
}
