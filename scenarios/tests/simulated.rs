//! Every scenario file that comes with the project, in virtual time.

use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_journal::{Happening, Journal, JournalState, Members, Record, RunEvent, records};
use understudy_scenarios::{
    Account, Circumstances, OriginRule, Scenario, Summary, Table, Terms, World, figure, read,
    report, simulate,
};
use understudy_testing::press_cell;

fn scenario(cluster: &Cluster, text: &str) -> Scenario {
    let found = read("scenario.toml", text, Some(&Members::of(cluster)));
    assert_eq!(found.report.diagnostics, []);
    found.scenario.expect("no diagnostics")
}

fn circumstances() -> Circumstances {
    Circumstances {
        world: World::Simulator,
        seed: Some(1),
        cluster: "press-cell".into(),
        configuration: "0".into(),
        mode: "full".into(),
        period_us: 10_000,
        link: "simulated".into(),
        version: "0".into(),
        machine: Vec::new(),
        repeat: "understudy simulate <cluster> & more".into(),
    }
}

/// Runs from a seed; the journal's bytes, and what it came to.
fn run(mode: Mode, text: &str, seed: u64) -> (Vec<u8>, Summary, Account) {
    let cluster = press_cell(mode);
    let scenario = scenario(&cluster, text);
    let mut bytes = Vec::new();
    let mut journal = Journal::new(&mut bytes);
    let account = simulate(&cluster, &scenario, seed, &mut |record| journal.write(record));
    let account = account.expect("the cluster comes into step");
    let state = journal.finish();
    let (summary, account) = Summary::new(account, &scenario, circumstances(), state);
    (bytes, summary, account)
}

#[track_caller]
fn check(mode: Mode, text: &str) -> Summary {
    let (_, summary, _) = run(mode, text, 1);
    assert!(summary.passed, "{}\n{summary:#?}", Table::new(&summary));
    summary
}

#[test]
fn table_two() {
    let summary = check(Mode::Full, include_str!("../table-two.toml"));
    insta::assert_snapshot!(Table::new(&summary));
}

#[test]
fn kill_each() {
    check(Mode::Full, include_str!("../kill-each.toml"));
}

#[test]
fn double_kill() {
    check(Mode::Full, include_str!("../double-kill.toml"));
}

#[test]
fn paper_double_kill() {
    let text = include_str!("../paper-double-kill.toml");
    check(Mode::Paper, text);
    let (_, summary, _) = run(Mode::Full, text, 1);
    assert!(!summary.passed, "the other mode masks the second failure");
}

#[test]
fn stop_and_continue() {
    check(Mode::Full, include_str!("../stop-and-continue.toml"));
}

#[test]
fn remote_io_restart() {
    check(Mode::Full, include_str!("../remote-io-restart.toml"));
}

#[test]
fn stations_are_cut_off() {
    check(Mode::Full, include_str!("../cut-off.toml"));
}

#[test]
fn lossy() {
    let summary = check(Mode::Full, include_str!("../lossy.toml"));
    assert!(summary.total().held > 0, "loss costs something");
}

/// The summary says so where a scenario does not come out as it expects.
#[test]
fn what_is_not_met_is_said() {
    let text = r#"
title = "Too much is expected"
cycles = 100
step = [{ at = 50, action = "crash", station = "robot" }]
[expect]
finished = { ram = 1000 }
during = [{ from = 40, to = 60, remote_io = "robot-io", source = "direct" }]
"#;
    let (_, summary, _) = run(Mode::Full, text, 1);
    assert!(!summary.passed);
    let lines: Vec<String> = summary
        .expectations
        .iter()
        .map(|expectation| {
            let met = if expectation.met { "met" } else { "NOT MET" };
            format!("{met}: {}; found {}", expectation.expected, expectation.found)
        })
        .collect();
    insta::assert_snapshot!(lines.join("\n"), @r"
    met: no wrong outputs; found 0
    NOT MET: ram finishes at least 1000 parts; found 2
    NOT MET: robot-io direct in cycles 40-59; found not in 10 cycles, first in cycle 50: reconstructed
    ");
}

/// The cycles in which a remote I/O is killed are neither held nor fail-safe: they are missed, and have a limit of their own.
#[test]
fn missed_cycles_have_a_limit() {
    let text = r#"
title = "A remote I/O is killed"
cycles = 100
step = [
    { at = 50, action = "crash", station = "robot-io" },
    { at = 60, action = "restart", station = "robot-io" },
]
[expect]
missed = 0
"#;
    let (_, summary, _) = run(Mode::Full, text, 1);
    assert!(!summary.passed);
    let unmet: Vec<_> = summary.expectations.iter().filter(|expected| !expected.met).collect();
    let [missed] = unmet[..] else { panic!("{:?}", summary.expectations) };
    assert_eq!(missed.expected, "no cycles missed");
    let found = summary.total().missed;
    assert!(found >= 10, "{found}");
    assert_eq!(missed.found, found.to_string());
    let allowed = text.replace("missed = 0", &format!("missed = {found}"));
    assert!(run(Mode::Full, &allowed, 1).1.passed);
}

/// The journal alone holds all that the account was made of.
#[test]
fn the_account_can_be_made_again_from_the_journal() {
    let text = include_str!("../kill-each.toml");
    let (bytes, summary, _) = run(Mode::Full, text, 3);
    let again = account_of(&bytes, text, Some);
    assert_eq!(again.remote_ios, summary.remote_ios);
    assert_eq!(again.violation_count, 0);
    // Found by the records, the origin may lie a cycle before the one that the simulator tells.
    assert_eq!(again.cycles_run, summary.cycles_run);
}

/// A referee that cannot fail would be none.
#[test]
fn an_output_that_was_changed_is_found() {
    use understudy_remote_io::Event;
    use understudy_wire::Source;

    let text = include_str!("../kill-each.toml");
    let (bytes, ..) = run(Mode::Full, text, 3);
    let mut deadlines = 0;
    let changed = account_of(&bytes, text, |mut record| {
        if let Happening::RemoteIo(Event::Applied { outputs, source: Source::Direct, .. }) =
            &mut record.event
        {
            deadlines += 1;
            if deadlines == 150 {
                outputs.set(0, !outputs.get(0));
            }
        }
        Some(record)
    });
    assert_eq!(changed.violation_count, 1);
    assert_eq!(changed.total().wrong, 1);
    assert!(!changed.passed);
    // A sample that is missing in the journal makes the state unknown or wrong, never silently right.
    let mut samples = 0;
    let lacking = account_of(&bytes, text, |record| {
        let sampled = matches!(record.event, Happening::RemoteIo(Event::Sampled { .. }));
        samples += usize::from(sampled);
        (!(sampled && samples == 150)).then_some(record)
    });
    assert!(lacking.violation_count > 0);
    assert!(!lacking.passed);
}

/// A remote I/O whose journal was too slow has not driven anything wrong; it has not been judged, which is no pass.
#[test]
fn what_was_not_written_is_not_judged_and_is_said() {
    use understudy_bus::HostEvent;
    use understudy_remote_io::Event;

    let text = "title = \"Quiet\"\ncycles = 60\n[expect]\nwrong = 0\n";
    let (bytes, summary, _) = run(Mode::Full, text, 3);
    assert!(summary.passed);
    let mut samples = 0;
    let lacking = account_of(&bytes, text, |record| {
        let sampled = record.name == "press-io"
            && matches!(record.event, Happening::RemoteIo(Event::Sampled { .. }));
        samples += usize::from(sampled);
        if !(sampled && samples == 30) {
            return Some(record);
        }
        Some(Record { event: Happening::Host(HostEvent::JournalLost { records: 1 }), ..record })
    });
    assert_eq!(lacking.violation_count, 0, "{:?}", lacking.violations);
    assert!(!lacking.passed);
    let unmet: Vec<&str> = lacking
        .expectations
        .iter()
        .filter(|expectation| !expectation.met)
        .map(|expectation| expectation.found.as_str())
        .collect();
    assert_eq!(
        unmet,
        [
            "its journal lost 1 records on a host that was too slow to write them; what came after was not judged"
        ]
    );
}

/// Held cycles count against the cluster, but for those in which the host under it did not run.
#[test]
fn what_a_stall_explains_is_apart() {
    use understudy_remote_io::Event;

    let text = r#"
title = "Nobody is left for the robot"
cycles = 60

[[step]]
at = 50
action = "crash"
station = "robot"

[[step]]
at = 50
action = "crash"
station = "understudy"

[expect]
held = 0

[[expect.during]]
from = 50
to = 60
remote_io = "robot-io"
source = "reconstructed"
"#;
    let (bytes, summary, _) = run(Mode::Full, text, 3);
    let unmet = summary.expectations.iter().filter(|expected| !expected.met);
    assert_eq!(unmet.count(), 2, "held cycles, and those of the range");
    let stalled = account_of(&bytes, text, |record| {
        let woken_late = match &record.event {
            Happening::RemoteIo(Event::Applied { moment, .. }) if record.name == "press-io" => {
                let (moment, late) = (*moment, std::time::Duration::from_millis(5));
                let event = Happening::RemoteIo(Event::Stalled { moment, late });
                Some(Record { event, ..record.clone() })
            }
            _ => None,
        };
        woken_late.into_iter().chain([record])
    });
    let found: Vec<&str> =
        stalled.expectations.iter().map(|expected| expected.found.as_str()).collect();
    assert!(stalled.passed, "{found:?}");
    assert_eq!(found.last().copied(), Some("as expected, but for 10 while the host stood still"));
}

/// The device of a suspended remote I/O keeps its last values: no deadline of that time was held or fail-safe, whatever it finds in its buffers
/// afterwards.
#[test]
fn the_deadlines_of_a_suspended_remote_io_are_missed() {
    let text = "title = \"Suspended\"\ncycles = 120\n\n[[step]]\nat = 30\naction = \"stop\"\nstation = \"robot-io\"\n\n[[step]]\nat = 80\naction = \"continue\"\nstation = \"robot-io\"\n";
    for seed in 0..20 {
        let (bytes, summary, _) = run(Mode::Full, text, seed);
        let mut at = std::collections::BTreeMap::<u64, usize>::new();
        for record in records(&bytes[..]) {
            let record = record.expect("a record");
            if record.name == "robot-io"
                && matches!(
                    record.event,
                    Happening::RemoteIo(understudy_remote_io::Event::Applied { .. })
                )
            {
                *at.entry(record.at_ns / 10_000_000).or_default() += 1;
            }
        }
        // At most one for the cycle in which it was suspended, and the one of the period in which it continues.
        assert!(at.values().all(|&count| count <= 2), "{seed}: {at:?}");
        let counts = summary.remote_ios[0].counts;
        assert!((48..=50).contains(&counts.missed), "{seed}: {counts:?}");
        assert!(counts.fail_safe + counts.held <= 4, "{seed}: {counts:?}");
        assert_eq!(counts.wrong, 0);
    }
}

/// A host that woke a member late once may have cost more than the cycle in which that was seen: neither passed nor failed.
#[test]
fn a_run_on_a_late_host_is_inconclusive() {
    use understudy_remote_io::Event;

    let text = "title = \"Nobody is left\"\ncycles = 60\n\n[[step]]\nat = 50\naction = \"crash\"\nstation = \"robot\"\n\n[[step]]\nat = 50\naction = \"crash\"\nstation = \"understudy\"\n\n[expect]\nheld = 0\n";
    let (bytes, summary, _) = run(Mode::Full, text, 3);
    assert_eq!((summary.passed, summary.inconclusive), (false, None));
    let judged = |text: &str| {
        let mut seen = 0;
        account_of(&bytes, text, |record| {
            let mut late = None;
            if let Happening::RemoteIo(Event::Applied { moment, .. }) = &record.event {
                seen += 1;
                let late_by = std::time::Duration::from_millis(5);
                let event = Happening::RemoteIo(Event::Stalled { moment: *moment, late: late_by });
                late = (seen == 40).then(|| Record { event, ..record.clone() });
            }
            late.into_iter().chain([record])
        })
    };
    let late = judged(text);
    assert!(!late.passed);
    assert_eq!(
        late.inconclusive.as_deref(),
        Some("the host woke members late 1 times, up to 5.0 ms of a period of 10.0 ms")
    );
    let longer = judged(&text.replace("cycles = 60", "cycles = 70"));
    assert_eq!(longer.inconclusive, None, "it is not complete");
}

#[test]
fn what_is_read_long_after_the_rest_is_counted_all_the_same() {
    let text = include_str!("../kill-each.toml");
    let (bytes, summary, _) = run(Mode::Full, text, 1);
    let (mut seen, mut kept) = (0, Vec::new());
    let late = account_of(&bytes, text, |record| {
        let is_late = record.name == "press-io";
        let is_last = record.event == Happening::Run(RunEvent::Finished);
        seen += u32::from(is_late);
        kept.push(record);
        // In step first, so that the steps find their cycles; then half of a thousand records at once.
        let waits = is_late && seen > 200 && kept.len() < 500;
        if waits && !is_last {
            return Vec::new();
        }
        if is_late || is_last {
            return std::mem::take(&mut kept);
        }
        kept.pop().into_iter().collect()
    });
    assert_eq!(late.remote_ios, summary.remote_ios);
    assert_eq!(late.stations, summary.stations);
}

/// Whoever tells last has not told of the cycle in which everybody is asked to end.
#[test]
fn the_cycle_in_which_a_run_is_interrupted_is_none_of_it() {
    use understudy_remote_io::Event as RemoteIoEvent;

    let text = include_str!("../kill-each.toml");
    let (bytes, _, _) = run(Mode::Full, text, 1);
    for teller in ["robot-io", "press-io"] {
        let mut told = 0;
        let summary = account_of(&bytes, text, |record| {
            let tells = matches!(record.event, Happening::RemoteIo(RemoteIoEvent::Applied { .. }));
            told += u32::from(tells && record.name == teller);
            match told {
                0..=150 => vec![record],
                151 if tells && record.name == teller => {
                    vec![record, Record::of_run(0, RunEvent::Interrupted)]
                }
                _ => Vec::new(),
            }
        });
        assert!(summary.interrupted && summary.cycles_run > 100, "{teller}");
        assert!(!summary.plants.is_empty(), "{teller}");
        assert!(summary.plants.iter().all(|plant| plant.functional));
        let missed = summary.remote_ios.iter().map(|one| one.counts.missed);
        assert_eq!(missed.sum::<u64>(), 0, "{teller}");
    }
}

/// The summary of a journal whose records went through `change`.
fn account_of<Changed: IntoIterator<Item = Record>>(
    bytes: &[u8],
    text: &str,
    mut change: impl FnMut(Record) -> Changed,
) -> Summary {
    let cluster = press_cell(Mode::Full);
    let scenario = scenario(&cluster, text);
    let mut account = Account::new(Terms::of(&cluster), &scenario, OriginRule::Found);
    let told = records(bytes).map(|record| record.expect("a record"));
    let finished = Record::of_run(0, RunEvent::Finished);
    for record in told.chain([finished]).flat_map(&mut change) {
        account.observe(&record);
    }
    Summary::new(account, &scenario, circumstances(), JournalState::default()).0
}

#[test]
fn the_report_and_the_figure_show_the_run() {
    let (_, summary, account) = run(Mode::Full, include_str!("../kill-each.toml"), 1);
    let figure = figure(&account, &summary).expect("a figure");
    for expected in [
        "(a) plant arm",
        "(b) plant ram",
        "(c) controller robot",
        "(d) controller press",
        "(e) understudy: parity",
        "part_present",
        "#F3C6C1",
    ] {
        assert!(figure.contains(expected), "{expected}");
    }
    let report = report(&summary, &figure).expect("a report");
    assert!(report.contains(&figure), "in one file");
    assert!(report.contains("understudy simulate &lt;cluster&gt; &amp; more"), "escaped");
    assert!(!report.contains("http://") || !report.contains("<link"), "alone");
}
