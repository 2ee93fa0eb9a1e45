//! The reader `proposals` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::scenes::PROPOSALS);
