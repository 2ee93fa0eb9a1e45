//! How are several slow contacts of the same bodies resolved?
//!
//! Bodies that are pushed together touch at many points with low approach speeds.  All their contacts are resolved together by Moreau's impact
//! law (Moreau 1988): after the impact each contact opens at e times the speed at which it closed, or has no impulse.  Friction
//! sticks or slides at each contact.  The projected Gauss-Seidel method finds the impulses.

use crate::physics::impact::island::Island;
use crate::physics::impact::routh::{Impulse, RestitutionLaw};
use crate::physics::options::Pressing;

/// Greatest number of sweeps over all contacts.
const SWEEPS: usize = 200;
/// Change of speed in a sweep (m/s) at which the iteration has converged.
const CONVERGED_M_S: f64 = 1e-9;

impl Island {
    /// Resolves all contacts of the island by Moreau's law.
    pub(crate) fn resolve_moreau(&mut self, law: RestitutionLaw, pressing: Pressing) {
        for contact in &mut self.contacts {
            let approach = contact.impact.approach;
            let measured = law.restitution(contact.coefficients.restitution, approach.max(0.0));
            contact.separation_speed =
                if approach > 0.0 { pressing.restitution(measured, approach) * approach } else { 0.0 };
        }
        for _ in 0..SWEEPS {
            if self.sweep() < CONVERGED_M_S {
                break;
            }
        }
        if pressing == Pressing::Fine {
            self.limit_energy();
        }
    }

    /// One sweep over all contacts; returns the greatest change of speed (m/s).
    fn sweep(&mut self) -> f64 {
        let mut greatest: f64 = 0.0;
        for k in 0..self.contacts.len() {
            let contact = &self.contacts[k];
            let [approach, slip] = contact.present_speeds(&self.members);
            let old = contact.impulse;
            let normal = (old.normal + (approach + contact.separation_speed) / contact.impact.k_nn).max(0.0);
            let limit = contact.coefficients.friction * normal;
            let slip = slip - contact.impact.k_nt * (normal - old.normal);
            let tangent = (old.tangent + slip / contact.impact.k_tt).clamp(-limit, limit);
            let change = Impulse { normal: normal - old.normal, tangent: tangent - old.tangent };
            greatest = greatest.max(change.normal.abs() * contact.impact.k_nn);
            self.apply_impulse(k, change);
        }
        greatest
    }

    /// Scales all impulses down where Newton's law with friction would gain energy.
    fn limit_energy(&mut self) {
        let whole: f64 = self.contacts.iter().map(|c| c.impulse.normal).sum();
        if whole == 0.0 {
            return;
        }
        let scale = self.greatest_scale().clamp(0.0, 1.0);
        self.scale(scale);
        let lost = self.lost_energy_j().max(0.0);
        for contact in &mut self.contacts {
            contact.loss_j = lost * contact.impulse.normal / (whole * scale).max(f64::MIN_POSITIVE);
        }
    }
}
