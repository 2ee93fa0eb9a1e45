//! The distortion models of lenses and their coefficients.

use serde::{Deserialize, Serialize};

/// How a lens displaces a ray in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DistortionModel {
    /// Brown's model (1966) with three radial and two tangential coefficients.
    #[default]
    PlumbBob,
    /// Brown's model whose radial factor is a ratio of two cubic polynomials (OpenCV's `CALIB_RATIONAL_MODEL`).
    RationalPolynomial,
    /// A polynomial of the ray's angle (Kannala and Brandt, 2006), OpenCV's fisheye model.
    Equidistant,
}

impl DistortionModel {
    /// All models.
    pub const ALL: [Self; 3] = [Self::PlumbBob, Self::RationalPolynomial, Self::Equidistant];

    /// The name in files: ROS's.
    pub fn name(self) -> &'static str {
        match self {
            Self::PlumbBob => "plumb_bob",
            Self::RationalPolynomial => "rational_polynomial",
            Self::Equidistant => "equidistant",
        }
    }

    /// The names of the coefficients, in OpenCV's order.
    pub fn coefficient_names(self) -> &'static [&'static str] {
        match self {
            Self::PlumbBob => &["k1", "k2", "p1", "p2", "k3"],
            Self::RationalPolynomial => &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"],
            Self::Equidistant => &["k1", "k2", "k3", "k4"],
        }
    }
}

/// A distortion model with its coefficients, in OpenCV's order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distortion {
    /// k1 k2 p1 p2 k3.
    PlumbBob([f64; 5]),
    /// k1 k2 p1 p2 k3 k4 k5 k6.
    RationalPolynomial([f64; 8]),
    /// k1 k2 k3 k4.
    Equidistant([f64; 4]),
}

impl Default for Distortion {
    fn default() -> Self {
        Self::PlumbBob([0.0; 5])
    }
}

impl From<[f64; 5]> for Distortion {
    fn from(coefficients: [f64; 5]) -> Self {
        Self::PlumbBob(coefficients)
    }
}

impl Distortion {
    /// The model with these coefficients; missing ones are zero.
    ///
    /// # Errors
    /// What is needed instead: finite coefficients, and no more than the model has unless they are zero (the thin
    /// prism and tilted sensor terms of OpenCV's models of 12 and 14 coefficients).
    pub fn new(model: DistortionModel, coefficients: &[f64]) -> Result<Self, String> {
        let names = model.coefficient_names();
        let needed = |more: &str| format!("`{}`: {}{more}", model.name(), names.join(" "));
        if coefficients.iter().any(|k| !k.is_finite()) {
            return Err(needed(", finite numbers"));
        }
        let longest = if model == DistortionModel::RationalPolynomial { 14 } else { names.len() };
        let extra = coefficients.get(names.len()..).unwrap_or_default();
        if extra.iter().any(|&k| k != 0.0) {
            let what = match model {
                DistortionModel::RationalPolynomial => {
                    " without thin prism (s1 s2 s3 s4) and tilt (tx ty) terms: calibrate without them"
                }
                DistortionModel::PlumbBob => ", or the model `rational_polynomial` with eight coefficients",
                DistortionModel::Equidistant => "",
            };
            return Err(needed(what));
        }
        if model == DistortionModel::RationalPolynomial && coefficients.len() > longest {
            return Err(needed(", at most 14 numbers"));
        }
        Ok(match model {
            DistortionModel::PlumbBob => Self::PlumbBob(padded(coefficients)),
            DistortionModel::RationalPolynomial => Self::RationalPolynomial(padded(coefficients)),
            DistortionModel::Equidistant => Self::Equidistant(padded(coefficients)),
        })
    }

    /// The model.
    pub fn model(&self) -> DistortionModel {
        match self {
            Self::PlumbBob(_) => DistortionModel::PlumbBob,
            Self::RationalPolynomial(_) => DistortionModel::RationalPolynomial,
            Self::Equidistant(_) => DistortionModel::Equidistant,
        }
    }

    /// The coefficients, in the order of [`DistortionModel::coefficient_names`].
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Self::PlumbBob(k) => k,
            Self::RationalPolynomial(k) => k,
            Self::Equidistant(k) => k,
        }
    }
}

fn padded<const N: usize>(coefficients: &[f64]) -> [f64; N] {
    let mut padded = [0.0; N];
    for (coefficient, value) in padded.iter_mut().zip(coefficients) {
        *coefficient = *value;
    }
    padded
}
