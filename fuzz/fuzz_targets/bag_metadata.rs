//! The reader `bag_metadata` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::films::BAG_METADATA);
