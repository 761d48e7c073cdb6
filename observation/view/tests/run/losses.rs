//! Lines of a journal that are lost, whether that is recorded or not, raise no alarm that the whole journal does not raise.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use understudy_bus::HostEvent;
use understudy_cluster::Cluster;
use understudy_journal::{Happening, Record};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_view::{Bounds, Model};
use understudy_wire::{Member, Source};

use crate::complete::{DISTURBED, QUIET, delivered};
use crate::support::{cell, example, records, scenario};

/// Both stations of a program fail, one after the other, and its remote I/O is started again.
const WITHOUT_OUTPUTS: &str = r#"
title = "without outputs"
cycles = 260

[[step]]
at = 30
action = "crash"
station = "robot"
[[step]]
at = 60
action = "stop"
station = "understudy"
[[step]]
at = 120
action = "continue"
station = "understudy"
[[step]]
at = 150
action = "restart"
station = "robot"
[[step]]
at = 200
action = "crash"
station = "robot-io"
[[step]]
at = 210
action = "restart"
station = "robot-io"
"#;

/// Outputs are reconstructed and held while stations come and go.
const TANK: &str = r#"
title = "a tank"
cycles = 160

[[step]]
at = 40
action = "crash"
station = "level"
[[step]]
at = 60
action = "stop"
station = "understudy"
[[step]]
at = 120
action = "continue"
station = "understudy"
"#;

/// Every member and kind of alarm of which there was one, however briefly.
fn alarms(cluster: &Cluster, records: &[Record]) -> BTreeSet<(String, &'static str)> {
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    records.iter().for_each(|record| model.note(record));
    model.alarms().map(|alarm| (alarm.name.clone(), alarm.alarm)).collect()
}

/// Loses lines of members alone and in a row; says so before the next line of the member where `says`.
fn with_losses(
    records: &[Record],
    period: Duration,
    chance: &mut Pcg64Mcg,
    says: bool,
) -> Vec<Record> {
    let every = [200, 40, 8][chance.random_range(0..3)];
    // Less than the second after which a member does not report.
    let longest = if period < Duration::from_millis(50) { 60 } else { 8 };
    let longest = [1, 4, longest][chance.random_range(0..3)];
    let mut lost = std::collections::BTreeMap::<Member, u64>::new();
    let mut left = std::collections::BTreeMap::<Member, u64>::new();
    let mut kept = Vec::new();
    for record in records {
        let Some(member) = record.member else {
            kept.push(record.clone());
            continue;
        };
        let left = left.entry(member).or_default();
        if *left == 0 && chance.random_range(0..every) == 0 {
            *left = chance.random_range(1..=longest);
        }
        if *left > 0 {
            *left -= 1;
            *lost.entry(member).or_default() += 1;
            continue;
        }
        if let Some(records) = lost.remove(&member).filter(|_| says) {
            let event = Happening::Host(HostEvent::JournalLost { records });
            kept.push(Record { event, ..record.clone() });
        }
        kept.push(record.clone());
    }
    kept
}

#[test]
fn lines_that_are_lost_raise_no_alarm_that_the_whole_journal_does_not() {
    let runs = [
        (cell(), QUIET),
        (cell(), DISTURBED),
        (cell(), WITHOUT_OUTPUTS),
        (example("heated-tank"), TANK),
    ];
    for (cluster, text) in runs {
        let records = records(&cluster, &scenario(&cluster, text), 1);
        let period = cluster.agreement().schedule.period();
        for seed in 0..30 {
            let mut chance = Pcg64Mcg::seed_from_u64(seed);
            let whole = delivered(&records, &mut chance);
            let expected = alarms(&cluster, &whole);
            for says in [false, true] {
                let kept = with_losses(&whole, period, &mut chance, says);
                let found = alarms(&cluster, &kept);
                let more: Vec<_> = found.difference(&expected).collect();
                assert!(more.is_empty(), "{more:?} of {text}, seed {seed}, said: {says}");
            }
        }
    }
}

/// After a loss a wrong output is found again as soon as the state is known.
#[test]
fn a_wrong_output_is_found_after_a_loss() {
    let cell = cell();
    // Stations report the states that they hold every few seconds.
    let records = records(&cell, &scenario(&cell, "title = \"long\"\ncycles = 900\n"), 1);
    let is_applied = |record: &Record| {
        record.name == "robot-io"
            && matches!(
                &record.event,
                Happening::RemoteIo(RemoteIoEvent::Applied { source: Source::Direct, .. })
            )
    };
    let places: Vec<usize> = (0..records.len()).filter(|at| is_applied(&records[*at])).collect();
    let (lost, wrong) = (places[60], places[places.len() - 5]);
    let mut kept = records.clone();
    let Happening::RemoteIo(RemoteIoEvent::Applied { outputs, .. }) = &mut kept[wrong].event else {
        panic!("outputs");
    };
    outputs.set(0, !outputs.get(0));
    // The sample and the deadline of one cycle, and nobody says so.
    let sample = (0..lost).rev().find(|at| {
        kept[*at].name == "robot-io"
            && matches!(kept[*at].event, Happening::RemoteIo(RemoteIoEvent::Sampled { .. }))
    });
    kept.remove(lost);
    kept.remove(sample.expect("a sample"));
    let found = alarms(&cell, &kept);
    assert!(found.contains(&("robot-io".to_owned(), "wrong")), "{found:?}");
}
