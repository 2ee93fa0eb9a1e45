//! Objects, campaigns, scenes, strikes and plans; what is read is also used.

use super::cells::TOML;
use super::numbers::demo_properties;
use super::{JSON, fixture, fixture_text, outcome, repository};
use crate::{Scratch, Target};
use breakshot::physics;
use breakshot::plan::{Aim, Plan, aimed};
use breakshot::scene::{Scene, Strike};
use breakshot::{files, report};

/// `objects.toml`.
pub const OBJECTS: Target = Target::of_text(
    "objects",
    "objects.toml: outlines, markers, supports",
    |bytes| outcome(files::load_objects(Scratch::folder().write("objects.toml", bytes)), &["objects.toml"]),
    || {
        let polygon = "[[objects]]\nname = \"l\"\nheight_m = 0.03\nmass_kg = 0.2\nshape = { polygon = { points_m = [[0, 0], [0.06, 0], \
                       [0.06, 0.02], [0.02, 0.02], [0.02, 0.05], [0, 0.05]] } }\n[[objects]]\nname = \"b\"\nheight_m = 0.03\n\
                       shape = { rectangle = { size_m = [0.08, 0.04] } }\n";
        vec![
            fixture("fixtures/demo/objects.toml"),
            fixture("crates/breakshot-cli/templates/objects.toml"),
            polygon.into(),
        ]
    },
    &[TOML],
);

/// `campaign.toml` beside a cell, objects, a film and tracks.
pub const CAMPAIGN: Target = Target::of_text(
    "campaign",
    "campaign.toml: clips, strikes, columns of tables",
    |bytes| {
        let scratch = demo();
        let path = scratch.write("campaign.toml", bytes);
        // The errors of a file that it names name that file.
        outcome(files::load_campaign(path), &[".toml", "film.mp4", "run.csv"])
    },
    || {
        let clips = "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n[[clips]]\nvideo = \"film.mp4\"\nobjects = [\"a\", \"c\"]\n\
                     strike = { speed_m_s = 0.4, heading_rad = -0.02, start_m = [-0.29, 0.02], travel_m = 0.07 }\n\
                     [[clips]]\ntracks = \"run.csv\"\nobjects = [\"a\"]\nframe_rate_hz = 240.0\nscene = \"pile.scene.toml\"\n";
        let columns = "[columns]\ntime = \"t\"\ntime_unit = \"ms\"\nlength_unit = \"mm\"\nangle_unit = \"deg\"\n\
                       objects = { a = { x = \"x1\", y = \"y1\", yaw = \"w\" } }\n";
        let with_columns = clips.replace("[[clips]]\nvideo", &format!("{columns}[[clips]]\nvideo"));
        vec![clips.into(), with_columns.into_bytes()]
    },
    &[TOML],
);

/// `scene.toml`, struck in simulation.
pub const SCENE: Target = Target {
    most_memory_mb: 200.0,
    ..Target::of_text(
        "scene",
        "scene.toml, and a strike on it, simulated",
        |bytes| {
            let path = demo().write("scene.toml", bytes);
            let scene = files::load_scene(path);
            if let Ok(scene) = &scene {
                simulated(
                    &scene.value,
                    &files::load_strike(repository(STRIKE_FILE)).map_err(|e| e.to_string())?,
                )?;
            }
            outcome(scene, &["scene.toml"])
        },
        || vec![fixture("fixtures/demo/pile.scene.toml"), walled()],
        &[TOML],
    )
};

/// A strike, simulated on the pile of the demo.
pub const STRIKE: Target = Target {
    most_memory_mb: 200.0,
    ..Target::of_text(
        "strike",
        "strike.json, simulated on a pile",
        |bytes| {
            let path = Scratch::folder().write("strike.json", bytes);
            let planned = files::load_planned(path);
            if let Ok(planned) = &planned {
                simulated(planned.scene.as_ref().unwrap_or(&pile()?), &planned.strike)?;
            }
            outcome(planned, &["strike.json"])
        },
        || vec![fixture(STRIKE_FILE), plan().into_bytes()],
        &[JSON],
    )
};

/// A plan, drawn.
pub const PLAN: Target = Target::of_text(
    "plan",
    "plan.json, and its figure",
    |bytes| {
        let plan = files::read_json::<Plan>(&Scratch::folder().write("plan.json", bytes));
        if let Ok(plan) = &plan {
            drop(report::plan_figure(plan));
        }
        outcome(plan, &["plan.json"])
    },
    || vec![plan().into_bytes()],
    &[JSON],
);

/// Proposed strikes for the planner.
pub const PROPOSALS: Target = Target::of_text(
    "proposals",
    "proposed strikes (JSON), aimed at a pile",
    |bytes| {
        let aims = files::read_json::<Vec<Aim>>(&Scratch::folder().write("proposals.json", bytes));
        if let Ok(aims) = &aims {
            let scene = pile()?;
            for aim in aims {
                drop(aimed(&scene, aim));
            }
        }
        outcome(aims, &["proposals.json"])
    },
    || {
        vec![br#"[{"object": "a", "heading_rad": 0.3, "offset_m": 0.01, "speed_m_s": 0.6, "follow_through_m": 0.02}]"#.to_vec()]
    },
    &[JSON],
);

const STRIKE_FILE: &str = "fixtures/demo/pile.strike.json";

/// The files of the demo, with a film and tracks in place of its films.
fn demo() -> Scratch {
    let scratch = Scratch::folder();
    for (name, file) in [
        ("cell.toml", "fixtures/demo/cell.toml"),
        ("objects.toml", "fixtures/demo/objects.toml"),
        ("pile.scene.toml", "fixtures/demo/pile.scene.toml"),
        ("film.mp4", "crates/breakshot/tests/data/footage/b_frames.mp4"),
    ] {
        // Other targets write files of these names in the tests.
        scratch.write(name, &fixture(file));
    }
    scratch.keep("run.csv", b"object,time_s,x_m,y_m\na,0,0.1,0.1\na,0.1,0.2,0.1\n");
    scratch
}

/// The pile of the demo.
fn pile() -> Result<Scene, String> {
    let scene = files::load_scene(repository("fixtures/demo/pile.scene.toml"));
    scene.map(|scene| scene.value).map_err(|e| e.to_string())
}

/// The scene of the demo with a wall and an area that must stay free.
fn walled() -> Vec<u8> {
    let scene = fixture_text("fixtures/demo/pile.scene.toml");
    let walls = "[[walls]]\nfrom_m = [0.2, -0.2]\nto_m = [0.2, 0.2]\nrestitution = 0.5\n";
    scene.replace("[goal]", &format!("{walls}\n[goal]")).into_bytes()
}

/// The demo's strike and scene as a plan.
fn plan() -> String {
    let scene = pile().and_then(|scene| serde_json::to_string(&scene).map_err(|e| e.to_string()));
    format!(
        "{{\"version\": 1, \"method\": \"paper\", \"outcome\": \"found\", \"reason\": \"works\", \"scene\": {}, \"strike\": {}, \
         \"prediction\": null, \"iterations\": []}}",
        scene.unwrap_or_else(|e| panic!("{e}")),
        fixture_text(STRIKE_FILE)
    )
}

/// Simulates a strike; a trajectory without numbers is wrong.
fn simulated(scene: &Scene, strike: &Strike) -> Result<(), String> {
    let Ok(trajectory) = physics::trajectory(scene, demo_properties()?, strike, &physics::Options::default())
    else {
        return Ok(());
    };
    for placed in &scene.placed {
        let pose = trajectory.pose(&placed.object, f64::MAX);
        if pose.is_some_and(|pose| {
            ![pose.position.x, pose.position.y, pose.yaw_rad].iter().all(|x| x.is_finite())
        }) {
            return Err(format!("{} comes to rest at {pose:?}", placed.object));
        }
    }
    Ok(())
}
