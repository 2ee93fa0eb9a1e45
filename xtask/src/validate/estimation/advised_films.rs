//! Ten advised clips of a cell of the lab: what they are, how the lab carries them out and films them, and the properties that they improve.

use crate::validate::Program;
use crate::validate::strikes::lab::LabCell;
use crate::venv;
use breakshot::campaign::Campaign;
use breakshot::estimate::{self, AdviceOptions, Setup};
use breakshot::files;
use breakshot::geometry::Pose;
use breakshot::properties::Properties;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Advised clips.
const ADVISED: usize = 10;

/// The properties that a cell's films give, and those after ten advised clips, which are filmed as well.
pub(crate) fn learned(program: &Program, cell: &LabCell) -> Result<[PathBuf; 2], String> {
    let python = venv::python("lab", &venv::LAB)?;
    let name = match cell.campaign.file_name() {
        Some(folder) if folder != "campaign" => format!("-{}", folder.to_string_lossy()),
        _ => String::new(),
    };
    let [before, after] =
        ["before", "after"].map(|when| program.output.join(format!("properties-{when}{name}.json")));
    let path = cell.campaign.join("campaign.toml");
    program.run(&["estimate", &path.to_string_lossy(), "-o", &before.to_string_lossy()])?;
    let campaign = files::load_campaign(&path).map_err(|e| e.to_string())?.value;
    let properties = files::load_properties(&before).map_err(|e| e.to_string())?;

    // The films are made again if other clips are advised
    let (clips, folder) =
        (program.output.join(format!("advised{name}.json")), program.output.join(format!("advised{name}")));
    let wanted = advised(&campaign, &properties)?.to_string();
    if std::fs::read_to_string(&clips).is_ok_and(|made| made != wanted) && folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(|e| e.to_string())?;
    }
    std::fs::write(&clips, wanted).map_err(|e| e.to_string())?;
    let request =
        Request { specification: &cell.specification, clips: &clips, folder: &folder, films: Films::Made };
    request.carry_out(&python, &cell.lab)?;
    let update = folder.join("campaign.toml");
    program.run(&[
        "estimate",
        &update.to_string_lossy(),
        "--update",
        &before.to_string_lossy(),
        "-o",
        &after.to_string_lossy(),
    ])?;
    Ok([before, after])
}

/// The advised clips as the lab's scripts describe them.
pub(super) fn advised(campaign: &Campaign, properties: &Properties) -> Result<serde_json::Value, String> {
    let Campaign { cell, objects, .. } = campaign;
    let options = AdviceOptions { clips: ADVISED, scene: None, seed: 1 };
    let advice = estimate::advice(properties, cell, objects, &options).map_err(|e| e.to_string())?;
    let clip = |(k, clip): (usize, &estimate::AdvisedClip)| {
        let (scene, strike) = clip.experiment.layout(Setup { cell, objects }).map_err(|e| e.to_string())?;
        // In order: a campaign lists the object that is struck first.
        let placed: Vec<(&str, Pose)> = scene.placed.iter().map(|p| (p.object.as_str(), p.pose())).collect();
        Ok(json!({
            "name": format!("advised_{:02}", k + 1),
            "placed": placed,
            "striker_start": strike.start_m,
            "heading": strike.heading_rad,
            "speed": strike.speed_m_s,
            "travel": strike.travel_m,
        }))
    };
    advice.clips.iter().enumerate().map(clip).collect::<Result<Vec<_>, String>>().map(Into::into)
}

/// Whether clips that are carried out are filmed.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Films {
    Made,
    Empty,
}

/// Clips of a cell of the lab, as `lab_clips.py` reads them, and the folder for what it writes.
pub(super) struct Request<'a> {
    pub(super) specification: &'a Path,
    pub(super) clips: &'a Path,
    pub(super) folder: &'a Path,
    pub(super) films: Films,
}

impl Request<'_> {
    pub(super) fn carry_out(&self, python: &Path, lab: &Path) -> Result<(), String> {
        let mut command = Command::new(python);
        command.arg("xtask/peers/lab_clips.py").args([lab, self.specification, self.clips, self.folder]);
        if self.films == Films::Made {
            command.arg("--film").env("MUJOCO_GL", "osmesa");
        }
        venv::succeed(&mut command)
    }
}
