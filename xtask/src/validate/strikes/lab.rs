//! The lab as a running program: `xtask/peers/lab_strikes.py`.

use crate::venv;
use breakshot::geometry::Pose;
use breakshot::scene::{Placed, Strike};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// A cell of the lab: its folder of scripts, that of the campaign with the cell's files, and what the scripts read about it.
pub(crate) struct LabCell {
    pub(crate) lab: PathBuf,
    pub(crate) campaign: PathBuf,
    pub(crate) specification: PathBuf,
}

impl LabCell {
    /// The lab's own cell.
    pub(crate) fn own(lab: &Path) -> Self {
        let (campaign, specification) = (lab.join("campaign"), lab.join("campaign_spec.json"));
        Self { lab: lab.into(), campaign, specification }
    }

    /// A cell that `validate cells` drew and filmed into a folder.
    pub(crate) fn drawn(lab: &Path, folder: &Path) -> Result<Self, String> {
        let files = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let mut paths: Vec<PathBuf> = files.filter_map(|file| Some(file.ok()?.path())).collect();
        paths.sort();
        let is_specification = |path: &PathBuf| {
            let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
            stem.starts_with("campaign_") && path.extension().is_some_and(|extension| extension == "json")
        };
        let specification = paths.into_iter().find(is_specification);
        let missing = || format!("{}: no campaign_SEED.json of a drawn cell", folder.display());
        Ok(Self {
            lab: lab.into(),
            campaign: folder.into(),
            specification: specification.ok_or_else(missing)?,
        })
    }

    /// The cell of the lab in `folder`, else the lab's own.
    pub(crate) fn of(lab: &Path, folder: Option<&Path>) -> Result<Self, String> {
        folder.map_or_else(|| Ok(Self::own(lab)), |folder| Self::drawn(lab, folder))
    }
}

/// A lab that waits for requests.
pub(crate) struct Lab {
    program: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
}

/// Conditions of one strike in the lab.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variation {
    /// Friction over its nominal value.
    pub friction_scale: f64,
    /// Seed of the disturbances of poses, speed and heading; none without disturbances.
    pub seed: Option<u64>,
}

/// A random pile: its objects and their poses.
#[derive(Clone, Debug)]
pub(crate) struct Pile {
    pub name: String,
    pub poses: Vec<(String, Pose)>,
}

/// The poses in which all objects came to rest.
#[derive(Clone, Debug)]
pub(crate) struct Rest {
    pub poses: Vec<(String, Pose)>,
    /// The largest tilt of an object (degrees).
    pub tilt_deg: f64,
}

#[derive(Deserialize)]
struct PileAnswer {
    name: String,
    #[serde(rename = "place")]
    poses: BTreeMap<String, Pose>,
}

#[derive(Deserialize)]
struct StrikeAnswer {
    #[serde(rename = "final")]
    poses: BTreeMap<String, Pose>,
    max_tilt_deg: f64,
}

impl Lab {
    /// Starts the lab with a cell.
    pub(crate) fn start(LabCell { lab, specification, .. }: &LabCell) -> Result<Self, String> {
        let python = venv::python("lab", &venv::LAB)?;
        let mut program = Command::new(python)
            .arg("xtask/peers/lab_strikes.py")
            .args([lab, specification])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| format!("the lab cannot be started ({e})"))?;
        let (Some(requests), Some(answers)) = (program.stdin.take(), program.stdout.take()) else {
            return Err("the lab has no input or output".into());
        };
        Ok(Self { program, requests, answers: BufReader::new(answers) })
    }

    fn ask(&mut self, request: &Value) -> Result<Value, String> {
        writeln!(self.requests, "{request}")
            .map_err(|e| format!("the lab does not accept a request ({e})"))?;
        let mut line = String::new();
        self.answers.read_line(&mut line).map_err(|e| format!("the lab does not answer ({e})"))?;
        serde_json::from_str(&line).map_err(|e| format!("the lab answered {line:?} ({e})"))
    }

    /// Random piles of 2 to 6 objects.
    pub(crate) fn piles(&mut self, count: usize, seed: u64) -> Result<Vec<Pile>, String> {
        let answer = self.ask(&json!({ "piles": count, "seed": seed }))?;
        let piles: Vec<PileAnswer> = serde_json::from_value(answer).map_err(|e| e.to_string())?;
        Ok(piles.into_iter().map(|p| Pile { name: p.name, poses: p.poses.into_iter().collect() }).collect())
    }

    /// Carries a strike out; none if the lab refuses it.  With a seed poses, speed and heading are off by 1 mm, 2 % and 1 degree
    /// (one standard deviation each).
    pub(crate) fn strike(
        &mut self,
        placed: &[Placed],
        strike: &Strike,
        Variation { friction_scale, seed }: Variation,
    ) -> Result<Option<Rest>, String> {
        let poses: BTreeMap<&str, Pose> = placed.iter().map(|p| (p.object.as_str(), p.pose())).collect();
        let answer = self.ask(&json!({
            "place": poses,
            "strike": {
                "start": strike.start_m,
                "heading": strike.heading_rad,
                "speed": strike.speed_m_s,
                "travel": strike.travel_m,
            },
            "friction_scale": friction_scale,
            "seed": seed,
        }))?;
        if answer.get("refused").is_some() {
            return Ok(None);
        }
        let StrikeAnswer { poses, max_tilt_deg } =
            serde_json::from_value(answer).map_err(|e| e.to_string())?;
        Ok(Some(Rest { poses: poses.into_iter().collect(), tilt_deg: max_tilt_deg }))
    }
}

impl Drop for Lab {
    fn drop(&mut self) {
        // The program may have ended by itself.
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}
