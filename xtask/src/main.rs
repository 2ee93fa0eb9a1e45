//! The project's own tasks: `cargo xtask test`, `validate`, `bench`.

fn main() {}
