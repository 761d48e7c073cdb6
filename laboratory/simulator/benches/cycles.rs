//! How many cycles of the press cell one core simulates in a second; the bar is 200,000.

#[path = "../tests/press_cell/mod.rs"]
mod press_cell;

use understudy_cycle::Mode;
use understudy_simulator::{Network, Simulation};

const CYCLES: u64 = 20_000;

fn main() {
    divan::main();
}

/// Divan prints this as items a second: an item is one cycle of the whole cell.
#[divan::bench]
fn press_cell_cycles(bencher: divan::Bencher<'_, '_>) {
    bencher
        .counter(divan::counter::ItemsCount::new(CYCLES))
        .with_inputs(|| Simulation::new(press_cell::parts(Mode::Full, 1), Network::default(), 1))
        .bench_values(|mut simulation| {
            simulation.run(CYCLES, 100, &mut |_, _, _, _| {}).expect("the cluster gets ready");
            assert_eq!(simulation.violations(), []);
        });
}
