//! Markers that are struck during an exposure, by a camera whose exposure nobody knows.

use super::*;
use crate::object::Dot;

/// A strike of the object: it is at rest until then, and slides on with constant speed.
struct Blow {
    start: Pose,
    velocity: Vec2,
    time_s: f64,
}

impl Blow {
    /// Pose and velocity between two times on the same side of the strike, in the middle of that interval.
    fn between(&self, from_s: f64, to_s: f64) -> (Pose, Vec2) {
        let sliding_s = f64::midpoint(from_s, to_s) - self.time_s;
        let velocity = if sliding_s > 0.0 { self.velocity } else { Vec2::ZERO };
        let position = self.start.position + velocity * sliding_s;
        (Pose { position, ..self.start }, velocity)
    }

    /// The parts of an exposure around a time that the strike separates.
    fn parts(&self, time_s: f64, exposure_s: f64) -> Vec<[f64; 2]> {
        let [open_s, closed_s] = [time_s - exposure_s / 2.0, time_s + exposure_s / 2.0];
        if open_s < self.time_s && self.time_s < closed_s {
            vec![[open_s, self.time_s], [self.time_s, closed_s]]
        } else {
            vec![[open_s, closed_s]]
        }
    }

    /// The mean pose during an exposure.
    fn mean(&self, time_s: f64, exposure_s: f64) -> Pose {
        let shifts = self.parts(time_s, exposure_s).into_iter().map(|[from_s, to_s]| {
            (self.between(from_s, to_s).0.position - self.start.position) * ((to_s - from_s) / exposure_s)
        });
        let position = shifts.fold(self.start.position, |position, shift| position + shift);
        Pose { position, ..self.start }
    }

    /// The picture of an exposure: the mean of those of its parts, each for as long as it lasts.
    fn picture(
        &self,
        view: &View,
        time_s: f64,
        exposure_s: f64,
        things: impl Fn(Pose) -> Vec<Thing>,
    ) -> Frame {
        let mut sums = vec![0.0; view.camera.size_px.iter().product()];
        for [from_s, to_s] in self.parts(time_s, exposure_s) {
            let (pose, velocity) = self.between(from_s, to_s);
            let mut view = View { seed: (1e6 * from_s.abs()) as u64, ..view.clone() };
            view.camera.exposure_s = Some(to_s - from_s);
            let moving: Vec<Thing> =
                things(pose).into_iter().map(|thing| thing.moving(velocity, 0.0)).collect();
            let image = picture(&view, &moving);
            let part = (to_s - from_s) / exposure_s;
            sums.iter_mut().zip(&image.pixels).for_each(|(sum, &grey)| *sum += part * f64::from(grey));
        }
        let [width, height] = view.camera.size_px;
        let pixels = sums.into_iter().map(|sum| sum.round() as u8).collect();
        Frame { time_s, image: GreyImage { width, height, pixels } }
    }
}

/// Beyond the first error a sample is wrong unless it is doubtful, and beyond the second it is that of one end of the path.
const WRONG_MM: f64 = 0.5;
const FAR_MM: f64 = 1.0;
/// Grey levels of an object and its marker: a dark and a light one.
const DARK: [f64; 2] = [150.0, 20.0];
const LIGHT: [f64; 2] = [80.0, 200.0];

/// Checks that an object struck at this speed is where it was on average during each exposure: by about a pixel where doubtful.
fn struck(marker: Marker, greys: [f64; 2], speed_m_s: f64, exposure_s: f64) {
    let mut view = View { noise: 2.0, ..view() };
    let objects = [Object { marker: Some(marker), ..object("a", disc(0.035), disc(0.01)) }];
    for (struck_s, heading_rad) in [(0.0507, 0.1), (0.0557, -0.5), (0.0617, 2.5)] {
        let velocity = Vec2::from_heading(heading_rad) * speed_m_s;
        let start = Pose { position: Point::new(0.0, 0.0) + velocity * -0.05, yaw_rad: 0.2 };
        let blow = Blow { start, velocity, time_s: struck_s };
        let things = |pose: Pose| painted(&objects[0], pose, greys);
        let frames = times_s(9).into_iter().map(|t| blow.picture(&view, t, exposure_s, things)).collect();
        view.camera.exposure_s = None;
        let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
        let case = format!("{speed_m_s} m/s, {exposure_s} s, struck at {struck_s} s");
        let samples = &tracks.tracks[0].samples;
        assert_eq!(samples.len(), 9, "{case}: {:?}", tracks.warnings);
        for s in samples {
            let off_mm = error_mm(s, blow.mean(s.time_s, exposure_s));
            let seen = format!("{case}: {off_mm:.2} mm off at {:.3} s", s.time_s);
            assert!(off_mm < WRONG_MM || s.doubtful, "{seen}, and not doubtful");
            assert!(off_mm < FAR_MM, "{seen}");
        }
    }
}

#[test]
fn a_dark_disc_that_is_struck_is_at_its_mean_position_during_each_exposure() {
    for (speed_m_s, exposure_s) in [(0.2, 0.016), (0.6, 0.004), (0.6, 0.016), (1.2, 0.008)] {
        struck(Marker::centred(disc(0.011)), DARK, speed_m_s, exposure_s);
    }
}

#[test]
fn a_light_bar_that_is_struck_is_at_its_mean_position_during_each_exposure() {
    for (speed_m_s, exposure_s) in [(0.5, 0.012), (0.8, 0.016), (1.2, 0.004)] {
        struck(Marker::centred(bar(0.012, 0.024)), LIGHT, speed_m_s, exposure_s);
    }
}

#[test]
fn a_disc_with_a_dot_that_is_struck_is_at_its_mean_position_during_each_exposure() {
    let dot = Some(Dot { radius_m: 0.004, at_m: Point::new(0.016, 0.0) });
    for (greys, speed_m_s, exposure_s) in [(DARK, 0.6, 0.004), (DARK, 0.6, 0.016), (LIGHT, 0.8, 0.012)] {
        struck(Marker { dot, ..Marker::centred(disc(0.008)) }, greys, speed_m_s, exposure_s);
    }
}

#[test]
fn a_disc_with_a_dot_is_seen_sharp_by_an_exposure_that_is_much_shorter_than_the_interval_of_the_frames() {
    let mut view = View { noise: 2.0, ..view() };
    view.camera.exposure_s = Some(0.0013);
    let dot = Some(Dot { radius_m: 0.0033, at_m: Point::new(0.0068, 0.0094) });
    let marker = Some(Marker { dot, ..Marker::centred(disc(0.0063)) });
    let objects = [Object { marker, ..object("a", bar(0.045, 0.038), disc(0.01)) }];
    let times_s: Vec<f64> = (0..16).map(|k| f64::from(k) / 30.0).collect();
    for (heading_rad, rate) in [(-0.1, 3.0), (0.4, -5.0), (2.8, 6.0)] {
        let velocity = Vec2::from_heading(heading_rad) * 0.65;
        let start = Pose { position: Point::new(0.0, 0.0) + velocity * -0.1, yaw_rad: 1.1 };
        let motion = |t: f64| slid(start, velocity, rate, t);
        let frames = film(&view, &times_s, |t| {
            // Grain of the table, along the motion
            let stripe = |k: u32| {
                let y_m = -0.2 + 0.01 * f64::from(k);
                Thing::flat(bar(0.8, 0.004), Pose::new(0.0, y_m, 0.0), 1e-5, 150.0 + 10.0 * f64::from(k % 3))
            };
            let (pose, velocity, rate) = motion(t);
            let painted = painted(&objects[0], pose, LIGHT).into_iter();
            (0..40).map(stripe).chain(painted.map(|thing| thing.moving(velocity, rate))).collect()
        });
        let mut unknown = view.clone();
        unknown.camera.exposure_s = None;
        let tracks = found(&unknown, frames, &objects, &Layout::Unknown).expect("tracks");
        let samples = &tracks.tracks[0].samples;
        assert_eq!(samples.len(), times_s.len());
        for s in samples {
            let off_mm = error_mm(s, motion(s.time_s).0);
            assert!(off_mm < 0.08 && !s.doubtful, "heading {heading_rad}: {off_mm} mm off: {s:?}");
        }
    }
}
