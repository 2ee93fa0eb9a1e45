//! Impacts in a crowd: a third body near by, or another impact just before or after, takes part of the impulse.

use super::contact::{Contact, Party};
use crate::estimate::clip::fit::Fitted;
use crate::estimate::clip::initial_guess::frame_s;
use crate::outline::Outline;

/// A body this near to a partner of an impact may have been touched by it (m): the ruler and the camera are no better.
const NEAR_M: f64 = 0.0015;
/// Between two impacts of one body at least so many frames show how it moved.
const FRAMES_BETWEEN: f64 = 1.5;

/// Leaves out the impacts of clips of three bodies and more that were not single and clean, with the reason.
pub(crate) fn leave_out(fitted: &Fitted, contacts: &mut [Contact]) {
    let bodies = fitted.model.bodies.len();
    if bodies < 3 {
        return;
    }
    let frame_s = frame_s(&fitted.model.bodies);
    let time_s = |slot: usize| fitted.minimum.parameters[slot];
    let name = |k: usize| &fitted.model.bodies[k].object;
    for contact in contacts.iter_mut().filter(|c| c.restitution || c.mass_ratio) {
        let at_s = time_s(contact.time_slot);
        let partners = partners(contact);
        let outline =
            |k: usize| Outline::new(&fitted.model.bodies[k].shape, fitted.paths[k].motion_before(at_s).pose);
        let close = |k: usize| partners.iter().any(|&p| outline(p).gap_m(&outline(k)) < NEAR_M);
        if let Some(k) = (0..bodies).find(|&k| !partners.contains(&k) && close(k)) {
            contact.leave_out(format!(
                "`{}` lies next to the impact at {at_s:.3} s: it is not a single one",
                name(k)
            ));
            continue;
        }
        let soon = (fitted.model.events.iter().zip(&fitted.layout.events)).find_map(|(event, slots)| {
            let shared = event.members.iter().find(|m| partners.contains(m))?;
            let apart_s = (time_s(slots.time) - at_s).abs();
            (slots.time != contact.time_slot && apart_s < FRAMES_BETWEEN * frame_s)
                .then_some((*shared, apart_s))
        });
        if let Some((k, apart_s)) = soon {
            let apart_ms = apart_s * 1e3;
            contact.leave_out(format!(
                "`{}` is in another impact {apart_ms:.1} ms from that at {at_s:.3} s",
                name(k)
            ));
        }
    }
}

fn partners(contact: &Contact) -> Vec<usize> {
    match contact.a {
        Party::Body(a) => vec![a, contact.b],
        _ => vec![contact.b],
    }
}
