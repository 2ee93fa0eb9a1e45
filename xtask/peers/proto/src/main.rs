//! Generates the Rust code of the Indy's messages: `proto-generator FOLDER --check|--write`.
//!
//! FOLDER holds `indy.proto` and `generated/`. `--check` fails if the code in `generated/` is not what the proto file
//! generates; `--write` writes it. No `protoc` is needed.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

/// The name that the generator gives to the file of the proto file's package.
const PACKAGE_FILE: &str = "nrmk.indy_framework.rs";

type Generated = [(&'static str, String); 2];

/// The client with its messages, and the server of the mock controller, which uses the client's messages.
fn generated(folder: &Path) -> Result<Generated, Box<dyn Error>> {
    let files = protox::compile([folder.join("indy.proto")], [folder])?;
    let output = tempfile::tempdir()?;
    let code = || std::fs::read_to_string(output.path().join(PACKAGE_FILE));

    let client = tonic_prost_build::configure().build_server(false).out_dir(output.path());
    client.compile_fds(files.clone())?;
    let client = code()?;

    let server = tonic_prost_build::configure().build_client(false).out_dir(output.path());
    server.extern_path(".Nrmk.IndyFramework", "::breakshot_drivers::wire").compile_fds(files)?;
    Ok([("client.rs", client), ("server.rs", code()?)])
}

/// Whether the code in the repository is current; with `write` it is made so.
fn run(folder: &Path, write: bool) -> Result<bool, Box<dyn Error>> {
    let mut is_current = true;
    for (name, code) in generated(folder)? {
        let path = folder.join("generated").join(name);
        if write {
            std::fs::write(&path, code)?;
        } else if std::fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n") != code {
            eprintln!("{} is not what indy.proto generates; `cargo xtask proto` writes it", path.display());
            is_current = false;
        }
    }
    Ok(is_current)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let done = match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        [folder, "--check"] => run(Path::new(folder), false),
        [folder, "--write"] => run(Path::new(folder), true),
        _ => Err("usage: proto-generator FOLDER --check|--write".into()),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
