//! `cargo bench -p understudy-reliability`

use std::fmt::Write;

use divan::Bencher;
use understudy_reliability::{ChainBuilder, answer_chain, read_chain};

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
            builder.transition(degraded, degraded - 1, down * REPAIR_RATE).transition(
                degraded,
                failed,
                down * FAILURE_RATE,
            );
        }
    }
    let chain = builder.build().expect("a chain");
    bencher.bench(|| chain.mttf().expect("a mean"));
}

/// A text of a million states and two million transitions: reading, means, long run. The figure to reach is 2 s.
#[divan::bench(sample_count = 3)]
fn answer_about_a_text_of_a_million_states(bencher: Bencher<'_, '_>) {
    const STATES: usize = 1_000_000;
    let mut text = String::from("u = 2 / 10000h\nr = 1 / 24h\n");
    for state in 0..STATES {
        let _ = writeln!(text, "state s{state:x}");
    }
    text.push_str("state failed failure\n");
    for state in 0..STATES {
        let rest = STATES - state;
        let _ = match state {
            0 => writeln!(text, "s0 -> s1 : {rest}*u"),
            _ if rest == 1 => writeln!(text, "s{state:x} -> failed : u"),
            _ => writeln!(
                text,
                "s{state:x}->s{:x}:{rest}*u\ns{state:x}->s{:x}:{state}*r",
                state + 1,
                state - 1
            ),
        };
        if state % 16 == 1 {
            let _ = writeln!(text, "s{state:x}->failed:{state}*u");
        }
    }
    bencher.with_inputs(|| text.clone()).bench_values(|text| {
        let read = read_chain("million.chain", text);
        let chain = read.chain.expect("a chain");
        answer_chain(&chain, None).expect("an answer").to_text()
    });
}
