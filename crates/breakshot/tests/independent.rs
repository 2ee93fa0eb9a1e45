//! The simulator against an independent one (`stepper`), which takes small time steps and has no events.
//!
//! `cargo xtask validate physics` does the same over files of forty piles each.

mod piles;
mod stepper;

use breakshot::geometry::{Point, Pose};
use breakshot::object::Shape;
use breakshot::physics::MultipleImpact;
use piles::{Pile, disc, four_discs, four_shapes};
use stepper::outline::Outline;
use stepper::{Body, Contact, Striker, settled};

/// The pile in the types of the stepper.
fn stepped(pile: &Pile) -> stepper::Pile {
    let (properties, strike) = (&pile.properties, &pile.strike);
    let Shape::Disc { radius_m } = pile.scene.cell.striker.shape else {
        panic!("the stepper strikes with discs")
    };
    let bodies = pile.scene.placed.iter().map(|placed| {
        let shape = &pile.scene.object(&placed.object).expect("known").shape;
        let mass_kg = properties.mass_ratio[&placed.object].mean;
        let (outline, gyration_m, mean_arm_m) = if let Shape::Disc { radius_m } = shape {
            (Outline::Disc(*radius_m), radius_m / 2f64.sqrt(), radius_m * 2.0 / 3.0)
        } else {
            let corners: Vec<[f64; 2]> = shape.corners().iter().map(|c| [c.x, c.y]).collect();
            let (gyration_m, mean_arm_m) = summed_arms_m(&corners);
            (Outline::Convex(corners), gyration_m, mean_arm_m)
        };
        Body {
            mass_kg,
            inertia_kg_m2: mass_kg * gyration_m * gyration_m,
            friction: properties.friction[&placed.object].mean,
            bounce: properties.striker_restitution[&placed.object].mean,
            mean_arm_m,
            outline,
            pose: [placed.position_m.x, placed.position_m.y, placed.yaw_rad],
            speed: [0.0; 3],
        }
    });
    stepper::Pile {
        name: String::new(),
        striker: Striker {
            radius_m,
            start_m: [strike.start_m.x, strike.start_m.y],
            speed_m_s: strike.speed_m_s,
            travel_m: strike.travel_m,
            bounce: 1.0,
        },
        bodies: bodies.collect(),
    }
}

/// Radius of gyration and mean distance from the centroid of a convex polygon about the origin, summed over small
/// triangles.
fn summed_arms_m(corners: &[[f64; 2]]) -> (f64, f64) {
    let cuts = 400;
    let (mut area, mut squares, mut arms) = (0.0, 0.0, 0.0);
    for k in 0..corners.len() {
        let (p, q) = (corners[k], corners[(k + 1) % corners.len()]);
        let whole = 0.5 * (p[0] * q[1] - p[1] * q[0]);
        area += whole;
        for i in 0..cuts {
            // A thin triangle from the origin: the mean of r is 2/3 and of r^2 1/2 of those at its outer side.
            let fraction = (f64::from(i) + 0.5) / f64::from(cuts);
            let outer = [0, 1].map(|c| p[c] + fraction * (q[c] - p[c]));
            let r = outer[0].hypot(outer[1]);
            arms += whole / f64::from(cuts) * r * 2.0 / 3.0;
            squares += whole / f64::from(cuts) * r * r / 2.0;
        }
    }
    ((squares / area).sqrt(), arms / area)
}

/// Greatest distance of a body's final position from the one of the stepper (m).
fn difference_m(pile: &Pile, contact: Contact, step_s: f64) -> f64 {
    let run = pile.run();
    let steps = settled(&stepped(pile), contact, step_s);
    let distances = pile.scene.placed.iter().zip(steps).map(|(placed, [x, y, _])| {
        let position = run.final_poses[&placed.object].position;
        (position.x - x).hypot(position.y - y)
    });
    distances.fold(0.0, f64::max)
}

/// The pile with pairwise impacts of no duration, like the rigid contacts of the stepper.
fn pairwise(mut pile: Pile) -> Pile {
    pile.options.multiple_impact = MultipleImpact::Pairwise;
    pile
}

#[test]
fn discs_rest_at_the_positions_of_a_simulation_in_small_steps() {
    for seed in 0..6 {
        let apart_m = difference_m(&pairwise(four_discs(seed)), Contact::Rigid, 4e-7);
        assert!(apart_m < 1e-5, "seed {seed}: {} mm", apart_m * 1e3);
    }
}

#[test]
fn polygons_rest_at_the_positions_of_a_simulation_in_small_steps() {
    let mut apart_m: Vec<f64> =
        (0..7).map(|seed| difference_m(&pairwise(four_shapes(seed)), Contact::Rigid, 1e-6)).collect();
    apart_m.sort_by(f64::total_cmp);
    // A corner that narrowly hits or misses changes everything after it: the median is compared.
    assert!(apart_m[3] < 5e-5, "median {} mm of {apart_m:?} m", apart_m[3] * 1e3);
}

#[test]
fn touching_discs_separate_like_springs() {
    // The result does not depend on the contact time; this one needs fewer steps than the default.
    let contact_time_s = 1e-4;
    let mut apart_m = Vec::new();
    for offset_m in [-0.008, 0.001, 0.006] {
        let mut pile = Pile::new();
        // Three that touch each other; the striker runs into the first.
        let (r, s, t) = (0.05, 0.045, 0.038);
        let (rs, rt, st): (f64, f64, f64) = (r + s, r + t, s + t);
        let angle = ((rs * rs + rt * rt - st * st) / (2.0 * rs * rt)).acos();
        let (one, other) = (0.55, 0.55 - angle);
        for (radius_m, material, distance_m, heading) in [
            (r, (0.143, 0.25, 0.9), 0.0, 0.0),
            (s, (0.112, 0.3, 0.8), rs, one),
            (t, (0.061, 0.35, 0.7), rt, other),
        ] {
            let pose = Pose::new(distance_m * heading.cos(), distance_m * heading.sin(), 0.0);
            pile.add(disc(radius_m), material, pose);
        }
        pile.strike.start_m = Point::new(-0.085, offset_m);
        pile.strike.travel_m = 0.06;
        apart_m.push(difference_m(&pile, Contact::Springs { contact_time_s, exponent: 1.5 }, 1e-6));
    }
    apart_m.sort_by(f64::total_cmp);
    // A narrow hit or miss after the springs changes everything after it: the median is compared.
    assert!(apart_m[1] < 1e-3, "median {} mm of {apart_m:?} m", apart_m[1] * 1e3);
}

/// Final pose and time of rest (s) of a body released with its speeds and braked in small steps.
fn slid(mut body: Body, step_s: f64) -> ([f64; 3], f64) {
    let patch = stepper::patch::Patch::new();
    let mut time_s = 0.0;
    while body.speed != [0.0; 3] {
        patch.rub(&mut body, 0.5 * step_s);
        for (coordinate, speed) in body.pose.iter_mut().zip(body.speed) {
            *coordinate += step_s * speed;
        }
        patch.rub(&mut body, 0.5 * step_s);
        time_s += step_s;
    }
    (body.pose, time_s)
}

#[test]
fn a_slide_with_spin_ends_where_friction_summed_over_the_support_leads() {
    let square = Shape::Rectangle { size_m: [0.08, 0.08] };
    // Shape, offset of the strike from the centre (m), and distance of the striker's centre at the contact (m).
    let rim = |offset_m: f64| (0.055f64.powi(2) - offset_m * offset_m).sqrt();
    for (shape, offset_m, contact_m) in [
        (disc(0.04), 0.004, rim(0.004)),
        (disc(0.04), 0.02, rim(0.02)),
        (disc(0.04), 0.045, rim(0.045)),
        (square.clone(), 0.01, 0.055),
        (square.clone(), 0.035, 0.055),
        (square, 0.0001, 0.055),
    ] {
        let mut pile = Pile::new();
        pile.add(shape, (0.1, 0.3, 0.6), Pose::new(0.0, -offset_m, 0.0));
        pile.contact_friction(0.4);
        pile.strike.start_m = Point::new(-0.2, 0.0);
        pile.strike.travel_m = 0.2 - contact_m + 1e-9;
        let run = pile.run();
        let (hit, end) = (&run.events[0], run.final_poses["o000"]);
        let mut body = stepped(&pile).bodies.remove(0);
        let struck = hit.bodies.iter().position(|name| name == "o000").expect("it was hit");
        let v = hit.velocities_after_m_s[struck];
        body.speed = [v.x, v.y, hit.yaw_rates_after_rad_s[struck]];
        let ([x, y, yaw], time_s) = slid(body, 4e-6);
        let distance_m = (x * x + (y + offset_m).powi(2)).sqrt();
        let apart_m = (end.position.x - x).hypot(end.position.y - y);
        assert!(apart_m < 1e-4 * distance_m, "struck {offset_m} m beside: {apart_m} m of {distance_m} m");
        assert!(
            (end.yaw_rad / yaw - 1.0).abs() < 2e-4,
            "struck {offset_m} m beside: {} rad, not {yaw}",
            end.yaw_rad
        );
        let ours_s = run.duration_s - hit.time_s;
        assert!((ours_s / time_s - 1.0).abs() < 1e-4, "struck {offset_m} m beside: {ours_s} s, not {time_s}");
    }
}
