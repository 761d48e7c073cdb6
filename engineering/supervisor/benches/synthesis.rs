//! Synthesis: the explicit engine, the symbolic one, reduction and minimisation, each with its figure.

#[path = "../tests/automata/families.rs"]
mod families;
#[path = "../tests/reference_models/mod.rs"]
mod models;

use divan::counter::ItemsCount;
use divan::{AllocProfiler, Bencher, black_box};
use families::{line, philosophers, workshop};
use models::Model;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use understudy_supervisor::operations::{compare_effects, condat, minstate, supreduce, sync};
use understudy_supervisor::{
    Automaton, Bounds, Label, State, SymbolicBounds, Transition, synthesise,
    synthesise_symbolically,
};

/// So that memory is measured beside time.
#[global_allocator]
static ALLOCATOR: AllocProfiler = AllocProfiler::system();

fn main() {
    divan::main();
}

fn references(automata: &[Automaton]) -> Vec<&Automaton> {
    automata.iter().collect()
}

/// Product states a second; the figure to reach is 2 million. 200 thousand, 2 million and 15 million states.
#[divan::bench(args = [(6, 4), (7, 4), (7, 6)], sample_count = 1, sample_size = 1)]
fn product_states(bencher: Bencher<'_, '_>, (machines, capacity): (u32, u32)) {
    let (plants, buffers) = line(machines, capacity);
    let all: Vec<&Automaton> = plants.iter().chain(&buffers).collect();
    let bounds = Bounds { memory_bytes: 8_000_000_000 };
    let states = 2_usize.pow(machines) * (capacity as usize + 1).pow(machines - 1);
    bencher.counter(ItemsCount::new(states)).bench_local(|| {
        assert_eq!(sync(black_box(&all), bounds).expect("it fits").state_count(), states)
    });
}

/// The figure to reach is 50 ms.
#[divan::bench]
fn supcon_of_the_guided_vehicles(bencher: Bencher<'_, '_>) {
    let model = Model::read("agv");
    bencher.bench_local(|| synthesise(&model.plants(), &model.specifications(), Bounds::default()));
}

/// The figure to reach is 1 s.
#[divan::bench(sample_count = 5)]
fn supreduce_of_the_guided_vehicles(bencher: Bencher<'_, '_>) {
    let model = Model::read("agv");
    let plant = sync(&model.plants(), Bounds::default()).expect("it fits");
    let supervisor = model.file("_SUPER");
    bencher.bench_local(|| supreduce(&plant, &supervisor, Bounds::default()));
}

#[divan::bench]
fn condat_of_the_guided_vehicles(bencher: Bencher<'_, '_>) {
    let model = Model::read("agv");
    let plant = sync(&model.plants(), Bounds::default()).expect("it fits");
    let supervisor = model.file("_SUPER");
    bencher.bench_local(|| condat(&plant, &supervisor, Bounds::default()));
}

/// Ten times the states should take little more than ten times the time.
#[divan::bench(args = [(5, 4), (6, 4)], sample_count = 3)]
fn minimal_states(bencher: Bencher<'_, '_>, (machines, capacity): (u32, u32)) {
    let (plants, buffers) = line(machines, capacity);
    let all: Vec<&Automaton> = plants.iter().chain(&buffers).collect();
    let product = sync(&all, Bounds::default()).expect("it fits");
    bencher
        .counter(ItemsCount::new(product.state_count()))
        .bench_local(|| minstate(black_box(&product)));
}

/// line(20, 10) has 2 * 21^19 states; the figure to reach is 60 s.
#[divan::bench(args = [(10, 5), (20, 10)], sample_count = 1, sample_size = 1)]
fn symbolic_lines(bencher: Bencher<'_, '_>, (machines, capacity): (u32, u32)) {
    let (plants, buffers) = line(machines, capacity);
    bencher.bench_local(|| {
        let bounds = SymbolicBounds::default();
        let made = synthesise_symbolically(&references(&plants), &references(&buffers), bounds);
        let states = made.expect("it fits").state_count();
        assert_eq!(states, Some(2 * (2 * u128::from(capacity) + 1).pow(machines - 1)));
    });
}

/// Philosophers share their forks; 30 of them and their forks have more than 10^12 states. The figure to reach is 60 s.
#[divan::bench(args = [10, 30], sample_count = 1, sample_size = 1)]
fn symbolic_shared_resources(bencher: Bencher<'_, '_>, count: u32) {
    let automata = philosophers(count);
    bencher.bench_local(|| {
        let made = synthesise_symbolically(&references(&automata), &[], SymbolicBounds::default());
        let states = made.expect("it fits").state_count();
        assert!(count < 30 || states > Some(1_000_000_000_000));
        states
    });
}

/// 12,807 states with 39 events, and 43,800 with 40; the figure to reach is 30 s.
#[divan::bench(args = [(3, 4, 1), (4, 3, 1)], sample_count = 1, sample_size = 1)]
fn supreduce_of_a_workshop(bencher: Bencher<'_, '_>, (machines, kinds, capacity): (u32, u32, u32)) {
    let (plants, specifications) = workshop(machines, kinds, capacity);
    let plants = references(&plants);
    let made = synthesise(&plants, &references(&specifications), Bounds::default());
    let supervisor = made.expect("it fits").supervisor;
    let plant = sync(&plants, Bounds::default()).expect("it fits");
    bencher.bench_local(|| supreduce(&plant, &supervisor, Bounds::default()));
}

/// A plant without any structure, in which each state has `events / 3` random events with random targets, and a supervisor that disables
/// one of ten that are controllable. Every pair of states is tried; the figure to reach is 30 s.
#[divan::bench(args = [(20_000, 60), (50_000, 30)], sample_count = 1, sample_size = 1)]
fn supreduce_of_random_plants(bencher: Bencher<'_, '_>, (states, events): (u32, u32)) {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut transitions = Vec::new();
    for source in (0..states).map(State::new) {
        for label in (0..events).map(Label::new) {
            if random.random_ratio(1, 3) {
                let target = State::new(random.random_range(0..states));
                let is_allowed = !label.is_controllable() || random.random_ratio(9, 10);
                let transition = Transition { source, label, target };
                transitions.push((transition, is_allowed));
            }
        }
    }
    let automaton = |name: &str, transitions: Vec<Transition>| {
        let marked = vec![true; states as usize];
        Automaton::new(name, [], marked, transitions).expect("deterministic")
    };
    let all = transitions.iter().map(|(transition, _)| *transition);
    let plant = automaton("plant", all.collect());
    let allowed = transitions.iter().filter(|(_, is_allowed)| *is_allowed);
    let supervisor = automaton("supervisor", allowed.map(|(transition, _)| *transition).collect());
    bencher.bench_local(|| supreduce(&plant, &supervisor, Bounds::default()));
}

/// The check that follows each reduction.
#[divan::bench(sample_count = 3)]
fn effects_of_a_workshop(bencher: Bencher<'_, '_>) {
    let (plants, specifications) = workshop(4, 3, 1);
    let plants = references(&plants);
    let made = synthesise(&plants, &references(&specifications), Bounds::default());
    let supervisor = made.expect("it fits").supervisor;
    let plant = sync(&plants, Bounds::default()).expect("it fits");
    bencher.bench_local(|| compare_effects(&plant, &supervisor, &supervisor, Bounds::default()));
}
