//! The reader `rosbridge` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::robots::ROSBRIDGE);
