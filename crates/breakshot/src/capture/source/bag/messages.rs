//! Messages that hold an image.

use super::cdr::{Cdr, time_ns};
use super::protobuf::{Fields, Value};
use crate::capture::source::error::SourceError;

type Result<T> = std::result::Result<T, SourceError>;

/// The messages that are read, for messages to the user.
pub(super) const READ: &str =
    "sensor_msgs/msg/Image, sensor_msgs/msg/CompressedImage or foxglove CompressedVideo";

/// A kind of messages that hold an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// `sensor_msgs/msg/Image`
    Raw,
    /// `sensor_msgs/msg/CompressedImage`
    Compressed,
    /// `foxglove_msgs/msg/CompressedVideo`
    Video,
    /// `foxglove.CompressedVideo`
    ProtobufVideo,
}

impl Kind {
    /// The kind of a schema's messages; `None` for messages that hold no image.
    ///
    /// # Errors
    /// Images that are not read: the reason.
    pub(super) fn of(schema: &str, encoding: &str) -> Option<Result<Self>> {
        let kind = match schema {
            "sensor_msgs/msg/Image" | "sensor_msgs/Image" => Self::Raw,
            "sensor_msgs/msg/CompressedImage" | "sensor_msgs/CompressedImage" => Self::Compressed,
            "foxglove_msgs/msg/CompressedVideo" => Self::Video,
            "foxglove.CompressedVideo" => Self::ProtobufVideo,
            "foxglove.CompressedImage"
            | "foxglove.RawImage"
            | "foxglove_msgs/msg/CompressedImage"
            | "foxglove_msgs/msg/RawImage"
            | "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"
            | "theora_image_transport/msg/Packet" => {
                return Some(Err(SourceError::unsuitable(format!("messages of type {schema}"), READ)));
            }
            _ => return None,
        };
        let needed = if kind == Self::ProtobufVideo { "protobuf" } else { "cdr" };
        Some(match encoding {
            own if own == needed => Ok(kind),
            "ros1" => Err(SourceError::of_ros_1("messages of ROS 1")),
            other => {
                let found = format!("messages of type {schema} serialised as `{}`", other.escape_debug());
                Err(SourceError::unsuitable(found, format!("`{needed}`")))
            }
        })
    }

    /// The first bytes of a message that hold its time; `None` if it may be anywhere.
    pub(super) fn time_bytes(self) -> Option<u64> {
        (self != Self::ProtobufVideo).then_some(12)
    }

    /// When the image of a message was taken (ns); the first [`Kind::time_bytes`] are enough.
    pub(super) fn time_ns(self, message: &[u8]) -> Result<i64> {
        match self {
            Self::Raw | Self::Compressed | Self::Video => Cdr::of(message)?.time_ns(),
            Self::ProtobufVideo => Ok(protobuf_video(message)?.0),
        }
    }

    /// The image of a message.
    pub(super) fn image(self, message: &[u8]) -> Result<Image<'_>> {
        if self == Self::ProtobufVideo {
            return Ok(protobuf_video(message)?.1);
        }
        let mut fields = Cdr::of(message)?;
        fields.time_ns()?;
        // The coordinate frame
        fields.text()?;
        Ok(match self {
            Self::Raw => {
                let (height, width) = (fields.u32()?, fields.u32()?);
                let (encoding, is_big_endian) = (fields.text()?, fields.u8()? != 0);
                let (step, data) = (fields.u32()?, fields.bytes()?);
                Image::Raw(RawImage { width, height, encoding, is_big_endian, step, data })
            }
            Self::Compressed => {
                let format = fields.text()?;
                Image::Compressed { format, data: fields.bytes()? }
            }
            Self::Video | Self::ProtobufVideo => {
                let data = fields.bytes()?;
                Image::Video { format: fields.text()?, data }
            }
        })
    }
}

/// The image in a message.
pub(super) enum Image<'a> {
    Raw(RawImage<'a>),
    Compressed { format: &'a str, data: &'a [u8] },
    Video { format: &'a str, data: &'a [u8] },
}

/// Rows of pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct RawImage<'a> {
    pub width: u32,
    pub height: u32,
    pub encoding: &'a str,
    pub is_big_endian: bool,
    /// Bytes from one row to the next.
    pub step: u32,
    pub data: &'a [u8],
}

/// Time (ns) and image of a `foxglove.CompressedVideo`.
fn protobuf_video(message: &[u8]) -> Result<(i64, Image<'_>)> {
    let (mut taken_ns, mut data, mut format) = (0, &[][..], "");
    for field in Fields::of(message) {
        match field? {
            (1, Value::Bytes(timestamp)) => taken_ns = protobuf_time_ns(timestamp)?,
            (3, Value::Bytes(bytes)) => data = bytes,
            (4, Value::Bytes(text)) => format = std::str::from_utf8(text).unwrap_or("no text"),
            _ => {}
        }
    }
    Ok((taken_ns, Image::Video { format, data }))
}

/// `google.protobuf.Timestamp` (ns).
fn protobuf_time_ns(timestamp: &[u8]) -> Result<i64> {
    let (mut seconds, mut nanoseconds) = (0, 0);
    for field in Fields::of(timestamp) {
        match field? {
            (1, Value::Number(number)) => seconds = number.cast_signed(),
            (2, Value::Number(number)) => nanoseconds = number.cast_signed(),
            _ => {}
        }
    }
    time_ns(seconds, nanoseconds)
}
