//! From supervisors to ladders: generation of a large one, and the proof of a reduced one with its plants.

#[path = "../tests/reference_models/mod.rs"]
mod reference_models;

use divan::Bencher;
use reference_models::automaton;
use understudy_supervisor::ladder::{Conversion, InputOutputMap, Mode, Modules, convert};
use understudy_supervisor::proof::{ProofSettings, Verdict, prove};
use understudy_supervisor::{Automaton, Label, State, Transition};

fn main() {
    divan::main();
}

/// A supervisor of `states` states in which each has four events and two commands.
fn large(states: u32) -> Automaton {
    let transitions = (0..states).flat_map(|source| {
        [(0, 1), (2, 7), (4, 101), (6, 1009), (1, 3), (3, 31)].map(|(label, stride)| Transition {
            source: State::new(source),
            label: Label::new(label),
            target: State::new((source + stride) % states),
        })
    });
    Automaton::new("large", [], vec![true; states as usize], transitions.collect())
        .expect("deterministic")
}

#[divan::bench(args = [1_000, 10_000], sample_count = 3)]
fn generation(bencher: Bencher, states: u32) {
    let automaton = large(states);
    let modules = Modules::supervisor(&automaton);
    let map = InputOutputMap::direct("large", &modules.alphabet());
    bencher.bench_local(|| {
        let conversion = convert(&modules, &map, Mode::Automatic).expect("the map fits");
        understudy_ladder::print(&conversion.program)
    });
}

/// A generated ladder of 10,000 and 45,000 states of the supervisor, of which each command waits for a request.
#[divan::bench(sample_count = 1, args = [10_000, 45_000])]
fn proof_of_a_large_one(bencher: Bencher, states: u32) {
    let automaton = large(states);
    let modules = Modules::supervisor(&automaton);
    proof(bencher, "large", &modules, Mode::Requested);
}

/// Proof of the ladder of `modules`.
fn proof(bencher: Bencher, name: &str, modules: &Modules, mode: Mode) {
    let map = InputOutputMap::direct(name, &modules.alphabet());
    let Conversion { program, correspondence, .. } =
        convert(modules, &map, mode).expect("the map fits");
    let settings = ProofSettings { mode, ..ProofSettings::default() };
    bencher.bench_local(|| {
        let verdict = prove(&program, modules, &map, &correspondence, settings);
        match verdict.expect("a verdict") {
            Verdict::Proved(proof) => proof,
            Verdict::Refuted(found) => panic!("{found}"),
        }
    });
}

fn agv(name: &str) -> Automaton {
    automaton("agv", name)
}

/// The AGV's reduced supervisor of 494 states, with the five vehicles that it does not know by itself.
#[divan::bench(sample_count = 1, args = [Mode::Automatic, Mode::Requested])]
fn proof_of_the_agv(bencher: Bencher, mode: Mode) {
    let supervisors = [agv("_SIMSUP")];
    let plants = ["AGV1", "AGV2", "AGV3", "AGV4", "AGV5"].map(agv);
    let modules = Modules { supervisors: &supervisors, plants: &plants };
    proof(bencher, "agv", &modules, mode);
}
