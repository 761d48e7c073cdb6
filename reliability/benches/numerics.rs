//! `cargo bench -p understudy-reliability`

use divan::Bencher;
use understudy_reliability::{ChainBuilder, Level, birth_death_mttf};

fn main() {
    divan::main();
}

const FAILURE_RATE: f64 = 1e-4;
const REPAIR_RATE: f64 = 1.0 / 24.0;

fn level(pairs: f64, degraded: f64) -> Level {
    Level {
        up: (pairs - degraded) * 2.0 * FAILURE_RATE,
        down: degraded * REPAIR_RATE,
        lethal: degraded * FAILURE_RATE,
    }
}

/// The duplex system of a million pairs, lumped.
#[divan::bench]
fn duplex_of_a_million_states(bencher: Bencher<'_, '_>) {
    bencher.bench(|| birth_death_mttf(1_000_000, |k| level(999_999.0, k as f64)).expect("a mean"));
}

/// The same as a chain of any shape, already in memory.
#[divan::bench]
fn duplex_of_a_million_states_as_a_chain(bencher: Bencher<'_, '_>) {
    let mut builder = ChainBuilder::new();
    let pairs = 999_999;
    for _ in 0..=pairs {
        builder.state("");
    }
    let failed = builder.failure("failed");
    for k in 0..=pairs {
        let level = level(pairs as f64, k as f64);
        if k < pairs {
            builder.transition(k, k + 1, level.up);
        }
        if k > 0 {
            builder
                .transition(k, k - 1, level.down)
                .transition(k, failed, level.lethal);
        }
    }
    let chain = builder.build().expect("a chain");
    bencher.bench(|| chain.mttf().expect("a mean"));
}
