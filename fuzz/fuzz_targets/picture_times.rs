//! The reader `picture_times` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::films::PICTURE_TIMES);
