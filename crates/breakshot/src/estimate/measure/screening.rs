//! Which impacts measure restitution and mass ratio: those of two bodies alone, with opposite impulses.

use super::contact::{Contact, OUTLINE_ACCURACY_M, Partner};
use super::{impulse_ratio, restitution};
use crate::estimate::clip::fit::MotionFit;
use crate::estimate::clip::initial_guess::frame_s;
use crate::estimate::clip::motion_model::Observation;
use crate::estimate::clip::striker::further_strikes::{APPROACHED_M, POSITIONS_AFTER_STRIKE};
use crate::estimate::clip::striker::path::StrikerPath;
use crate::geometry::outline::Outline;

/// The striker counts as touching a body that hits another one if their gap is smaller than this (m).
const STRIKER_CONTACT_M: f64 = 5e-4;
/// Two impacts of one body need at least this number of frames between them, which show its motion.
const FRAMES_BETWEEN: f64 = 1.5;
/// The speed at which two bodies part follows from at least this number of frames before they hit each other again.
const FRAMES_UNTIL_REPEATED: f64 = 3.0;
/// A motion of fewer frames between two impacts is fitted wrongly at both ends if it is at one.
const FRAMES_OF_MOTION: f64 = 8.0;
/// The instant of a strike is known if it is further from the positions before and after it than this many of its standard deviations.
const INSTANT_STDS: f64 = 3.0;
/// Number of positions of a body in motion that show its deceleration, among those of motions that more than one shows.
const POSITIONS_OF_FRICTION: usize = 3;
/// A position shows a motion between two impacts if the body moves by at least this many of its standard deviations.
const LEAST_STDS_MOVED: f64 = 10.0;
/// A struck body is near the striker for this number of frames, whether or not it is hit again.
const FRAMES_UNTIL_MET_AGAIN: f64 = 2.0;
/// A second strike may be hidden in the beginning of a motion to rest if that is more than this part of it and no trusted position shows it.
const UNSEEN_PART: f64 = 0.3;
/// Number of steps of an unobserved motion at whose ends its distance from the striker is determined.
const UNSEEN_STEPS: u32 = 8;
/// Repeated impacts of a pair follow each other like those of a bouncing ball: each interval is the restitution times the one
/// before it. It is taken as this part, since the restitution is not known yet.
const REPEATED_INTERVAL: f64 = 0.5;

/// Excludes from the measurements the contacts that fail a check, and adds the reason to their remarks. Returns the bodies whose deceleration is
/// not shown either.
pub(crate) fn screen(
    fitted: &MotionFit,
    striker: Option<&StrikerPath>,
    contacts: &mut [Contact],
) -> Vec<usize> {
    let mut wrong: Vec<(Vec<usize>, f64)> = Vec::new();
    for contact in contacts.iter_mut() {
        if contact.normal_from_outlines && contact.restitution {
            restitution::check_facing_sides(fitted, contact);
        }
        if let Partner::Body(a) = contact.a {
            if !impulse_ratio::check_momentum(fitted, contact, a) {
                wrong.push((partners(contact), contact.time_s(fitted)));
            }
            if let Some(striker) = striker {
                exclude_squeezed(fitted, striker, contact);
            }
        }
    }
    let mut without_friction = exclude_unobserved(fitted, contacts);
    without_friction.extend(exclude_soon_pushed(fitted, contacts));
    without_friction.retain(|k| !shows_friction(fitted, *k));
    exclude_wrong(fitted, contacts, &wrong);
    exclude_repeated(fitted, contacts);
    exclude_after_further_strike(fitted, contacts);
    if let Some(striker) = striker {
        exclude_after_hidden_strike(fitted, striker, contacts);
    }
    exclude_crowded(fitted, contacts);
    without_friction
}

/// Excludes the impacts before and after a motion that too few positions show: none, or a single one after a strike whose instant is not clear.
/// Any instant of the first impact then explains the positions, and the fit stops at the earliest, where its covariance is that of the frame before.
/// Returns the bodies with such a motion.
fn exclude_unobserved(fitted: &MotionFit, contacts: &mut [Contact]) -> Vec<usize> {
    let mut unobserved = Vec::new();
    for (k, (body, path)) in fitted.model.bodies.iter().zip(&fitted.paths).enumerate() {
        let mut impacts: Vec<(usize, f64)> = contacts
            .iter()
            .enumerate()
            .filter(|(_, contact)| partners(contact).contains(&k))
            .map(|(index, contact)| (index, contact.time_s(fitted)))
            .collect();
        impacts.sort_by(|a, b| a.1.total_cmp(&b.1));
        for pair in impacts.windows(2) {
            let [(first, from_s), (second, to_s)] = [pair[0], pair[1]];
            let [from, to] =
                [path.motion(from_s), path.motion_before(to_s)].map(|motion| motion.pose.position);
            let least_m = from.distance(to) / LEAST_STDS_MOVED;
            let shows =
                |o: &&Observation| !o.excluded && (from_s..to_s).contains(&o.time_s) && o.std_m < least_m;
            let found = body.observations.iter().filter(shows).count();
            let is_open =
                contacts[first].a == Partner::Striker && !is_instant_known(fitted, &contacts[first]);
            let needed = if is_open { POSITIONS_AFTER_STRIKE } else { 1 };
            if found < needed {
                let shown = if found == 0 { "no position shows" } else { "a single position shows" };
                let reason = format!(
                    "{shown} the motion of `{}` between {from_s:.3} and {to_s:.3} s: the impacts before and after it measure nothing",
                    body.object
                );
                contacts[first].exclude(reason.clone());
                contacts[second].exclude(reason);
                unobserved.push(k);
            }
        }
    }
    unobserved
}

/// Excludes the strike of a body whose motion is left out before enough positions show it, since the striker pushes it. Returns the body.
fn exclude_soon_pushed(fitted: &MotionFit, contacts: &mut [Contact]) -> Option<usize> {
    let strike = contacts.iter_mut().rfind(|contact| contact.a == Partner::Striker)?;
    let (struck, strike_s) = (strike.b, strike.time_s(fitted));
    let body = &fitted.model.bodies[struck];
    let is_pushed = body.observations.last().is_some_and(|last| last.excluded);
    let after = body.observations.iter().filter(|o| o.time_s > strike_s);
    let shown = after.filter(|o| !o.excluded && !o.doubtful).count();
    if !is_pushed || shown >= POSITIONS_OF_FRICTION {
        return None;
    }
    strike.exclude(format!(
        "the strike of `{}` at {strike_s:.3} s measures nothing: only {shown} trusted positions show its motion before it is pushed",
        body.object
    ));
    Some(struck)
}

/// Whether the instant of a strike lies clearly between two positions of the struck body, by what else the clip shows: the place where the body
/// hits another one and the instant, which the other body shows.
fn is_instant_known(fitted: &MotionFit, strike: &Contact) -> bool {
    let observations = &fitted.model.bodies[strike.b].observations;
    let (index, time_s) = (strike.time_index, strike.time_s(fitted));
    let std_s = fitted.minimum.covariance[(index, index)].sqrt();
    let after = observations.partition_point(|o| o.time_s <= time_s);
    let (Some(before), Some(next)) = (observations[..after].last(), observations.get(after)) else {
        return false;
    };
    (time_s - before.time_s).min(next.time_s - time_s) > INSTANT_STDS * std_s
}

/// Whether enough positions show how body `k` decelerates.
fn shows_friction(fitted: &MotionFit, k: usize) -> bool {
    let observations = &fitted.model.bodies[k].observations;
    let shown = fitted.paths[k].legs().into_iter().map(|leg| {
        let during = leg.start_s..leg.end_s;
        observations.iter().filter(|o| !o.excluded && during.contains(&o.time_s)).count()
    });
    shown.filter(|count| *count > 1).sum::<usize>() >= POSITIONS_OF_FRICTION
}

/// Excludes the restitutions of impacts that share a short motion with one that does not conserve momentum (its bodies and its time): that motion
/// is fitted wrongly.
fn exclude_wrong(fitted: &MotionFit, contacts: &mut [Contact], wrong: &[(Vec<usize>, f64)]) {
    let frame_s = frame_s(&fitted.model.bodies);
    for contact in contacts.iter_mut().filter(|contact| contact.restitution) {
        let (bodies, time_s) = (partners(contact), contact.time_s(fitted));
        let shares = |(others, other_s): &&(Vec<usize>, f64)| {
            bodies.iter().any(|k| others.contains(k)) && (other_s - time_s).abs() < FRAMES_OF_MOTION * frame_s
        };
        if let Some((_, other_s)) = wrong.iter().find(shares) {
            contact.restitution = false;
            contact.remarks.push(format!(
                "the impact at {time_s:.3} s gives no restitution: that at {other_s:.3} s follows or precedes it within {FRAMES_OF_MOTION} frames and \
                 does not conserve momentum"
            ));
        }
    }
}

/// Excludes the restitution of an impact of two bodies that hit each other again before enough frames show how they part.
///
/// The impacts that follow the last one found are closer to each other still, and no frame shows them. The motion among them is fitted
/// only roughly, and with it the end of the motion that leads there.
fn exclude_repeated(fitted: &MotionFit, contacts: &mut [Contact]) {
    let frame_s = frame_s(&fitted.model.bodies);
    let impacts: Vec<(Partner, usize, f64)> = contacts.iter().map(|c| (c.a, c.b, c.time_s(fitted))).collect();
    let least_s = FRAMES_UNTIL_REPEATED * frame_s;
    for (contact, &(a, b, time_s)) in contacts.iter_mut().zip(&impacts) {
        if !contact.restitution || !matches!(a, Partner::Body(_)) {
            continue;
        }
        let of_pair = || impacts.iter().filter(|other| (other.0, other.1) == (a, b)).map(|other| other.2);
        let next_s = |time_s: f64| of_pair().filter(|other_s| *other_s > time_s).min_by(f64::total_cmp);
        let until_s = until_repeated_s(of_pair(), time_s);
        let row = next_s(time_s).and_then(|second_s| Some(next_s(second_s)? - second_s));
        let reason = if until_s < least_s {
            let frames = until_s / frame_s;
            format!("again within {frames:.1} frames: fewer than {FRAMES_UNTIL_REPEATED} show how they part")
        } else if row.is_some_and(|apart_s| apart_s < least_s) {
            "several times in a row afterwards, and no frame shows their motion between".to_owned()
        } else {
            continue;
        };
        contact.restitution = false;
        contact.remarks.push(format!(
            "the bodies that meet at {time_s:.3} s hit each other {reason}, so the impact gives no restitution"
        ));
    }
}

/// Excludes an impact of a body that the striker hit again a few frames before: too few show how the body approaches.
fn exclude_after_further_strike(fitted: &MotionFit, contacts: &mut [Contact]) {
    let least_s = FRAMES_UNTIL_REPEATED * frame_s(&fitted.model.bodies);
    let strikes = contacts.iter().filter(|contact| contact.a == Partner::Striker).skip(1);
    let strikes: Vec<(usize, f64)> = strikes.map(|contact| (contact.b, contact.time_s(fitted))).collect();
    for contact in contacts.iter_mut().filter(|contact| contact.a != Partner::Striker) {
        let (members, time_s) = (partners(contact), contact.time_s(fitted));
        let is_soon_after = |&&(k, strike_s): &&(usize, f64)| {
            members.contains(&k) && (0.0..least_s).contains(&(time_s - strike_s))
        };
        if let Some((k, strike_s)) = strikes.iter().find(is_soon_after) {
            let object = &fitted.model.bodies[*k].object;
            let apart_ms = 1e3 * (time_s - strike_s);
            contact.exclude(format!(
                "the striker hits `{object}` again {apart_ms:.1} ms before the impact at {time_s:.3} s"
            ));
        }
    }
}

/// The least gap between the striker and body `k` (m) at the ends of equal steps from a time on; infinite unless the first impact is the striker's.
fn least_striker_gap_m(
    fitted: &MotionFit,
    striker: &StrikerPath,
    k: usize,
    (from_s, duration_s, steps): (f64, f64, u32),
) -> f64 {
    let times_s = (0..=steps).map(|n| from_s + duration_s * f64::from(n) / f64::from(steps));
    let gaps_m = times_s.filter_map(|time_s| fitted.striker_gap_m(striker, k, time_s));
    gaps_m.fold(f64::INFINITY, f64::min)
}

/// Excludes the strike, and the next impact of the struck body, where the striker is near the body and no trusted position shows the motion until that
/// impact; and the strike of a body that hits no other one, where this is so in a large part of its motion from the beginning on: a second strike
/// would change how the body moves, and the fit explains that by the first one.
fn exclude_after_hidden_strike(fitted: &MotionFit, striker: &StrikerPath, contacts: &mut [Contact]) {
    let frame_s = frame_s(&fitted.model.bodies);
    let Some(strike) = contacts.iter().rposition(|contact| contact.a == Partner::Striker) else { return };
    let (struck, strike_s) = (contacts[strike].b, contacts[strike].time_s(fitted));
    let mut later = strike + 1..contacts.len();
    let next = later.find(|&k| partners(&contacts[k]).contains(&struck));
    let rest_s = || fitted.paths[struck].legs().last().map(|leg| leg.end_s);
    let Some(end_s) = next.map(|next| contacts[next].time_s(fitted)).or_else(rest_s) else { return };
    let observations = fitted.model.bodies[struck].observations.iter();
    let trusted_s = observations.filter(|o| !o.excluded && !o.doubtful).map(|o| o.time_s);
    let shown_s = trusted_s.filter(|time_s| (strike_s..end_s).contains(time_s));
    let (from_s, to_s) = match next {
        Some(_) => (shown_s.fold(strike_s, f64::max), end_s),
        None => (strike_s, shown_s.fold(end_s, f64::min)),
    };
    // First they part.
    let parted_s = from_s.max(strike_s + FRAMES_UNTIL_MET_AGAIN * frame_s);
    let is_large_part = to_s - from_s > UNSEEN_PART * (end_s - strike_s);
    if to_s - from_s < FRAMES_BETWEEN * frame_s || to_s < parted_s || next.is_none() && !is_large_part {
        return;
    }
    let gap_m = least_striker_gap_m(fitted, striker, struck, (parted_s, to_s - parted_s, UNSEEN_STEPS));
    if gap_m < APPROACHED_M {
        let before = next.map_or(String::new(), |_| format!(" before the impact at {end_s:.3} s"));
        let reason = format!(
            "the striker may hit `{}` again{before}: the gap is {:.1} mm, and no trusted position shows the motion between {from_s:.3} and {to_s:.3} s",
            fitted.model.bodies[struck].object,
            1e3 * gap_m
        );
        contacts[strike].exclude(reason.clone());
        if let Some(next) = next {
            contacts[next].exclude(reason);
        }
    }
}

/// The time from an impact of a pair to the next one (s), found or expected from the time since the one before; infinite for a single impact.
fn until_repeated_s(of_pair: impl Iterator<Item = f64>, time_s: f64) -> f64 {
    let apart_s = of_pair.map(|other_s| other_s - time_s).filter(|apart_s| *apart_s != 0.0);
    apart_s.map(|t| if t > 0.0 { t } else { -t * REPEATED_INTERVAL }).fold(f64::INFINITY, f64::min)
}

/// Excludes an impact during which the striker touches a partner: the striker's impulse is part of the momentum balance.
fn exclude_squeezed(fitted: &MotionFit, striker: &StrikerPath, contact: &mut Contact) {
    /// A second strike within this time has no observation before it and would be taken for a part of the impact.
    const UNOBSERVED_FRAMES: f64 = 1.0;
    const STEPS: u32 = 4;
    let time_s = contact.time_s(fitted);
    let frame_s = frame_s(&fitted.model.bodies);
    for partner in [contact.a, Partner::Body(contact.b)] {
        let Partner::Body(k) = partner else { continue };
        let during = (time_s, UNOBSERVED_FRAMES * frame_s, STEPS);
        if least_striker_gap_m(fitted, striker, k, during) < STRIKER_CONTACT_M {
            let object = &fitted.model.bodies[k].object;
            contact.exclude(format!("the striker touches `{object}` at the impact"));
        }
    }
}

/// In clips of three bodies and more, excludes impacts with a third body close by or another impact shortly before or
/// after: they may share the impulse.
fn exclude_crowded(fitted: &MotionFit, contacts: &mut [Contact]) {
    let bodies = fitted.model.bodies.len();
    if bodies < 3 {
        return;
    }
    let frame_s = frame_s(&fitted.model.bodies);
    let time_s = |index: usize| fitted.minimum.parameters[index];
    let name = |k: usize| &fitted.model.bodies[k].object;
    for contact in contacts.iter_mut().filter(|c| c.restitution || c.mass_ratio) {
        let impact_s = contact.time_s(fitted);
        let partners = partners(contact);
        let outline = |k: usize| {
            Outline::new(&fitted.model.bodies[k].shape, fitted.paths[k].motion_before(impact_s).pose)
        };
        let close = |k: usize| partners.iter().any(|&p| outline(p).gap_m(&outline(k)) < OUTLINE_ACCURACY_M);
        if let Some(k) = (0..bodies).find(|&k| !partners.contains(&k) && close(k)) {
            contact.exclude(format!(
                "`{}` lies next to the impact at {impact_s:.3} s and may have taken part in it",
                name(k)
            ));
            continue;
        }
        let other = (fitted.model.events.iter().zip(&fitted.layout.events)).find_map(|(event, indices)| {
            let shared = event.members.iter().find(|m| partners.contains(m))?;
            let apart_s = (time_s(indices.time) - impact_s).abs();
            (indices.time != contact.time_index && apart_s < FRAMES_BETWEEN * frame_s)
                .then_some((*shared, apart_s))
        });
        if let Some((k, apart_s)) = other {
            let apart_ms = apart_s * 1e3;
            contact.exclude(format!(
                "`{}` is in another impact {apart_ms:.1} ms from that at {impact_s:.3} s",
                name(k)
            ));
        }
    }
}

fn partners(contact: &Contact) -> Vec<usize> {
    match contact.a {
        Partner::Body(a) => vec![a, contact.b],
        _ => vec![contact.b],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_impacts_follow_each_other_like_those_of_a_bouncing_ball() {
        let until_s = |time_s| until_repeated_s([0.1, 0.15].into_iter(), time_s);
        assert!((until_s(0.1) - 0.05).abs() < 1e-12, "{} s", until_s(0.1));
        assert!((until_s(0.15) - 0.025).abs() < 1e-12, "{} s", until_s(0.15));
        assert_eq!(until_repeated_s(std::iter::once(0.1), 0.1), f64::INFINITY);
    }
}
