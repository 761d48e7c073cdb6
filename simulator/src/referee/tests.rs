//! A referee that never blows its whistle proves nothing: every kind of violation is shown to it.

use understudy_logic::CircuitBuilder;
use understudy_remote_io::{Release, ValueFault};
use understudy_wire::{
    Agreement, ClusterHash, ConfigurationHash, Cycle, Epoch, Mode, ProgramId, Schedule, StationId,
    StationSet,
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
        inputs: 1,
        channels: Vec::new(),
        diagnosis: None,
        hold_cycles: 2,
        fail_safe: Image::zero(1),
        release: Release::Automatic,
        value_fault: ValueFault::Hold,
    };
    Referee::new(&settings, Scan::new(&circuit))
}

fn moment(cycle: u64) -> Moment {
    Moment {
        epoch: Epoch(1),
        cycle: Cycle(cycle),
    }
}

fn bit(bit: bool) -> Image {
    Image::from_bits([bit])
}

fn born() -> Event {
    Event::StartedCold {
        born: moment(0),
        awaits_release: false,
    }
}

fn sampled(cycle: u64, input: bool) -> Event {
    Event::Sampled {
        moment: moment(cycle),
        inputs: bit(input),
    }
}

fn applied(cycle: u64, output: bool, source: Source) -> Event {
    Event::Applied {
        moment: moment(cycle),
        sampled: None,
        outputs: bit(output),
        source,
        word_of: None,
        missing: None,
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
fn only_the_true_output_may_be_driven_as_true() {
    for source in [Source::Direct, Source::Reconstructed] {
        for (first, second, output) in
            (0..8).map(|case| (case & 1 == 1, case & 2 == 2, case & 4 == 4))
        {
            let truth = first ^ second;
            let events = [
                born(),
                sampled(1, first),
                sampled(2, second),
                applied(2, output, source),
            ];
            check(&events, output != truth);
        }
        check(&[born(), sampled(1, true), applied(2, true, source)], true);
        check(&[applied(1, false, source)], true);
    }
}

#[test]
fn only_the_last_true_output_may_be_held_and_not_for_long() {
    let start = [born(), sampled(1, true), applied(1, true, Source::Direct)];
    let then = |more: &[Event]| [&start, more].concat();
    let held = |cycle, output| applied(cycle, output, Source::Held);
    check(&then(&[held(2, true)]), false);
    check(&then(&[held(2, false)]), true);
    check(&then(&[held(2, true), held(3, true)]), false);
    check(&then(&[held(2, true), held(3, true), held(4, true)]), true);
    check(&[born(), held(1, false)], true);
}

#[test]
fn only_the_configured_values_are_safe() {
    check(&[applied(1, false, Source::FailSafe)], false);
    check(&[applied(1, true, Source::FailSafe)], true);
}

#[test]
fn a_program_goes_on_only_from_what_its_plant_has_seen() {
    let genesis = Lineage::genesis(ProgramHash(5), moment(0));
    let seen = genesis.after(&bit(true));
    let adopted = |lineage| Event::AdoptedLineage {
        moment: moment(3),
        lineage,
        from: StationId(0),
    };
    let voided = |lineage| Event::Voided {
        moment: moment(3),
        samples: 1,
        lineage,
    };
    let start = [born(), sampled(1, true), sampled(2, false)];
    for (lineage, violation) in [
        (seen, false),
        (genesis, false),
        (seen.after(&bit(true)), true),
    ] {
        check(&[&start[..], &[adopted(lineage)]].concat(), violation);
        check(&[&start[..], &[voided(lineage)]].concat(), violation);
    }
    // From the state after u = 1, an input of 0 gives 1.
    let resumed = [
        voided(seen),
        sampled(3, false),
        applied(3, true, Source::Direct),
    ];
    check(&[&start[..], &resumed].concat(), false);
}

#[test]
fn what_follows_missing_records_is_not_judged_until_a_state_is_known() {
    let mut referee = referee();
    for event in [born(), sampled(1, true), applied(1, true, Source::Direct)] {
        assert_eq!(referee.observe(&event), Ok(()), "{event:?}");
    }
    let (lineage, _) = referee.standing().expect("it was born");
    referee.misses_records();
    assert_eq!(referee.standing(), None);
    // Whether these are true nobody can say, and that they are not the fail-safe values everybody can.
    for event in [
        applied(5, false, Source::Held),
        sampled(6, true),
        applied(6, true, Source::Reconstructed),
        Event::Voided {
            moment: moment(7),
            samples: 1,
            lineage: lineage
                .after(&bit(false))
                .after(&bit(false))
                .after(&bit(false)),
        },
        applied(7, true, Source::Direct),
    ] {
        assert_eq!(referee.observe(&event), Ok(()), "{event:?}");
    }
    let wrong = referee.observe(&applied(8, true, Source::FailSafe));
    assert!(wrong.is_err(), "{wrong:?}");
    // From a state that is known it judges again: x = 1 and u = 1 give 0.
    referee.goes_on_from(lineage, bit(true));
    assert_eq!(referee.observe(&sampled(9, true)), Ok(()));
    let wrong = referee.observe(&applied(9, true, Source::Direct));
    assert!(wrong.is_err(), "{wrong:?}");
}
