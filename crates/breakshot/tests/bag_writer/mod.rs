//! Writes bags of ROS 2 (MCAP, <https://mcap.dev/spec>) and messages that hold images and lenses, for tests of their reader.

#![allow(dead_code, reason = "each user needs a part of it")]

/// How chunks are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Chunks {
    /// Messages outside of chunks.
    Without,
    Plain,
    Zstd,
    Lz4,
}

/// A bag in memory.
pub(crate) struct BagWriter {
    chunks: Chunks,
    file: Vec<u8>,
    /// Records of the chunk that is being filled.
    records: Vec<u8>,
    waiting: usize,
    channels: u16,
    messages: u64,
    has_checksums: bool,
}

/// Number of messages in a chunk.
const MESSAGES: usize = 3;
pub(crate) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

impl BagWriter {
    pub(crate) fn new(chunks: Chunks) -> Self {
        let mut file = MAGIC.to_vec();
        push_record(&mut file, 1, &[text("ros2"), text("test")].concat());
        Self { chunks, file, records: Vec::new(), waiting: 0, channels: 0, messages: 0, has_checksums: true }
    }

    /// The same bag with chunks without checksums, so that changed bytes are read.
    pub(crate) fn without_checksums(self) -> Self {
        Self { has_checksums: false, ..self }
    }

    /// A new channel.
    pub(crate) fn channel(&mut self, topic: &str, schema: &str, encoding: &str) -> u16 {
        self.channels += 1;
        let id = self.channels.to_le_bytes();
        push_record(&mut self.records, 3, &[&id[..], &text(schema), &text("ros2msg"), &text("")].concat());
        push_record(&mut self.records, 4, &[&id[..], &id, &text(topic), &text(encoding), &[0; 4]].concat());
        self.channels
    }

    /// Adds a message that was recorded at this time.
    pub(crate) fn message(&mut self, channel: u16, recorded_ns: u64, data: &[u8]) {
        let time = recorded_ns.to_le_bytes();
        push_record(
            &mut self.records,
            5,
            &[&channel.to_le_bytes()[..], &[0; 4], &time, &time, data].concat(),
        );
        self.waiting += 1;
        self.messages += 1;
        if self.waiting == MESSAGES {
            self.end_chunk();
        }
    }

    fn end_chunk(&mut self) {
        let records = std::mem::take(&mut self.records);
        self.waiting = 0;
        let (name, stored) = match self.chunks {
            Chunks::Without => {
                self.file.extend(records);
                return;
            }
            Chunks::Plain => ("", records.clone()),
            Chunks::Zstd => (
                "zstd",
                ruzstd::encoding::compress_to_vec(&records[..], ruzstd::encoding::CompressionLevel::Fastest),
            ),
            Chunks::Lz4 => {
                let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
                std::io::Write::write_all(&mut encoder, &records).expect("memory");
                ("lz4", encoder.finish().expect("memory"))
            }
        };
        let head = [[0; 16].as_slice(), &(records.len() as u64).to_le_bytes()].concat();
        let checksum = if self.has_checksums { crc32fast::hash(&records) } else { 0 }.to_le_bytes();
        let length = (stored.len() as u64).to_le_bytes();
        push_record(&mut self.file, 6, &[&head[..], &checksum, &text(name), &length, &stored].concat());
    }

    /// The whole file.
    pub(crate) fn finished(mut self) -> Vec<u8> {
        self.end_chunk();
        push_record(&mut self.file, 15, &[0; 4]);
        // The statistics: messages, then other counts and times.
        push_record(&mut self.file, 11, &[&self.messages.to_le_bytes()[..], &[0; 38]].concat());
        push_record(&mut self.file, 2, &[0; 20]);
        self.file.extend(MAGIC);
        self.file
    }
}

fn push_record(file: &mut Vec<u8>, opcode: u8, content: &[u8]) {
    file.push(opcode);
    file.extend((content.len() as u64).to_le_bytes());
    file.extend(content);
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// Fields in CDR, lowest byte first.
struct Cdr(Vec<u8>);

impl Cdr {
    /// A message that begins with this time and a coordinate frame.
    fn new(taken_ns: u64, frame: &str) -> Self {
        let (seconds, rest) = (taken_ns / 1_000_000_000, taken_ns % 1_000_000_000);
        Self(vec![0, 1, 0, 0]).u32(seconds as u32).u32(rest as u32).text(frame)
    }

    fn u8(mut self, number: u8) -> Self {
        self.0.push(number);
        self
    }

    fn u32(mut self, number: u32) -> Self {
        // The four bytes before the fields do not change the alignment.
        self.0.resize(self.0.len().next_multiple_of(4), 0);
        self.0.extend(number.to_le_bytes());
        self
    }

    fn f64s(mut self, numbers: &[f64]) -> Self {
        if !numbers.is_empty() {
            self.0.resize((self.0.len() - 4).next_multiple_of(8) + 4, 0);
        }
        self.0.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        self
    }

    fn text(self, text: &str) -> Self {
        self.bytes(&[text.as_bytes(), b"\0"].concat())
    }

    fn bytes(self, bytes: &[u8]) -> Self {
        let mut all = self.u32(bytes.len() as u32);
        all.0.extend(bytes);
        all
    }
}

/// `sensor_msgs/msg/Image`
pub(crate) fn image(
    taken_ns: u64,
    [width, height]: [usize; 2],
    encoding: &str,
    step: usize,
    data: &[u8],
) -> Vec<u8> {
    let head = Cdr::new(taken_ns, "camera").u32(height as u32).u32(width as u32);
    head.text(encoding).u8(0).u32(step as u32).bytes(data).0
}

/// `sensor_msgs/msg/CompressedImage`
pub(crate) fn compressed(taken_ns: u64, format: &str, data: &[u8]) -> Vec<u8> {
    Cdr::new(taken_ns, "camera").text(format).bytes(data).0
}

/// `foxglove_msgs/msg/CompressedVideo`
pub(crate) fn video(taken_ns: u64, format: &str, data: &[u8]) -> Vec<u8> {
    Cdr::new(taken_ns, "camera").bytes(data).text(format).0
}

/// `foxglove.CompressedVideo`
pub(crate) fn protobuf_video(taken_ns: u64, format: &str, data: &[u8]) -> Vec<u8> {
    let field = protobuf_field;
    let time = protobuf_time(taken_ns);
    [field(1, &time), field(2, b"camera"), field(3, data), field(4, format.as_bytes())].concat()
}

/// A calibration of a camera, for messages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Info<'a> {
    pub(crate) size_px: [u32; 2],
    pub(crate) model: &'a str,
    pub(crate) d: &'a [f64],
    pub(crate) k: [f64; 9],
    pub(crate) p: [f64; 12],
    pub(crate) binning: [u32; 2],
    /// x offset, y offset, width, height.
    pub(crate) roi: [u32; 4],
}

impl<'a> Info<'a> {
    /// The whole sensor; rectified pictures have the same camera matrix.
    pub(crate) fn new(
        size_px: [u32; 2],
        [fx, fy]: [f64; 2],
        [cx, cy]: [f64; 2],
        model: &'a str,
        d: &'a [f64],
    ) -> Self {
        let k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0];
        let p = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
        Self { size_px, model, d, k, p, binning: [0; 2], roi: [0; 4] }
    }

    fn matrices(&self, head: Cdr) -> Cdr {
        let coefficients = head.text(self.model).u32(self.d.len() as u32).f64s(self.d);
        coefficients.f64s(&self.k).f64s(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]).f64s(&self.p)
    }
}

/// `sensor_msgs/msg/CameraInfo`
pub(crate) fn camera_info(taken_ns: u64, info: &Info) -> Vec<u8> {
    let ([width, height], [x, y, roi_width, roi_height]) = (info.size_px, info.roi);
    let matrices = info.matrices(Cdr::new(taken_ns, "camera").u32(height).u32(width));
    let binned = matrices.u32(info.binning[0]).u32(info.binning[1]);
    binned.u32(x).u32(y).u32(roi_height).u32(roi_width).u8(0).0
}

/// `foxglove_msgs/msg/CameraCalibration`
pub(crate) fn camera_calibration(taken_ns: u64, info: &Info) -> Vec<u8> {
    info.matrices(Cdr::new(taken_ns, "camera").u32(info.size_px[0]).u32(info.size_px[1])).0
}

/// `foxglove.CameraCalibration`
pub(crate) fn protobuf_calibration(taken_ns: u64, info: &Info) -> Vec<u8> {
    let bytes = |numbers: &[f64]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<_>>();
    let fixed = |number: u8, value: u32| [&[number << 3 | 5][..], &value.to_le_bytes()].concat();
    let one_by_one: Vec<u8> =
        info.d.iter().flat_map(|d| [&[5 << 3 | 1][..], &d.to_le_bytes()].concat()).collect();
    [
        protobuf_field(1, &protobuf_time(taken_ns)),
        fixed(2, info.size_px[0]),
        fixed(3, info.size_px[1]),
        protobuf_field(4, info.model.as_bytes()),
        one_by_one,
        protobuf_field(6, &bytes(&info.k)),
        protobuf_field(8, &bytes(&info.p)),
        protobuf_field(9, b"camera"),
    ]
    .concat()
}

fn protobuf_time(taken_ns: u64) -> Vec<u8> {
    let (seconds, rest) = (taken_ns / 1_000_000_000, taken_ns % 1_000_000_000);
    [&[0x08][..], &varint(seconds), &[0x10], &varint(rest)].concat()
}

fn protobuf_field(number: u8, bytes: &[u8]) -> Vec<u8> {
    [&[number << 3 | 2][..], &varint(bytes.len() as u64), bytes].concat()
}

fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number > 0x7f {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}
