//! Speed of detection: from a frame to components and from a film to tracks. `cargo bench -p breakshot --bench detect`

use breakshot::campaign::Campaign;
use breakshot::capture::{Decoder, GreyImage};
use breakshot::clip_tracks;
use breakshot::detect::label::{Labeller, Level, Window};
use breakshot::files::load_campaign;
use divan::counter::{BytesCount, ItemsCount};
use divan::{Bencher, black_box};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::path::Path;

fn main() {
    divan::main();
}

/// A grey level between those of markers and table.
const LEVEL: Level = Level::Below(110);

/// Eight dark discs on a light, noisy table; this fraction of all pixels is black.
fn frame([width, height]: [usize; 2], black_fraction: f64) -> GreyImage {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let scale = width as f64 / 3840.0;
    let mut pixel = |at: usize| {
        let (x, y) = ((at % width) as f64 / scale, (at / width) as f64 / scale);
        let on_disc = |k: i32| {
            let k = f64::from(k);
            (x - 400.3 - 420.0 * k).hypot(y - 300.7 - 210.0 * k) < 40.0
        };
        let grey: u8 = if (0..8).any(on_disc) { 17 } else { 177 };
        if rng.random_bool(black_fraction) { 0 } else { grey + rng.random_range(0..16) }
    };
    GreyImage { width, height, pixels: (0..width * height).map(&mut pixel).collect() }
}

/// Areas, bounding boxes, first and second moments of all components of at least two pixels.
fn label(bencher: Bencher, size_px: [usize; 2], black_fraction: f64) {
    let image = frame(size_px, black_fraction);
    let mut labeller = Labeller::default();
    bencher.counter(BytesCount::from(image.pixels.len())).bench_local(|| {
        labeller.components(black_box(&image), Window::whole(&image), LEVEL, &(2..=u64::MAX)).len()
    });
}

#[divan::bench(args = [0.0, 0.01, 0.02])]
fn label_4k(bencher: Bencher, black_fraction: f64) {
    label(bencher, [3840, 2160], black_fraction);
}

#[divan::bench]
fn label_540p(bencher: Bencher) {
    label(bencher, [960, 540], 0.0);
}

/// Reading all pixels: a lower bound of the time for labelling.
#[divan::bench]
fn read_4k(bencher: Bencher) {
    let image = frame([3840, 2160], 0.0);
    bencher
        .counter(BytesCount::from(image.pixels.len()))
        .bench_local(|| black_box(&image.pixels).iter().fold(u8::MAX, |least, &p| least.min(p)));
}

fn demo() -> Campaign {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo/campaign.toml");
    load_campaign(&file).expect("the demo's campaign").value
}

/// One film of the demo with the built-in decoder.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn film_to_tracks(bencher: Bencher) {
    let campaign = demo();
    let tracks = || clip_tracks(&campaign, &campaign.clips[0], Decoder::Builtin).expect("tracks").tracks;
    let frames = tracks().tracks.iter().map(|track| track.samples.len()).max().unwrap_or(0);
    bencher.counter(ItemsCount::new(frames)).bench_local(tracks);
}
