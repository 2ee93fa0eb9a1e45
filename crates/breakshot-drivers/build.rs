//! Makes the messages and the client from `proto/indy.proto`, and for the tests a server; no `protoc` is needed.

use std::error::Error;
use std::path::PathBuf;

const PROTO: &str = "proto/indy.proto";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed={PROTO}");
    let files = protox::compile([PROTO], ["proto"])?;
    let output = PathBuf::from(std::env::var("OUT_DIR")?);
    let (client, server) = (output.join("client"), output.join("server"));
    std::fs::create_dir_all(&client)?;
    std::fs::create_dir_all(&server)?;
    tonic_prost_build::configure().build_server(false).out_dir(client).compile_fds(files.clone())?;
    tonic_prost_build::configure()
        .build_client(false)
        .extern_path(".Nrmk.IndyFramework", "::breakshot_drivers::wire")
        .out_dir(server)
        .compile_fds(files)?;
    Ok(())
}
