//! Simulation of strikes on the pile of the demo.  `cargo bench -p breakshot --bench simulate`

mod demo;

use breakshot::files::load_strike;
use breakshot::geometry::Vec2;
use breakshot::physics::{Options, Simulator, World, rollouts, trajectory};
use breakshot::scene::Strike;
use demo::Demo;
use divan::Bencher;
use divan::counter::ItemsCount;

fn main() {
    divan::main();
}

/// The filmed strike.
fn strike() -> Strike {
    load_strike(demo::folder().join("pile.strike.json")).expect("the strike")
}

/// The final poses after one strike, on one thread.
#[divan::bench]
fn outcome(bencher: Bencher) {
    let demo = Demo::load();
    let strike = strike();
    let world = World::new(&demo.scene, &demo.properties, &Options::default()).expect("a world");
    let mut simulator = Simulator::new();
    bencher.bench_local(|| simulator.run(&world, &strike).expect("an outcome"));
}

/// The same with all events and motions recorded.
#[divan::bench]
fn logged(bencher: Bencher) {
    let demo = Demo::load();
    let (strike, options) = (strike(), Options::default());
    bencher
        .bench_local(|| trajectory(&demo.scene, &demo.properties, &strike, &options).expect("a trajectory"));
}

/// Many strikes on all cores, each shifted by a further micrometre.
#[divan::bench]
fn many(bencher: Bencher) {
    let demo = Demo::load();
    let world = World::new(&demo.scene, &demo.properties, &Options::default()).expect("a world");
    let first = strike();
    let aside =
        |k: u32| Strike { start_m: first.start_m + Vec2::new(0.0, 1e-6 * f64::from(k)), ..first.clone() };
    let strikes: Vec<Strike> = (0..1000).map(aside).collect();
    bencher.counter(ItemsCount::new(strikes.len())).bench_local(|| rollouts(&world, &strikes));
}
