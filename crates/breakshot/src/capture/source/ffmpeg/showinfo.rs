//! The lines that `ffmpeg` writes about each frame (its filter `showinfo`) and about what is wrong.

/// A line of the program about the frame that follows, or about what is wrong.
#[derive(Debug, PartialEq)]
pub(super) enum Line {
    /// The clock's step is the first over the second (s).
    Tick([f64; 2]),
    Frame(Info),
    Error(String),
}

/// A frame that is on its way.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Info {
    /// When it is shown, in ticks; some files do not say.
    pub(super) ticks: Option<i64>,
    pub(super) width: usize,
    pub(super) height: usize,
    /// Bits of a grey level; more than eight take two bytes.
    pub(super) bits: u32,
    pub(super) interlaced: bool,
}

impl Line {
    /// What a line says, if it matters.
    pub(super) fn of(text: &str) -> Option<Self> {
        let wrong = ["[error] ", "[fatal] "].iter().find_map(|mark| Some(text.split_once(mark)?.1));
        // What is lost is filled in from elsewhere, and that is only mentioned.
        let filled_in = text.find("concealing ").map(|at| &text[at..]);
        if let Some(said) = wrong.or(filled_in) {
            return Some(Self::Error(said.trim().into()));
        }
        let (_, said) = text.split_once("Parsed_showinfo")?;
        let value = |key: &str| said.split_once(key)?.1.split_whitespace().next();
        if let Some(base) = value("config in time_base: ") {
            let (part, whole) = base.trim_end_matches(',').split_once('/')?;
            return Some(Self::Tick([part.parse().ok()?, whole.parse().ok()?]));
        }
        let (width, height) = value(" s:")?.split_once('x')?;
        let bits = match value(" fmt:")?.strip_prefix("gray")? {
            "" => 8,
            deep => deep.strip_suffix("le")?.parse().ok()?,
        };
        Some(Self::Frame(Info {
            ticks: value(" pts:")?.parse().ok(),
            width: width.parse().ok()?,
            height: height.parse().ok()?,
            bits,
            interlaced: value(" i:")? != "P",
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_programs_lines_are_understood() {
        let frame = "[Parsed_showinfo_2 @ 0x55] [info] n:   1 pts:    256 pts_time:0.016 pos:     1298 fmt:gray10le \
                     sar:1/1 s:64x48 i:T iskey:0 type:P ";
        let info = Info { ticks: Some(256), width: 64, height: 48, bits: 10, interlaced: true };
        assert_eq!(Line::of(frame), Some(Line::Frame(info)));
        let timeless =
            frame.replace("pts:    256", "pts: NOPTS").replace("gray10le", "gray").replace("i:T", "i:P");
        let info = Info { ticks: None, width: 64, height: 48, bits: 8, interlaced: false };
        assert_eq!(Line::of(&timeless), Some(Line::Frame(info)));
        let base = "[Parsed_showinfo_2 @ 0x5] [info] config in time_base: 1/15360, frame_rate: 60/1";
        assert_eq!(Line::of(base), Some(Line::Tick([1.0, 15360.0])));
        let error = "[mov,mp4,m4a @ 0x55f] [error] stream 0, offset 0x30: partial file";
        assert_eq!(Line::of(error), Some(Line::Error("stream 0, offset 0x30: partial file".into())));
        let concealed = "[h264 @ 0x5] [info] concealing 12 DC, 12 AC, 12 MV errors in P frame";
        assert!(matches!(Line::of(concealed), Some(Line::Error(said)) if said.starts_with("concealing 12")));
        assert_eq!(Line::of("[info] video:9kB audio:0kB"), None);
    }
}
