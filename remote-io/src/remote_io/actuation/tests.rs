//! What is driven, and whether the program runs: each reachable named state, with each thing that can happen, and the state that follows.
//!
//! The drawing in `docs/pictures/driven-output.dot` is made from the first table.

use understudy_cycle::{PointPlace, Ramp};
use understudy_testing::states::Table;
use understudy_typed::Elementary;

use super::super::states::settings;
use super::*;

/// Something that happens to the program, with its name.
type Step = (fn(&mut Actuation), &'static str);

/// An output that is held for two deadlines, and then falls by 8 from one to the next.
#[derive(Debug, Clone)]
struct Bench {
    actuation: Actuation,
    fallback: Fallback,
}

#[derive(Debug, Clone, Copy)]
enum AtDeadline {
    Proved,
    Missing,
    Forgotten,
}

impl Bench {
    fn new() -> Self {
        let place = PointPlace { bit: 0, of: Elementary::Int };
        let fallback = Fallback {
            fail_safe: Image::zero(16),
            ramps: vec![Ramp { place, step: 8.0 }],
            ..settings().fallback
        };
        Self { actuation: Actuation::default(), fallback }
    }

    fn happens(&mut self, happening: AtDeadline) {
        let sixteen = Image::from_bits((0..16).map(|bit| bit == 4));
        let selection = match happening {
            AtDeadline::Proved => Selection::Direct(sixteen),
            AtDeadline::Missing => Selection::Missing(Missing::NoCycle),
            AtDeadline::Forgotten => return self.actuation.forget_proved(),
        };
        self.actuation.apply(selection, &self.fallback);
    }

    /// The name of its state.
    fn state(&self) -> String {
        let Actuation { missed, applied, proved, descent, .. } = &self.actuation;
        let Some(applied) = applied else {
            return "Nothing".to_owned();
        };
        let name = match applied.source {
            Source::FailSafe if descent.is_some() => return "Falling".to_owned(),
            Source::FailSafe => return "Safe".to_owned(),
            Source::Held => format!("Held, {missed}"),
            Source::Direct | Source::Reconstructed => "Proved".to_owned(),
        };
        if proved.is_some() { name } else { name + ", not to be held" }
    }
}

fn table() -> Table {
    let inputs = [
        (AtDeadline::Proved, "an output is proved"),
        (AtDeadline::Missing, "nothing is proved"),
        (AtDeadline::Forgotten, "a start or a value fault"),
    ];
    Table::explore(Bench::new(), &inputs, Bench::happens, Bench::state)
}

#[test]
fn each_state_answers_each_deadline() {
    insta::assert_snapshot!(table().text());
}

#[test]
fn the_drawing_is_the_table() {
    let drawing = table().drawing("driven output", "remote-io/src/remote_io/actuation/tests.rs");
    let drawn = include_str!("../../../../docs/pictures/driven-output.dot");
    assert!(drawing == drawn, "docs/pictures/driven-output.dot should be\n{drawing}");
}

#[test]
fn a_stopped_program_runs_again_after_a_release_and_a_reset() {
    let steps: [Step; 4] = [
        (|actuation| actuation.note_execution(false), "outputs say that it runs"),
        (|actuation| actuation.note_execution(true), "outputs say that it is stopped"),
        (|actuation| _ = actuation.release(), "operator: release"),
        (Actuation::note_reset, "a sample resets it"),
    ];
    let table = Table::explore(
        Actuation::default(),
        &steps,
        |actuation, step| step(actuation),
        |actuation| format!("{:?}", actuation.execution),
    );
    insta::assert_snapshot!(table.text());
}
