//! The reader `tracks` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::numbers::TRACKS);
