//! The reader `camera_info` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::cells::CAMERA_INFO);
