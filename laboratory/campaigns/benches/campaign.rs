//! How long 1,000 failures of the simulated press cell take at MTBF/MTTR = 50 and an MTTR of 50 cycles; the bar is 120 s on two cores.

use understudy_campaigns::{CampaignPlan, run_campaign};
use understudy_cycle::Mode;
use understudy_testing::press_cell;

const FAILURES: u64 = 1_000;

fn main() {
    divan::main();
}

/// Divan prints the whole time, and failures a second as items.
#[divan::bench(sample_count = 1, sample_size = 1)]
fn a_thousand_failures_of_the_press_cell(bencher: divan::Bencher<'_, '_>) {
    let cell = press_cell(Mode::Full);
    let plan = CampaignPlan {
        mtbf_cycles: 2_500.0,
        mttr_cycles: 50.0,
        crews: None,
        acceleration: 1.0,
        failures: FAILURES,
        seed: 1,
        maximum_cycles: u64::MAX,
        threads: 2,
        remote_io: None,
        network: None,
    };
    bencher
        .counter(divan::counter::ItemsCount::new(FAILURES))
        .bench_local(|| run_campaign(&cell, &plan, &mut |_| {}).expect("the cell comes into step"));
}
