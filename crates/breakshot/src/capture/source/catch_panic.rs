//! Catches the panics of a decoder on damaged bytes.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static DECODING: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread decodes bytes of a film whose damage may end in a panic. Such a panic becomes an error: the hook of a
/// program need not report it.
pub fn is_decoding() -> bool {
    DECODING.get()
}

/// The result of `decode`, or `None` if it panicked; the caller must then drop the state that it changed.
pub(super) fn catch_panic<T>(decode: impl FnOnce() -> T) -> Option<T> {
    let outer = DECODING.replace(true);
    let result = catch_unwind(AssertUnwindSafe(decode)).ok();
    DECODING.set(outer);
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::{set_hook, take_hook};

    #[test]
    fn a_panic_becomes_none() {
        assert_eq!(catch_panic(|| 7), Some(7));
        assert_eq!(catch_panic(|| -> u8 { panic!("a decoder's bug") }), None);
    }

    #[test]
    fn the_hook_of_the_program_stays_and_knows_that_a_decoder_panicked() {
        thread_local! {
            static SEEN: Cell<Option<bool>> = const { Cell::new(None) };
        }
        let previous = take_hook();
        set_hook(Box::new(move |panic| {
            SEEN.set(Some(is_decoding()));
            previous(panic);
        }));
        assert_eq!(catch_panic(|| -> u8 { panic!("a decoder's bug") }), None);
        assert_eq!((SEEN.get(), is_decoding()), (Some(true), false));
    }
}
