//! Messages that hold the calibration of a camera, and the topic of them that belongs to a topic of images.

use super::cdr::Cdr;
use super::protobuf::{Fields, Value};
use crate::capture::source::error::SourceError;
use crate::cell::camera_info::SensorCalibration;

type Result<T> = std::result::Result<T, SourceError>;

/// Longest such message (bytes); a usual one has 400.
pub(super) const MAX_BYTES: u64 = 1 << 16;
/// Most distortion coefficients of a message; OpenCV's longest model has 14.
const MAX_COEFFICIENTS: usize = 64;

/// A kind of messages that hold a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// `sensor_msgs/msg/CameraInfo`
    CameraInfo,
    /// `foxglove_msgs/msg/CameraCalibration`
    Foxglove,
    /// `foxglove.CameraCalibration`
    ProtobufFoxglove,
}

/// The calibration of a message: of the camera's own image, and the projection matrix of the rectified one.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct CameraInfo {
    own: SensorCalibration,
    /// The projection matrix `P`, 3 x 4, row by row (px).
    projection: Vec<f64>,
}

/// The calibrations of a topic.
pub(super) struct Calibrations {
    kind: Result<Kind>,
    count: u64,
    /// That of the first message, and what is wrong with it.
    first: Option<Result<CameraInfo>>,
    /// The number of the first message, from 1 on, with another calibration or a damaged one.
    pub change: Option<u64>,
}

impl Kind {
    fn of(schema: &str, encoding: &str) -> Option<Result<Self>> {
        let kind = match schema {
            "sensor_msgs/msg/CameraInfo" | "sensor_msgs/CameraInfo" => Self::CameraInfo,
            "foxglove_msgs/msg/CameraCalibration" => Self::Foxglove,
            "foxglove.CameraCalibration" => Self::ProtobufFoxglove,
            _ => return None,
        };
        let needed = if kind == Self::ProtobufFoxglove { "protobuf" } else { "cdr" };
        if encoding == needed {
            return Some(Ok(kind));
        }
        let found = format!("messages of type {schema} serialised as `{}`", encoding.escape_debug());
        Some(Err(SourceError::unsuitable(found, format!("`{needed}`"))))
    }

    fn read(self, message: &[u8]) -> Result<CameraInfo> {
        if self == Self::ProtobufFoxglove {
            return protobuf(message);
        }
        let mut fields = Cdr::of(message)?;
        fields.time_ns()?;
        // The coordinate frame
        fields.text()?;
        let sides = [fields.u32()?, fields.u32()?];
        let [width, height] = if self == Self::Foxglove { sides } else { [sides[1], sides[0]] };
        let model = fields.text()?.to_owned();
        let coefficients = fields.f64_sequence(MAX_COEFFICIENTS)?;
        let matrix = fields.f64_array(9)?;
        // The rotation of the rectification
        fields.f64_array(9)?;
        let projection = fields.f64_array(12)?;
        let mut own = calibration([width, height], matrix, model, coefficients);
        if self == Self::CameraInfo {
            own.binning = [fields.u32()?, fields.u32()?];
            own.roi_offset_px = [fields.u32()?, fields.u32()?];
            let [height, width] = [fields.u32()?, fields.u32()?];
            own.roi_size_px = [width, height];
        }
        Ok(CameraInfo { own, projection })
    }
}

fn calibration(
    size_px: [u32; 2],
    matrix: Vec<f64>,
    model: String,
    coefficients: Vec<f64>,
) -> SensorCalibration {
    let is_ambiguous = true;
    SensorCalibration { size_px, matrix, model, coefficients, is_ambiguous, ..SensorCalibration::default() }
}

/// A `foxglove.CameraCalibration`.
fn protobuf(message: &[u8]) -> Result<CameraInfo> {
    let (mut size_px, mut model) = ([0; 2], String::new());
    let [mut coefficients, mut matrix, mut projection] = [const { Vec::new() }; 3];
    for field in Fields::of(message) {
        match field? {
            (2, Value::Fixed32(width)) => size_px[0] = width,
            (3, Value::Fixed32(height)) => size_px[1] = height,
            (4, Value::Bytes(text)) => model = String::from_utf8_lossy(text).into_owned(),
            (5, value) => coefficients.extend(doubles(value)?),
            (6, value) => matrix.extend(doubles(value)?),
            (8, value) => projection.extend(doubles(value)?),
            _ => {}
        }
    }
    if coefficients.len() > MAX_COEFFICIENTS {
        let found = format!("a message with a list of {} numbers", coefficients.len());
        return Err(SourceError::damaged(found));
    }
    Ok(CameraInfo { own: calibration(size_px, matrix, model, coefficients), projection })
}

/// The numbers of a repeated field, packed or one by one.
fn doubles(value: Value) -> Result<Vec<f64>> {
    match value {
        Value::Fixed64(bits) => Ok(vec![f64::from_bits(bits)]),
        Value::Bytes(bytes) if bytes.len().is_multiple_of(8) => {
            Ok(bytes.as_chunks().0.iter().copied().map(f64::from_le_bytes).collect())
        }
        _ => Err(SourceError::damaged("a calibration with numbers of another type")),
    }
}

impl Calibrations {
    /// Without a message so far; `None` for messages that hold no calibration.
    pub(super) fn of(schema: &str, encoding: &str) -> Option<Self> {
        Kind::of(schema, encoding).map(|kind| Self { kind, count: 0, first: None, change: None })
    }

    /// Whether the next message must be added: the calibration is not known to change yet.
    pub(super) fn wants_more(&self) -> bool {
        self.kind.is_ok() && self.change.is_none() && !matches!(self.first, Some(Err(_)))
    }

    /// Adds the next message, or what is wrong with it.
    pub(super) fn add(&mut self, message: Result<&[u8]>) {
        let Ok(kind) = &self.kind else { return };
        let found = message.and_then(|message| kind.read(message));
        self.count += 1;
        match &self.first {
            None => self.first = Some(found),
            Some(first) if *first != found => self.change = Some(self.count),
            Some(_) => {}
        }
    }

    /// The calibration of the topic's images, rectified ones or the camera's own; `None` without messages, and from a driver that has none.
    ///
    /// # Errors
    /// Messages that are damaged or serialised in an unknown form.
    pub(super) fn of_images(&self, are_rectified: bool) -> Option<Result<SensorCalibration>> {
        if let Err(error) = &self.kind {
            return Some(Err(error.clone()));
        }
        match self.first.as_ref()? {
            Err(error) => Some(Err(error.clone())),
            Ok(info) => {
                let calibration = if are_rectified { info.rectified() } else { info.own.clone() };
                calibration.is_calibrated().then_some(Ok(calibration))
            }
        }
    }
}

impl CameraInfo {
    /// The calibration of the rectified image: the left part of the projection matrix, and no distortion.
    fn rectified(&self) -> SensorCalibration {
        let matrix = match self.projection.as_slice() {
            &[fx, a, cx, _, b, fy, cy, _, c, d, e, _] => vec![fx, a, cx, b, fy, cy, c, d, e],
            other => other.to_vec(),
        };
        SensorCalibration { matrix, model: String::new(), coefficients: Vec::new(), ..self.own.clone() }
    }
}

/// The name of ROS for the topic of the calibration.
const CAMERA_INFO: &str = "camera_info";

/// The name of a topic of images and the namespace of its camera.
///
/// `image_transport` puts the calibration beside the images (`/camera/image_raw`, `/camera/camera_info`), and each compressed form of the images
/// below their name (`/camera/image_raw/compressed`).
struct ImageTopic<'a> {
    namespace: &'a str,
    image: &'a str,
}

impl<'a> ImageTopic<'a> {
    fn of(topic: &'a str) -> Self {
        let (above, name) = topic.rsplit_once('/').unwrap_or(("", topic));
        match above.rsplit_once('/').unwrap_or(("", above)) {
            (namespace, image) if image.starts_with("image") || name == "compressed" => {
                Self { namespace, image }
            }
            _ => Self { namespace: above, image: name },
        }
    }
}

/// The one of these topics of calibrations that belongs to a topic of images: in its namespace `camera_info`, or the only one there.
pub(super) fn topic_of<'t>(image_topic: &str, mut topics: impl Iterator<Item = &'t str>) -> Option<&'t str> {
    let ImageTopic { namespace, .. } = ImageTopic::of(image_topic);
    let split = |topic: &'t str| topic.rsplit_once('/').unwrap_or(("", topic));
    let mut beside: Vec<&str> = topics.by_ref().filter(|topic| split(topic).0 == namespace).collect();
    if let Some(named) = beside.iter().find(|topic| split(topic).1 == CAMERA_INFO) {
        return Some(named);
    }
    if beside.len() == 1 { beside.pop() } else { None }
}

/// Whether the images of a topic are rectified, by the names that `image_proc` gives them (`image_rect`, `image_rect_color`).
pub(super) fn are_rectified(image_topic: &str) -> bool {
    ImageTopic::of(image_topic).image.starts_with("image_rect")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_calibration_of_a_topic_lies_beside_its_images() {
        for (image, topics, wanted) in [
            ("/camera/image_raw", &["/camera/camera_info", "/camera_info"][..], Some("/camera/camera_info")),
            (
                "/camera/image_raw/compressed",
                &["/camera/camera_info", "/x/camera_info"],
                Some("/camera/camera_info"),
            ),
            (
                "/a/b/image_rect_color/ffmpeg",
                &["/a/b/camera_info", "/a/camera_info"],
                Some("/a/b/camera_info"),
            ),
            ("/image_raw", &["/camera_info"], Some("/camera_info")),
            ("/image_raw/compressed", &["/camera_info"], Some("/camera_info")),
            ("image", &["camera_info"], Some("camera_info")),
            ("/left/image", &["/right/camera_info", "/camera_info"], None),
            ("/camera/color/compressed", &["/camera/camera_info"], Some("/camera/camera_info")),
            ("/left/video", &["/left/calibration", "/right/calibration"], Some("/left/calibration")),
            ("/left/video", &["/left/one", "/left/two"], None),
            ("/left/video", &["/left/one", "/left/camera_info"], Some("/left/camera_info")),
        ] {
            assert_eq!(topic_of(image, topics.iter().copied()), wanted, "{image} among {topics:?}");
        }
        for (topic, wanted) in [
            ("/c/image_rect", true),
            ("/c/image_rect_color/compressed", true),
            ("/c/image_raw", false),
            ("/image_rect/video/x", false),
        ] {
            assert_eq!(are_rectified(topic), wanted, "{topic}");
        }
    }
}
