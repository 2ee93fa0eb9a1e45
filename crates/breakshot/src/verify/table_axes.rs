//! Are the axes of the robot's table frame those of the tags?
//!
//! Robots and tags are often set up with axes that are mirrored or exchanged, or rotated by a right angle. The given strikes then miss the objects, or
//! send them elsewhere, in most clips. With the right axes they send nearly all of them where the films show them go.

use super::departure::{Departing, Known};
use crate::geometry::{Point, Vec2};
use crate::scene::Strike;
use crate::warning::{Cause, Warning};

/// Other axes are the right ones if at least this part of the strikes fits with them...
const MOST: f64 = 0.8;
/// ... and by so much more than with the given ones, as a part of all, ...
const MORE: f64 = 0.25;
/// ... in at least this number of clips: one clip may be wrong by itself, and two may fit by chance.
const FEWEST: usize = 3;

/// Coordinates in other axes: rows of the matrix that makes them of the given ones, and what is wrong then, for people.
struct Axes {
    rows: [[f64; 2]; 2],
    changed: &'static str,
    wrong: &'static str,
}

const OTHERS: [Axes; 7] = [
    Axes {
        rows: [[1.0, 0.0], [0.0, -1.0]],
        changed: "the y of start_m and heading_rad have the other sign",
        wrong: "the y axis of the robot's table frame points the other way than that of the tags",
    },
    Axes {
        rows: [[-1.0, 0.0], [0.0, 1.0]],
        changed: "the x of start_m has the other sign and heading_rad is pi - heading_rad",
        wrong: "the x axis of the robot's table frame points the other way than that of the tags",
    },
    Axes {
        rows: [[-1.0, 0.0], [0.0, -1.0]],
        changed: "start_m has the other signs and heading_rad is pi more",
        wrong: "the robot's table frame is rotated by half a turn beside that of the tags",
    },
    Axes {
        rows: [[0.0, -1.0], [1.0, 0.0]],
        changed: "start_m is [-y, x] and heading_rad is pi/2 more",
        wrong: "the robot's table frame is rotated by a quarter turn beside that of the tags",
    },
    Axes {
        rows: [[0.0, 1.0], [-1.0, 0.0]],
        changed: "start_m is [y, -x] and heading_rad is pi/2 less",
        wrong: "the robot's table frame is rotated by a quarter turn beside that of the tags",
    },
    Axes {
        rows: [[0.0, 1.0], [1.0, 0.0]],
        changed: "start_m is [y, x] and heading_rad is pi/2 - heading_rad",
        wrong: "the axes of the robot's table frame are exchanged beside those of the tags",
    },
    Axes {
        rows: [[0.0, -1.0], [-1.0, 0.0]],
        changed: "start_m is [-y, -x] and heading_rad is -pi/2 - heading_rad",
        wrong: "the axes of the robot's table frame are exchanged beside those of the tags, and point the other way",
    },
];

impl Axes {
    fn vector(&self, given: Vec2) -> Vec2 {
        let [x, y] = self.rows.map(|[by_x, by_y]| by_x * given.x + by_y * given.y);
        Vec2::new(x, y)
    }

    fn strike(&self, given: &Strike) -> Strike {
        Strike {
            start_m: Point::ORIGIN + self.vector(given.start_m.to_vec()),
            heading_rad: self.vector(Vec2::from_heading(given.heading_rad)).heading_rad(),
            ..given.clone()
        }
    }
}

/// A warning that names the axes with which the given strikes send the objects where the films show them go; `None` if they do so with the given
/// ones, or with no others.
pub(super) fn warning(departing: &[Departing], known: Known) -> Option<Warning> {
    let (given, all) = (departing.iter().filter(|d| d.is_as_sent()).count(), departing.len());
    let least = (MOST * all as f64).max(given as f64 + MORE * all as f64);
    if all < FEWEST || least > all as f64 {
        return None;
    }
    let mut scene = known.free_table();
    let mut sent_with = |axes: &Axes| {
        let is_sent =
            |d: &&Departing| d.would_be_sent_by(&axes.strike(d.strike), &mut scene, known.properties);
        departing.iter().filter(is_sent).count()
    };
    let others = OTHERS.iter().map(|axes| (sent_with(axes), axes));
    let (best, Axes { changed, wrong, .. }) = others.max_by_key(|(sent, _)| *sent)?;
    let text = format!(
        "{given} of {all} given strikes send the objects where the films show them go, and {best} if {changed}: {wrong}"
    );
    (best as f64 >= least).then(|| Warning::new(Cause::GivenStrike, text))
}

#[cfg(test)]
mod tests {
    use super::super::campaign_warnings;
    use super::*;
    use crate::estimate::{Options, estimation};
    use crate::synthetic::campaign::{CampaignSpec, campaign};
    use std::f64::consts::FRAC_PI_2;

    /// The warnings about a campaign whose strikes are changed in this way.
    fn warnings(seed: u64, change: impl Fn(&mut Strike)) -> Vec<String> {
        let mut drawn = campaign(&CampaignSpec { objects: 3, ..CampaignSpec::default() }, seed);
        drawn.clips.iter_mut().filter_map(|clip| clip.strike.as_mut()).for_each(change);
        let estimation =
            estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("clips");
        let found = campaign_warnings(&drawn.clips, &estimation, &drawn.cell, &drawn.objects);
        found.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn axes_of_the_robot_that_are_not_those_of_the_tags_are_named_alone() {
        let mirrored = |s: &mut Strike| {
            (s.start_m.y, s.heading_rad) = (-s.start_m.y, -s.heading_rad);
        };
        let exchanged = |s: &mut Strike| {
            s.start_m = Point::new(s.start_m.y, s.start_m.x);
            s.heading_rad = FRAC_PI_2 - s.heading_rad;
        };
        // Of a quarter turn to the right, the quarter turn to the left is undone.
        let turned = |s: &mut Strike| {
            s.start_m = Point::new(-s.start_m.y, s.start_m.x);
            s.heading_rad += FRAC_PI_2;
        };
        for seed in 1..4 {
            for (change, expected) in [
                (&mirrored as &dyn Fn(&mut Strike), "the y of start_m and heading_rad have the other sign"),
                (&exchanged, "start_m is [y, x] and heading_rad is pi/2 - heading_rad"),
                (&turned, "start_m is [y, -x] and heading_rad is pi/2 less"),
            ] {
                let found = warnings(seed, change);
                assert!(found.len() == 1 && found[0].contains(expected), "campaign {seed}: {found:?}");
            }
        }
    }

    #[test]
    fn other_mistakes_are_no_axes() {
        let displaced = |s: &mut Strike| s.start_m += Vec2::new(0.01, -0.02);
        let rotated = |s: &mut Strike| s.heading_rad += 0.4;
        for change in [&displaced as &dyn Fn(&mut Strike), &rotated, &|_: &mut Strike| {}] {
            let found = warnings(1, change);
            assert!(!found.iter().any(|text| text.contains("that of the tags")), "{found:?}");
        }
    }
}
