//! The gap between two outlines, and their nearest points.

/// An outline from above, about the centroid.
#[derive(Clone, Debug)]
pub(crate) enum Outline {
    /// A disc of a radius (m).
    Disc(f64),
    /// A convex polygon: its corners, counter-clockwise (m).
    Convex(Vec<[f64; 2]>),
}

/// The nearest points of two outlines.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Witness {
    /// Gap (m), a lower bound if positive; negative: depth of the overlap.
    pub(crate) gap_m: f64,
    pub(crate) point: [f64; 2],
    /// Unit vector from the first to the second.
    pub(crate) normal: [f64; 2],
}

impl Witness {
    /// Lever arm of the normal about a body's centroid (m).
    pub(crate) fn arm_m(&self, pose: [f64; 3]) -> f64 {
        (self.point[0] - pose[0]) * self.normal[1] - (self.point[1] - pose[1]) * self.normal[0]
    }

    /// The same with the bodies exchanged.
    fn reversed(self) -> Self {
        Self { normal: self.normal.map(|c| -c), ..self }
    }
}

impl Outline {
    /// Greatest distance from the centroid (m).
    pub(crate) fn reach_m(&self) -> f64 {
        match self {
            Self::Disc(radius_m) => *radius_m,
            Self::Convex(corners) => corners.iter().map(|c| c[0].hypot(c[1])).fold(0.0, f64::max),
        }
    }
}

/// The nearest points of two outlines at their poses.
pub(crate) fn witness(a: (&Outline, [f64; 3]), b: (&Outline, [f64; 3])) -> Witness {
    match (a.0, b.0) {
        (Outline::Disc(ra), Outline::Disc(rb)) => discs((*ra, a.1), (*rb, b.1)),
        (Outline::Disc(ra), Outline::Convex(corners)) => {
            disc_beside(&laid(corners, b.1), (*ra, a.1)).reversed()
        }
        (Outline::Convex(corners), Outline::Disc(rb)) => disc_beside(&laid(corners, a.1), (*rb, b.1)),
        (Outline::Convex(ca), Outline::Convex(cb)) => {
            let (p, q) = (laid(ca, a.1), laid(cb, b.1));
            let (one, other) = (corner_beside(&p, &q), corner_beside(&q, &p));
            if one.gap_m >= other.gap_m { one } else { other.reversed() }
        }
    }
}

fn laid(corners: &[[f64; 2]], [x, y, yaw]: [f64; 3]) -> Vec<[f64; 2]> {
    let (sin, cos) = yaw.sin_cos();
    corners.iter().map(|c| [x + cos * c[0] - sin * c[1], y + sin * c[0] + cos * c[1]]).collect()
}

fn discs((ra, a): (f64, [f64; 3]), (rb, b): (f64, [f64; 3])) -> Witness {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let apart = dx.hypot(dy);
    let normal = [dx / apart, dy / apart];
    Witness { gap_m: apart - ra - rb, point: [a[0] + ra * normal[0], a[1] + ra * normal[1]], normal }
}

/// Outward normal of the side from corner k, and the distance of a point beyond it (m).
fn side(p: &[[f64; 2]], k: usize) -> ([f64; 2], impl Fn([f64; 2]) -> f64 + use<>) {
    let (from, to) = (p[k], p[(k + 1) % p.len()]);
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    let normal = [dy / length, -dx / length];
    (normal, move |q: [f64; 2]| (q[0] - from[0]) * normal[0] + (q[1] - from[1]) * normal[1])
}

/// The side of p from whose line the nearest corner of q is farthest.
fn corner_beside(p: &[[f64; 2]], q: &[[f64; 2]]) -> Witness {
    let mut found = Witness { gap_m: f64::NEG_INFINITY, point: [0.0; 2], normal: [0.0; 2] };
    for k in 0..p.len() {
        let (normal, beyond) = side(p, k);
        let mut nearest = (f64::INFINITY, q[0]);
        for &corner in q {
            let gap_m = beyond(corner);
            if gap_m < nearest.0 {
                nearest = (gap_m, corner);
            }
        }
        if nearest.0 > found.gap_m {
            found = Witness { gap_m: nearest.0, point: nearest.1, normal };
        }
    }
    found
}

/// A disc and a convex polygon: nearest at a side or at a corner.
fn disc_beside(p: &[[f64; 2]], (radius_m, [x, y, _]): (f64, [f64; 3])) -> Witness {
    let mut found = (f64::NEG_INFINITY, 0, [0.0; 2]);
    for k in 0..p.len() {
        let (normal, beyond) = side(p, k);
        let gap_m = beyond([x, y]);
        if gap_m > found.0 {
            found = (gap_m, k, normal);
        }
    }
    let (mut gap_m, k, mut normal) = found;
    let (from, to) = (p[k], p[(k + 1) % p.len()]);
    let along = [to[0] - from[0], to[1] - from[1]];
    let fraction =
        ((x - from[0]) * along[0] + (y - from[1]) * along[1]) / (along[0].powi(2) + along[1].powi(2));
    if gap_m > 0.0 && !(0.0..=1.0).contains(&fraction) {
        let corner = if fraction < 0.0 { from } else { to };
        let (dx, dy) = (x - corner[0], y - corner[1]);
        gap_m = dx.hypot(dy);
        normal = [dx / gap_m, dy / gap_m];
    }
    let point = [x - normal[0] * radius_m, y - normal[1] * radius_m];
    Witness { gap_m: gap_m - radius_m, point, normal }
}
