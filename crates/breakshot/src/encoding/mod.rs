//! How are bytes written as text?

mod base64;

pub(crate) use base64::base64;
use sha2::{Digest, Sha256};

/// The hash of a script or style by which a content security policy permits it (W3C, Content Security Policy Level 3): `sha256-` and the
/// hash in Base64.
pub(crate) fn integrity(text: &str) -> String {
    format!("sha256-{}", base64(&Sha256::digest(text.as_bytes())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_permitted_by_the_published_hash_of_its_bytes() {
        // FIPS 180-4's example `abc`, in Base64.
        assert_eq!(integrity("abc"), "sha256-ungWv48Bz+pBQUDeXa4iI7ADYaOWF3qctBD/YfIAFa0=");
    }
}
