use understudy_cycle::Mode;
use understudy_node::Event as StationEvent;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_wire::{Image, Moment, StationSet};

use understudy_simulator::Action;

use super::*;
use crate::outlook::look_ahead;

const MILLISECOND: u64 = 1_000_000;

/// A record of a member, its time in milliseconds.
fn of(ms: u64, member: Member, event: Happening) -> Record {
    Record { at_ns: ms * MILLISECOND, name: String::new(), member: Some(member), event }
}

fn published(ms: u64, rank: u8) -> Record {
    let event = StationEvent::Published { moment: Moment::default(), words: Default::default() };
    of(ms, Member::Station(StationId(rank)), Happening::Station(event))
}

fn flagged(ms: u64, rank: u8) -> Record {
    let event = RemoteIoEvent::Flagged { moment: Moment::default(), station: StationId(rank) };
    of(ms, Member::RemoteIo(ProgramId(0)), Happening::RemoteIo(event))
}

fn stalled(ms: u64) -> Record {
    let event = RemoteIoEvent::Stalled {
        moment: Moment::default(),
        late: std::time::Duration::from_millis(50),
    };
    of(ms, Member::RemoteIo(ProgramId(1)), Happening::RemoteIo(event))
}

fn applied(ms: u64, program: u8, source: Source) -> Record {
    let event = RemoteIoEvent::Applied {
        moment: Moment::default(),
        sampled: None,
        outputs: Image::zero(1),
        driven: None,
        source,
        word_of: None,
        missing: None,
        points: None,
        heard: StationSet::EMPTY,
    };
    of(ms, Member::RemoteIo(ProgramId(program)), Happening::RemoteIo(event))
}

fn killed(ms: u64, rank: u8) -> Record {
    let event = RunEvent::Fault {
        action: Action::Crash,
        member: Member::Station(StationId(rank)),
        asked: 0,
    };
    Record::of_run(ms * MILLISECOND, event)
}

fn ended(ms: u64, rank: u8) -> Record {
    let event = RunEvent::Ended {
        member: Member::Station(StationId(rank)),
        how: "signal: 9 (SIGKILL)".to_owned(),
        said: Vec::new(),
    };
    Record::of_run(ms * MILLISECOND, event)
}

/// Two controllers and an understudy that speak until one second, and `more`.
fn view(more: Vec<Record>) -> JournalView {
    let mut records = vec![
        published(0, 0),
        published(1, 1),
        published(2, 2),
        applied(7, 0, Source::Direct),
        applied(7, 1, Source::Direct),
    ];
    records.extend(more);
    records.push(applied(10_002, 0, Source::Direct));
    observe_journal(records.into_iter().map(Ok)).expect("something is observed")
}

fn milliseconds(hours: f64) -> f64 {
    (hours * 3.6e6 * 1e3).round() / 1e3
}

#[test]
fn a_station_whose_process_ended_unexpectedly_failed_then() {
    let steps = |taken: fn(u64, u8) -> Record| {
        view(vec![taken(2_002, 0), flagged(2_032, 0), published(2_532, 0)])
    };
    assert_eq!(steps(ended), steps(killed));
}

#[test]
fn a_killed_station_failed_when_it_was_killed_and_is_repaired_when_it_speaks() {
    let found = view(vec![killed(2_002, 0), flagged(2_032, 0), published(2_532, 0)]);
    let observed = &found.observed;
    assert_eq!((found.controllers, found.understudies), (2, 1));
    assert_eq!(milliseconds(observed.hours), 10_000.0);
    assert_eq!(observed.failures_at.len(), 1);
    assert_eq!(milliseconds(observed.failures_at[0]), 2_000.0);
    assert_eq!(milliseconds(observed.detection_hours[0]), 30.0);
    assert_eq!(milliseconds(observed.repairing_hours), 500.0);
    assert_eq!(milliseconds(observed.working_hours), 3.0 * 10_000.0 - 530.0);
    assert_eq!((observed.asked, observed.masked, observed.repairs), (1, 1, 1));
}

#[test]
fn one_that_nobody_killed_failed_when_it_last_published() {
    let found = view(vec![published(3_002, 1), flagged(3_042, 1)]);
    assert_eq!(milliseconds(found.observed.failures_at[0]), 3_000.0);
    assert_eq!(milliseconds(found.observed.detection_hours[0]), 40.0);
    assert_eq!(found.observed.repairs, 0);
    assert_eq!(milliseconds(found.observed.repairing_hours), 6_960.0);
}

#[test]
fn a_silence_beside_a_stall_is_no_failure() {
    let found = view(vec![flagged(3_000, 1), stalled(3_050), published(3_060, 1)]);
    assert_eq!((found.observed.failures_at.len(), found.stalls), (0, 1));
}

#[test]
fn a_held_deadline_shows_that_a_failure_was_not_masked_unless_the_system_has_failed() {
    let check = |more: Vec<Record>, asked, masked, fail_safe| {
        let found = view(more);
        assert_eq!((found.observed.asked, found.observed.masked), (asked, masked));
        assert_eq!(found.fail_safe, fail_safe);
    };
    let held = |ms| applied(ms, 0, Source::Held);
    let one = || vec![killed(2_000, 0), flagged(2_040, 0)];
    check([one(), vec![held(2_010)]].concat(), 1, 0, 0);
    check([one(), vec![held(2_050)]].concat(), 1, 0, 0);
    check([one(), vec![held(1_900)]].concat(), 1, 1, 0);
    check([one(), vec![held(2_050), stalled(2_060)]].concat(), 1, 1, 0);
    let second =
        vec![killed(4_000, 2), held(4_010), flagged(4_040, 2), applied(4_050, 0, Source::FailSafe)];
    check([one(), second].concat(), 1, 1, 1);
}

#[test]
fn a_journal_without_a_whole_cluster_or_with_a_broken_line_says_so() {
    let refused = |records: Vec<Record>| {
        let found = observe_journal(records.into_iter().map(Ok));
        found.expect_err("nothing to observe").to_string()
    };
    assert!(refused(Vec::new()).contains("all"));
    let silent = refused(vec![published(1, 0), flagged(2, 2), applied(3, 0, Source::Direct)]);
    assert!(silent.contains("station 2, station 3"), "{silent}");
    let code = |bytes: &[u8]| {
        let broken = observe_journal(understudy_journal::records(bytes));
        broken.expect_err("no record").code()
    };
    let headed = [understudy_journal::journal_header(1), b"{}\n{}\n".to_vec()].concat();
    assert_eq!(code(&headed), "U0532");
    assert_eq!(code(b"{}\n{}\n"), "U0532");
    let first = br#"{"at_ns":1,"name":"laboratory","party":null,"event":{"event":"finished"}}"#;
    assert_eq!(code(first), "U0534");
}

#[test]
fn the_hours_to_come_take_a_repair_from_the_journal_or_from_the_user() {
    let hours = |text: &str| text.parse().expect("a time");
    let undisturbed = || view(Vec::new());
    let refused = look_ahead(undisturbed(), Mode::Full, hours("1h"), None);
    assert!(refused.expect_err("no repair")[0].to_string().contains("--mttr"));
    let given = look_ahead(undisturbed(), Mode::Full, hours("1s"), Some(hours("1s")));
    let given = given.expect("an outlook");
    assert!(given.outlook.reliability.estimate.is_some_and(|r| r > 0.8));
    let seen = view(vec![killed(2_002, 0), flagged(2_032, 0), published(2_532, 0)]);
    let found = look_ahead(seen, Mode::Full, hours("10s"), None).expect("an outlook");
    insta::assert_snapshot!(found.to_text());
}
