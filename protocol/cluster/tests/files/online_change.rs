//! Online changes of ladders: what did not change goes on as if nothing had happened.

use std::sync::Arc;

use proptest::prelude::*;
use understudy_cluster::{ChangeTexts, Cluster, Code, NeedsStop, OnlineChanges, Way, fates};
use understudy_cycle::{OnlineChange, ProgramChange};
use understudy_executable::{Executable, Scratch};
use understudy_ladder::{Coil, CoilKind, Contact, ContactKind, Element, Rung, Signal, print};
use understudy_testing::random::{Dice, random_program};
use understudy_typed::{CarriedPath, Fate, Machine, Program};

use crate::common::{findings, load};

fn cluster(file: &str, text: &str) -> Cluster {
    let cluster = format!(
        "[cluster]\nname = \"cell\"\nperiod = \"100ms\"\n[[controller]]\nname = \"one\"\nladder = \"{file}\"\n"
    );
    let loaded = load(&cluster, &[(file, text)]);
    let found = findings(&loaded.reports);
    loaded.cluster.unwrap_or_else(|| panic!("{found}\n{text}"))
}

fn change(file: &str, before: &str, after: &str) -> Result<OnlineChange, Vec<NeedsStop>> {
    let [before, after] = [before, after].map(|text| cluster(file, text));
    let texts = ChangeTexts::between(&before, &after)?;
    Ok(texts.load(&before).expect("a change of this cluster"))
}

/// A program that runs.
struct Running<'a> {
    executable: &'a Executable,
    state: Vec<u64>,
}

impl<'a> Running<'a> {
    fn new(executable: &'a Executable) -> Self {
        Self { executable, state: executable.initial().to_vec() }
    }

    /// Its outputs in a scan.
    fn step(&mut self, inputs: &[u64]) -> Vec<u64> {
        let mut outputs = vec![0; self.executable.output_count().div_ceil(64)];
        let scratch = &mut Scratch::default();
        self.executable.step(scratch, &mut self.state, inputs, &mut outputs);
        outputs
    }
}

/// One more rung at a random place, which no other rung reads.
fn with_a_rung(seed: u64) -> (String, String) {
    let mut program = random_program(seed, 6);
    let before = print(&program);
    let mut dice = Dice::new(!seed);
    program.memory.push(Signal::new("extra"));
    let operand = program.inputs[dice.below(program.inputs.len())].name.clone();
    let kinds = [ContactKind::NormallyOpen, ContactKind::Rising, ContactKind::Falling];
    let kind = kinds[dice.below(kinds.len())];
    let rung = Rung {
        network: vec![Element::Contact(Contact { kind, operand })],
        coils: vec![Coil { kind: CoilKind::Set, target: "extra".into() }],
        ..Rung::default()
    };
    let place = dice.below(program.rungs.len() + 1);
    program.rungs.insert(place, rung);
    (before, print(&program))
}

/// A program that changes there and back at random, beside one that does not: their outputs are equal.
fn check(change: &ProgramChange, seed: u64, about: &str) {
    let mut dice = Dice::new(seed);
    let mut inputs = vec![0_u64; change.before.executable.input_count().div_ceil(64)];
    let mut alone = Running::new(&change.before.executable);
    let mut changed = Running::new(&change.before.executable);
    let mut is_new = false;
    for scan in 0..120 {
        if dice.rarely(30) {
            let conversion = if is_new { &change.back } else { &change.forward };
            let to = if is_new { &change.before } else { &change.after };
            is_new = !is_new;
            let state = conversion.convert(&changed.state);
            changed = Running { executable: &to.executable, state };
        }
        // Inputs that stay for a while let timers end.
        if dice.rarely(3) {
            let place = dice.below(change.before.executable.input_count());
            inputs[place / 64] ^= 1 << (place % 64);
        }
        let (wanted, found) = (alone.step(&inputs), changed.step(&inputs));
        assert_eq!(found, wanted, "scan {scan}, seed {seed}\n{about}");
    }
}

/// Whether the program could change while it ran.
fn goes_on(seed: u64) -> bool {
    let (before, after) = with_a_rung(seed);
    let change = match change("one.ladder", &before, &after) {
        Ok(change) => change,
        Err(reasons) => {
            assert!(matches!(reasons[..], [NeedsStop::Unfit(_)]), "{reasons:?}\n{after}");
            return false;
        }
    };
    let [change] = &change.programs[..] else {
        // A rung that has no effect makes no other program.
        return false;
    };
    check(change, seed, &after);
    true
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rungs_that_did_not_change_go_on(seed: u64) {
        goes_on(seed);
    }
}

#[test]
fn most_programs_can_change() {
    let count = (0..60).filter(|&seed| goes_on(seed)).count();
    assert!(count > 20, "{count} of 60");
}

/// What a contact for edges of a drawn ladder has seen is not seen again.
#[test]
fn a_drawn_ladder_goes_on() {
    let before = include_str!("../../../../examples/plcopen/pump.xml");
    let after = before.replace("<expression>100</expression>", "<expression>101</expression>");
    let change = change("one.xml", before, &after).expect("an online change");
    for seed in 0..20 {
        check(&change.programs[0], seed, "pump");
    }
}

/// The outputs of a ladder whose text changes after some scans.
fn outputs(before: &str, after: &str, at: usize, inputs: &[u64]) -> Vec<u64> {
    let change = change("one.ladder", before, after).expect("an online change");
    let change = &change.programs[0];
    let mut running = Running::new(&change.before.executable);
    let mut outputs = Vec::new();
    for (scan, &inputs) in inputs.iter().enumerate() {
        if scan == at {
            let state = change.forward.convert(&running.state);
            running = Running { executable: &change.after.executable, state };
        }
        outputs.push(running.step(&[inputs])[0]);
    }
    outputs
}

/// As the timers of other systems: what is over stays over, and what runs is over where its time was longer than the new preset.
#[test]
fn a_timer_with_another_preset_goes_on() {
    let text = |block: &str, preset: u32| {
        format!("program one\ninput a\noutput y\nrung\n    a {{{block} t {preset}ms}} ( y )\n")
    };
    for (block, [before, after], at, inputs, wanted) in [
        // Runs on, to the new preset.
        ("TON", [500, 800], 3, [1; 10], [0, 0, 0, 0, 0, 0, 0, 0, 1, 1]),
        // Is over at once.
        ("TON", [800, 200], 4, [1; 10], [0, 0, 0, 0, 1, 1, 1, 1, 1, 1]),
        // Was over.
        ("TON", [200, 800], 4, [1; 10], [0, 0, 1, 1, 1, 1, 1, 1, 1, 1]),
        // A pulse does not come back.
        ("TP", [200, 800], 4, [1; 10], [1, 1, 0, 0, 0, 0, 0, 0, 0, 0]),
        ("TP", [500, 200], 3, [1; 10], [1, 1, 1, 0, 0, 0, 0, 0, 0, 0]),
        ("TOF", [500, 300], 3, [1, 0, 0, 0, 0, 0, 0, 0, 0, 0], [1, 1, 1, 1, 0, 0, 0, 0, 0, 0]),
        ("TOF", [200, 800], 5, [1, 0, 0, 0, 0, 0, 0, 0, 0, 0], [1, 1, 1, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        let found = outputs(&text(block, before), &text(block, after), at, &inputs);
        assert_eq!(found, wanted, "{block} from {before} to {after} ms");
    }
}

/// The counter had counted past the preset that the new program has.
#[test]
fn a_counter_with_a_lower_preset_is_full() {
    let text = |preset: u32| {
        format!(
            "program one\ninput a\ninput r\noutput y\nrung\n    a {{CTU c {preset} R=r}} ( y )\n"
        )
    };
    let found = outputs(&text(9), &text(3), 8, &[1, 0, 1, 0, 1, 0, 1, 0, 0, 1, 2, 0]);
    assert_eq!(found, [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0]);
}

/// A program that a naive reference executes: statement by statement, on all its variables.
struct Reference<'a> {
    program: &'a Program,
    machine: Machine,
    state: Vec<u64>,
}

impl<'a> Reference<'a> {
    fn new(program: &'a Program) -> Self {
        Self { program, machine: Machine::new(program), state: program.initial_state() }
    }

    fn step(&mut self, inputs: &[u64]) -> Vec<u64> {
        let mut outputs = vec![0; self.machine.output_count().div_ceil(64)];
        let scratch = &mut understudy_typed::Scratch::default();
        self.machine.step(scratch, &mut self.state, inputs, &mut outputs);
        outputs
    }

    /// Another program with the slots of all variables of the same names.
    fn changed<'b>(&self, to: &'b Program) -> Reference<'b> {
        let mut changed = Reference::new(to);
        let header = Program::HEADER as usize;
        changed.state[..header].copy_from_slice(&self.state[..header]);
        for variable in &to.variables {
            let mut known = self.program.variables.iter();
            if let Some(old) = known.find(|old| old.name == variable.name) {
                let slots = variable.of.slots() as usize;
                let (from, to) = (old.slot as usize, variable.slot as usize);
                changed.state[to..to + slots].copy_from_slice(&self.state[from..from + slots]);
            }
        }
        changed
    }
}

/// One more rung at a random place, which reads a signal or an output of a block that may be read by no other rung: what is read is what the
/// old program had computed.
#[test]
fn a_rung_that_is_added_reads_what_the_old_program_had_computed() {
    let (mut changes, mut newly_read) = (0, 0);
    for seed in 0..300 {
        let mut program = random_program(seed, 6);
        let before = print(&program);
        let mut dice = Dice::new(!seed);
        let signals = program.writable().map(|signal| signal.name.to_string());
        let blocks = program.blocks();
        let pins = blocks.iter().flat_map(|block| {
            let pins = block.kind.outputs().iter();
            pins.map(|pin| format!("{}.{pin}", block.name))
        });
        let read: Vec<String> = signals.chain(pins).collect();
        let contact = |kind, operand: String| {
            Element::Contact(Contact { kind, operand: operand.as_str().into() })
        };
        let input = program.inputs[dice.below(program.inputs.len())].name.to_string();
        let seal = vec![
            vec![contact(ContactKind::NormallyOpen, input.clone())],
            vec![contact(ContactKind::NormallyOpen, dice.pick(&read))],
        ];
        let target = program.outputs[dice.below(program.outputs.len())].name.clone();
        let rung = Rung {
            network: vec![Element::Branches(seal), contact(ContactKind::NormallyClosed, input)],
            coils: vec![Coil { kind: CoilKind::Plain, target }],
            ..Rung::default()
        };
        program.rungs.insert(dice.below(program.rungs.len() + 1), rung);
        let after = print(&program);
        let clusters = [&before, &after].map(|text| cluster("one.ladder", text));
        let codes = clusters.each_ref().map(|cluster| &cluster.controllers()[0].code);
        let Ok(change) = change("one.ladder", &before, &after) else { continue };
        let [change] = &change.programs[..] else { continue };
        changes += 1;
        let lost = |path: &CarriedPath| path.fate == Fate::Dropped;
        let fates = fates(codes[0], codes[1], Way::There);
        assert!(!fates.iter().any(lost), "seed {seed}: {fates:?}\n{before}to\n{after}");
        let registers = |code: &Code| code.circuit().map_or(0, |of| of.registers().len());
        newly_read += u32::from(registers(codes[1]) > registers(codes[0]));
        let mut running = Running::new(&change.before.executable);
        let mut reference = Reference::new(codes[0].typed());
        let mut inputs = vec![0_u64; change.before.executable.input_count().div_ceil(64)];
        let switch = dice.below(40);
        for scan in 0..80 {
            if scan == switch {
                let state = change.forward.convert(&running.state);
                running = Running { executable: &change.after.executable, state };
                reference = reference.changed(codes[1].typed());
            }
            if dice.rarely(2) {
                let place = dice.below(change.before.executable.input_count());
                inputs[place / 64] ^= 1 << (place % 64);
            }
            let (wanted, found) = (reference.step(&inputs), running.step(&inputs));
            assert_eq!(
                found, wanted,
                "scan {scan}, switch {switch}, seed {seed}\n{before}to\n{after}"
            );
        }
    }
    assert!(changes > 100 && newly_read > 20, "{changes} changes, {newly_read} newly read");
}

/// The motor runs, and the rung that is added holds it.
#[test]
fn a_seal_in_that_is_added_holds_what_runs() {
    let text = |rung: &str| {
        format!("program one\ninput start\ninput stop\noutput motor\nrung\n    {rung} ( motor )\n")
    };
    let found =
        outputs(&text("start /stop"), &text("[ start | motor ] /stop"), 2, &[1, 1, 0, 0, 2, 0]);
    assert_eq!(found, [1, 1, 1, 1, 0, 0]);
}

/// A chart that is the body of a PROGRAM goes on in its active step, in a program that is alone and in one of several.
#[test]
fn a_chart_goes_on_in_its_active_step() {
    let text = |more: &str, ends: &str| {
        format!(
            "PROGRAM one\nVAR_INPUT a, b : BOOL; END_VAR\nVAR_OUTPUT y : BOOL; END_VAR\n\
             INITIAL_STEP idle: END_STEP\nSTEP work: y(N); END_STEP\n\
             TRANSITION FROM idle TO work := a; END_TRANSITION\n\
             TRANSITION FROM work TO idle := {ends}; END_TRANSITION\nEND_PROGRAM\n{more}"
        )
    };
    let several = "PROGRAM two\nVAR_INPUT c : BOOL; END_VAR\nVAR_OUTPUT z : BOOL; END_VAR\nz := c;\nEND_PROGRAM\n\
                   CONFIGURATION c RESOURCE r ON PLC TASK t(INTERVAL := T#100ms, PRIORITY := 1);\n\
                   PROGRAM i1 WITH t : one; PROGRAM i2 WITH t : two; END_RESOURCE END_CONFIGURATION\n";
    for more in ["", several] {
        let change = change("one.st", &text(more, "b"), &text(more, "b AND NOT a"));
        let change = change.unwrap_or_else(|reasons| panic!("{reasons:?}"));
        let change = &change.programs[0];
        let mut running = Running::new(&change.before.executable);
        let [a, both, b] = [1, 3, 2];
        // It begins in the first scan, works, and is changed and changed back while it works.
        running.step(&[0]);
        running.step(&[a]);
        assert_eq!(running.step(&[0])[0] & 1, 1, "it works");
        let state = change.forward.convert(&running.state);
        let mut running = Running { executable: &change.after.executable, state };
        for inputs in [0, both, both] {
            assert_eq!(running.step(&[inputs])[0] & 1, 1, "it goes on, and ends in another way");
        }
        let state = change.back.convert(&running.state);
        let mut running = Running { executable: &change.before.executable, state };
        assert_eq!(running.step(&[0])[0] & 1, 1, "it goes on");
        running.step(&[b]);
        assert_eq!(running.step(&[0])[0] & 1, 0, "it is over as before");
    }
}

/// What differs beside the programs is said in the words of the cluster file, all of it.
#[test]
fn settings_that_need_a_stop_are_named_as_in_the_file() {
    let program =
        "program one\ninput a\noutput y = 0\noutput z\nrung\n    a ( y )\nrung\n    a ( z )\n";
    let file = "[cluster]\nname = \"cell\"\nperiod = \"10ms\"\n[[controller]]\nname = \"one\"\nladder = \"one.ladder\"\n[[remote_io]]\ncontroller = \"one\"\n";
    let cluster = |text: &str| {
        let loaded = load(text, &[("one.ladder", program)]);
        loaded.cluster.unwrap_or_else(|| panic!("{:?}\n{text}", loaded.reports))
    };
    let reasons = |from: &str, to: &str| {
        let changed = file.replace(from, to);
        assert_ne!(changed, file);
        let reasons = ChangeTexts::between(&cluster(file), &cluster(&changed));
        let reasons = reasons.expect_err("it needs a stop");
        reasons.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    };
    let remote_io = "controller = \"one\"\n";
    let with = |keys: &str| format!("{remote_io}{keys}\n");
    let second = "[[controller]]\nname = \"two\"\nladder = \"one.ladder\"\n[[remote_io]]";
    for (from, to, expected) in [
        ("10ms", "20ms".to_owned(), "`period` of the cluster changes from `10ms` to `20ms`"),
        (
            remote_io,
            with("twin = { name = \"second\", wiring = \"exclusive\" }"),
            "`twin` of remote I/O `one-io` changes",
        ),
        (
            remote_io,
            with("inputs = { a = { operator = \"level\" } }"),
            "inputs or outputs of `one` change, and its program does not: only a changed program brings others while it runs (sourced input a  from: the \
             field; now: level, initial FALSE)",
        ),
        (
            "[[remote_io]]",
            second.to_owned(),
            "only the new file has controller `two`; only the new file has remote I/O `two-io`",
        ),
        (
            "[[remote_io]]",
            "[[understudy]]\nname = \"more\"\n[[remote_io]]".to_owned(),
            "only the old file has understudy `understudy`; only the new file has understudy `more`",
        ),
    ] {
        assert_eq!(reasons(from, &to), expected, "{to}");
    }
}

/// What an operator, a signal or a device has in an image is a number: where it would be another value, the point is another one.
#[test]
fn values_of_points_keep_their_numbers() {
    let text = |values: &str| {
        format!(
            "TYPE Mode : ({values}); END_TYPE\nPROGRAM one\n  VAR_INPUT want : Mode; END_VAR\n  VAR_OUTPUT is : Mode; END_VAR\n  is := want;\nEND_PROGRAM\n"
        )
    };
    let before = text("Off, Auto, Man");
    for (values, fits) in [
        ("Off, Auto, Man", true),
        ("off, auto, man, Extra", true),
        ("Man, Off, Auto", false),
        ("Off, Auto", false),
        ("Off, Auto, Hand", false),
    ] {
        let change = change("one.st", &before, &text(values)).expect("an online change");
        let points = change.programs.first().and_then(|changed| changed.points.as_ref());
        assert_eq!(points.is_none(), fits, "{values}");
        // Only the points of the program fault stay then.
        let mut moved = points.into_iter().flat_map(|it| it.inputs.iter().chain(&it.outputs));
        assert!(moved.all(|it| it.before.bit != 0 && it.after.bit != 0), "{values}");
    }
}

/// A view that reads a journal from its middle has only the newest changes, each in the order in which it was loaded last. The programs of all are known.
#[test]
fn changes_of_a_run_are_loaded_from_every_configuration_that_is_known() {
    let numbered = |seconds: usize| {
        let text =
            format!("program one\ninput a\noutput y = 0\nrung\n    a {{TON t {seconds}s}} ( y )\n");
        cluster("one.ladder", &text)
    };
    let clusters: Vec<Cluster> = (1..81).map(numbered).collect();
    let texts = |from: usize, to: usize| {
        ChangeTexts::between(&clusters[from], &clusters[to]).expect("an online change")
    };
    let mut changes = OnlineChanges::of(Arc::new(clusters[0].clone()));
    let hash = |number: usize| clusters[number].controllers()[0].hash;
    let program = understudy_wire::ProgramId(0);
    // Of a configuration that is not known.
    assert!(changes.load(&texts(2, 3)).is_none());
    assert!(changes.controller(program, hash(1)).is_none());
    for (from, to) in [(0, 1), (2, 1), (1, 2), (2, 3), (3, 0), (0, 3)] {
        let loaded = changes.load(&texts(from, to)).expect("from a known one, or to it");
        assert_eq!(loaded.name(), texts(from, to).name());
        for number in [from, to] {
            let found = changes.controller(program, hash(number)).expect("it is known");
            assert_eq!(
                found.code.source().text,
                clusters[number].controllers()[0].code.source().text
            );
        }
    }
    // Many that are taken back: the one that runs stays known.
    for number in 4..80 {
        assert!(changes.load(&texts(3, number)).is_some(), "{number}");
        assert!(changes.controller(program, hash(number)).is_some());
    }
    assert!(changes.controller(program, hash(0)).is_some(), "the first one");
    assert!(changes.controller(program, hash(5)).is_none(), "there is a bound");
}
