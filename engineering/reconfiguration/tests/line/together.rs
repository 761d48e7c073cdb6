//! Events that one scan shows together, some of them on failed channels.

use proptest::strategy::{Strategy as _, ValueTree as _};
use proptest::test_runner::TestRunner;
use understudy_reconfiguration::{
    Event, Failure, MegaController, Outcome, Question, analyse, project,
};

use crate::trimming::{any_automaton, question};

/// A box may have a lid; both sensors are at one place, so a box with a lid is seen by both in one scan.
const LIDS: [&str; 3] = [
    "program lids\ninput box\ninput lid\noutput Motor\noutput Press\n\
     rung\n    /box ( Motor )\nrung\n    box lid ( Press )\n",
    "program lids_plant\ninput Motor\ninput Press\ninput comes\ninput lidded\ninput taken\noutput box\noutput lid\n\
     rung\n    box taken (R box) (R lid)\nrung\n    Motor /box comes lidded (S lid)\n\
     rung\n    Motor /box comes (S box)\n",
    "[[relation]]\nevents = [\"box+\", \"lid+\"]\nrows = [\"Motor\"]\n",
];

fn analysed(texts: &[String; 3], detection: &str, simultaneous: usize) -> Result<Outcome, Failure> {
    let [ladder, plant, relations] = texts;
    let text = format!(
        "[project]\nladder = \"a.ladder\"\nplant = \"b.ladder\"\nperiod = \"100ms\"\n\
         detection = \"{detection}\"\nsimultaneous = {simultaneous}\n{relations}"
    );
    let mut read = |name: &str| Ok(if name.starts_with('a') { ladder } else { plant }.clone());
    let loaded = project::read("project.toml", &text, &mut read);
    let project = loaded.project.unwrap_or_else(|| panic!("{:?}\n{texts:?}", loaded.reports));
    analyse(&project)
}

/// While the sensor of the lid is failed, a box that has come may have a lid.
#[test]
fn what_comes_together_with_a_seen_event_may_have_come() {
    for detection in ["late", "prompt"] {
        for simultaneous in 1..=2 {
            let outcome = analysed(&LIDS.map(String::from), detection, simultaneous);
            let outcome = outcome.unwrap_or_else(|failure| panic!("{detection}: {failure}"));
            let state = |name: &str| {
                let mut states = 0..outcome.controller.states().len();
                states.find(|&state| outcome.controller.state_name(state) == name)
            };
            let without = state("10_00").expect("a box without a lid") as u32;
            let with = state("11_01").expect("a box with a lid") as u32;
            let lid = 0b10;
            let entry = |fresh: bool| {
                let place = outcome.mega.entry(without, lid, fresh)?;
                Some(outcome.mega.states[place].members.clone())
            };
            let mut both = vec![without, with];
            both.sort_unstable();
            assert_eq!(entry(false), Some(both.clone()), "{detection}");
            // A channel that fails in this scan has missed nothing where it is known at once.
            assert_eq!(entry(true), (detection == "late").then_some(both), "{detection}");
        }
    }
}

/// The events that the ladder sees while the channels of `failed` are failed.
fn shown(events: &[Event], failed: u64) -> Vec<Event> {
    let is_seen = |event: &&Event| event.channel().is_some_and(|bit| failed >> bit & 1 == 0);
    events.iter().filter(is_seen).copied().collect()
}

/// In every state in which module 2 reads the state from the ladder, and for everything that the plant does then: the
/// ladder comes to a state that stands for the one in which the plant is.
#[test]
fn what_a_ladder_takes_for_another_event_is_among_what_it_stands_for() {
    let mut runner = TestRunner::deterministic();
    let mut checked = [0; 2];
    for _ in 0..500 {
        let (controller, relation) =
            any_automaton().new_tree(&mut runner).expect("a value").current();
        for late in [false, true] {
            let question = Question { channels: vec![0, 1], simultaneous: 2, ..question(late) };
            let Ok(mega) = MegaController::build(&controller, &relation, &question) else {
                continue;
            };
            for state in &mega.states {
                let ([source], None) = (&state.members[..], &state.command) else { continue };
                let moves = controller.moves(*source as usize);
                for (whole, failed) in
                    moves.iter().flat_map(|whole| (1..4).map(move |bits| (whole, bits)))
                {
                    let newly = failed & !state.failed;
                    let is_missed_late = shown(&whole.events, newly).len() < whole.events.len();
                    if state.failed & !failed != 0
                        || newly.count_ones() > 1
                        || is_missed_late && !late
                    {
                        continue;
                    }
                    let seen = shown(&whole.events, failed);
                    if seen.is_empty() || seen == whole.events {
                        continue;
                    }
                    for part in moves.iter().filter(|part| part.events == seen) {
                        if part.target == whole.target {
                            continue;
                        }
                        let place = mega.entry(part.target as u32, failed, newly != 0);
                        let place = place.expect("another state is possible");
                        let members = &mega.states[place].members;
                        let both = [part.target, whole.target].map(|state| state as u32);
                        assert!(both.iter().all(|state| members.contains(state)));
                        assert!(mega.states[place].command.is_some());
                        checked[usize::from(newly != 0)] += 1;
                    }
                }
            }
        }
    }
    assert!(checked.iter().all(|&count| count > 50), "{checked:?}");
}
