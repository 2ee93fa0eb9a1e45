//! A camera, or a file that is played in its place.

use breakshot::{Error, Result, files};
use std::fmt::{Display, Formatter};
use std::path::{Path, PathBuf};

/// Where pictures come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// A camera of this machine (`Video4Linux`).
    Device(PathBuf),
    /// A camera of the network, or a stream: `rtsp`, `rtsps`, `http`, `https`.
    Address(String),
    /// A video file, played in real time.
    File(PathBuf),
}

/// What names a camera of this machine.
const DEVICE: &str = "v4l2:";
/// The schemes of addresses.
const SCHEMES: [&str; 4] = ["rtsp://", "rtsps://", "http://", "https://"];
/// Longest address.
const LONGEST_ADDRESS: usize = 2048;

impl Source {
    /// The source that a text names.
    ///
    /// # Errors
    /// A name with control characters, a device that is not below `/dev`, an address without a host.
    pub(crate) fn of(text: &str) -> Result<Self> {
        Self::live(text).unwrap_or_else(|| {
            files::check_file_name(Path::new(text))?;
            Ok(Self::File(text.into()))
        })
    }

    /// The camera that a text names; `None` for the name of a file.
    pub(crate) fn live(text: &str) -> Option<Result<Self>> {
        if let Some(device) = text.strip_prefix(DEVICE) {
            return Some(self::device(device));
        }
        let scheme = SCHEMES.into_iter().find(|scheme| text.starts_with(scheme))?;
        Some(address(text, &text[scheme.len()..]))
    }

    /// Whether its pictures are taken while they are recorded, as far as is known: an address may deliver a file.
    pub(crate) fn takes_now(&self) -> bool {
        match self {
            Self::Device(_) => true,
            Self::Address(address) => address.starts_with("rtsp"),
            Self::File(_) => false,
        }
    }
}

/// The camera at a path below `/dev`.
fn device(path: &str) -> Result<Source> {
    files::check_file_name(Path::new(path))?;
    if path.starts_with("/dev/") && !path.contains("..") {
        return Ok(Source::Device(path.into()));
    }
    Err(Error::invalid(DEVICE, "the camera", format!("`{path}`"), "a device such as v4l2:/dev/video0"))
}

/// The stream at an address, without characters that no address has.
fn address(text: &str, after_scheme: &str) -> Result<Source> {
    let host = after_scheme.split(['/', '?', '#']).next().unwrap_or_default();
    let plain = text.chars().all(|c| c.is_ascii_graphic() && !matches!(c, '|' | '"' | '\'' | '\\' | '`'));
    if plain && !host.is_empty() && text.len() <= LONGEST_ADDRESS {
        return Ok(Source::Address(text.into()));
    }
    let found = if plain { "without a host, or too long" } else { "with characters that no address has" };
    Err(Error::invalid("the source", "the address", found, "an address such as rtsp://192.168.0.20/stream"))
}

/// As the user wrote it, but without a password.
impl Display for Source {
    fn fmt(&self, f: &mut Formatter) -> std::fmt::Result {
        match self {
            Self::Device(path) => write!(f, "{DEVICE}{}", path.display()),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Address(address) => {
                let (scheme, rest) = address.split_once("://").unwrap_or(("", address));
                let host_end = rest.find(['/', '?', '#']).unwrap_or(rest.len());
                let without_user = rest[..host_end].rfind('@').map_or(rest, |at| &rest[at + 1..]);
                write!(f, "{scheme}://{without_user}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_read_and_shown_without_passwords() {
        for (text, shown, is_live, takes_now) in [
            ("v4l2:/dev/video0", "v4l2:/dev/video0", true, true),
            ("rtsp://u:p@ss@10.0.0.2:554/a@b?x=1", "rtsp://10.0.0.2:554/a@b?x=1", true, true),
            ("http://cam/video.mjpg", "http://cam/video.mjpg", true, false),
            ("clip.mp4", "clip.mp4", false, false),
            ("concat:a.mp4|b.mp4", "concat:a.mp4|b.mp4", false, false),
        ] {
            let source = Source::of(text).unwrap();
            assert_eq!(source.to_string(), shown);
            assert_eq!((Source::live(text).is_some(), source.takes_now()), (is_live, takes_now), "{text}");
        }
        assert_eq!(Source::of("file:clip.mp4").unwrap(), Source::File("file:clip.mp4".into()));
    }

    #[test]
    fn impossible_sources_are_refused() {
        for text in ["v4l2:", "v4l2:video0", "v4l2:/dev/../etc/passwd", "rtsp://", "http:///a", "http://a b/"]
        {
            let message = Source::of(text).unwrap_err().to_string();
            assert!(message.contains("needed"), "{text}: {message}");
        }
        assert!(Source::of("rtsp://a/|b").is_err() && Source::of("a\nb").is_err());
        assert!(Source::of(&format!("http://{}", "a".repeat(3000))).is_err());
    }
}
