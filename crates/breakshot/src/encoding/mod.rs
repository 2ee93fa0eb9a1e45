//! How are bytes written as text?

mod base64;
mod sha256;

pub(crate) use base64::base64;

/// The hash of a script or style by which a content security policy permits it (W3C, Content Security Policy Level 3): `sha256-` and the
/// hash in Base64.
pub(crate) fn integrity(text: &str) -> String {
    format!("sha256-{}", base64(&sha256::sha256(text.as_bytes())))
}
