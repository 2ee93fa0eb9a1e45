//! Are decoded films what ffmpeg decodes, and what does decoding cost?  Needs an `ffmpeg` with x264 on the path.

use crate::process::{children_cpu_s, own_cpu_s};
use breakshot::capture::{Footage, Frame};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A moving, grainy scene: width x height, frames a second, seconds.
const SCENE: [(&str, &str); 3] = [
    ("HD", "testsrc2=size=1280x720:rate=60:duration=1,noise=alls=10:allf=t:all_seed=1"),
    ("odd", "testsrc2=size=1366x766:rate=60:duration=0.5"),
    ("4K", "testsrc2=size=3840x2160:rate=60:duration=0.3,noise=alls=10:allf=t:all_seed=1"),
];

/// Films that are read: name, scene, how ffmpeg makes it.
const KINDS: [(&str, usize, &str); 35] = [
    ("baseline.mp4", 0, "-profile:v baseline"),
    ("main.mp4", 0, "-profile:v main -bf 2"),
    ("high.mp4", 0, "-profile:v high -bf 2 -b:v 8M"),
    ("pyramid.mp4", 0, "-bf 8 -x264-params b-pyramid=normal:b-adapt=2:ref=6"),
    ("weighted.mp4", 0, "-vf fade=out:10:40 -bf 3 -x264-params weightp=2:weightb=1"),
    ("temporal.mp4", 0, "-bf 3 -x264-params direct=temporal:ref=4"),
    ("spatial.mp4", 0, "-bf 3 -x264-params direct=spatial"),
    ("open_gop.mp4", 0, "-bf 3 -x264-params open-gop=1:keyint=16:b-adapt=0:scenecut=0"),
    ("slices.mp4", 0, "-bf 2 -x264-params slices=4"),
    ("veryslow.mp4", 0, "-preset veryslow"),
    ("ultrafast.mp4", 0, "-preset ultrafast"),
    ("sixteen_references.mp4", 0, "-bf 3 -x264-params ref=16"),
    ("fine.mp4", 0, "-qp 1"),
    ("full_range.mp4", 0, "-vf scale=out_range=full -color_range pc -bf 2"),
    ("intra.mp4", 0, "-x264-params keyint=1"),
    ("refresh.mp4", 0, "-x264-params intra-refresh=1:keyint=20"),
    ("matrices.mp4", 0, "-x264-params cqm=jvt"),
    ("cavlc_8x8.mp4", 0, "-bf 3 -x264-params cabac=0:8x8dct=1"),
    ("zero_latency.mp4", 0, "-tune zerolatency"),
    ("progressive_fields.mp4", 0, "-x264-params fake-interlaced=1"),
    ("no_deblocking.mp4", 0, "-bf 2 -x264-params no-deblock=1"),
    ("delimiters.mp4", 0, "-bf 2 -x264-params aud=1"),
    ("film.mov", 0, "-bf 2"),
    ("fragments.mp4", 0, "-bf 2 -g 15 -movflags frag_keyframe+empty_moov"),
    ("fragment_each.mp4", 0, "-bf 2 -g 15 -movflags frag_every_frame+empty_moov"),
    ("cmaf.mp4", 0, "-bf 2 -g 15 -movflags cmaf"),
    ("index_and_fragments.mp4", 0, "-bf 2 -g 15 -movflags frag_keyframe"),
    ("negative_delays.mp4", 0, "-bf 2 -movflags negative_cts_offsets"),
    ("fast_start.mp4", 0, "-bf 2 -movflags faststart"),
    ("23.976.mp4", 0, "-r 24000/1001 -bf 2"),
    ("240.mp4", 0, "-r 240 -bf 2"),
    ("variable_rate.mp4", 0, "-vf select='not(eq(mod(n\\,7)\\,3))' -vsync vfr -bf 2"),
    ("wide_pixels.mp4", 0, "-vf setsar=4/3"),
    ("odd_crop.mp4", 1, "-bf 2"),
    ("4k.mp4", 2, "-profile:v high -bf 2 -b:v 60M"),
];

/// Films made from others without coding them again: name, original film, ffmpeg's arguments before and after it.
const COPIES: [(&str, &str, &str, &str); 5] = [
    ("turned_90.mp4", "odd_crop.mp4", "", "-metadata:s:v rotate=90"),
    ("turned_180.mp4", "odd_crop.mp4", "", "-metadata:s:v rotate=180"),
    ("turned_270.mp4", "odd_crop.mp4", "", "-metadata:s:v rotate=270"),
    ("edit_list.mp4", "high.mp4", "-ss 0.3", ""),
    ("open_gop_cut.mp4", "open_gop.mp4", "-ss 0.5", ""),
];

/// Makes films of every kind in a folder that goes away, compares each with ffmpeg, then weighs `clips`.
pub(crate) fn bench(clips: &Path) -> Result<(), String> {
    // Minutes pass before they are wanted.
    let given = films(clips)?;
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let mut unequal = 0;
    println!("{:26} {:>6} {:>10} {:>10}", "film", "frames", "same luma", "same time");
    for (name, scene, options) in KINDS {
        let lavfi = format!("-f lavfi -i {}", SCENE[scene].1);
        make(folder.path(), name, &format!("{lavfi} -c:v libx264 -pix_fmt yuv420p {options}"))?;
        unequal += compare(&folder.path().join(name))?;
    }
    for (name, from, before, after) in COPIES {
        let source = folder.path().join(from);
        make(folder.path(), name, &format!("{before} -i {} -c copy {after}", source.display()))?;
        unequal += compare(&folder.path().join(name))?;
    }
    println!("{unequal} of {} films differ", KINDS.len() + COPIES.len());
    println!("\nCPU ms a frame (medians of {ROUNDS})   ours   ffmpeg -f null   ffmpeg to luma");
    weigh("4K, 60 Mbit/s", &[folder.path().join("4k.mp4")])?;
    weigh("all given clips", &given)?;
    if unequal == 0 { Ok(()) } else { Err(format!("{unequal} films differ from what ffmpeg decodes")) }
}

fn ffmpeg(arguments: &str) -> Command {
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-nostdin"]).args(arguments.split_whitespace()).stdin(Stdio::null());
    command
}

fn make(folder: &Path, name: &str, arguments: &str) -> Result<(), String> {
    let status = ffmpeg(arguments).arg("-y").arg(folder.join(name)).status();
    let status = status.map_err(|e| format!("ffmpeg cannot be started ({e})"))?;
    if status.success() { Ok(()) } else { Err(format!("ffmpeg cannot make {name}")) }
}

/// What a program printed.
fn output(command: &mut Command) -> Result<Vec<u8>, String> {
    let output = command.output().map_err(|e| format!("ffmpeg cannot be started ({e})"))?;
    if output.status.success() { Ok(output.stdout) } else { Err("ffmpeg failed".into()) }
}

/// Prints how many frames are equal; 1 if any is not.
fn compare(film: &Path) -> Result<usize, String> {
    let ours = frames(film)?;
    // Without this flag ffmpeg rounds a crop on the left to what its vector code likes.
    let whole = format!("-flags unaligned -i {} -vsync passthrough", film.display());
    let luma = output(&mut ffmpeg(&format!("{whole} -vf extractplanes=y -f rawvideo -pix_fmt gray -")))?;
    let times_s = times_s(&output(&mut ffmpeg(&format!("{whole} -f framehash -hash adler32 -")))?);
    let size = ours.first().map_or(1, |frame| frame.image.pixels.len());
    let theirs: Vec<&[u8]> = luma.chunks(size).collect();
    let same_luma = ours.iter().zip(&theirs).filter(|(ours, theirs)| ours.image.pixels == **theirs).count();
    let same_time =
        ours.iter().zip(&times_s).filter(|(ours, time_s)| (ours.time_s - *time_s).abs() < 1e-6).count();
    let frames = theirs.len();
    let name = film.file_name().unwrap_or_default().to_string_lossy();
    println!("{name:26} {frames:6} {same_luma:10} {same_time:10}");
    Ok(usize::from([ours.len(), same_luma, same_time, times_s.len()] != [frames; 4]))
}

fn frames(film: &Path) -> Result<Vec<Frame>, String> {
    let footage = Footage::open(film).map_err(|e| e.to_string())?;
    footage.collect::<Result<_, _>>().map_err(|e| e.to_string())
}

/// When ffmpeg shows each frame (s); the first one at 0.
fn times_s(framehash: &[u8]) -> Vec<f64> {
    let text = String::from_utf8_lossy(framehash);
    let base =
        text.lines().find_map(|line| line.strip_prefix("#tb 0: ")).and_then(|base| base.split_once('/'));
    let number = |text: &str| text.trim().parse::<f64>().unwrap_or(f64::NAN);
    let tick_s = base.map_or(f64::NAN, |(part, whole)| number(part) / number(whole));
    let frames = text.lines().filter(|line| !line.starts_with('#'));
    let ticks: Vec<f64> = frames.filter_map(|line| line.split(',').nth(2)).map(number).collect();
    ticks.iter().map(|tick| (tick - ticks[0]) * tick_s).collect()
}

/// The MP4 films of a folder, by name.
fn films(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut films: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    films.retain(|film| film.extension().is_some_and(|extension| extension == "mp4"));
    films.sort();
    Ok(films)
}

/// How often each program runs.
const ROUNDS: usize = 5;

/// Prints the CPU time per frame of decoding these films; the programs run alternately.
fn weigh(title: &str, films: &[PathBuf]) -> Result<(), String> {
    let mut spent_s = [const { Vec::new() }; 3];
    let mut count = 0_usize;
    for _ in 0..ROUNDS {
        count = 0;
        let before_s = own_cpu_s()?;
        for film in films {
            let footage = Footage::open(film).map_err(|e| e.to_string())?;
            for frame in footage {
                frame.map_err(|e| e.to_string())?;
                count += 1;
            }
        }
        spent_s[0].push(own_cpu_s()? - before_s);
        for (k, sink) in [(1, "-f null -"), (2, "-vf extractplanes=y -f rawvideo -pix_fmt gray -y /dev/null")]
        {
            let before_s = children_cpu_s()?;
            for film in films {
                output(&mut ffmpeg(&format!("-threads 1 -i {} -vsync passthrough {sink}", film.display())))?;
            }
            spent_s[k].push(children_cpu_s()? - before_s);
        }
    }
    let [ours, null, luma] = spent_s.map(|mut rounds| {
        rounds.sort_by(f64::total_cmp);
        1e3 * rounds[ROUNDS / 2] / count.max(1) as f64
    });
    println!("{title:24} {count:6} frames {ours:8.2} {null:16.2} {luma:16.2}");
    Ok(())
}
