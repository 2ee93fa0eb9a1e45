//! The reader `touches` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::cells::TOUCHES);
