//! The contents of the page: the results of the stages that it shows.

use crate::capture::GreyImage;
use crate::cell::Cell;
use crate::detect::Tracks;
use crate::estimate::ClipFit;
use crate::object::Object;
use crate::physics::Trajectory;
use crate::plan::Plan;
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use crate::verify::Report;

/// The results that the page shows; a chapter without results is left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct Page<'a> {
    /// The title.
    pub title: &'a str,
    /// The objects: their weighed masses give the errors of the estimated mass ratios.
    pub objects: &'a [Object],
    /// The motion in one clip (Fig. 6).
    pub motion: Option<ClipMotion<'a>>,
    /// Friction, restitution and mass ratios (Figs. 7 to 9, Table 1).
    pub properties: Option<&'a Properties>,
    /// The motion fits of the clips from which the properties were estimated.
    pub fits: &'a [ClipFit],
    /// The planned strike.
    pub plan: Option<&'a Plan>,
    /// The simulation of a strike.
    pub simulated: Option<SimulatedStrike<'a>>,
    /// Filmed strikes and their simulations (Figs. 12 to 17).
    pub filmed: &'a [FilmedStrike<'a>],
    /// Further warnings; those of the results are listed in any case.
    pub warnings: &'a [String],
}

/// The tracks of one clip and the motion that was fitted to them.
#[derive(Clone, Copy, Debug)]
pub struct ClipMotion<'a> {
    /// The measured positions of the objects.
    pub tracks: &'a Tracks,
    /// The fitted motion.
    pub fit: Option<&'a ClipFit>,
    /// The cell in which it was filmed: with it and the page's objects the motion can be played.
    pub cell: Option<&'a Cell>,
    /// The strike.
    pub strike: Option<&'a Strike>,
}

/// A simulated strike.
#[derive(Clone, Copy, Debug)]
pub struct SimulatedStrike<'a> {
    /// The pile.
    pub scene: &'a Scene,
    /// The strike.
    pub strike: &'a Strike,
    /// The motion of the objects.
    pub trajectory: &'a Trajectory,
}

/// A filmed strike and its simulation.
#[derive(Clone, Copy, Debug)]
pub struct FilmedStrike<'a> {
    /// The pile.
    pub scene: &'a Scene,
    /// The strike.
    pub strike: &'a Strike,
    /// The tracks of the film, for the paths of the centres and the filmed motion.
    pub tracks: Option<&'a Tracks>,
    /// The simulation, for the paths of the centres and the simulated motion.
    pub trajectory: Option<&'a Trajectory>,
    /// The comparison of the two; with its alignment film and simulation are played together.
    pub report: &'a Report,
    /// A frame from before the strike and one from after it.
    pub frames: Option<[&'a GreyImage; 2]>,
}
