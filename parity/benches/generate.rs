//! Generation (7)-(9) for 32 programs of 1,000 rungs; the bar is 2 s and 500 MB.

use understudy_logic::{Circuit, CircuitBuilder};
use understudy_parity::generate;

fn main() {
    divan::main();
}

/// Rungs of 4.9 contacts on average: seal-ins that read their neighbours.
fn program(name: String, rungs: usize) -> Circuit {
    let mut builder = CircuitBuilder::new(name);
    let inputs: Vec<_> = (0..rungs).map(|rung| builder.input(format!("u{rung}"))).collect();
    let registers: Vec<_> =
        (0..rungs).map(|rung| builder.register(format!("x{rung}"), false)).collect();
    let mut state: Vec<_> = registers.iter().map(|register| register.1).collect();
    for rung in 0..rungs {
        let [first, second, third] = [1, 7, 31].map(|step| (rung * step + step) % rungs);
        let graph = builder.graph();
        let start = graph.and(inputs[rung], state[first]);
        let either = graph.or(start, state[rung]);
        let not_stop = graph.not(inputs[second]);
        let run = graph.and(either, not_stop);
        let next = if rung % 10 == 0 { run } else { graph.and(run, inputs[third]) };
        state[rung] = next;
        builder.set_next(registers[rung].0, next);
        builder.output(format!("y{rung}"), next);
    }
    builder.finish().expect("names are numbered")
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn thirty_two_programs_of_a_thousand_rungs(bencher: divan::Bencher) {
    let programs: Vec<Circuit> =
        (0..32).map(|number| program(format!("p{number}"), 1_000)).collect();
    bencher.bench(|| generate(&programs));
}
