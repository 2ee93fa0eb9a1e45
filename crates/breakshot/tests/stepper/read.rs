//! Reads files of piles (the format of the example `scenes`).

use super::outline::Outline;
use super::{Body, Pile, Striker};

/// All piles of a file.
pub(crate) fn piles(text: &str) -> Result<Vec<Pile>, String> {
    let mut piles: Vec<Pile> = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let what = words.next().unwrap_or_default();
        let rest: Vec<&str> = words.collect();
        let fault = || format!("line {}: not a scene's line: {line}", k + 1);
        if what == "scene" {
            let name = rest.get(1).ok_or_else(fault)?;
            piles.push(Pile { name: (*name).into(), striker: striker(&[0.0; 6]), bodies: Vec::new() });
            continue;
        }
        let n: Vec<f64> = rest.iter().map(|w| w.parse().map_err(|_| fault())).collect::<Result<_, _>>()?;
        let Some(pile) = piles.last_mut() else { continue };
        match what {
            "striker" if n.len() == 7 => pile.striker = striker(&n),
            "disc" if n.len() == 9 => {
                let inertia_kg_m2 = 0.5 * n[0] * n[7] * n[7];
                pile.bodies.push(body(&n, Outline::Disc(n[7]), (n[8], inertia_kg_m2)));
            }
            "poly" if n.len() > 9 => {
                let corners = n[10..].chunks_exact(2).map(|c| [c[0], c[1]]).collect();
                pile.bodies.push(body(&n, Outline::Convex(corners), (n[7], n[8])));
            }
            "end" | "" => {}
            _ => return Err(fault()),
        }
    }
    Ok(piles)
}

fn striker(n: &[f64]) -> Striker {
    Striker { radius_m: n[0], start_m: [n[1], n[2]], speed_m_s: n[3], travel_m: n[4], bounce: n[5] }
}

fn body(n: &[f64], outline: Outline, (mean_arm_m, inertia_kg_m2): (f64, f64)) -> Body {
    Body {
        mass_kg: n[0],
        inertia_kg_m2,
        friction: n[1],
        bounce: n[2],
        mean_arm_m,
        outline,
        pose: [n[4], n[5], n[6]],
        speed: [0.0; 3],
    }
}
