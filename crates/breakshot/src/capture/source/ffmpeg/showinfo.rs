//! The lines that `ffmpeg` writes about each frame (its filter `showinfo`) and about errors.

/// A line about the next frame or about an error.
#[derive(Debug, PartialEq)]
pub(super) enum Line {
    /// The period of the clock: the first number over the second (s).
    Tick([f64; 2]),
    Frame(Info),
    Error(String),
}

/// The properties of the next frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Info {
    /// Its display time in ticks; `None` where the file has no time stamp.
    pub(super) ticks: Option<i64>,
    pub(super) width: usize,
    pub(super) height: usize,
    /// Bits of a grey level; more than eight are stored in two bytes.
    pub(super) bits: u32,
    pub(super) interlaced: bool,
}

impl Line {
    /// The content of a line; `None` for any other line.
    pub(super) fn of(text: &str) -> Option<Self> {
        let (context, level, message) = parts(text);
        // Concealed errors are reported at the level `info` only.
        if matches!(level, "error" | "fatal" | "panic") || message.starts_with("concealing ") {
            return Some(Self::Error(message.trim().into()));
        }
        let fields = message;
        context.strip_prefix("[Parsed_showinfo")?;
        let value = |key: &str| fields.split_once(key)?.1.split_whitespace().next();
        if let Some(base) = value("config in time_base: ") {
            let (numerator, denominator) = base.trim_end_matches(',').split_once('/')?;
            return Some(Self::Tick([numerator.parse().ok()?, denominator.parse().ok()?]));
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

/// The context (`[name @ address]`, one or more), the level and the message of a line. Only what stands before the message is
/// `ffmpeg`'s own: a message may contain the name of a file.
fn parts(text: &str) -> (&str, &str, &str) {
    let mut rest = text;
    while let Some((bracket, after)) = rest.strip_prefix('[').and_then(|rest| rest.split_once("] ")) {
        if !bracket.contains(" @ 0x") {
            return (text, bracket, after.trim_start());
        }
        rest = after;
    }
    (text, "", rest.trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_about_frames_clocks_and_errors_are_parsed() {
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
        assert!(
            matches!(Line::of(concealed), Some(Line::Error(message)) if message.starts_with("concealing 12"))
        );
        assert_eq!(Line::of("[info] video:9kB audio:0kB"), None);
        let twice = "[vist#0:0/h264 @ 0x5] [dec:h264 @ 0x6] [error] Error submitting packet to decoder";
        assert!(
            matches!(Line::of(twice), Some(Line::Error(message)) if message.starts_with("Error submitting"))
        );
    }

    #[test]
    fn the_name_of_a_film_is_no_error() {
        for name in ["concealing x/film.mp4", "[error] film.mp4", "[fatal] concealing 3 errors.mp4"] {
            let line = format!("[info] Input #0, mov,mp4,m4a, from 'file:/films/{name}':");
            assert_eq!(Line::of(&line), None);
            assert_eq!(Line::of(&format!("  title : {name}")), None);
        }
        let named = "[info] from 'Parsed_showinfo_2 config in time_base: 1/7, x.mp4'";
        assert_eq!(Line::of(named), None);
    }
}
