//! From how far can the striker reach the contact without hitting anything else?

use crate::error::Result;
use crate::geometry::{Point, Pose, Vec2};
use crate::outline::Outline;
use crate::scene::{Placed, Scene, Strike};

/// How far the striker runs before it touches the object, the longest free way first: 70 mm is enough to reach 1 m/s
/// at 7 m/s2.
const LEAD_INS_M: [f64; 4] = [0.07, 0.05, 0.035, 0.02];
/// It draws back so far past its start.
const DRAW_BACK_M: f64 = 0.02;
/// Poses are known to some tenths of a millimetre and an arm's path to about one: what is nearer may be hit.
const CLEARANCE_M: f64 = 0.003;
/// Touching within this is a contact and no overlap (m).
pub(crate) const TOUCH_M: f64 = 1e-6;

/// A strike with its numbers rounded to what an arm can tell apart.
pub(crate) fn rounded_strike(strike: Strike) -> Strike {
    Strike {
        start_m: Point::new(rounded(strike.start_m.x, 1e-6), rounded(strike.start_m.y, 1e-6)),
        heading_rad: rounded(strike.heading_rad, 1e-6),
        speed_m_s: rounded(strike.speed_m_s, 1e-4),
        travel_m: rounded(strike.travel_m, 1e-5),
        ..strike
    }
}

/// To a multiple of a power of ten, such that it prints short.
pub(crate) fn rounded(value: f64, step: f64) -> f64 {
    let steps_per_unit = (1.0 / step).round();
    (value * steps_per_unit).round() / steps_per_unit
}

/// What may be in the striker's way.
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

    /// The longest lead-in for which the way is free, or what is in the way of the shortest.
    ///
    /// The way goes on past the contact; there only walls, keep-out areas and the table's edge count.
    pub(crate) fn free_lead_in_m(
        &self,
        (contact_m, heading_rad): (Point, f64),
        follow_through_m: f64,
    ) -> std::result::Result<f64, String> {
        let mut obstacle = String::new();
        for lead_in_m in LEAD_INS_M {
            match self.obstacle((contact_m, heading_rad), lead_in_m, follow_through_m) {
                None => return Ok(lead_in_m),
                Some(found) => obstacle = found,
            }
        }
        Err(obstacle)
    }

    fn obstacle(
        &self,
        (contact_m, heading_rad): (Point, f64),
        lead_in_m: f64,
        follow_through_m: f64,
    ) -> Option<String> {
        let striker = &self.scene.cell.striker.shape;
        let along = Vec2::from_heading(heading_rad);
        let at = |position| Pose { position, yaw_rad: heading_rad };
        let behind = contact_m - along * (lead_in_m + DRAW_BACK_M);
        let end = contact_m + along * follow_through_m;
        if let Some(table) = &self.scene.cell.table {
            let top = Outline::polygon(&table.outline_m);
            if [behind, end].into_iter().any(|place| !top.contains(place)) {
                return Some("the table's edge".into());
            }
        }
        if Outline::new(striker, at(contact_m)).gap_m(&self.target) < -TOUCH_M
            || Outline::new(striker, at(contact_m - along * lead_in_m)).gap_m(&self.target) < CLEARANCE_M
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
