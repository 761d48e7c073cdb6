//! A referee that never blows its whistle proves nothing: every kind of violation is shown to it.

use understudy_cycle::{
    Agreement, Conversion, FallbackChange, Layout, Mode, ProgramChange, Schedule,
};
use understudy_logic::CircuitBuilder;
use understudy_remote_io::{Fallback, PointPlace, Ramp, Release, StaleState, ValueFault};
use understudy_typed::Elementary;
use understudy_wire::{
    ClusterHash, ConfigurationHash, Configurations, Cycle, Epoch, Member, ProgramId, Role,
    StationSet, Time, Write, WriteId,
};

use super::*;

/// y = x ⊕ u, x' = u.
fn referee() -> Referee {
    let mut builder = CircuitBuilder::new("delay");
    let input = builder.input("u");
    let (register, state) = builder.register("x", false);
    builder.set_next(register, input);
    let output = builder.graph().xor(state, input);
    builder.output("y", output);
    let circuit = builder.finish().expect("a circuit");
    let period = std::time::Duration::from_millis(10);
    let agreement = Agreement {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(1),
        schedule: Schedule::new(period, 1, 1, 1).expect("within bounds"),
        mode: Mode::Full,
        history: 4,
        flag_after: 3,
        shadow_cycles: 1,
        listen_cycles: 1,
    };
    let settings = Settings {
        program: ProgramId(0),
        agreement: std::sync::Arc::new(agreement),
        hash: ProgramHash(5),
        layout: std::sync::Arc::new(Layout::booleans(1, 1)),
        diagnosis: None,
        fallback: fallback(),
        pair: None,
        paired_inputs: Vec::new(),
        shared_outputs: understudy_remote_io::SharedOutputs::default(),
    };
    Referee::new(&settings, (&circuit).into())
}

fn fallback() -> Fallback {
    Fallback {
        hold_cycles: 2,
        trial_cycles: 0,
        fail_safe: Image::zero(1),
        ramps: Vec::new(),
        release: Release::Automatic,
        value_fault: ValueFault::Hold,
        stale_state: StaleState::Operator,
        restart: None,
    }
}

/// The same remote I/O, whose input operators write.
fn referee_of_an_operator_input() -> Referee {
    let mut referee = referee();
    referee.unrecorded = Unrecorded::new([0].into_iter());
    referee
}

fn moment(cycle: u64) -> Moment {
    Moment { epoch: Epoch(1), cycle: Cycle(cycle) }
}

fn bit(bit: bool) -> Image {
    Image::from_bits([bit])
}

/// L after these inputs, from the genesis of cycle 0.
fn after(inputs: &[bool]) -> Lineage {
    let genesis = Lineage::genesis(ProgramHash(5), moment(0));
    inputs.iter().fold(genesis, |lineage, &input| lineage.after(&bit(input)))
}

/// The sample of a cycle that extends the state after the inputs `before`.
fn sampled(cycle: u64, before: &[bool], input: bool) -> Event {
    Event::Sampled {
        moment: moment(cycle),
        inputs: bit(input),
        born: moment(0),
        before: after(before),
        change: None,
    }
}

fn applied(cycle: u64, output: bool, source: Source) -> Event {
    Event::Applied {
        moment: moment(cycle),
        sampled: None,
        outputs: bit(output),
        driven: None,
        source,
        word_of: None,
        missing: None,
        points: None,
        heard: StationSet::EMPTY,
    }
}

/// Shows `events` to a referee; only the last may be a violation, and is one if `violation`.
fn check(events: &[Event], violation: bool) {
    let mut referee = referee();
    let (last, before) = events.split_last().expect("one event");
    for event in before {
        assert_eq!(referee.observe(event), Ok(()), "{event:?}");
    }
    let found = referee.observe(last);
    assert_eq!(found.is_err(), violation, "{found:?}");
}

#[test]
fn only_the_true_output_may_be_applied_as_true() {
    for source in [Source::Direct, Source::Reconstructed] {
        for (first, second, output) in
            (0..8).map(|case| (case & 1 == 1, case & 2 == 2, case & 4 == 4))
        {
            let truth = first ^ second;
            let events =
                [sampled(1, &[], first), sampled(2, &[first], second), applied(2, output, source)];
            check(&events, output != truth);
        }
        check(&[sampled(1, &[], true), applied(2, true, source)], true);
        check(&[applied(1, false, source)], true);
    }
}

#[test]
fn only_the_last_true_output_may_be_held_and_not_for_long() {
    let start = [sampled(1, &[], true), applied(1, true, Source::Direct)];
    let then = |more: &[Event]| [&start, more].concat();
    let held = |cycle, output| applied(cycle, output, Source::Held);
    check(&then(&[held(2, true)]), false);
    check(&then(&[held(2, false)]), true);
    check(&then(&[held(2, true), held(3, true)]), false);
    check(&then(&[held(2, true), held(3, true), held(4, true)]), true);
    check(&[sampled(1, &[], true), held(1, false)], true);
}

#[test]
fn only_the_configured_values_are_safe() {
    check(&[applied(1, false, Source::FailSafe)], false);
    check(&[applied(1, true, Source::FailSafe)], true);
}

/// Every history of four samples of which any were applied, and a fifth sample that extends any of its states: a state before the
/// newest applied sample is a violation, and no other is.
#[test]
fn a_program_never_goes_back_behind_an_applied_output() {
    for (inputs, outputs) in (0..16_u32).flat_map(|a| (0..16_u32).map(move |b| (a, b))) {
        let inputs: Vec<bool> = (0..4).map(|k| inputs >> k & 1 == 1).collect();
        let floor = (0..4).rev().find(|k| outputs >> k & 1 == 1);
        let floor = floor.map_or(0, |newest| newest + 1);
        for from in 0..=4 {
            let mut events = Vec::new();
            for (k, &input) in inputs.iter().enumerate() {
                events.push(sampled(k as u64 + 1, &inputs[..k], input));
                if outputs >> k & 1 == 1 {
                    let state = k.checked_sub(1).is_some_and(|before| inputs[before]);
                    events.push(applied(k as u64 + 1, state ^ input, Source::Direct));
                }
            }
            events.push(sampled(9, &inputs[..from], true));
            check(&events, from < floor);
        }
    }
}

#[test]
fn a_program_continues_only_from_what_its_samples_led_to() {
    let start = [sampled(1, &[], true), sampled(2, &[true], false)];
    let unknown = sampled(3, &[true, true], false);
    check(&[&start[..], &[unknown]].concat(), true);
    // From the state after u = 1, an input of 0 gives 1.
    let resumed = [sampled(3, &[true], false), applied(3, true, Source::Direct)];
    check(&[&start[..], &resumed].concat(), false);
}

#[test]
fn the_operator_may_choose_an_older_state_once() {
    let back = |cycle| sampled(cycle, &[], true);
    let mut referee = referee();
    for event in [
        sampled(1, &[], true),
        applied(1, true, Source::Direct),
        sampled(2, &[true], true),
        applied(2, false, Source::Direct),
    ] {
        assert_eq!(referee.observe(&event), Ok(()), "{event:?}");
    }
    referee.operator_chooses();
    assert_eq!(referee.observe(&back(3)), Ok(()));
    assert_eq!(referee.observe(&applied(3, true, Source::Direct)), Ok(()));
    let again = referee.observe(&back(4));
    assert!(matches!(again, Err(Violation::WentBack { .. })), "{again:?}");
}

#[test]
fn a_cold_start_is_counted() {
    let mut referee = referee();
    let cold = |cycle| Event::Sampled {
        moment: moment(cycle),
        inputs: bit(true),
        born: moment(cycle),
        before: Lineage::genesis(ProgramHash(5), moment(cycle)),
        change: None,
    };
    for cycle in [1, 5] {
        assert_eq!(referee.observe(&cold(cycle)), Ok(()));
        let output = applied(cycle, true, Source::Direct);
        assert_eq!(referee.observe(&output), Ok(()));
    }
    assert_eq!(referee.cold_starts(), 2);
}

#[test]
fn what_follows_missing_records_is_not_judged_until_a_state_is_known() {
    let mut referee = referee();
    for event in [sampled(1, &[], true), applied(1, true, Source::Direct)] {
        assert_eq!(referee.observe(&event), Ok(()), "{event:?}");
    }
    referee.misses_records();
    assert_eq!(referee.standing(), None);
    // Whether these are true is not known; whether they are the fail-safe values is.
    for event in [
        applied(5, false, Source::Held),
        sampled(6, &[true, false, false], true),
        applied(6, true, Source::Reconstructed),
        sampled(7, &[true, false, false, false], true),
        applied(7, true, Source::Direct),
    ] {
        assert_eq!(referee.observe(&event), Ok(()), "{event:?}");
    }
    let wrong = referee.observe(&applied(8, true, Source::FailSafe));
    assert!(wrong.is_err(), "{wrong:?}");
    // From a state that is known it judges again: x = 1 and u = 1 give 0.
    referee.goes_on_from((None, after(&[true])), bit(true));
    assert_eq!(referee.observe(&sampled(9, &[true], true)), Ok(()));
    let wrong = referee.observe(&applied(9, true, Source::Direct));
    assert!(wrong.is_err(), "{wrong:?}");
}

#[test]
fn a_sample_without_a_record_may_have_what_was_written() {
    let write = Write {
        id: WriteId { session: 1, number: 1 },
        input: 0,
        value: true.into(),
        role: Role::Operator,
        owner: "anna".to_owned(),
        reason: "a test".to_owned(),
        points: None,
    };
    let written = Event::Written { moment: moment(1), write };
    // The remote I/O was killed after the sample of cycle 2, in which the value was; a pulse is over in the next one.
    let resumed = sampled(4, &[false, true], false);
    // Without the record of the write there may be that of the request.
    for (is_asked, is_written) in [(false, false), (false, true), (true, false)] {
        let mut referee = referee_of_an_operator_input();
        referee.saw(&bit(false));
        assert_eq!(referee.observe(&sampled(1, &[], false)), Ok(()));
        if is_asked {
            referee.asked(0, true.into());
        }
        if is_written {
            assert_eq!(referee.observe(&written), Ok(()));
        }
        referee.starts_again();
        assert_eq!(referee.observe(&resumed), Ok(()));
        assert_eq!(referee.gaps(), u64::from(!is_asked && !is_written));
    }
}

#[test]
fn a_state_that_a_station_holds_ends_a_gap() {
    let mut referee = referee();
    for event in [sampled(1, &[], true), applied(1, true, Source::Direct)] {
        assert_eq!(referee.observe(&event), Ok(()), "{event:?}");
    }
    // Killed with more unknown samples than can be found: x is not known. A process that was not started again is no excuse.
    let resumed = sampled(9, &[true, true, false, true, true, false], true);
    let mut running = referee.clone();
    assert!(running.observe(&resumed).is_err());
    referee.starts_again();
    for event in [resumed, applied(9, false, Source::Direct)] {
        assert_eq!(referee.observe(&event), Ok(()), "{event:?}");
    }
    assert_eq!(referee.gaps(), 1);
    let next = [true, true, false, true, true, false, true];
    assert_eq!(referee.observe(&sampled(10, &next, true)), Ok(()));
    let lineage = after(&[true, true, false, true, true, false, true, true]);
    referee.holds(moment(9), (None, lineage), &bit(false));
    assert_eq!(referee.standing(), None, "of another cycle");
    referee.holds(moment(10), (None, lineage), &bit(true));
    assert_eq!(referee.standing(), Some((lineage, &bit(true))));
    assert_eq!(referee.observe(&applied(10, true, Source::Direct)), Ok(()));
    let held = applied(11, true, Source::Held);
    assert_eq!(referee.observe(&held), Ok(()));
    let next = [true, true, false, true, true, false, true, true];
    assert_eq!(referee.observe(&sampled(12, &next, true)), Ok(()));
    let wrong = referee.observe(&applied(12, true, Source::Direct));
    assert!(wrong.is_err(), "{wrong:?}");
}

/// Outputs of a program with a ramp, driven one after the other from 10 on: whether the referee permits them all.
#[track_caller]
fn descends(driven: &[(bool, u16)], permitted: bool) {
    let place = PointPlace { bit: 16, of: Elementary::Int };
    let ramps = vec![Ramp { place, step: 2.5 }];
    let image = |switch: bool, number: u16| {
        let bits = (0..16).map(|bit| switch && bit == 0);
        Image::from_bits(bits.chain((0..16).map(|bit| number >> bit & 1 == 1)))
    };
    let fallback = Fallback { ramps, fail_safe: image(false, 0), ..fallback() };
    let mut descent = Descent::default();
    descent.begins_at(&image(true, 10));
    let found = driven.iter().all(|&(switch, number)| {
        descent.goes_on();
        descent.permits(&image(switch, number), &fallback)
    });
    assert_eq!(found, permitted, "{driven:?}");
}

#[test]
fn only_a_ramp_and_its_end_are_fail_safe() {
    descends(&[(false, 8), (false, 5), (false, 3), (false, 0)], true);
    descends(&[(false, 0), (false, 0)], true);
    descends(&[(false, 10), (false, 10)], false);
    descends(&[(false, 4)], false);
    descends(&[(false, 12)], false);
    descends(&[(true, 8)], false);
}

/// The settings are those of the configuration that the remote I/O runs: older and newer ones are wrong, and only of one that has started again neither is.
#[test]
fn only_the_settings_of_its_configuration_are_permitted() {
    let [before, after] = [ConfigurationHash(1), ConfigurationHash(2)];
    let new = Fallback { hold_cycles: 3, fail_safe: bit(true), ..fallback() };
    let changed = FallbackChange { program: ProgramId(0), before: fallback(), after: new };
    let (programs, fallbacks) = (Vec::new(), vec![changed]);
    let change = Arc::new(OnlineChange { before, after, programs, fallbacks });
    let remote_io = Member::RemoteIo(ProgramId(0));
    let configured = |own| Event::Configured(Configurations { own, prepared: None });
    // After one proved output of 1: whether so many are held, and what is driven then.
    let run = |own: Option<ConfigurationHash>, again: bool, held: u64, fail_safe: bool| {
        let mut referee = referee();
        referee.learn(&change);
        let mut take = |cycle, event: &Event| referee.observe_from(remote_io, Time(cycle), event);
        take(1, &sampled(1, &[], true)).expect("a cold start");
        take(1, &applied(1, true, Source::Direct)).expect("proved");
        if let Some(own) = own {
            take(1, &configured(own)).expect("no output");
        }
        if again {
            referee.starts_again();
        }
        let mut take = |cycle, event: &Event| referee.observe_from(remote_io, Time(cycle), event);
        let mut held = (2..2 + held).map(|cycle| applied(cycle, true, Source::Held));
        let is_held = held.all(|event| take(2, &event).is_ok());
        (is_held, take(9, &applied(9, fail_safe, Source::FailSafe)).is_ok())
    };
    for own in [None, Some(before)] {
        assert_eq!(run(own, false, 2, false), (true, true));
        assert_eq!(run(own, false, 3, true), (false, false));
    }
    assert_eq!(run(Some(after), false, 3, true), (true, true));
    assert_eq!(run(Some(after), false, 4, false), (false, false));
    // What a change that was not told leads to is not known, so it is not called wrong.
    assert_eq!(run(Some(ConfigurationHash(7)), false, 5, true), (true, true));
    for own in [None, Some(before), Some(after)] {
        assert_eq!(
            (run(own, true, 3, true), run(own, true, 2, false)),
            ((true, true), (true, true))
        );
        assert!(!run(own, true, 4, true).0);
    }
}

/// An author is suspended after its outputs of cycle 3, and writes the record at last when its twin has proved cycle 5.
#[test]
fn outputs_recorded_after_those_of_a_successor_are_judged_by_their_own_cycle() {
    let (author, successor) = (Member::RemoteIo(ProgramId(0)), Member::Twin(ProgramId(0)));
    let sampled = |cycle: u64, input| sampled(cycle, &[true; 8][1..cycle as usize], input);
    let applied_of = |cycle, input, output, source| match applied(cycle, output, source) {
        Event::Applied { moment, outputs, source, word_of, missing, points, heard, .. } => {
            let (sampled, driven) = (input, None);
            Event::Applied {
                moment,
                sampled,
                outputs,
                driven,
                source,
                word_of,
                missing,
                points,
                heard,
            }
        }
        _ => unreachable!("outputs that were applied"),
    };
    let direct = |cycle, output| applied_of(cycle, Some(bit(true)), output, Source::Direct);
    let mut referee = referee();
    let mut take = |member, at, event: &Event| referee.observe_from(member, Time(at), event);
    // y = x ⊕ u: only the first output is 1.
    for (member, at, event) in [
        (author, 10, sampled(1, true)),
        (author, 18, direct(1, true)),
        (author, 20, sampled(2, true)),
        (author, 28, direct(2, false)),
        (author, 30, sampled(3, true)),
        (successor, 40, sampled(4, true)),
        (successor, 48, direct(4, false)),
        (successor, 50, sampled(5, true)),
        (successor, 58, direct(5, false)),
    ] {
        assert_eq!(take(member, at, &event), Ok(()), "{event:?}");
    }
    let mut late = referee.clone();
    assert_eq!(late.observe_from(author, Time(38), &direct(3, false)), Ok(()));
    assert!(late.counts(successor) && !late.counts(author) && late.gaps() == 0);
    let mut wrong = referee.clone();
    let found = wrong.observe_from(author, Time(38), &direct(3, true));
    assert!(matches!(found, Err(Violation::Wrong { truth: Some(_), .. })), "{found:?}");
    // What was applied now is of an old cycle.
    let mut old = referee.clone();
    let found = old.observe_from(author, Time(59), &direct(3, false));
    assert!(matches!(found, Err(Violation::Wrong { truth: None, .. })), "{found:?}");
    for (input, source) in [(None, Source::Direct), (Some(bit(true)), Source::Held)] {
        let mut unknown = referee.clone();
        let event = applied_of(3, input, false, source);
        assert_eq!(unknown.observe_from(author, Time(38), &event), Ok(()), "{event:?}");
        assert_eq!(unknown.gaps(), 1, "{event:?}");
    }
    // The sample of cycle 2 has no record, and is no sample of cycle 1.
    let mut unrecorded = self::referee();
    unrecorded.saw(&bit(true));
    assert_eq!(unrecorded.observe_from(author, Time(10), &sampled(1, true)), Ok(()));
    unrecorded.starts_again();
    for (at, event) in [(30, sampled(3, true)), (38, direct(3, false))] {
        assert_eq!(unrecorded.observe_from(successor, Time(at), &event), Ok(()), "{event:?}");
    }
    let found = unrecorded.clone().observe_from(author, Time(18), &direct(1, false));
    assert!(matches!(found, Err(Violation::Wrong { truth: Some(_), .. })), "{found:?}");
    assert_eq!(unrecorded.observe_from(author, Time(18), &direct(1, true)), Ok(()));
    assert_eq!(unrecorded.gaps(), 0);
}

#[derive(Debug)]
struct Unchanged;

impl Conversion for Unchanged {
    fn convert(&self, state: &[u64]) -> Vec<u64> {
        state.to_vec()
    }

    fn release(&self, _: &mut [u64], _: &[u64]) {}
}

/// A change of other programs or settings leaves the program running that a change before it has brought, and its outputs are judged.
#[test]
fn a_program_is_judged_during_later_changes_of_others() {
    let mut referee = referee();
    let before = referee.programs.first.clone();
    let after = Program { hash: ProgramHash(6), executable: before.executable.clone() };
    let way = Arc::new(Unchanged);
    let change = |number: u64, programs| {
        let [before, after] = [number, number + 1].map(ConfigurationHash);
        Arc::new(OnlineChange { before, after, programs, fallbacks: Vec::new() })
    };
    let program = ProgramChange {
        program: ProgramId(0),
        before,
        after,
        forward: way.clone(),
        back: way,
        points: None,
        known_by: Default::default(),
    };
    referee.learn(&change(1, vec![program]));
    let mut lineage = Lineage::genesis(ProgramHash(5), moment(0));
    let mut sample = |cycle, change| {
        let (moment, born, inputs) = (moment(cycle), moment(0), bit(true));
        let event =
            Event::Sampled { moment, born, before: lineage, change, inputs: inputs.clone() };
        lineage = lineage.after_step(&Step { change, inputs });
        event
    };
    assert_eq!(referee.observe(&sample(1, None)), Ok(()));
    assert_eq!(referee.observe(&sample(2, Some(ProgramHash(6)))), Ok(()));
    for number in 2..2 + programs::EARLIER_PROGRAMS as u64 {
        referee.learn(&change(number, Vec::new()));
        assert_eq!(referee.observe(&sample(1 + number, None)), Ok(()));
        assert_eq!(referee.observe(&applied(1 + number, false, Source::Direct)), Ok(()));
    }
    assert_eq!(referee.gaps(), 0);
    let wrong = referee.observe(&applied(99, true, Source::Direct));
    assert!(wrong.is_err(), "{wrong:?}");
}
