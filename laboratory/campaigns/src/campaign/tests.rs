use understudy_cycle::Mode;
use understudy_reliability::Hours;
use understudy_simulator::{Action, SpareTimes};
use understudy_testing::press_cell;
use understudy_wire::{Member, ProgramId, StationId, Time};

use super::lives::{Lives, Order};
use super::seen::Seen;
use super::*;

fn plan(failures: u64, threads: usize) -> CampaignPlan {
    CampaignPlan {
        mtbf_cycles: 300.0,
        mttr_cycles: 50.0,
        crews: None,
        acceleration: 1.0,
        failures,
        seed: 3,
        maximum_cycles: 1_000_000,
        threads,
        remote_io: None,
        network: None,
    }
}

#[test]
fn a_campaign_is_the_same_on_any_number_of_processors() {
    let cell = press_cell(Mode::Full);
    let one = run_campaign(&cell, &plan(6, 1), &mut |_| {});
    let three = run_campaign(&cell, &plan(6, 3), &mut |_| {});
    assert_eq!(one, three);
    let other = CampaignPlan { seed: 4, ..plan(6, 1) };
    assert_ne!(one, run_campaign(&cell, &other, &mut |_| {}));
}

#[test]
fn every_failure_of_the_system_has_the_cause_that_its_definition_names() {
    for (mode, second) in [(Mode::Full, "understudy"), (Mode::Paper, " after ")] {
        let found =
            run_campaign(&press_cell(mode), &plan(30, 2), &mut |_| {}).expect("synchronised");
        assert_eq!(found.campaign.failures.len(), 30);
        assert_eq!(found.violations, Vec::<String>::new());
        assert_eq!(found.unmasked, 0, "one failure at a time is masked");
        for failure in &found.campaign.failures {
            assert!(failure.cause.contains(second), "{}", failure.cause);
            assert!(failure.cause.contains(" after "), "{}", failure.cause);
        }
        let detection = found.own.detection_cycles.expect("failures are detected");
        assert!(detection < 10.0, "{detection}");
    }
}

#[test]
fn a_replica_that_does_not_fail_is_censored() {
    let lasting = CampaignPlan { mtbf_cycles: 1e9, maximum_cycles: 200, ..plan(2, 1) };
    let found = run_campaign(&press_cell(Mode::Full), &lasting, &mut |_| {}).expect("synchronised");
    assert_eq!(found.campaign.failures.len(), 0);
    assert_eq!(found.campaign.censored_hours.len(), 2);
}

/// The press cell's period is 10 ms.
fn hours(cycles: f64) -> Hours {
    Hours::new("a time", cycles * 0.01 / 3600.0).expect("a time")
}

/// With the protocol's own time, and with no more than that, the model is that of the campaign.
#[test]
fn the_model_with_the_protocols_own_time_lies_in_the_interval() {
    for (mode, crews) in [(Mode::Full, None), (Mode::Paper, None), (Mode::Full, Some(1))] {
        let cell = press_cell(mode);
        let question = Question {
            mtbf: hours(300.0),
            mttr: hours(50.0),
            remote_io: None,
            network: None,
            crews,
            failures: 60,
            seed: 1,
            speed: Speed::Usual,
            forced: false,
        };
        let planned = plan_campaign(&cell, &question).expect("a campaign");
        assert!((planned.plan.acceleration - 1.0).abs() < 1e-12);
        let mut told = Vec::new();
        let measured = run_campaign(&cell, &planned.plan, &mut |done| told.push(done));
        assert_eq!(told, (1..=60).collect::<Vec<u64>>());
        let found = hold_against_model(&cell, &planned, measured.expect("synchronised"));
        let found = found.expect("an assessment");
        assert!(found.is_met(), "{mode:?}: {}", found.to_text());
        assert!(found.own_time_bias < 0.0);
        assert!(
            (3.0..5.0).contains(&found.own.detection_cycles.expect("detected")),
            "three silent cycles, and the rest of the one in which it failed"
        );
        assert!(found.own.taking_over_cycles.expect("taken over") < 3.0);
    }
}

/// What is ordered to whom.
fn orders(lives: &mut Lives<'_>) -> Vec<(StationId, Action)> {
    let orders = lives.take_orders().into_iter();
    orders
        .filter_map(|order| match order {
            Order::Do { member: Member::Station(station), action, .. } => Some((station, action)),
            Order::Do { .. } | Order::Forget(_) => None,
        })
        .collect()
}

const ROBOT: StationId = StationId(0);
const PRESS: StationId = StationId(1);
const UNDERSTUDY: StationId = StationId(2);

#[test]
fn a_station_is_down_until_it_holds_every_state() {
    let cell = press_cell(Mode::Full);
    let plan = plan(1, 1);
    let mut lives = Lives::new(&cell, &plan, 0);
    lives.begin();
    assert_eq!(orders(&mut lives).len(), 3);
    lives.see(Time(100), Seen::Crashed(UNDERSTUDY));
    lives.see(Time(130), Seen::Flagged(UNDERSTUDY));
    lives.see(Time(131), Seen::Flagged(UNDERSTUDY));
    assert_eq!(orders(&mut lives), [(UNDERSTUDY, Action::Restart)]);
    lives.see(Time(200), Seen::Restarted(UNDERSTUDY));
    lives.see(Time(210), Seen::Adopted(UNDERSTUDY, ProgramId(0)));
    assert_eq!(orders(&mut lives), []);
    lives.see(Time(211), Seen::Adopted(UNDERSTUDY, ProgramId(1)));
    assert_eq!(orders(&mut lives), [(UNDERSTUDY, Action::Crash)]);
    // It is in shadow, and still counts as failed with everybody: nobody will flag it once more.
    lives.see(Time(220), Seen::Crashed(UNDERSTUDY));
    assert_eq!(orders(&mut lives), [(UNDERSTUDY, Action::Restart)]);
    lives.see(Time(230), Seen::Crashed(PRESS));
    assert!(lives.has_failed());
    let run = lives.end(Time(240), 240, true);
    assert_eq!(run.cause.as_deref(), Some("press after understudy"));
    assert_eq!(run.detection.finished_ns, [30, 0]);
    assert_eq!(run.detection.unfinished_ns, [10]);
    assert_eq!(run.repair.finished_ns, [70]);
    assert_eq!(run.repair.unfinished_ns, [20]);
    assert_eq!(run.taking_over.finished_ns, [11]);
    assert_eq!(run.shadow.unfinished_ns, [9]);
    assert_eq!(run.repair.mean_ns(), Some(90.0));
}

#[test]
fn one_crew_works_on_one_station_at_a_time() {
    let cell = press_cell(Mode::Full);
    let plan = CampaignPlan { crews: Some(1), ..plan(1, 1) };
    let mut lives = Lives::new(&cell, &plan, 0);
    for (time, station) in [(1, ROBOT), (2, PRESS)] {
        lives.see(Time(time), Seen::Crashed(station));
        lives.see(Time(time), Seen::Flagged(station));
    }
    let ordered = lives.take_orders();
    let forgotten = ordered.iter().filter(|order| matches!(order, Order::Forget(_)));
    assert_eq!(forgotten.count(), 2, "{ordered:?}");
    let Some(Order::Do { member: Member::Station(station), .. }) = ordered.last() else {
        panic!("{ordered:?}");
    };
    lives.see(Time(3), Seen::Restarted(*station));
    let left = if *station == ROBOT { PRESS } else { ROBOT };
    assert_eq!(orders(&mut lives), [(left, Action::Restart)]);
}

#[test]
fn a_deadline_beside_a_stall_of_the_host_says_nothing_of_the_masking() {
    let period = 10_000_000;
    let check = |seen: &[(u64, Seen)], asked, unmasked, excused| {
        let cell = press_cell(Mode::Full);
        let plan = plan(1, 1);
        let mut lives = Lives::new(&cell, &plan, 0);
        lives.see(Time(0), Seen::Crashed(ROBOT));
        for (cycle, seen) in seen {
            lives.see(Time(cycle * period), seen.clone());
        }
        let run = lives.end(Time(100 * period), 100, false);
        assert_eq!((run.asked, run.unmasked, run.excused), (asked, unmasked, excused));
    };
    check(&[], 1, 0, 0);
    check(&[(1, Seen::Missed), (2, Seen::Missed)], 1, 1, 0);
    check(&[(1, Seen::Missed), (3, Seen::Stalled)], 0, 0, 1);
    check(&[(1, Seen::Stalled), (3, Seen::Missed)], 0, 0, 1);
    check(&[(1, Seen::Missed), (30, Seen::Stalled)], 1, 1, 0);
}

/// Two groups share a spare: the measured MTTF agrees with the model of shared spares, and is well above that without them.
#[test]
fn groups_that_share_a_spare_live_as_long_as_the_model_says() {
    let cell = understudy_testing::cluster(understudy_testing::CELL_WITH_SPARE, Mode::Full);
    let question = Question {
        mtbf: hours(1500.0),
        mttr: hours(300.0),
        remote_io: None,
        network: None,
        crews: None,
        failures: 40,
        seed: 1,
        speed: Speed::Factor(1.0),
        forced: false,
    };
    let planned = plan_campaign(&cell, &question).expect("a campaign");
    let times = SpareTimes { spare_after: 20, retire_after: 5 };
    let found = |threads| {
        let planned = Planned { plan: CampaignPlan { threads, ..planned.plan }, ..planned.clone() };
        let found = measure_shared(&cell, &planned, 2, times, &mut |_| {});
        found.expect("synchronised").expect("a model")
    };
    let (one, two) = (found(1), found(2));
    assert!(one.is_met(), "{}", one.to_text());
    assert!(one.model_hours > 1.5 * one.without_hours, "{}", one.to_text());
    assert!(one.joined_cycles.is_some_and(|cycles| cycles < 20.0), "{}", one.to_text());
    assert_eq!(one.mttf_hours, two.mttf_hours, "on any number of threads");
}

/// The press cell without a single point of failure above its devices: two networks, an understudy, twins.
const WHOLE_CELL: &str = include_str!("../../../../examples/twin-remote-io/cluster.toml");

/// Stations, remote I/Os and networks fail: the cell lives as long as the model of all of them says, by each of its causes.
#[test]
fn a_whole_cell_lives_as_long_as_the_model_says() {
    let cell = understudy_testing::cluster(WHOLE_CELL, Mode::Full);
    let times = |mtbf, mttr| Some((hours(mtbf), hours(mttr)));
    let question = Question {
        mtbf: hours(1500.0),
        mttr: hours(150.0),
        remote_io: times(1500.0, 150.0),
        network: times(1500.0, 150.0),
        crews: None,
        failures: 60,
        seed: 1,
        speed: Speed::Factor(1.0),
        forced: false,
    };
    let planned = plan_campaign(&cell, &question).expect("a campaign");
    let measured = run_campaign(&cell, &planned.plan, &mut |_| {}).expect("synchronised");
    let found = hold_against_model(&cell, &planned, measured).expect("an assessment");
    let text = found.to_text();
    assert!(found.is_met(), "{text}");
    let parts = found.parts.expect("they fail");
    assert!(parts.remote_ios > 60 && parts.networks > 30 && parts.switchovers > 30, "{text}");
    for cause in ["both networks", "after its twin", "understudy"] {
        assert!(found.assessment.causes.keys().any(|it| it.contains(cause)), "{cause}: {text}");
    }
}
