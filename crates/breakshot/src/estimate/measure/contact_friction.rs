//! Friction between objects, or between an object and the striker, in one oblique impact.
//!
//! If the contact points still slide over each other when the impact ends, the tangential impulse is the coefficient of
//! friction times the normal one; if they stick, it is the impulse that ended the slip, and the coefficient is larger.
//! The impulse follows from all velocity changes that the film shows: of both centroids, and of both spins.

use super::contact::{Contact, Partner};
use crate::estimate::clip::fit::MotionFit;
use crate::estimate::clip::result::Measured;
use crate::geometry::Vec2;
use crate::object::{kind, pair_key};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Tangential over normal impulse of one impact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ObliqueImpact {
    /// Whether the striker is a partner.
    pub(crate) with_striker: bool,
    /// The kinds of both objects, or the kind that the striker hits.
    #[serde(default)]
    pub(crate) pair: String,
    /// The measured ratio, positive against the slip.
    #[serde(rename = "seen")]
    pub(crate) impulse_ratio: Measured,
    /// The ratio that would have ended the slip.
    #[serde(rename = "to_stick")]
    pub(crate) sticking_ratio: f64,
    /// The part of that ratio that is due to the slip before the impact; the rest is due to the normal impulse. Absent in older files: all of it.
    #[serde(rename = "of_slip", default, skip_serializing_if = "Option::is_none")]
    pub(crate) slip_ratio: Option<f64>,
    /// The standard deviation of that ratio.
    #[serde(rename = "to_stick_std", default)]
    pub(crate) sticking_std: f64,
    /// The covariance of both ratios.
    #[serde(default)]
    pub(crate) covariance: f64,
}

/// The standard deviation of the ratio due to rocking, uneven faces and the error of the normal.
const MODEL_STD: f64 = 0.01;
/// The standard deviation of the lever of the impulse about a centroid (m): the contact point moves along uneven faces, and
/// the centre of mass is not exactly the centroid.
const LEVER_STD_M: f64 = 5e-4;
/// The relative standard deviation of a squared radius of gyration: objects are not exactly homogeneous.
const GYRATION_STD: f64 = 0.03;
/// A spin that the marker does not show, as the speed at the radius of gyration over the speed of the body: its standard deviation
/// where no earlier impact explains the spin.
const UNOBSERVED_SPIN: f64 = 0.07;
/// The same where earlier impacts explain it, over their velocity changes: twice the error of the normal.
const EXPLAINED_SPIN: f64 = 0.02;
/// The relative standard deviation of an explained spin: the table brakes it.
const BRAKED_SPIN: f64 = 0.2;
/// The weight of a spin that is not observed is that of a standard deviation of this many times the normal impulse (m).
const UNOBSERVED_LEVER_M: f64 = 10.0;
/// Gauss-Newton steps: the problem is nearly linear.
const STEPS: usize = 3;

/// The impulse ratio of an impact; `None` without a normal from the outlines or a single restitution.
///
/// Masses enter through the ratio of the impact's own velocity changes.
pub(crate) fn oblique_impact(
    fitted: &MotionFit,
    contacts: &[Contact],
    contact: &Contact,
) -> Option<ObliqueImpact> {
    if !contact.normal_from_outlines || !contact.restitution || contact.is_double {
        return None;
    }
    let geometry = ImpactGeometry::new(fitted, contacts, contact);
    let (changes, noise) = fitted.propagated(|parameters| geometry.changes(fitted, contact, parameters));
    let ratios = geometry.ratios(&changes, noise)?;

    let sign = ratios.values[1].signum();
    let std = |k: usize| ratios.covariance[(k, k)].max(0.0).sqrt();
    let impulse_ratio = Measured { value: sign * ratios.values[0], std: std(0).hypot(MODEL_STD) };
    let name = |k: usize| kind(&fitted.model.bodies[k].object);
    let pair = match contact.a {
        Partner::Body(a) => pair_key(name(a), name(contact.b)),
        Partner::Striker | Partner::Unknown => name(contact.b).to_owned(),
    };
    let found = ObliqueImpact {
        with_striker: contact.a == Partner::Striker,
        pair,
        impulse_ratio,
        sticking_ratio: sign * ratios.values[1],
        slip_ratio: Some(sign * ratios.slip_ratio),
        sticking_std: std(1),
        covariance: ratios.covariance[(0, 1)],
    };
    let numbers =
        [impulse_ratio.value, impulse_ratio.std, found.sticking_ratio, found.sticking_std, found.covariance];
    numbers.iter().chain(&found.slip_ratio).all(|x| x.is_finite()).then_some(found)
}

/// The spin before an impact of a body whose marker does not show it, from the impacts before.
///
/// An impulse at a contact point changes the spin by the cross product of lever and velocity change over the squared radius of gyration.
struct UnobservedSpin<'a> {
    body: usize,
    /// The impacts before; none if one of them does not show its impulse.
    earlier: Vec<&'a Contact>,
    /// The slip per spin times radius of gyration.
    slip_per_speed: f64,
    /// The standard deviation of the slip that the noise of the tracks does not explain (m/s).
    slip_std_m_s: f64,
}

impl<'a> UnobservedSpin<'a> {
    fn new(
        fitted: &MotionFit,
        contacts: &'a [Contact],
        until: &Contact,
        body: usize,
        slip_per_speed: f64,
    ) -> Self {
        let parameters = &fitted.minimum.parameters;
        let events = fitted.model.events.iter().zip(&fitted.layout.events).filter(|(event, indices)| {
            event.members.contains(&body) && parameters[indices.time] < parameters[until.time_index]
        });
        let shown = |time: usize| {
            contacts.iter().find(|c| c.time_index == time && c.normal_from_outlines && c.restitution)
        };
        let earlier: Option<Vec<&Contact>> = events.map(|(_, indices)| shown(indices.time)).collect();
        let mut spin = Self { body, earlier: earlier.unwrap_or_default(), slip_per_speed, slip_std_m_s: 0.0 };
        let std_m_s = if spin.earlier.is_empty() {
            let index = usize::from(until.b == body);
            UNOBSERVED_SPIN * until.motions(fitted, parameters).before[index].velocity.length()
        } else {
            let changes = spin.earlier.iter().map(|c| spin.velocity_change(fitted, parameters, c).1.length());
            let of_normals = changes.map(|change| (EXPLAINED_SPIN * change).powi(2)).sum::<f64>().sqrt();
            of_normals.hypot(BRAKED_SPIN * spin.speed_m_s(fitted, parameters))
        };
        spin.slip_std_m_s = slip_per_speed.abs() * std_m_s;
        spin
    }

    /// The lever of an earlier impact about the centroid (m), and the change of the centroid's velocity (m/s).
    fn velocity_change(&self, fitted: &MotionFit, parameters: &[f64], contact: &Contact) -> (Vec2, Vec2) {
        let (index, motions) = (usize::from(contact.b == self.body), contact.motions(fitted, parameters));
        (contact.closest.point - motions.before[index].pose.position, motions.velocity_change(index))
    }

    /// The spin times the radius of gyration; zero where nothing explains it.
    fn speed_m_s(&self, fitted: &MotionFit, parameters: &[f64]) -> f64 {
        let of_contact = |contact: &&Contact| {
            let (lever, change) = self.velocity_change(fitted, parameters, contact);
            lever.cross(change)
        };
        self.earlier.iter().map(of_contact).sum::<f64>() / fitted.model.bodies[self.body].gyration_m
    }

    /// The slip that it adds (m/s).
    fn slip_m_s(&self, fitted: &MotionFit, parameters: &[f64]) -> f64 {
        self.slip_per_speed * self.speed_m_s(fitted, parameters)
    }
}

/// How an impulse at the contact moves both bodies.
struct ImpactGeometry<'a> {
    normal: Vec2,
    along: Vec2,
    /// Body b and, unless the striker is the partner, body a.
    sides: Vec<Side<'a>>,
}

/// One body of an impact.
struct Side<'a> {
    /// 0 for a, 1 for b.
    index: usize,
    /// The torque about the centroid per normal and per tangential impulse (m).
    levers_m: [f64; 2],
    squared_gyration_m2: f64,
    yaw_observed: bool,
    /// `None` if the marker shows the spin.
    unobserved_spin: Option<UnobservedSpin<'a>>,
}

/// Normal and tangential impulse over the mass of b (m/s), and the mass of b over that of a.
#[derive(Clone, Copy)]
struct Impulse {
    normal: f64,
    tangential: f64,
    mass_b_over_a: f64,
}

/// Tangential over normal impulse, as measured and as it would end the slip, with their covariance.
struct Ratios {
    values: [f64; 2],
    /// The part of the ratio that would end the slip that is due to the slip before the impact.
    slip_ratio: f64,
    covariance: DMatrix<f64>,
}

impl<'a> ImpactGeometry<'a> {
    fn new(fitted: &MotionFit, contacts: &'a [Contact], contact: &Contact) -> Self {
        let normal = contact.closest.normal_ab;
        let along = normal.perpendicular();
        let motions = contact.motions(fitted, &fitted.minimum.parameters);
        let side = |index: usize, k: usize| {
            let (before, body) = (motions.before[index], &fitted.model.bodies[k]);
            let lever = contact.closest.point - before.pose.position;
            let sign = if index == 0 { 1.0 } else { -1.0 };
            let slip_per_speed = sign * lever.dot(normal) / body.gyration_m;
            let unobserved_spin = (!body.yaw_observed)
                .then(|| UnobservedSpin::new(fitted, contacts, contact, k, slip_per_speed));
            Side {
                index,
                levers_m: [lever.cross(normal), lever.cross(along)],
                squared_gyration_m2: body.gyration_m.powi(2),
                yaw_observed: body.yaw_observed,
                unobserved_spin,
            }
        };
        let mut sides = vec![side(1, contact.b)];
        if let Partner::Body(a) = contact.a {
            sides.push(side(0, a));
        }
        Self { normal, along, sides }
    }

    /// The number of velocity changes.
    fn rows(&self) -> usize {
        3 * self.sides.len()
    }

    /// For each side the change of the centroid's velocity along normal and tangent (m/s), and that of the spin times the
    /// squared radius of gyration (m2/s); last the slip: the tangential velocity of a's contact point relative to b's (m/s).
    fn changes(&self, fitted: &MotionFit, contact: &Contact, parameters: &[f64]) -> Vec<f64> {
        let motions = &contact.motions(fitted, parameters);
        let mut changes = Vec::with_capacity(self.rows() + 1);
        for side in &self.sides {
            let [before, after] = [motions.before[side.index], motions.after[side.index]];
            let change = after.velocity - before.velocity;
            let spin = side.squared_gyration_m2 * (after.spin_rad_s - before.spin_rad_s);
            changes.extend([change.dot(self.normal), change.dot(self.along), spin]);
        }
        let unobserved_spins = self.sides.iter().filter_map(|side| side.unobserved_spin.as_ref());
        let unobserved: f64 = unobserved_spins.map(|spin| spin.slip_m_s(fitted, parameters)).sum();
        changes.push(contact.relative_velocities(motions)[0].dot(self.along) + unobserved);
        changes
    }

    /// The changes that an impulse causes, and their derivatives by normal impulse, tangential impulse and ratio of masses.
    fn expected(&self, impulse: Impulse) -> (DVector<f64>, DMatrix<f64>) {
        let unknowns = self.sides.len() + 1;
        let (mut values, mut slopes) = (DVector::zeros(self.rows()), DMatrix::zeros(self.rows(), unknowns));
        for (n, side) in self.sides.iter().enumerate() {
            let share = if side.index == 1 { 1.0 } else { -impulse.mass_b_over_a };
            for (k, [p, q]) in [[1.0, 0.0], [0.0, 1.0], side.levers_m].into_iter().enumerate() {
                let (row, per_share) = (3 * n + k, p * impulse.normal + q * impulse.tangential);
                values[row] = share * per_share;
                (slopes[(row, 0)], slopes[(row, 1)]) = (share * p, share * q);
                if side.index == 0 {
                    slopes[(row, 2)] = -per_share;
                }
            }
        }
        (values, slopes)
    }

    /// The covariance of the changes: that of the tracks' noise, plus what a rigid homogeneous body on its outline leaves out.
    fn with_model_noise(&self, changes: &[f64], mut covariance: DMatrix<f64>) -> DMatrix<f64> {
        for (n, side) in self.sides.iter().enumerate() {
            let (normal, row) = (changes[3 * n], 3 * n + 2);
            let lever_m = if side.yaw_observed { LEVER_STD_M } else { UNOBSERVED_LEVER_M };
            covariance[(row - 1, row - 1)] += (MODEL_STD * normal).powi(2);
            covariance[(row, row)] += (lever_m * normal).powi(2) + (GYRATION_STD * changes[row]).powi(2);
            let slip = self.rows();
            covariance[(slip, slip)] +=
                side.unobserved_spin.as_ref().map_or(0.0, |spin| spin.slip_std_m_s.powi(2));
        }
        covariance
    }

    /// The ratios from the changes by weighted least squares; `None` if the bodies were not pushed apart.
    fn ratios(&self, changes: &[f64], noise: DMatrix<f64>) -> Option<Ratios> {
        let (rows, unknowns) = (self.rows(), self.sides.len() + 1);
        let covariance = self.with_model_noise(changes, noise);
        let weights = covariance.view((0, 0), (rows, rows)).into_owned().cholesky()?;
        let observed = DVector::from_column_slice(&changes[..rows]);

        // Gauss-Newton: the ratio of masses multiplies the impulse
        let mass_b_over_a = if self.sides.len() == 2 { -changes[3] / changes[0] } else { 0.0 };
        let mut impulse = Impulse { normal: changes[0], tangential: changes[1], mass_b_over_a };
        let mut gain = DMatrix::zeros(unknowns, rows);
        for _ in 0..STEPS {
            let (expected, slopes) = self.expected(impulse);
            let weighted = weights.solve(&slopes);
            gain = slopes.tr_mul(&weighted).cholesky()?.solve(&weighted.transpose());
            let step = &gain * (&observed - expected);
            impulse.normal += step[0];
            impulse.tangential += step[1];
            impulse.mass_b_over_a += step.get(2).copied().unwrap_or(0.0);
        }
        if impulse.normal <= 0.0 || impulse.mass_b_over_a < 0.0 {
            return None;
        }

        // The covariance of unknowns and slip, larger where the changes do not fit together
        let residuals = &observed - self.expected(impulse).0;
        let chi2 = residuals.dot(&weights.solve(&residuals));
        let excess = (chi2 / (rows - unknowns) as f64).max(1.0);
        let mut of_changes = DMatrix::zeros(unknowns + 1, rows + 1);
        of_changes.view_mut((0, 0), (unknowns, rows)).copy_from(&gain);
        of_changes[(unknowns, rows)] = 1.0;
        let (values, slip_ratio, slopes) = self.ratios_of(impulse, changes[rows]);
        let map = slopes * of_changes;
        Some(Ratios { values, slip_ratio, covariance: &map * covariance * map.transpose() * excess })
    }

    /// The ratios of an impulse and a slip, the part of the second one that is due to the slip, and the derivatives of both by the unknowns and
    /// the slip.
    ///
    /// A tangential impulse of `slip - coupling x normal` over `tangential` ends the slip (Routh).
    fn ratios_of(&self, impulse: Impulse, slip: f64) -> ([f64; 2], f64, DMatrix<f64>) {
        let per_mass = |side: &Side<'_>| {
            let [by_normal, by_tangential] = side.levers_m;
            let squared = side.squared_gyration_m2;
            [1.0 + by_tangential * by_tangential / squared, by_normal * by_tangential / squared]
        };
        let [mut tangential, mut coupling] = per_mass(&self.sides[0]);
        let of_a = self.sides.get(1).map(per_mass);
        if let Some([of_tangential, of_coupling]) = of_a {
            tangential += impulse.mass_b_over_a * of_tangential;
            coupling += impulse.mass_b_over_a * of_coupling;
        }
        let measured = impulse.tangential / impulse.normal;
        let sticking = (slip / impulse.normal - coupling) / tangential;

        let unknowns = self.sides.len() + 1;
        let mut slopes = DMatrix::zeros(2, unknowns + 1);
        slopes[(0, 0)] = -measured / impulse.normal;
        slopes[(0, 1)] = 1.0 / impulse.normal;
        slopes[(1, 0)] = -slip / (impulse.normal * impulse.normal * tangential);
        if let Some([of_tangential, of_coupling]) = of_a {
            slopes[(1, 2)] = -(of_coupling + sticking * of_tangential) / tangential;
        }
        slopes[(1, unknowns)] = 1.0 / (impulse.normal * tangential);
        ([measured, sticking], slip / (impulse.normal * tangential), slopes)
    }
}
