//! The reader `plan` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::scenes::PLAN);
