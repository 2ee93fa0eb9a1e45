//! From how far can the striker approach the contact without touching anything else?

use crate::error::Result;
use crate::geometry::outline::Outline;
use crate::geometry::{Point, Pose, Vec2};
use crate::scene::{Placed, RETRACT_PAST_START_M, Scene, Strike};

/// Lead-ins (m), the longest first: 70 mm is enough to reach 1 m/s at 7 m/s2.
const LEAD_INS_M: [f64; 4] = [0.07, 0.05, 0.035, 0.02];
/// Clearance of the swept striker (m): observed poses are accurate to some tenths of a millimetre, an arm's path to about one.
const CLEARANCE_M: f64 = 0.003;
/// Overlaps up to this are contacts (m).
pub(crate) const TOUCH_M: f64 = 1e-6;

/// The line of a strike up to the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactLine {
    /// The striker's centre when it first touches the object (m).
    pub contact_m: Point,
    /// Direction of motion (rad).
    pub heading_rad: f64,
}

impl ContactLine {
    /// The striker's centre before the contact (m).
    pub(crate) fn start_m(self, lead_in_m: f64) -> Point {
        self.contact_m - Vec2::from_heading(self.heading_rad) * lead_in_m
    }
}

/// The outlines that a striker has to avoid on its path to one object.
pub(crate) struct Surroundings<'a> {
    scene: &'a Scene,
    target: Outline,
    others: Vec<(&'a str, Outline)>,
    walls: Vec<Outline>,
    keep_out: Vec<Outline>,
}

impl<'a> Surroundings<'a> {
    pub(crate) fn new(scene: &'a Scene, target: &Placed) -> Result<Self> {
        let outline = |placed: &Placed| Ok(Outline::new(&scene.object(&placed.object)?.shape, placed.pose()));
        let others = scene.placed.iter().filter(|p| p.object != target.object);
        Ok(Self {
            scene,
            target: outline(target)?,
            others: others.map(|p| Ok((p.object.as_str(), outline(p)?))).collect::<Result<_>>()?,
            walls: scene.walls.iter().map(|w| Outline::segment(w.from_m, w.to_m)).collect(),
            keep_out: scene.keep_out.iter().map(|k| Outline::polygon(&k.points_m)).collect(),
        })
    }

    /// The longest lead-in (m) on which the striker touches nothing else.
    ///
    /// Past the contact only walls, keep-out areas and the table's edge count: objects there are moved by the strike.
    ///
    /// # Errors
    /// The obstacle of the shortest lead-in.
    pub(crate) fn free_lead_in_m(
        &self,
        line: ContactLine,
        follow_through_m: f64,
    ) -> std::result::Result<f64, String> {
        let mut obstacle = String::new();
        for lead_in_m in LEAD_INS_M {
            match self.obstacle(line, lead_in_m, follow_through_m) {
                None => return Ok(lead_in_m),
                Some(found) => obstacle = found,
            }
        }
        Err(obstacle)
    }

    /// The first obstacle on the striker's path, which begins where it retracts to.
    fn obstacle(&self, line: ContactLine, lead_in_m: f64, follow_through_m: f64) -> Option<String> {
        let ContactLine { contact_m, heading_rad } = line;
        let striker = &self.scene.cell.striker.shape;
        let along = Vec2::from_heading(heading_rad);
        let at = |position| Pose { position, yaw_rad: heading_rad };
        let behind = line.start_m(lead_in_m + RETRACT_PAST_START_M);
        let end = contact_m + along * follow_through_m;
        if let Some(table) = &self.scene.cell.table {
            let top = Outline::polygon(&table.outline_m);
            if [behind, end].into_iter().any(|position| !top.contains(position)) {
                return Some("the table's edge".into());
            }
        }
        if Outline::new(striker, at(contact_m)).gap_m(&self.target) < -TOUCH_M
            || Outline::new(striker, at(line.start_m(lead_in_m))).gap_m(&self.target) < CLEARANCE_M
        {
            return Some("its own outline".into());
        }
        let approach = Outline::swept(striker, at(behind), contact_m - behind);
        let touched = |outline: &Outline| approach.gap_m(outline) < CLEARANCE_M;
        if let Some((name, _)) = self.others.iter().find(|(_, outline)| touched(outline)) {
            return Some((*name).to_owned());
        }
        let whole = Outline::swept(striker, at(behind), end - behind);
        let touched = |outline: &Outline| whole.gap_m(outline) < CLEARANCE_M;
        if self.walls.iter().any(touched) {
            return Some("a wall".into());
        }
        self.keep_out.iter().any(touched).then(|| "a keep-out area".into())
    }
}

/// A strike rounded to an arm's resolution: 1 um, 1 urad, 0.1 mm/s, 10 um of travel.
pub(crate) fn rounded_strike(strike: Strike) -> Strike {
    Strike {
        start_m: Point::new(rounded(strike.start_m.x, 1e-6), rounded(strike.start_m.y, 1e-6)),
        heading_rad: rounded(strike.heading_rad, 1e-6),
        speed_m_s: rounded(strike.speed_m_s, 1e-4),
        travel_m: rounded(strike.travel_m, 1e-5),
        ..strike
    }
}

/// The nearest multiple of a power of ten, with the shortest decimal representation.
pub(crate) fn rounded(value: f64, step: f64) -> f64 {
    let steps_per_unit = (1.0 / step).round();
    (value * steps_per_unit).round() / steps_per_unit
}
