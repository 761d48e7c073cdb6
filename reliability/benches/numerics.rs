//! `cargo bench -p understudy-reliability`

use divan::Bencher;
use understudy_reliability::ChainBuilder;

fn main() {
    divan::main();
}

const FAILURE_RATE: f64 = 1e-4;
const REPAIR_RATE: f64 = 1.0 / 24.0;

/// The duplex system of a million pairs, lumped: pairs fail and are repaired one by one, and any degraded one may be the end.
#[divan::bench]
fn duplex_of_a_million_states(bencher: Bencher<'_, '_>) {
    let mut builder = ChainBuilder::new();
    let pairs = 999_999;
    for _ in 0..=pairs {
        builder.state("");
    }
    let failed = builder.failure("failed");
    for degraded in 0..=pairs {
        let (whole, down) = ((pairs - degraded) as f64, degraded as f64);
        if degraded < pairs {
            builder.transition(degraded, degraded + 1, whole * 2.0 * FAILURE_RATE);
        }
        if degraded > 0 {
            builder
                .transition(degraded, degraded - 1, down * REPAIR_RATE)
                .transition(degraded, failed, down * FAILURE_RATE);
        }
    }
    let chain = builder.build().expect("a chain");
    bencher.bench(|| chain.mttf().expect("a mean"));
}
