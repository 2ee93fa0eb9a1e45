//! Planning the strike for the demo's pile.  `cargo bench -p breakshot --bench plan`

mod demo;

use breakshot::plan::{Method, Options, Plan, plan, survey};
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

/// The search for what works in most of the worlds that may be.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn robust(bencher: Bencher) {
    planned(bencher, Method::Robust);
}

/// A hundred strikes from all around in a hundred worlds each.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn surveyed(bencher: Bencher) {
    let demo = Demo::load();
    let surveyed =
        || survey(&demo.scene, &demo.properties, &Options::default(), (100, 100)).expect("a survey");
    bencher.counter(ItemsCount::new(100_usize * 100)).bench_local(surveyed);
}
