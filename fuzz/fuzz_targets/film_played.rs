//! The reader `film_played` under libFuzzer.

#![no_main]

breakshot_fuzz::guided!(breakshot_fuzz::targets::films::FILM_PLAYED);
