//! The reader `scene` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::scenes::SCENE);
