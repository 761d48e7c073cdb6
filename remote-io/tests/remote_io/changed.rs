//! A start after the program has changed while the power was off: when the values that stations have taken over may be used without a question.

use understudy_cycle::{Output, RemoteIoInput};
use understudy_remote_io::{Event, Restart};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Digest, Epoch, Holding, Image, Kept, Lineage,
    Moment, Note, ProgramHash, Recalled, SamplesReceived, StateChoice, StationId, StationSet,
};

use crate::bench::{Bench, PROGRAM, join, settings};

/// The program that runs now, the one before it, and a third one.
const NOW: u64 = 1;
const BEFORE: u64 = 7;
const OTHER: u64 = 8;

fn moment(cycle: u64) -> Moment {
    Moment { epoch: Epoch(1), cycle: Cycle(cycle) }
}

/// The note of an applied output: its program, cycle and lineage.
fn note(program: u64, cycle: u64, lineage: u64) -> Note {
    Note {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(9),
        hash: ProgramHash(program),
        is_retentive: true,
        number: 5,
        lineage: Lineage(lineage),
        begun: None,
        recalled: Recalled {
            program: PROGRAM,
            sampled: moment(cycle),
            received: SamplesReceived::Later,
            applied: Some(moment(cycle)),
            excluded: StationSet::EMPTY,
            accounted_for: StationSet::EMPTY,
            writes: Default::default(),
            pulses: Default::default(),
            inputs: Image::zero(2),
            version: None,
        },
    }
}

/// What a station has kept: a state of a program after a cycle.
fn kept(program: u64, cycle: u64, lineage: u64, is_whole: bool) -> Kept {
    let holding = Holding {
        program: PROGRAM,
        born: moment(0),
        lineage: Lineage(lineage),
        stepped: moment(cycle),
        digest: Digest(0),
        version: None,
    };
    Kept { holding, of: ProgramHash(program), is_whole }
}

/// What it reports while both stations ask to join with what they have kept; a person makes a choice in the end.
fn run(
    found: Option<Note>,
    is_damaged: bool,
    kept: [Option<Kept>; 2],
    choice: Option<StateChoice>,
) -> Vec<Event> {
    run_with(Some(Restart::Warm), found, is_damaged, kept, choice)
}

/// The same with another kind of restart; none of a program without retentive variables.
fn run_with(
    restart: Option<Restart>,
    found: Option<Note>,
    is_damaged: bool,
    kept: [Option<Kept>; 2],
    choice: Option<StateChoice>,
) -> Vec<Event> {
    let mut settings = settings(1);
    settings.fallback.restart = restart;
    let mut bench = Bench::new(settings, 1000);
    bench.epoch = 2;
    bench.remote_io = bench.remote_io.noting(found, is_damaged);
    let mut said = Vec::new();
    for cycle in 0..60 {
        bench.cycle = 1000 + cycle;
        for (rank, kept) in (0..).zip(kept) {
            let Body::Join(mut body) = join(None, None) else { unreachable!("it is one") };
            body.retained = kept.into_iter().collect();
            said.extend(bench.receive(bench.start(), rank, false, Body::Join(body)));
        }
        let sensors = Image::zero(2);
        said.extend(bench.tell(RemoteIoInput::Field(&sensors)));
        said.extend(bench.decide());
        if let Some(choice) = choice.filter(|_| cycle == 40) {
            said.extend(bench.tell(RemoteIoInput::Choose(choice)));
        }
    }
    let reported = said.into_iter().filter_map(|output| match output {
        Output::Report(event) => Some(event),
        _ => None,
    });
    reported.collect()
}

/// What it has asked or started, up to the first start: `warm` with the cycles that are lost, `cold`, `asked`, `disputed`.
fn started(events: &[Event]) -> String {
    let words = events.iter().filter_map(|event| match event {
        Event::StartedWarm { lost, .. } => {
            Some(format!("warm {}", lost.map_or("?".into(), |lost| lost.to_string())))
        }
        Event::StartedCold { .. } => Some("cold".to_owned()),
        Event::StateLost { asks: true, .. } => Some("asked".to_owned()),
        Event::Disputed { .. } => Some("disputed".to_owned()),
        _ => None,
    });
    let mut words: Vec<String> = words.collect();
    // These stations follow nothing, so it starts again and again.
    let first = words.iter().position(|word| word.starts_with("warm") || word == "cold");
    words.truncate(first.map_or(words.len(), |first| first + 1));
    words.join(", ")
}

/// After a warm start that no person has released, the power fails again: what stations have kept meanwhile is not behind the plant.
#[test]
fn what_is_kept_of_a_start_without_an_applied_output_is_used() {
    let begin = Moment { epoch: Epoch(2), cycle: Cycle(5) };
    let later = Moment { cycle: Cycle(40), ..begin };
    let noted = |begun, applied| {
        let of = note(NOW, 50, 33);
        Some(Note { begun, recalled: Recalled { applied, ..of.recalled }, ..of })
    };
    let applied = Some(moment(50));
    let of = |born, is_whole| {
        let before = kept(NOW, 50, 99, is_whole);
        Some(Kept { holding: Holding { born, stepped: later, ..before.holding }, ..before })
    };
    let other = Moment { cycle: Cycle(6), ..begin };
    let older = Some(kept(NOW, 50, 33, true));
    let cases = [
        ("of that start", noted(Some(begin), applied), [of(begin, true); 2], "warm 0"),
        ("of it and before it", noted(Some(begin), applied), [older, of(begin, true)], "warm 0"),
        ("before it only", noted(Some(begin), applied), [older; 2], "warm 0"),
        ("no output was ever applied", noted(Some(begin), None), [of(begin, true); 2], "warm 0"),
        ("of another start", noted(Some(begin), applied), [of(other, true); 2], "asked"),
        ("outputs of it were applied", noted(None, applied), [of(begin, true); 2], "asked"),
        ("values are dropped", noted(Some(begin), applied), [of(begin, false); 2], "asked"),
    ];
    for (name, found, kept, wanted) in cases {
        assert_eq!(started(&run(found, false, kept, None)), wanted, "{name}");
    }
}

#[test]
fn values_of_the_program_before_are_used_where_its_note_proves_them() {
    let whole = |cycle, lineage| Some(kept(BEFORE, cycle, lineage, true));
    let noted = || Some(note(BEFORE, 50, 33));
    let cases = [
        ("the newest applied state", noted(), [whole(50, 33); 2], "warm 0"),
        ("one station has it", noted(), [whole(50, 33), None], "warm 0"),
        ("a sample behind it", noted(), [whole(51, 34), whole(50, 33)], "warm 0"),
        ("a state before it", noted(), [whole(49, 32); 2], "asked"),
        ("another state of its cycle", noted(), [whole(50, 99); 2], "asked"),
        ("no note", None, [whole(50, 33); 2], "asked"),
        ("the note of a third program", Some(note(OTHER, 50, 33)), [whole(50, 33); 2], "asked"),
        ("the note of this program", Some(note(NOW, 50, 33)), [whole(50, 33); 2], "asked"),
        ("values are dropped", noted(), [Some(kept(BEFORE, 50, 33, false)); 2], "asked"),
        ("no station has taken over any", noted(), [None; 2], "asked"),
        (
            "its own state with the note of the one before",
            noted(),
            [Some(kept(NOW, 50, 33, true)); 2],
            "asked",
        ),
        ("different states of a later cycle", noted(), [whole(51, 34), whole(51, 35)], "disputed"),
    ];
    for (what, found, kept, wanted) in cases {
        assert_eq!(started(&run(found, false, kept, None)), wanted, "{what}");
    }
    assert_eq!(started(&run(None, true, [whole(50, 33); 2], None)), "asked");
}

/// The program before kept nothing: there is nothing to wait for.
#[test]
fn a_program_that_kept_nothing_leaves_nothing_to_ask_for() {
    let found = Note { is_retentive: false, ..note(BEFORE, 50, 33) };
    assert_eq!(started(&run(Some(found), false, [None; 2], None)), "cold");
}

#[test]
fn a_person_can_use_what_is_not_proved() {
    let older = [Some(kept(BEFORE, 40, 32, true)); 2];
    let choice = Some(StateChoice::Newest { cycle: Some(Cycle(40)) });
    let found = Some(note(BEFORE, 50, 33));
    assert_eq!(started(&run(found.clone(), false, older, choice)), "asked, warm 10");
    assert_eq!(started(&run(found, false, older, Some(StateChoice::Cold))), "asked, cold");
}

/// A station that was excluded for a value fault does not count after the power failure either. In another configuration, its number may be that of
/// another station, so the operator is asked.
#[test]
fn what_an_excluded_station_has_kept_is_not_used() {
    let excluding = |program, configuration| {
        let mut found = note(program, 50, 33);
        found.configuration = ConfigurationHash(configuration);
        found.recalled.excluded = StationSet::only(StationId(0));
        Some(found)
    };
    let newer = |program| Some(kept(program, 55, 40, true));
    let right = |program| Some(kept(program, 50, 33, true));
    let cases = [
        ("it alone has a state", excluding(NOW, 2), [newer(NOW), None], "asked"),
        ("another one has the right one", excluding(NOW, 2), [newer(NOW), right(NOW)], "warm 0"),
        ("other stations", excluding(NOW, 9), [newer(NOW), right(NOW)], "asked"),
        ("another program", excluding(BEFORE, 9), [right(BEFORE), newer(BEFORE)], "asked"),
    ];
    for (what, found, kept, wanted) in cases {
        assert_eq!(started(&run(found, false, kept, None)), wanted, "{what}");
    }
}

/// The program before kept values, and this one has no retentive variables: they are not given up without a question.
#[test]
fn a_program_that_keeps_nothing_any_more_asks_before_it_starts() {
    let started_with =
        |found, is_damaged, choice| started(&run_with(None, found, is_damaged, [None; 2], choice));
    let before = || Some(note(BEFORE, 50, 33));
    assert_eq!(started_with(before(), false, None), "asked");
    assert_eq!(started_with(None, true, None), "asked");
    assert_eq!(started_with(before(), false, Some(StateChoice::Cold)), "asked, cold");
    let kept_nothing = |hash| Note { is_retentive: false, ..note(hash, 50, 33) };
    for found in [Some(kept_nothing(BEFORE)), Some(kept_nothing(NOW)), None] {
        assert_eq!(started_with(found, false, None), "cold");
    }
}
