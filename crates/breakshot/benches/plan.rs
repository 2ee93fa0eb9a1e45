//! Planning the strike for the demo's pile.  `cargo bench -p breakshot --bench plan`

mod demo;

use breakshot::plan::{GridSize, Method, Options, Plan, evaluate_grid, plan};
use demo::Demo;
use divan::Bencher;
use divan::counter::ItemsCount;

fn main() {
    divan::main();
}

fn planned(bencher: Bencher, method: Method) {
    let demo = Demo::load();
    let options = Options { method, ..Options::default() };
    let planned = || -> Plan { plan(&demo.scene, &demo.properties, &options).expect("a plan") };
    bencher.bench_local(planned);
}

/// The paper's search, one simulation a strike.
#[divan::bench]
fn paper(bencher: Bencher) {
    planned(bencher, Method::Paper);
}

/// The search for the strike with the largest success probability.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn robust(bencher: Bencher) {
    planned(bencher, Method::Robust);
}

/// A hundred strikes of the grid in a hundred scenarios each.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn grid(bencher: Bencher) {
    let demo = Demo::load();
    let size = GridSize { strikes: 100, samples: 100 };
    let evaluated =
        || evaluate_grid(&demo.scene, &demo.properties, &Options::default(), size).expect("a grid");
    bencher.counter(ItemsCount::new(size.strikes * size.samples)).bench_local(evaluated);
}
