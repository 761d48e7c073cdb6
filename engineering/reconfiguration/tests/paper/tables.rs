//! Tables 4 to 6, and what section 7 says about failed channels.

use std::collections::BTreeSet;

use understudy_reconfiguration::command::Objective;
use understudy_reconfiguration::{
    Analysis, Event, Label, MegaController, Question, failed_channels, feedback,
};

use crate::filling_line::{controller, relation, signals};

/// Table 6, but for Weight_recd+ in state 6: there the scale is on, so that by the formula nothing disables the event, and
/// the 0 that is printed is a dc. Columns: Ready+ Ready- ps1+ ps1- ps2+ ps2- Filling_done+ Filling_done- Weight_recd+ Weight_recd-.
const TABLE_6: [&str; 12] = [
    "1 dc 0 0 0 0 0 dc 0 dc",
    "dc 1 dc dc dc dc 0 dc 0 dc",
    "dc dc 1 dc dc dc 0 dc 0 dc",
    "dc dc 0 0 1 dc 0 dc 0 dc",
    "dc dc 0 0 0 0 1 dc 0 dc",
    "dc dc 0 0 0 0 0 1 dc dc",
    "dc dc 0 0 0 0 0 dc 1 dc",
    "dc dc dc dc dc dc 0 dc 0 1",
    "dc dc dc 1 dc dc 0 dc 0 dc",
    "dc dc 0 0 dc dc 0 dc 0 dc",
    "dc dc 0 0 dc dc 0 dc 0 dc",
    "dc dc 0 0 dc 1 1 dc 0 dc",
];

#[test]
fn table_6_follows_from_tables_4_and_5() {
    let (controller, relation) = (controller(), relation());
    for (state, expected) in TABLE_6.iter().enumerate() {
        let row: Vec<&str> = signals()
            .events()
            .map(|event| feedback(&controller, &relation, state, event).text())
            .collect();
        assert_eq!(row.join(" "), *expected, "state {}", state + 1);
    }
}

#[test]
fn ps2_is_uncontrollable_in_four_states_only() {
    let relation = relation();
    let ps2 = signals().event("ps2+").expect("an event");
    let without: Vec<usize> =
        (1..=12).filter(|state| relation.rows(state - 1, ps2).is_empty()).collect();
    assert_eq!(without, [4, 10, 11, 12]);
}

fn question(analysis: Analysis, channels: &[usize]) -> Question {
    Question {
        channels: channels.to_vec(),
        simultaneous: channels.len(),
        analysis,
        objective: Objective::Fewest,
        maximum_states: 100_000,
    }
}

fn build(analysis: Analysis, channels: &[usize]) -> MegaController {
    let question = question(analysis, channels);
    MegaController::build(&controller(), &relation(), &question).expect("every state has a command")
}

/// The members, by the numbers of Table 4, and the outputs after a channel fails in a state with all channels working.
fn after_break(
    mega: &MegaController,
    state: usize,
    channel: usize,
) -> (Vec<usize>, Option<String>) {
    let home = mega.find(&[state as u32 - 1], 0).expect("reached");
    let place = mega.follow(home, &Label::Break(channel)).expect("it may fail");
    let found = &mega.states[place];
    let members = found.members.iter().map(|&member| member as usize + 1).collect();
    (members, found.command.as_ref().map(|command| command.outputs.to_string()))
}

#[test]
fn ready_failed_in_state_1_is_the_combined_state_123_with_all_outputs_off() {
    for analysis in [Analysis::Section2, Analysis::Prompt, Analysis::Late] {
        let mega = build(analysis, &[0, 1, 2, 3, 4]);
        let expected = (vec![1, 2, 3], Some("0000".to_owned()));
        assert_eq!(after_break(&mega, 1, 0), expected, "{analysis:?}");
    }
}

#[test]
fn ps1_failed_in_state_3_disables_ps1() {
    for analysis in [Analysis::Section2, Analysis::Prompt, Analysis::Late] {
        let mega = build(analysis, &[0, 1, 2, 3, 4]);
        let (members, outputs) = after_break(&mega, 3, 1);
        assert!(members.contains(&3));
        assert_eq!(
            outputs.expect("a command").as_bytes()[0],
            b'0',
            "the motor stops: {analysis:?}"
        );
    }
    let prompt = build(Analysis::Prompt, &[1]);
    assert_eq!(after_break(&prompt, 3, 0).0, [3]);
    let late = build(Analysis::Late, &[1]);
    assert_eq!(after_break(&late, 3, 0).0, [3, 4]);
}

#[test]
fn filling_done_failed_in_state_5_stops_the_filling() {
    let prompt = build(Analysis::Prompt, &[3]);
    assert_eq!(after_break(&prompt, 5, 0), (vec![5], Some("0000".to_owned())));
    let late = build(Analysis::Late, &[3]);
    assert_eq!(after_break(&late, 5, 0), (vec![5, 6, 7], Some("0000".to_owned())));
}

#[test]
fn a_failure_that_concerns_nothing_changes_nothing() {
    // In state 5 neither edge of Ready can come.
    let mega = build(Analysis::Late, &[0]);
    assert_eq!(after_break(&mega, 5, 0), (vec![5], None));
}

#[test]
fn with_prompt_detection_every_repair_finds_the_way_back() {
    let mega = build(Analysis::Prompt, &[0, 1, 2, 3, 4]);
    assert!(!mega.dangling.is_empty());
    assert!(mega.dangling.iter().all(|dangling| !dangling));
}

#[test]
fn trimming_disables_what_leads_to_where_nothing_leads_back() {
    let (controller, relation) = (controller(), relation());
    for analysis in [Analysis::Section2, Analysis::Late] {
        let mega = build(analysis, &[1, 3]);
        let trimming = mega.trim(&controller, &relation, &question(analysis, &[1, 3]));
        let crossing = mega.edges.iter().enumerate().flat_map(|(source, edges)| {
            let to = edges.iter().map(move |(_, target)| (source, *target));
            to.filter(|(source, target)| !mega.dangling[*source] && mega.dangling[*target])
        });
        let events = [&trimming.prevented, &trimming.kept, &trimming.stopped].into_iter().flatten();
        let told = events.count() + trimming.unavoidable.len();
        assert_eq!(told, crossing.count(), "{analysis:?}");
        for (state, events) in trimming.prevented.iter().chain(&trimming.kept) {
            for &member in &mega.states[*state].members {
                let defined =
                    events.iter().filter(|&&event| controller.is_defined(member as usize, event));
                assert!(
                    defined
                        .into_iter()
                        .all(|&event| !relation.rows(member as usize, event).is_empty())
                );
            }
        }
    }
    // Late, Filling_done fails in state 5: filled or not cannot be told any more when it is repaired at 0.
    let late = build(Analysis::Late, &[3]);
    let unknown = late.find(&[4, 6], 0).expect("it is come to");
    assert!(late.dangling[unknown]);
}

/// Section 2 once more, with sets of strings in place of a worklist.
fn naive_section_2(channels: &[usize]) -> BTreeSet<(BTreeSet<usize>, u64)> {
    let controller = controller();
    let events: Vec<Event> = signals().events().chain([Event::Omega]).collect();
    let step = |from: &BTreeSet<usize>, event: Event| -> BTreeSet<usize> {
        from.iter()
            .flat_map(|&state| controller.moves(state))
            .filter(|step| step.is(event))
            .map(|step| step.target)
            .collect()
    };
    let is_failed = |event: Event, failed: u64| {
        event
            .channel()
            .is_some_and(|input| failed_channels(channels, failed).any(|other| other == input))
    };
    let close = |mut set: BTreeSet<usize>, failed: u64| loop {
        let before = set.len();
        for &event in events.iter().filter(|&&event| is_failed(event, failed)) {
            set.extend(step(&set.clone(), event));
        }
        if set.len() == before {
            return set;
        }
    };
    let mut found = BTreeSet::from([(BTreeSet::from([0]), 0)]);
    loop {
        let before = found.len();
        for (members, failed) in found.clone() {
            for &event in events.iter().filter(|&&event| !is_failed(event, failed)) {
                let after = step(&members, event);
                if !after.is_empty() {
                    found.insert((close(after, failed), failed));
                }
            }
            for bit in 0..channels.len() {
                let other = failed ^ (1 << bit);
                found.insert((close(members.clone(), other), other));
            }
        }
        if found.len() == before {
            return found;
        }
    }
}

#[test]
fn section_2_is_built_as_by_hand() {
    for channels in [&[0][..], &[1], &[3], &[0, 1], &[1, 3, 4], &[0, 1, 2, 3, 4]] {
        let mega = build(Analysis::Section2, channels);
        let states: BTreeSet<(BTreeSet<usize>, u64)> = mega
            .states
            .iter()
            .map(|state| {
                let members = state.members.iter().map(|&member| member as usize);
                (members.collect(), state.failed)
            })
            .collect();
        assert_eq!(states, naive_section_2(channels), "{channels:?}");
    }
}
