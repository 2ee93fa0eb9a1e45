//! The conditions under which a synthetic campaign is filmed.

/// How a campaign is filmed, and how much friction and restitution vary.
#[derive(Clone, Debug, PartialEq)]
pub struct CampaignSpec {
    /// Number of kinds of objects; every third one is a square, the others are discs.
    pub objects: usize,
    /// Number of clips of every case (one object alone, or one pair).
    pub clips_per_case: usize,
    /// Time from frame to frame (s).
    pub frame_s: f64,
    /// Exposure time over the time from frame to frame.
    pub exposure_frames: f64,
    /// Position noise along each axis while a body moves (m, 1 sigma).
    pub noise_m: f64,
    /// Fraction (0 to 1, of the standard deviation) of the position noise that is independent in every frame while a body
    /// rests.  The rest is one constant offset, because a video codec repeats an unchanged picture.
    pub still_noise: f64,
    /// Fraction of the frames in which a marker is hidden.
    pub hidden_fraction: f64,
    /// Fraction of the positions that are wrong by up to two millimetres.
    pub outlier_fraction: f64,
    /// Variation of friction from clip to clip (relative, 1 sigma), equal for all objects of a clip.
    pub friction_std: f64,
    /// Variation of restitution from impact to impact (relative, 1 sigma).
    pub restitution_std: f64,
    /// Largest offset of an impact from a central one, over the offset at which the bodies would miss each other.
    pub max_offset: f64,
    /// Whether all markers are bars, which show the yaw angle; otherwise only those of squares are.
    pub bar_markers: bool,
    /// Whether every object presses on the table more or less towards its rim; otherwise all weights are spread uniformly.
    pub drawn_supports: bool,
    /// Gravity's component along the table over gravity, along x and y.
    pub slope: [f64; 2],
    /// Mean over the pairs of the relative loss of apparent mass of the taller body, because it rocks.
    pub rocking: f64,
    /// How far ahead of the centroid a sliding body presses on the table, over half its height times friction, where a pressure that varies
    /// linearly balances the torque of friction: with it, a body that spins curls.
    pub pressed_ahead: f64,
}

impl Default for CampaignSpec {
    /// Films like those of the paper: five clips of every case at 60 frames a second, nearly central impacts.
    fn default() -> Self {
        Self {
            objects: 4,
            clips_per_case: 5,
            frame_s: 1.0 / 60.0,
            exposure_frames: 0.25,
            noise_m: 2e-5,
            still_noise: 0.3,
            hidden_fraction: 0.02,
            outlier_fraction: 0.002,
            friction_std: 0.03,
            restitution_std: 0.02,
            max_offset: 0.1,
            bar_markers: false,
            drawn_supports: false,
            slope: [0.0; 2],
            rocking: 0.004,
            pressed_ahead: 0.0,
        }
    }
}
