//! Which format has this file, according to its first bytes?

use super::bag::MAGIC;
use super::error::SourceError;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Number of bytes that identify a format: two packets of a Blu-ray transport stream.
const HEAD_BYTES: u64 = 400;

/// The formats that are read.
pub(super) enum Kind {
    Mp4(File),
    Y4m(File),
    Png,
    /// A bag of ROS 2.
    Mcap,
    Folder,
    /// A film in a format that only `ffmpeg` decodes.
    Other(SourceError),
}

/// The format of the file or folder at `path`.
///
/// # Errors
/// An unreadable file, or one of another format, which the error names.
pub(super) fn of(path: &Path) -> Result<Kind> {
    let unreadable = |source| Error::Read { path: path.into(), source };
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if metadata.is_dir() {
        return Ok(Kind::Folder);
    }
    // Reading a pipe or a device could block for ever.
    if !metadata.is_file() {
        return Err(SourceError::unsupported("not a regular file").for_file(path));
    }
    let mut file = File::open(path).map_err(unreadable)?;
    let mut head = Vec::new();
    file.by_ref().take(HEAD_BYTES).read_to_end(&mut head).map_err(unreadable)?;
    file.seek(SeekFrom::Start(0)).map_err(unreadable)?;
    if is_png(&head) {
        return Ok(Kind::Png);
    }
    if head.starts_with(MAGIC) {
        return Ok(Kind::Mcap);
    }
    if head.starts_with(b"YUV4MPEG2 ") {
        return Ok(Kind::Y4m(file));
    }
    if is_mp4(&head) {
        return Ok(Kind::Mp4(file));
    }
    let error = unsupported(&head);
    if error.convertible { Ok(Kind::Other(error)) } else { Err(error.for_file(path)) }
}

pub(super) fn is_png(head: &[u8]) -> bool {
    head.starts_with(b"\x89PNG\r\n\x1a\n")
}

/// An ISO base media file starts with one of these boxes (ISO/IEC 14496-12; `QuickTime` files may lack `ftyp`).
fn is_mp4(head: &[u8]) -> bool {
    let names: [&[u8; 4]; 10] =
        [b"ftyp", b"moov", b"mdat", b"free", b"skip", b"wide", b"pnot", b"styp", b"moof", b"sidx"];
    let still: [&[u8; 4]; 6] = [b"heic", b"heix", b"mif1", b"avif", b"msf1", b"crx "];
    let at = |from: usize| head.get(from..from + 4);
    names.iter().any(|name| at(4) == Some(&name[..]))
        && !(at(4) == Some(b"ftyp") && still.iter().any(|brand| at(8) == Some(&brand[..])))
}

/// Known formats that are not read: offset of the signature, signature, name.
const UNSUPPORTED: [(usize, &[u8], &str); 25] = [
    (4, b"ftypavif", "an AVIF picture"),
    (4, b"ftypcrx ", "a Canon raw picture"),
    (4, b"ftyp", "a HEIF picture"),
    (8, b"AVI ", "an AVI film"),
    (8, b"WEBP", "a WebP picture"),
    (8, b"WAVE", "a sound file (WAV)"),
    (0, b"\x1a\x45\xdf\xa3", "a Matroska or WebM film"),
    (0, b"\x30\x26\xb2\x75", "a Windows Media film"),
    (0, b"FLV", "a Flash film"),
    (0, b"OggS", "an Ogg file"),
    (0, b"\x00\x00\x01\xba", "an MPEG program stream"),
    (0, b"\x00\x00\x01\xb3", "an MPEG-1 or MPEG-2 film"),
    (0, b"\x06\x0e\x2b\x34", "an MXF film"),
    (0, b"\x00\x00\x00\x01", "a bare H.264 or H.265 stream (no time stamps)"),
    (0, b"\x00\x00\x01", "a bare video stream (no time stamps)"),
    (0, b"\xff\xd8\xff", "a JPEG picture"),
    (0, b"GIF8", "a GIF picture"),
    (0, b"BM", "a bitmap picture (BMP)"),
    (0, b"II*\0", "a TIFF picture"),
    (0, b"MM\0*", "a TIFF picture"),
    (0, b"P5", "a PGM picture"),
    (0, b"P6", "a PPM picture"),
    (0, b"ID3", "a sound file (MP3)"),
    (0, b"PK\x03\x04", "a ZIP archive"),
    (0, b"\x1f\x8b", "a gzip archive"),
];

/// The error for a file of another format.
fn unsupported(head: &[u8]) -> SourceError {
    if head.is_empty() {
        return SourceError::unsupported("an empty file");
    }
    match head {
        [b'#', b'R', b'O', b'S', b'B', b'A', b'G', ..] => return SourceError::of_ros_1("a ROS 1 bag"),
        [0x28, 0xb5, 0x2f, 0xfd, ..] => {
            return SourceError::of_compressed_bag("a file compressed by zstd, as the files of some bags");
        }
        _ if head.starts_with(b"SQLite format 3\0") => return SourceError::of_sqlite(),
        _ => {}
    }
    let synchronised = |first: usize, step: usize| {
        head.len() > first + step && head[first] == 0x47 && head[first + step] == 0x47
    };
    if synchronised(0, 188) || synchronised(4, 192) {
        return SourceError::convertible("an MPEG transport stream (TS, MTS: AVCHD)");
    }
    let known =
        UNSUPPORTED.iter().find(|(at, mark, _)| head.get(*at..).is_some_and(|rest| rest.starts_with(mark)));
    if let Some((_, _, what)) = known {
        let read = ["film", "stream", "JPEG", "BMP", "TIFF", "PGM", "PPM", "GIF", "WebP"];
        let convertible = !what.contains("bare") && read.iter().any(|word| what.contains(word));
        return if convertible { SourceError::convertible(*what) } else { SourceError::unsupported(*what) };
    }
    if head.iter().all(|&byte| byte == 0) {
        return SourceError::unsupported("a file that begins with zeros");
    }
    if is_text(head) {
        return SourceError::unsupported("a text file");
    }
    let start: Vec<String> = head.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    SourceError::unsupported(format!("a file of unknown kind (it starts with {})", start.join(" ")))
}

fn is_text(head: &[u8]) -> bool {
    let valid = match std::str::from_utf8(head) {
        Ok(text) => text,
        // The head may end within a character.
        Err(e) if e.error_len().is_none() => {
            std::str::from_utf8(&head[..e.valid_up_to()]).unwrap_or_default()
        }
        Err(_) => return false,
    };
    !valid.is_empty() && valid.chars().all(|c| !c.is_control() || c.is_whitespace())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_content_of_a_file_decides_its_format() {
        for (bytes, what) in [
            (&b""[..], "empty"),
            (b"hello, this is no film\n", "text"),
            (b"RIFF\x10\0\0\0AVI LIST", "AVI"),
            (b"\x1a\x45\xdf\xa3\x01\0\0\0", "Matroska"),
            (b"\xff\xd8\xff\xe0\0\x10JFIF", "JPEG"),
            (b"\0\0\0\x18ftypheic\0\0\0\0mif1", "HEIF"),
            (b"\0\0\0\x01\x67\x64\0\x1e", "bare H.264"),
            (b"\x01\x02\x03\xfe", "01 02 03 fe"),
        ] {
            let found = unsupported(bytes).found;
            assert!(found.contains(what), "found `{found}`, which does not name `{what}`");
        }
        let mut stream = vec![0; 400];
        (stream[4], stream[196]) = (0x47, 0x47);
        assert!(unsupported(&stream).found.contains("AVCHD"));
    }
}
