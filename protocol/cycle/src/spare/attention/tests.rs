//! What wakes a spare, and what does not.

use std::time::Duration;

use proptest::prelude::*;
use understudy_wire::{ClusterHash, ConfigurationHash};

use super::*;
use crate::Schedule;
use crate::spare::{AttendanceCount, wanted};

const SPARE_AFTER: u32 = 20;

fn agreement(controllers: usize, understudies: usize, slots: usize) -> Agreement {
    let schedule = Schedule::new(Duration::from_millis(10), controllers, understudies + slots, 2);
    let first = controllers + understudies;
    let slots = (first..first + slots).map(|rank| StationId(rank as u8)).collect();
    Agreement {
        cluster: ClusterHash::default(),
        configuration: ConfigurationHash::default(),
        schedule: schedule.expect("a schedule").with_spare_slots(slots),
        mode: Mode::Full,
        history: 8,
        flag_after: 3,
        shadow_cycles: 3,
        listen_cycles: 4,
    }
}

/// Three controllers, an understudy (rank 3) and two slots (ranks 4 and 5), seen by three witnesses.
struct Bench {
    attention: Attention,
}

fn set(ranks: &[u8]) -> StationSet {
    ranks.iter().map(|rank| StationId(*rank)).collect()
}

const ALL: [u8; 4] = [0, 1, 2, 3];

impl Bench {
    fn new(own: u8) -> Self {
        let attention = Attention::new(&agreement(3, 1, 2), StationId(own), SPARE_AFTER);
        let mut bench = Self { attention };
        bench.pass(100, &ALL);
        bench
    }

    /// Deadlines at which every witness has received these stations.
    fn pass(&mut self, cycles: u32, heard: &[u8]) {
        for _ in 0..cycles {
            (0..3).for_each(|witness| self.attention.deadline(witness, set(heard)));
        }
    }

    fn is_wanted(&self) -> bool {
        wanted(&self.attention.standing())
    }
}

/// Every station, also the understudy.
#[test]
fn a_station_that_is_flagged_for_spare_after_cycles_wakes_the_spare_and_not_one_cycle_earlier() {
    for failed in ALL {
        let mut bench = Bench::new(4);
        let others: Vec<u8> = ALL.into_iter().filter(|rank| *rank != failed).collect();
        bench.pass(SPARE_AFTER - 1, &others);
        assert!(!bench.is_wanted(), "{failed}");
        bench.pass(1, &others);
        assert!(bench.is_wanted(), "{failed}");
        assert_eq!(bench.attention.failed().collect::<Vec<_>>(), [StationId(failed)]);
        assert_eq!(bench.attention.standing().redundancy, 0);
    }
}

#[test]
fn a_station_that_flaps_faster_than_spare_after_wakes_nobody() {
    let mut bench = Bench::new(4);
    for _ in 0..50 {
        bench.pass(SPARE_AFTER - 1, &[0, 1, 3]);
        assert!(!bench.is_wanted());
        bench.pass(1, &ALL);
    }
}

/// Ten failures in a minute: 6 s each, half of it down. Once awake, the spare stays; with an hour of rest it retires once.
#[test]
fn a_station_that_flaps_ten_times_a_minute_does_not_make_the_spare_run_in_circles() {
    let retire_after = 3000;
    let mut bench = Bench::new(4);
    let mut orders = 0;
    let mut awake = false;
    let mut turn = |bench: &Bench, awake: &mut bool| {
        let standing = bench.attention.standing();
        let next = if *awake { standing.complete < retire_after } else { wanted(&standing) };
        orders += u32::from(next != *awake);
        *awake = next;
    };
    for _ in 0..100 {
        for _ in 0..300 {
            bench.pass(1, &[0, 1, 3]);
            turn(&bench, &mut awake);
        }
        for _ in 0..300 {
            bench.pass(1, &[0, 1, 2, 3, 4]);
            turn(&bench, &mut awake);
        }
    }
    assert!(awake);
    for _ in 0..retire_after {
        bench.pass(1, &[0, 1, 2, 3, 4]);
        turn(&bench, &mut awake);
    }
    assert!(!awake);
    assert_eq!(orders, 2);
}

/// Its stations start one after the other; one that never comes counts in the end.
#[test]
fn a_group_that_starts_wakes_nobody() {
    let attention = Attention::new(&agreement(3, 1, 2), StationId(4), SPARE_AFTER);
    let mut bench = Bench { attention };
    bench.pass(SPARE_AFTER * 10 - 1, &[0, 2, 3]);
    assert!(!bench.is_wanted());
    bench.pass(1, &[0, 2, 3]);
    assert!(bench.is_wanted());
    bench.pass(1, &ALL);
    assert!(!bench.is_wanted());
    bench.pass(SPARE_AFTER, &[0, 2, 3]);
    assert!(bench.is_wanted(), "it is known now");
}

/// Its journal does not come, so it has no opinion; the others go on.
#[test]
fn a_remote_io_that_nobody_receives_wakes_nobody() {
    let mut bench = Bench::new(4);
    bench.attention.lost(0);
    for _ in 0..200 {
        (1..3).for_each(|witness| bench.attention.deadline(witness, set(&ALL)));
    }
    assert!(bench.attention.standing().seen);
    assert!(!bench.is_wanted());
}

/// A witness that is cut off from its group misses every station; the other ones do not.
#[test]
fn a_remote_io_that_is_cut_off_wakes_nobody() {
    let mut bench = Bench::new(4);
    for _ in 0..200 {
        bench.attention.deadline(0, StationSet::EMPTY);
        (1..3).for_each(|witness| bench.attention.deadline(witness, set(&ALL)));
    }
    assert!(!bench.is_wanted());
    // Of a broken link of one witness, the same.
    for _ in 0..200 {
        bench.attention.deadline(0, set(&[0, 1, 3]));
        (1..3).for_each(|witness| bench.attention.deadline(witness, set(&ALL)));
    }
    assert!(!bench.is_wanted());
}

/// One of three remote I/Os is followed: whatever it reports, most of the group is not seen.
#[test]
fn a_spare_that_sees_less_than_half_of_the_group_wakes_nowhere() {
    let mut bench = Bench::new(4);
    (1..3).for_each(|witness| bench.attention.lost(witness));
    (0..200).for_each(|_| bench.attention.deadline(0, set(&[0, 1, 3])));
    assert!(!bench.is_wanted());
    bench.attention.lost(0);
    let standing = bench.attention.standing();
    assert!(!standing.seen && !standing.served && !standing.publishes);
}

/// No station holds a state that the spare could adopt.
#[test]
fn a_group_without_a_living_station_wakes_nobody() {
    let mut bench = Bench::new(4);
    bench.pass(200, &[]);
    assert!(!bench.attention.standing().served);
    assert!(!bench.is_wanted());
}

/// In the paper's mode, one more understudy masks nothing.
#[test]
fn a_group_in_the_mode_of_the_paper_wakes_nobody() {
    let agreement = Agreement { mode: Mode::Paper, ..agreement(3, 1, 2) };
    let attention = Attention::new(&agreement, StationId(4), SPARE_AFTER);
    let mut bench = Bench { attention };
    bench.pass(100, &ALL);
    bench.pass(200, &[0, 1, 3]);
    assert!(bench.attention.failed().next().is_some());
    assert!(!bench.is_wanted());
}

#[test]
fn an_empty_slot_wakes_nobody() {
    let mut bench = Bench::new(4);
    bench.pass(1000, &ALL);
    assert!(!bench.is_wanted());
    assert_eq!(bench.attention.standing().full, 1);
}

/// The second slot waits for the first one: where that publishes, the second one is not needed, and two failures need both.
#[test]
fn the_second_slot_wakes_only_where_the_first_one_does_not_suffice() {
    let mut bench = Bench::new(5);
    bench.pass(SPARE_AFTER + 90, &[0, 1, 3]);
    assert!(!bench.is_wanted(), "it waits for the first slot");
    bench.pass(20, &[0, 1, 3]);
    assert!(bench.is_wanted(), "the first slot stays empty");
    bench.pass(1, &[0, 1, 3, 4]);
    assert!(!bench.is_wanted(), "the first slot publishes");
    bench.pass(SPARE_AFTER + 200, &[0, 1, 4]);
    assert!(bench.is_wanted(), "the understudy fails too");
}

/// Of two spares that are awake for one failure, the one of the later slot retires.
#[test]
fn the_later_slot_retires_where_both_are_awake() {
    for (own, retires) in [(4, false), (5, true)] {
        let mut bench = Bench::new(own);
        bench.pass(500, &[0, 1, 3, 4, 5]);
        assert_eq!(bench.attention.standing().complete > 400, retires, "{own}");
    }
}

proptest! {
    /// The redundancy is that of all sets of failures, tried one by one.
    #[test]
    fn redundancy_is_the_number_of_failures_that_every_program_survives(
        controllers in 1..4_usize, understudies in 0..3_usize, slots in 1..3_usize, heard in 0..256_u128,
    ) {
        let stations = controllers + understudies + slots;
        let own = StationId((stations - 1) as u8);
        let mut attention = Attention::new(&agreement(controllers, understudies, slots), own, 3);
        let present = StationSet::from_bits(heard).and(StationSet::first(stations));
        for _ in 0..2000 {
            (0..controllers).for_each(|witness| attention.deadline(witness, present));
        }
        let others = present.without(StationSet::only(own));
        let proves = |set: StationSet, program: usize| {
            set.iter().any(|it| it.index() == program || it.index() >= controllers)
        };
        let served: Vec<usize> = (0..controllers).filter(|it| proves(others, *it)).collect();
        let survives = |failures: u32| (0..1_u128 << stations).all(|failed| {
            let failed = StationSet::from_bits(failed).and(others);
            failed.len() as u32 > failures
                || served.iter().all(|program| proves(others.without(failed), *program))
        });
        let expected = (0..8).take_while(|failures| survives(*failures)).last();
        let standing = attention.standing();
        prop_assert_eq!(standing.served, !served.is_empty());
        if standing.served {
            prop_assert_eq!(Some(standing.redundancy), expected);
        }
    }
}

/// Reports that come once a second, and at once while a station is missed, lead to the same as every deadline.
#[test]
fn reports_lead_to_the_same_as_every_deadline() {
    let agreement = agreement(3, 1, 2);
    let mut by_deadline = Attention::new(&agreement, StationId(4), SPARE_AFTER);
    let mut by_report = by_deadline.clone();
    let mut counts = vec![AttendanceCount::new(&agreement.schedule); 3];
    let mut compared = 0;
    for cycle in 0..3000_u32 {
        let heard: &[u8] = match cycle {
            400..=410 | 900..=1100 => &[0, 2, 3],
            1000..=1300 => &[0, 1, 2, 4],
            1500..=1501 => &[0, 1, 2],
            _ => &ALL,
        };
        for (witness, count) in counts.iter_mut().enumerate() {
            by_deadline.deadline(witness, set(heard));
            count.deadline(set(heard));
            if let Some(report) = count.take() {
                by_report.told(witness, &report);
                compared += 1;
            }
        }
        let (every, told) = (by_deadline.standing(), by_report.standing());
        assert_eq!((every.redundancy, every.served), (told.redundancy, told.served), "{cycle}");
        assert!(told.complete <= every.complete, "{cycle}: {told:?} {every:?}");
        assert!(every.complete < told.complete + 110, "{cycle}: {told:?} {every:?}");
    }
    assert!(compared > 500, "{compared}");
}

/// A report of another number of stations is no report of this group.
#[test]
fn a_report_of_other_stations_is_not_taken() {
    let mut bench = Bench::new(4);
    let strange = AttendanceReport { deadlines: 7, silent: vec![9; 2], longest: vec![9; 2] };
    let before = bench.attention.standing();
    bench.attention.told(0, &strange);
    assert_eq!(bench.attention.standing(), before);
}

/// A spare that begins to follow a group does not take it for complete in the time before.
#[test]
fn the_first_report_says_nothing_of_the_time_before() {
    let mut attention = Attention::new(&agreement(3, 1, 2), StationId(4), SPARE_AFTER);
    let report = |deadlines| AttendanceReport {
        deadlines,
        silent: vec![0, 0, 0, 0, 9, 9],
        longest: vec![0, 0, 0, 0, 9, 9],
    };
    (0..3).for_each(|witness| attention.told(witness, &report(5_000)));
    assert_eq!(attention.standing().complete, 1);
    (0..3).for_each(|witness| attention.told(witness, &report(5_100)));
    assert_eq!(attention.standing().complete, 101);
    // It has started again.
    (0..3).for_each(|witness| attention.told(witness, &report(3)));
    assert_eq!(attention.standing().complete, 102);
}
