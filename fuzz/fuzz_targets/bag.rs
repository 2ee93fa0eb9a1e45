//! The reader `bag` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::films::BAG);
