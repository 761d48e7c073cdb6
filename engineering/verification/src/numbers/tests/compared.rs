//! Properties that compare numbers, and assumptions about inputs.

use understudy_typed::{Machine, Scratch};

use super::{PERIOD, ask, lowered};
use crate::numbers::{Answer, Model};
use crate::property::{Asked, Properties, read, read_one};

/// A level with an enumeration, a timer and numbers of each kind.
const TANK: &str = "
TYPE MODE : (idle, filling, full); END_TYPE
PROGRAM tank
  VAR_INPUT raw : INT; t : REAL; start : BOOL; stop : BOOL; END_VAR
  VAR_OUTPUT valve : BOOL; percent : INT; heater : REAL; END_VAR
  VAR mode : MODE; wait : TON; high : REAL; counts : ARRAY[1..2] OF INT; END_VAR
  percent := raw * 100 / 4095;
  wait(IN := start, PT := T#50ms);
  IF stop THEN mode := idle; ELSIF wait.Q THEN mode := filling; END_IF;
  IF percent >= 100 THEN mode := full; END_IF;
  valve := mode = filling;
  heater := LIMIT(0.0, 2.0 * (60.0 - t), 40.0);
  high := MAX(high, t);
  IF start AND counts[2] < 7 THEN counts[2] := counts[2] + 1; END_IF;
END_PROGRAM";

/// What the field keeps.
const FIELD: &str =
    "assume: raw >= 0\nassume: raw <= 4095\nassume: t < 200.0\nassume: !(start & stop)\n";

/// What is written as it is declared.
const CALENDAR: &str = "
PROGRAM calendar
  VAR_INPUT day : DATE; clock : TIME_OF_DAY; END_VAR
  VAR_OUTPUT leap : BOOL; afternoon : BOOL; END_VAR
  leap := day = D#2024-02-29;
  afternoon := clock >= TOD#12:00:00;
END_PROGRAM";

fn model(program: &str, asked: &Properties) -> Model {
    Model::of_program(&lowered(program), &Asked::of([asked])).expect("followed")
}

/// Whether a property of a program is proved; fails with a run; undecided is neither.
fn verdict(program: &str, asked: &Properties, property: &str) -> Option<bool> {
    let mut asked = asked.clone();
    asked.properties = vec![read_one(property, PERIOD).expect("a property")];
    match ask(&model(program, &asked), property) {
        Answer::Holds(_) => Some(true),
        Answer::Fails(_) => Some(false),
        Answer::Undecided(_) => None,
    }
}

/// With the verdict for all inputs, and with that for those of the field.
const VERDICTS: [(&str, bool, bool); 16] = [
    ("never percent > 100", false, true),
    ("never percent < 0", false, true),
    ("never raw > 4095", false, true),
    ("never start & stop", false, true),
    ("never heater > 50.0", true, true),
    ("never heater > 40", true, true),
    ("never heater >= 40", false, false),
    ("never heater < 0.0", true, true),
    ("never high >= 200.0", false, true),
    ("never wait.ET > 50ms", true, true),
    ("wait.ET = T#50ms can be reached", true, true),
    ("never mode = filling and stop", true, true),
    ("mode = full -> percent = 100", false, true),
    ("valve only while mode = filling", true, true),
    ("counts[2] = 7 can always be reached", true, true),
    ("within 50ms of start: counts[2] <= 6", false, false),
];

#[test]
fn numbers_are_compared_with_values_and_with_each_other() {
    let none = Properties::default();
    let field = read(FIELD, PERIOD);
    assert_eq!((field.assumed.len(), field.diagnostics.len()), (4, 0));
    for (property, of_all, of_field) in VERDICTS {
        assert_eq!(verdict(TANK, &none, property), Some(of_all), "{property}");
        assert_eq!(verdict(TANK, &field, property), Some(of_field), "{property}, in the field");
    }
}

#[test]
fn dates_and_times_of_day_are_compared_as_they_are_written() {
    let none = Properties::default();
    for (property, holds) in [
        ("never leap and day > D#2024-02-29", true),
        ("never leap and day < D#2024-03-01", false),
        ("afternoon only while clock >= TOD#12:00:00", true),
        ("afternoon only while clock > TOD#12:00:00", false),
    ] {
        assert_eq!(verdict(CALENDAR, &none, property), Some(holds), "{property}");
    }
}

/// What is proved of the field is so in runs of the machine whose inputs the field keeps.
#[test]
fn what_is_proved_holds_in_runs_of_the_machine() {
    let program = lowered(TANK);
    let machine = Machine::new(&program);
    let input = |name: &str| program.inputs.find(name).expect("an input");
    let output = |name: &str| program.outputs.find(name).expect("an output");
    let mut dice = understudy_testing::random::Dice::new(3);
    let mut scratch = Scratch::default();
    let mut state = machine.initial().to_vec();
    let mut extremes = (i128::MAX, i128::MIN);
    for _ in 0..20_000 {
        let mut image = vec![0; machine.input_count().div_ceil(64)];
        let mut outputs = vec![0; machine.output_count().div_ceil(64)];
        input("raw").set(&mut image, dice.number() % 4096);
        let t = (dice.number() % 40_000) as f32 / 100.0 - 200.0;
        input("t").set(&mut image, t.to_bits().into());
        let buttons = dice.number() % 3;
        input("start").set(&mut image, buttons & 1);
        input("stop").set(&mut image, buttons >> 1);
        machine.step(&mut scratch, &mut state, &image, &mut outputs);
        let percent = output("percent");
        let percent = percent.of.signed(percent.get(&outputs));
        extremes = (extremes.0.min(percent), extremes.1.max(percent));
        let heater = f32::from_bits(output("heater").get(&outputs) as u32);
        assert!((0.0..=40.0).contains(&heater), "{heater}");
        assert!(output("valve").get(&outputs) == 0 || buttons >> 1 == 0);
    }
    assert_eq!(extremes, (0, 100));
}

#[test]
fn what_is_no_comparison_or_assumption_is_told() {
    let text = "\
never heatr > 1
never raw > 50000
never start > 1
never heater > x
never raw > 1.5
never raw > heater
never mode = green
never t > T#2s
never wait.ET > 5
assume: percent < 5
assume: raw < percent
assume: nothing < 5
";
    let found = read(text, PERIOD);
    let model = model(TANK, &found);
    let resolved = found.properties.iter().filter_map(|property| model.resolve(property).err());
    let assumed = found.assumed.iter().map(|property| model.wrong_assumption(property));
    let told: Vec<String> = resolved
        .chain(assumed)
        .flatten()
        .map(|wrong| {
            format!("{} {} ({})", wrong.code, wrong.message, wrong.help.unwrap_or_default())
        })
        .collect();
    insta::assert_snapshot!(told.join("\n"));
}

/// Which of the two was meant is not guessed.
#[test]
fn a_name_of_a_variable_and_a_value_is_told() {
    let program = "
TYPE MODE : (idle, full); END_TYPE
PROGRAM two
  VAR_INPUT full : INT; END_VAR
  VAR_OUTPUT mode : MODE; END_VAR
  IF full > 3 THEN mode := MODE#full; ELSE mode := MODE#idle; END_IF;
END_PROGRAM";
    let found = read("never mode = full", PERIOD);
    let told = model(program, &found).resolve(&found.properties[0]).expect_err("two meanings");
    let [told] = &told[..] else {
        panic!("{told:?}");
    };
    assert_eq!((told.code, &*told.message), ("U0435", "`full` is a variable, and a value of MODE"));
    assert!(told.help.as_ref().is_some_and(|help| help.contains("`MODE#full`")), "{told:?}");
    let none = Properties::default();
    assert_eq!(verdict(program, &none, "mode = MODE#full -> full > 3"), Some(true));
}

#[test]
fn assumptions_that_contradict_each_other_prove_nothing() {
    let contradiction = read("assume: raw < 3\nassume: raw > 5\n", PERIOD);
    assert_eq!(verdict(TANK, &contradiction, "never percent > 100"), None);
    assert_eq!(verdict(TANK, &contradiction, "percent = 1 can be reached"), None);
}
