//! `cargo bench -p understudy-reliability`

use divan::Bencher;
use divan::counter::ItemsCount;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use understudy_reliability::{
    ChainBuilder, Level, ThreeState, Unit, at_most_down, birth_death_mttf, product_reliability,
    simulate,
};

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

/// Times to failure of the three-state model.
#[divan::bench]
fn three_state_paths(bencher: Bencher<'_, '_>) {
    let model = ThreeState::new(3, FAILURE_RATE, REPAIR_RATE).expect("a model");
    let mut random = Pcg64::seed_from_u64(1);
    bencher
        .counter(ItemsCount::new(1_000_000_u32))
        .bench_local(|| simulate(&model, 1_000_000, None, 0.95, &mut random).expect("a mean"));
}

fn units() -> Vec<Unit> {
    (0..20)
        .map(|k| {
            Unit::new(
                FAILURE_RATE * (1.0 + f64::from(k) / 10.0),
                1.0 / (20.0 + f64::from(k)),
            )
            .expect("a unit")
        })
        .collect()
}

/// A million states: twenty unequal units that fail together when more than ten are down.
#[divan::bench(sample_count = 1, sample_size = 1)]
fn product_of_twenty_units(bencher: Bencher<'_, '_>) {
    let units = units();
    bencher
        .bench(|| product_reliability(&units, |mask| mask.count_ones() <= 10, 1_000.0).expect("R"));
}

/// Where every state may be passed through.
#[divan::bench]
fn poisson_binomial_of_twenty_units(bencher: Bencher<'_, '_>) {
    let units = units();
    bencher.bench(|| at_most_down(&units, 10, 1_000.0));
}
