//! Simulates files of small piles and prints the number of rollouts per second.
//!
//! ```text
//! scene KIND NUMBER
//! striker RADIUS X Y SPEED TRAVEL E F           moves along +x, is lifted after TRAVEL
//! disc MASS MU E F X Y YAW RADIUS C
//! poly MASS MU E F X Y YAW C INERTIA N x1 y1 x2 y2 ...      corner points about the centroid
//! end
//! ```
//!
//! SI units; restitution of a pair is `E_i E_j`, contact friction `F_i F_j`, C the mean distance of the support from the
//! centroid.  An object's name is its line number within the scene, from 0.
//!
//! `cargo run --release --example scenes -- FILE [--repeat N] [--final OUT.csv] [--impact stronge|newton|poisson]
//! [--touching compliant|linear|pairwise] [--spin coupled|decoupled] [--hash]`
//!
//! `--hash` also prints a hash of every bit of the outcomes of many strikes on each pile, simulated in parallel: it is the
//! same in debug and release builds and for any number of threads (`RAYON_NUM_THREADS`).  Equal objects are copies of one
//! object.
//!
//! Each repeat shifts the striker by a new offset of up to a micrometre, so that no result can be reused.

use breakshot::cell::{Cell, Striker, Workspace};
use breakshot::geometry::{Point, Pose};
use breakshot::object::{Marker, Object, Shape, pair_key};
use breakshot::physics::{
    AfterStrike, Compliance, ContactForce, ImpactLaw, MultipleImpact, Options, Simulator, Spin, World,
    rollouts,
};
use breakshot::properties::Properties;
use breakshot::scene::{Goal, Placed, Scene, Strike};
use breakshot::uncertain::Estimate;
use std::error::Error;
use std::fmt::Write;

/// One scene of a file.
struct Pile {
    number: String,
    scene: Scene,
    properties: Properties,
    strike: Strike,
    /// Square roots of the contact frictions: striker, then objects.
    roughness: Vec<f64>,
    /// Square roots of the restitutions: striker, then objects.
    bounce: Vec<f64>,
    /// Mass, friction, restitution and contact friction of each kind; copies have the same values and the same outline.
    kinds: Vec<[f64; 4]>,
}

type Answer<T> = Result<T, Box<dyn Error>>;

impl Pile {
    fn new(number: &str) -> Self {
        let cell =
            Cell::from_above(1000.0, Workspace::centred([20.0, 20.0]), Striker::rod(1.0, [0.01, 10.0]));
        let (objects, placed, walls, keep_out) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let goal = Goal::default();
        let scene = Scene { cell, objects, observed_unix_s: None, placed, walls, keep_out, goal };
        let strike =
            Strike { object: None, start_m: Point::ORIGIN, heading_rad: 0.0, speed_m_s: 1.0, travel_m: 1.0 };
        let properties = Properties { version: 1, reference: "0".into(), ..Properties::default() };
        Self {
            number: number.into(),
            scene,
            properties,
            strike,
            roughness: vec![0.0],
            bounce: vec![1.0],
            kinds: Vec::new(),
        }
    }

    fn striker(&mut self, n: &[f64]) {
        self.scene.cell.striker.shape = Shape::Disc { radius_m: n[0] };
        self.strike = Strike {
            start_m: Point::new(n[1], n[2]),
            speed_m_s: n[3],
            travel_m: n[4],
            ..self.strike.clone()
        };
        (self.bounce[0], self.roughness[0]) = (n[5], n[6]);
    }

    fn object(&mut self, n: &[f64], shape: Shape) {
        let number = self.scene.placed.len();
        let kind = [n[0], n[1], n[2], n[3]];
        let like =
            self.kinds.iter().zip(&self.scene.objects).position(|(k, o)| *k == kind && o.shape == shape);
        let name = like.map_or_else(
            || number.to_string(),
            |like| format!("{}#{}", self.scene.objects[like].name, number + 1),
        );
        if like.is_none() {
            self.new_kind(&name, kind, shape);
        }
        self.roughness.push(n[3]);
        self.scene.placed.push(Placed { object: name, position_m: Point::new(n[4], n[5]), yaw_rad: n[6] });
    }

    fn new_kind(&mut self, name: &str, kind: [f64; 4], shape: Shape) {
        let [mass, friction, bounce, _] = kind;
        let p = &mut self.properties;
        p.mass_ratio.insert(name.into(), Estimate::exact(mass));
        p.friction.insert(name.into(), Estimate::exact(friction));
        p.striker_restitution.insert(name.into(), Estimate::exact(self.bounce[0] * bounce));
        self.bounce.push(bounce);
        self.kinds.push(kind);
        let marker = Some(Marker::centred(Shape::Disc { radius_m: 0.001 }));
        self.scene.objects.push(Object {
            name: name.into(),
            shape,
            height_m: 0.03,
            marker,
            mass_kg: None,
            support: None,
        });
        for (other, restitution_of_other) in self.scene.objects.iter().zip(&self.bounce[1..]) {
            p.restitution.insert(pair_key(name, &other.name), Estimate::exact(restitution_of_other * bounce));
        }
    }

    /// The strike, shifted by a new offset.
    fn shifted(&self, k: usize) -> Strike {
        let mut strike = self.strike.clone();
        strike.start_m.y += offset_m(k);
        strike
    }

    fn world(&self, options: &Options) -> Answer<World> {
        let mut world = World::new(&self.scene, &self.properties, options)?;
        let names = world.names().to_vec();
        for (i, one) in names.iter().enumerate() {
            world.set_striker_contact_friction(one, self.roughness[0] * self.roughness[1 + i])?;
            for (k, other) in names[..i].iter().enumerate() {
                world.set_contact_friction(one, other, self.roughness[1 + i] * self.roughness[1 + k])?;
            }
        }
        Ok(world)
    }
}

fn piles(text: &str) -> Answer<Vec<Pile>> {
    let mut piles: Vec<Pile> = Vec::new();
    for (line, words) in
        text.lines().enumerate().map(|(k, l)| (k + 1, l.split_whitespace().collect::<Vec<_>>()))
    {
        let Some((&what, rest)) = words.split_first() else { continue };
        if what == "scene" {
            piles.push(Pile::new(rest.get(1).ok_or("a scene without a number")?));
            continue;
        }
        let n: Vec<f64> = rest.iter().map(|w| w.parse()).collect::<Result<_, _>>()?;
        let pile = piles.last_mut().ok_or("the first line is not `scene`")?;
        match what {
            "striker" if n.len() == 7 => pile.striker(&n),
            "disc" if n.len() == 9 => pile.object(&n, Shape::Disc { radius_m: n[7] }),
            "poly" if n.len() > 9 && n.len() == 10 + 2 * n[9] as usize => {
                let points_m = n[10..].chunks(2).map(|p| Point::new(p[0], p[1])).collect();
                pile.object(&n, Shape::Polygon { points_m });
            }
            "end" => {}
            _ => return Err(format!("line {line}: not a scene's line: {what}").into()),
        }
    }
    Ok(piles)
}

struct Arguments {
    file: String,
    repeat: usize,
    hash: bool,
    final_csv: Option<String>,
    options: Options,
}

fn arguments() -> Answer<Arguments> {
    let mut words = std::env::args().skip(1);
    let mut found = Arguments {
        file: String::new(),
        repeat: 1,
        hash: false,
        final_csv: None,
        options: Options { after_strike: AfterStrike::Lift, ..Options::default() },
    };
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or_else(|| format!("{word} needs a value"));
        match word.as_str() {
            "--repeat" => found.repeat = value()?.parse()?,
            "--final" => found.final_csv = Some(value()?),
            "--impact" => {
                found.options.impact = match value()?.as_str() {
                    "stronge" => ImpactLaw::Stronge,
                    "newton" => ImpactLaw::Newton,
                    "poisson" => ImpactLaw::Poisson,
                    "paper" => ImpactLaw::Paper,
                    other => return Err(format!("no impact law {other}").into()),
                }
            }
            "--touching" => {
                found.options.multiple_impact = match value()?.as_str() {
                    "compliant" => MultipleImpact::default(),
                    "linear" => MultipleImpact::Compliant(Compliance {
                        force: ContactForce::Linear,
                        ..Compliance::default()
                    }),
                    "pairwise" => MultipleImpact::Pairwise,
                    other => return Err(format!("no law of multiple impacts {other}").into()),
                }
            }
            "--spin" => {
                found.options.spin = match value()?.as_str() {
                    "coupled" => Spin::Coupled,
                    "decoupled" => Spin::Decoupled,
                    other => return Err(format!("no spin law {other}").into()),
                }
            }
            "--hash" => found.hash = true,
            file => found.file = file.into(),
        }
    }
    if found.file.is_empty() { Err("which scene file?".into()) } else { Ok(found) }
}

/// CPU time of this thread (s); wall-clock time on systems without it.
#[allow(clippy::disallowed_types, clippy::disallowed_methods)]
fn cpu_s() -> f64 {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    let wall_s = START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64();
    let on_cpu = std::fs::read_to_string("/proc/self/schedstat").ok();
    let nanoseconds = on_cpu.and_then(|s| s.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or(wall_s, |ns| ns * 1e-9)
}

/// Offsets that never repeat (m): the fractional parts of multiples of the golden ratio.
fn offset_m(k: usize) -> f64 {
    1e-6 * (2.0 * (k as f64 * 0.618_033_988_749_894_9).fract() - 1.0)
}

/// Number of strikes on each pile that enter the hash.
const HASHED_STRIKES: usize = 24;

/// A hash (FNV-1a) of every bit of many outcomes.
fn hash(piles: &[Pile], worlds: &[World]) -> Answer<u64> {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for (pile, world) in piles.iter().zip(worlds) {
        let strikes: Vec<Strike> = (0..HASHED_STRIKES).map(|k| pile.shifted(k)).collect();
        for outcome in rollouts(world, &strikes) {
            let outcome = outcome?;
            let poses = outcome.poses.iter().flat_map(|p| [p.position.x, p.position.y, p.yaw_rad]);
            let numbers = poses.chain([outcome.duration_s]).map(f64::to_bits);
            for byte in numbers.chain([outcome.impacts as u64]).flat_map(u64::to_le_bytes) {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        }
    }
    Ok(hash)
}

fn main() -> Answer<()> {
    let arguments = arguments()?;
    let piles = piles(&std::fs::read_to_string(&arguments.file)?)?;
    let worlds: Vec<World> = piles.iter().map(|p| p.world(&arguments.options)).collect::<Result<_, _>>()?;
    let mut simulator = Simulator::new();
    if let Some(path) = &arguments.final_csv {
        let mut csv = String::from("scene,object,x_m,y_m,yaw_rad\n");
        for (pile, world) in piles.iter().zip(&worlds) {
            for (k, Pose { position, yaw_rad }) in
                simulator.run(world, &pile.strike)?.poses.iter().enumerate()
            {
                writeln!(csv, "{},{k},{},{},{yaw_rad}", pile.number, position.x, position.y)?;
            }
        }
        std::fs::write(path, csv)?;
    }
    let (mut impacts, start_s) = (0, cpu_s());
    for k in 0..arguments.repeat {
        for (pile, world) in piles.iter().zip(&worlds) {
            let strike = pile.shifted(k * worlds.len() + impacts % 7);
            impacts += simulator.run(world, &strike)?.impacts;
        }
    }
    let rollouts = (arguments.repeat * piles.len()) as f64;
    let (rate, mean) = (rollouts / (cpu_s() - start_s), impacts as f64 / rollouts);
    println!("scenes={} rollouts_per_cpu_s={rate:.0} impacts_per_rollout={mean:.2}", piles.len());
    if arguments.hash {
        println!("hash={:016x}", hash(&piles, &worlds)?);
    }
    Ok(())
}
