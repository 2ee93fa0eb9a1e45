//! The breakshot command line.

fn main() {}
