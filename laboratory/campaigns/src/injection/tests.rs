//! Campaigns on the press cell: the same on any number of threads and shards, and small failures that a scenario file repeats.

use understudy_cycle::Mode;
use understudy_journal::{JournalState, Members};
use understudy_simulator::{Action, Fault, ShardError};
use understudy_testing::press_cell;
use understudy_wire::{Member, Source, StationId};

use super::faultload::Injection;
use super::*;
use understudy_scenarios::{Circumstances, Scenario, Summary, World, read, simulate, write};

fn cell() -> Cluster {
    press_cell(Mode::Full)
}

fn plan(runs: u64, property: Property, kinds: &[Kind]) -> InjectionPlan {
    InjectionPlan {
        runs,
        seed: 7,
        cycles: 150,
        property,
        kinds: kinds.to_vec(),
        shard: Shard::WHOLE,
        spare_after: None,
    }
}

fn run(plan: &InjectionPlan, threads: usize) -> Findings {
    inject(&cell(), plan, threads, &|| true).expect("the cell comes into step")
}

fn scenario(text: &str) -> Scenario {
    let found = read("small.toml", text, Some(&Members::of(&cell())));
    assert_eq!(found.report.diagnostics, [], "{text}");
    found.scenario.expect("no diagnostics")
}

fn summary(scenario: &Scenario) -> Summary {
    let seed = scenario.seed.expect("a small scenario has its seed");
    let account = simulate(&cell(), scenario, seed, &mut |_| {}).expect("it comes into step");
    let circumstances = Circumstances {
        world: World::Simulator,
        seed: Some(seed),
        cluster: String::new(),
        configuration: String::new(),
        mode: String::new(),
        period_us: 10_000,
        link: String::new(),
        version: String::new(),
        machine: Vec::new(),
        repeat: String::new(),
    };
    Summary::new(account, scenario, circumstances, JournalState::default()).0
}

/// What the press cell is to bear: everything.
fn masked_kinds() -> Vec<Kind> {
    Kind::masked_by(cell().understudies().len())
}

#[test]
fn nothing_wrong_is_driven() {
    let findings = run(&plan(300, Property::Wrong, &masked_kinds()), 2);
    assert_eq!(findings.failures.first(), None);
    assert!(findings.is_good());
    // Every row of what was asked for was struck.
    let struck = |row: &CoverageRow| row.counts.iter().sum::<u64>() > 0;
    assert!(!findings.coverage.is_empty(), "{findings}");
    assert!(findings.coverage.iter().all(struck), "{findings}");
}

#[test]
fn threads_and_shards_change_nothing() {
    let whole = plan(60, Property::Held, &masked_kinds());
    let expected = run(&whole, 1);
    assert!(expected.runs_failed > 0, "loss holds cycles");
    assert_eq!(run(&whole, 3).to_json(), expected.to_json());
    let shards = ["2/3", "1/3", "3/3"].map(|shard| {
        let shard = InjectionPlan { shard: shard.parse().expect("a shard"), ..whole.clone() };
        let findings = run(&shard, 2);
        // As it is written and read again.
        let findings = Findings::parse(&findings.to_json()).expect("its own text");
        (shard.shard.to_string(), findings)
    });
    let merged = merge(shards.to_vec()).expect("they belong together");
    assert_eq!(merged.to_json(), expected.to_json());
}

/// What does not belong together is all said.
#[test]
fn shards_of_other_campaigns_are_refused() {
    let shard = |shard: &str, seed: u64| {
        let plan = InjectionPlan {
            seed,
            shard: shard.parse().expect("a shard"),
            ..plan(2, Property::Wrong, &[Kind::Crash])
        };
        (format!("{shard} of {seed}"), run(&plan, 1))
    };
    let errors = merge(vec![shard("1/4", 1), shard("1/4", 1), shard("2/4", 2)]);
    let texts: Vec<String> =
        errors.expect_err("they differ").iter().map(ToString::to_string).collect();
    let expected = [
        "1/4 of 1 and 1/4 of 1 are both shard 1/4",
        "2/4 of 2 is of another search than 1/4 of 1: the seed differs",
        "3 of 4 shards are missing: 2, 3, 4",
    ];
    assert_eq!(texts, expected);
    assert_eq!(merge(Vec::new()), Err(vec![ShardError::Nothing]));
}

/// Each small failure fails as a scenario file at the very cycle, from its own seed, and with nothing that could be left out.
#[test]
fn small_failures_are_repeated_by_a_scenario() {
    let held = run(&plan(40, Property::Held, &masked_kinds()), 2);
    let fail_safe = run(&plan(40, Property::FailSafe, &masked_kinds()), 2);
    for (findings, source) in [(&held, Source::Held), (&fail_safe, Source::FailSafe)] {
        assert!(findings.runs_failed > 0);
        for failure in &findings.failures {
            let scenario = scenario(&failure.scenario);
            assert!(scenario.cycles <= failure.cycle + 4);
            let summary = summary(&scenario);
            assert!(!summary.passed, "{}", failure.scenario);
            let total = summary.total();
            let count = match source {
                Source::Held => total.held,
                _ => total.fail_safe,
            };
            assert!(count > 0);
        }
    }
    // A crash of an understudy alone holds nothing, so what is left is never one.
    assert!(held.failures.iter().all(|failure| failure.faults <= failure.faults_drawn));
    let smallest = held.failures.iter().map(|failure| failure.faults).min();
    assert_eq!(smallest, Some(1));
}

/// Where protection is hunted, one crash without a repair is found as the whole cause.
#[test]
fn a_station_that_stays_away_is_one_crash() {
    let bench = Bench::new(&cell(), None).expect("the cell comes into step");
    let cell = cell();
    let plan = plan(1, Property::Unprotected, &[Kind::Crash, Kind::Stop]);
    let schedule = &cell.agreement().schedule;
    let (mut faultload, seed) = (0..)
        .map(|run| plan.draw(&Target::of(&cell), run))
        .find(|(faultload, _)| faultload.injections.len() > 3)
        .expect("some run has many faults");
    // One more, after all others, that never ends.
    let crash = Fault {
        at_cycle: plan.window().end,
        phase: 0.5,
        member: Member::Station(StationId(1)),
        action: Action::Crash,
    };
    faultload.injections.push(Injection {
        kind: Kind::Crash,
        role: Role::Controller,
        steps: vec![crash],
    });
    let symptom = bench.run(&faultload, plan.cycles, seed, plan.property).symptom;
    let found = Violating {
        faultload,
        cycles: plan.cycles,
        seed,
        symptom: symptom.expect("somebody stays away"),
    };
    let small = minimise(found, schedule, false, &mut |faultload, cycles, seed| {
        bench.run(faultload, cycles, seed, plan.property).symptom
    });
    let steps = small.faultload.steps();
    assert_eq!(steps.len(), 1, "{steps:?}");
    assert_eq!((steps[0].at_cycle, steps[0].phase), (FIRST_CYCLE, 0.0));
    let failure = Failure::new(&cell, &plan, 0, 4, &small);
    assert!(!summary(&scenario(&failure.scenario)).passed);
}

/// Whatever can be drawn can be written and is read back unchanged.
#[test]
fn scenarios_are_written_as_they_are_read() {
    let cell = cell();
    let plan = plan(300, Property::Wrong, &Kind::ALL);
    let members = Members::of(&cell);
    for run in 0..plan.runs {
        let (faultload, seed) = plan.draw(&Target::of(&cell), run);
        let title = format!("Run \"{run}\" \\ of\tall");
        let expect = plan.property.expectation();
        let drawn = faultload.scenario(title, plan.cycles, seed, expect);
        let text = write(&drawn, &members, &["Of a campaign".to_owned()]);
        let found = read("drawn.toml", &text, Some(&members));
        assert_eq!(found.report.diagnostics, [], "{text}");
        assert_eq!(found.scenario, Some(drawn), "{text}");
    }
}

/// Time that runs out leaves the findings of the first runs.
#[test]
fn a_campaign_may_end_early() {
    let asked = plan(1000, Property::Wrong, &[Kind::Crash]);
    let left = AtomicU64::new(20);
    let watch = || left.fetch_sub(1, Ordering::Relaxed) > 1;
    let early = inject(&cell(), &asked, 1, &watch).expect("it comes into step");
    assert_eq!((early.runs_made, early.is_good()), (20, false));
    let first = InjectionPlan { runs: 20, ..asked };
    assert_eq!(run(&first, 2).coverage, early.coverage);
}

/// The second remote I/O of a program fails with the power of all, is alone where it is isolated, and may have a wrong program.
#[test]
fn faults_strike_the_second_remote_io_too() {
    let text = "[cluster]\nname = \"twins\"\nperiod = \"10ms\"\n\
         [[controller]]\nname = \"robot\"\nladder = \"robot.ladder\"\n[[understudy]]\nname = \"u\"\n\
         [[remote_io]]\nname = \"io\"\ncontroller = \"robot\"\ntwin = { name = \"io-2\", wiring = \"exclusive\" }\n\
         [[plant]]\nname = \"arm\"\ncontroller = \"robot\"\nmodel = \"robot\"\nwatchdog_cycles = 4\n";
    let cluster = understudy_testing::cluster(text, Mode::Full);
    let target = Target::of(&cluster);
    let faults = |kind: Kind| {
        let plan = plan(40, Property::Wrong, &[kind]);
        let runs = (0..40).flat_map(|run| plan.draw(&target, run).0.injections);
        runs.collect::<Vec<Injection>>()
    };
    let program = understudy_wire::ProgramId(0);
    let (first, twin) = (Member::RemoteIo(program), Member::Twin(program));
    for injection in faults(Kind::PowerFailure) {
        for action in [Action::Crash, Action::Restart] {
            let steps = injection.steps.iter().filter(|step| step.action == action);
            let mut members: Vec<Member> = steps.map(|step| step.member).collect();
            members.sort_unstable();
            let stations = [0, 1].map(|rank| Member::Station(StationId(rank)));
            assert_eq!(members, [&stations[..], &[first, twin]].concat());
        }
    }
    for injection in faults(Kind::Isolation) {
        let alone = injection.steps[0].member;
        let cuts = |from: Member, to: Member| {
            injection.steps.iter().any(|it| (it.member, it.action) == (from, Action::Cut { to }))
        };
        for other in [first, twin].into_iter().filter(|other| *other != alone) {
            assert!(cuts(alone, other) && cuts(other, alone), "{alone:?} and {other:?}");
        }
    }
    for member in [first, twin] {
        let is_wrong =
            |step: &Fault| step.member == member && step.action == Action::RestartWrongProgram;
        assert!(faults(Kind::WrongProgram).iter().any(|it| it.steps.iter().any(is_wrong)));
    }
}

#[test]
fn the_page_shows_every_row() {
    let findings = run(&plan(20, Property::Held, &Kind::ALL), 2);
    let page = picture(&findings).expect("a page");
    for row in &findings.coverage {
        assert!(page.contains(row.kind.word()), "{}", row.kind);
    }
    assert!(page.contains("[[step]]"), "small scenarios are shown");
}
