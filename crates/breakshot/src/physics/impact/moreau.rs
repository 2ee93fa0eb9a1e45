//! What happens where several bodies lean on each other?
//!
//! Bodies pushed along together touch slowly in many places.  All their contacts are resolved at once by Moreau's impact
//! law: after it each contact opens at e times the speed at which it closed, or not at all if it needs no impulse.  Friction
//! holds or slides at each contact.  The projected Gauss-Seidel method finds the impulses.

use crate::physics::contact::PRESSING_M_S;
use crate::physics::impact::island::Cluster;
use crate::physics::impact::routh::{Impulse, RestitutionLaw};

/// Sweeps over all contacts at most.
const SWEEPS: usize = 200;
/// Speeds settled to this (m/s) are settled.
const SETTLED_M_S: f64 = 1e-9;

/// Restitution of a contact that may press: at a creeping speed bodies hop elastically, so that a push is a bounded number
/// of tiny impacts and no impact makes energy.
pub(crate) fn hopping(measured: f64, approach_m_s: f64) -> f64 {
    measured.max(PRESSING_M_S / approach_m_s).min(1.0)
}

impl Cluster {
    /// Resolves all contacts of bodies that lean on each other.
    pub(crate) fn press(&mut self, law: RestitutionLaw) {
        for contact in &mut self.contacts {
            let approach = contact.impact.approach;
            let measured = law.restitution(contact.coefficients.restitution, approach.max(0.0));
            contact.parting = if approach > 0.0 { hopping(measured, approach) * approach } else { 0.0 };
        }
        for _ in 0..SWEEPS {
            if self.sweep() < SETTLED_M_S {
                break;
            }
        }
        self.keep_energy();
    }

    /// One sweep; the greatest change of speed that an impulse made (m/s).
    fn sweep(&mut self) -> f64 {
        let mut greatest: f64 = 0.0;
        for k in 0..self.contacts.len() {
            let contact = &self.contacts[k];
            let [closing, slip] = contact.present_speeds(&self.members);
            let old = contact.impulse;
            let normal = (old.normal + (closing + contact.parting) / contact.impact.k_nn).max(0.0);
            let limit = contact.coefficients.friction * normal;
            let slip = slip - contact.impact.k_nt * (normal - old.normal);
            let tangent = (old.tangent + slip / contact.impact.k_tt).clamp(-limit, limit);
            let change = Impulse { normal: normal - old.normal, tangent: tangent - old.tangent };
            greatest = greatest.max(change.normal.abs() * contact.impact.k_nn);
            self.kick(k, change);
        }
        greatest
    }

    /// Newton's law with friction can make energy: then all impulses shrink until they do not.
    fn keep_energy(&mut self) {
        let given: f64 = self
            .contacts
            .iter()
            .map(|c| c.impulse.normal * c.impact.approach + c.impulse.tangent * c.impact.slip)
            .sum();
        let taken: f64 =
            self.members.iter().map(crate::physics::impact::island::Member::impulse_energy_j).sum();
        let whole: f64 = self.contacts.iter().map(|c| c.impulse.normal).sum();
        if taken == 0.0 || whole == 0.0 {
            return;
        }
        let scale = (given / taken).clamp(0.0, 1.0);
        self.scale(scale);
        let lost = (scale * (given - taken * scale)).max(0.0);
        for contact in &mut self.contacts {
            contact.loss_j = lost * contact.impulse.normal / (whole * scale).max(f64::MIN_POSITIVE);
        }
    }
}
