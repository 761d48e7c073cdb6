//! The evaluation against a naive one that looks back over all values.

use proptest::prelude::*;
use understudy_cluster::{Cluster, read};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_simulator::Action;
use understudy_wire::{Cycle, Epoch, Moment, Source, StationSet};

use super::*;
use crate::members::Members;

const TANK: &str = "PROGRAM tank
VAR_INPUT level : REAL; full : BOOL; END_VAR
VAR_OUTPUT inlet : INT; open : BOOL; END_VAR
inlet := 0;
open := full;
END_PROGRAM";

const CLUSTER: &str = r#"
[cluster]
name = "cell"
period = "10ms"
[[controller]]
name = "tank"
ladder = "tank.st"
[[alarm]]
signal = "tank.level"
name = "high"
above = 90.0
hysteresis = 5.0
on_delay = "30ms"
off_delay = "20ms"
text = "high"
[[alarm]]
signal = "tank.level"
name = "low"
below = 10.0
text = "low"
[[alarm]]
signal = "tank.full"
when = false
off_delay = "40ms"
text = "not full"
[[alarm]]
signal = "tank.inlet"
below = -3
hysteresis = 2
on_delay = "10ms"
text = "inlet"
"#;

fn cluster() -> Cluster {
    let loaded = read("cluster.toml", CLUSTER, &mut |_| Ok(TANK.to_owned()));
    loaded.cluster.expect("it is right")
}

/// One record, or the loss of some.
#[derive(Debug, Clone)]
enum Step {
    /// A deadline after so many cycles, with a sample or not.
    Applied {
        after: i64,
        level: f32,
        full: bool,
        inlet: i16,
        missing: Option<Missing>,
    },
    StartedCold,
    /// The process of the remote I/O ends.
    Killed,
    Started,
    /// Its journal lost records.
    Lost,
}

fn step() -> impl Strategy<Value = Step> {
    let levels = [5.0, 10.0, 50.0, 85.0, 87.0, 90.0, 91.0, f32::NAN];
    let missing = [None, None, None, Some(Missing::NoCycle), Some(Missing::BadQuality)];
    let applied = (
        1i64..4,
        proptest::sample::select(levels.to_vec()),
        any::<bool>(),
        -5i16..3,
        proptest::sample::select(missing.to_vec()),
    );
    let applied = applied.prop_map(|(after, level, full, inlet, missing)| Step::Applied {
        after,
        level,
        full,
        inlet,
        missing,
    });
    prop_oneof![
        20 => applied,
        1 => Just(Step::StartedCold),
        1 => Just(Step::Killed),
        2 => Just(Step::Started),
        1 => Just(Step::Lost),
    ]
}

/// Values hardly ever stay for a delay where each is drawn alone.
fn steps() -> impl Strategy<Value = Vec<Step>> {
    let runs = proptest::collection::vec((step(), 1usize..5), 1..40);
    runs.prop_map(|runs| {
        let runs = runs.into_iter();
        runs.flat_map(|(step, times)| std::iter::repeat_n(step, times)).collect()
    })
}

fn images(cluster: &Cluster, level: f32, full: bool, inlet: i16) -> (Image, Image) {
    let interface = &cluster.controllers()[0].interface;
    let mut inputs = Image::zero(interface.inputs.width());
    let mut outputs = Image::zero(interface.outputs.width());
    let mut set = |name: &str, value: u64| {
        if let Some(point) = interface.inputs.find(name) {
            point.set(inputs.words_mut(), value);
        }
        if let Some(point) = interface.outputs.find(name) {
            point.set(outputs.words_mut(), value);
        }
    };
    set("level", u64::from(level.to_bits()));
    set("full", u64::from(full));
    set("inlet", u64::from(inlet as u16));
    (inputs, outputs)
}

/// The records of the steps, each with its cycle; a process that does not run writes none.
fn journal(cluster: &Cluster, steps: &[Step]) -> Vec<(i64, Record)> {
    let members = Members::of(cluster);
    let member = Member::RemoteIo(ProgramId(0));
    let of_member = |event| Record::of_member(0, member, &members, Happening::RemoteIo(event));
    let fault = |action| {
        let asked = 0;
        let event = RunEvent::Fault { action, member, asked };
        Record::of_run(0, event)
    };
    let (mut cycle, mut runs) = (0, true);
    let mut records = Vec::new();
    for step in steps {
        let moment = |cycle: i64| Moment { epoch: Epoch(1), cycle: Cycle(cycle as u64) };
        let record = match step {
            Step::Started => {
                runs = true;
                fault(Action::Restart)
            }
            _ if !runs => continue,
            Step::Applied { after, level, full, inlet, missing } => {
                cycle += after;
                let (inputs, outputs) = images(cluster, *level, *full, *inlet);
                of_member(RemoteIoEvent::Applied {
                    moment: moment(cycle),
                    sampled: missing.is_none().then_some(inputs),
                    outputs,
                    driven: None,
                    source: Source::Direct,
                    word_of: None,
                    missing: *missing,
                    points: None,
                    heard: StationSet::EMPTY,
                })
            }
            Step::StartedCold => of_member(RemoteIoEvent::StartedCold {
                born: moment(cycle),
                awaits_release: false,
                lost: None,
            }),
            Step::Killed => {
                runs = false;
                fault(Action::Crash)
            }
            Step::Lost => {
                let lost = HostEvent::JournalLost { records: 3 };
                Record::of_member(0, member, &members, Happening::Host(lost))
            }
        };
        records.push((cycle, record));
    }
    records
}

/// Whether an alarm is active after some records: from all of them, backwards.
fn naive(records: &[(i64, Record)], alarm: &AlarmDeclaration) -> Option<bool> {
    // Everything since the values were last unknown as a whole.
    let is_end = |(_, record): &(i64, Record)| match &record.event {
        Happening::Host(_) => true,
        Happening::Run(RunEvent::Fault { action, .. }) => *action == Action::Crash,
        _ => false,
    };
    let start = records.iter().rposition(is_end).map_or(0, |end| end + 1);
    let is_applied = |(_, record): &(i64, Record)| {
        matches!(record.event, Happening::RemoteIo(RemoteIoEvent::Applied { .. }))
    };
    let is_cold = |(_, record): &(i64, Record)| {
        matches!(record.event, Happening::RemoteIo(RemoteIoEvent::StartedCold { .. }))
    };
    let first_applied = records.iter().position(is_applied);
    let first_cold = records.iter().position(is_cold);
    let begins = start == 0
        && first_cold.is_some_and(|cold| first_applied.is_none_or(|applied| cold < applied));
    // The value of each cycle; nothing where it is unknown.
    let mut values: Vec<(i64, Option<u64>)> = Vec::new();
    let mut inputs = None;
    for (cycle, record) in &records[start..] {
        let Happening::RemoteIo(RemoteIoEvent::Applied { sampled, outputs, missing, .. }) =
            &record.event
        else {
            continue;
        };
        if *missing != Some(Missing::NoCycle) {
            inputs.clone_from(sampled);
        }
        let image = if alarm.is_output { Some(outputs) } else { inputs.as_ref() };
        values.push((*cycle, image.map(|image| alarm.point.get(image.words()))));
    }
    let held: Vec<(i64, Option<bool>)> = (0..values.len())
        .map(|end| {
            // The newest value outside the hysteresis decides, unless a value after it is unknown.
            for (_, value) in values[..=end].iter().rev() {
                let sure = |before| {
                    let value = (*value)?;
                    alarm.condition.holds(alarm.point.of, value, before)
                };
                match (sure(Some(true)), sure(Some(false))) {
                    (Some(one), Some(other)) if one == other => return (values[end].0, Some(one)),
                    (Some(_), Some(_)) => {}
                    _ => return (values[end].0, None),
                }
            }
            (values[end].0, begins.then_some(false))
        })
        .collect();
    // The newest time for which the condition was one for its delay.
    for end in (0..held.len()).rev() {
        let is = held[end].1?;
        let mut from = end;
        while from > 0 && held[from - 1].1 == Some(is) {
            from -= 1;
        }
        let delay = if is { alarm.on_delay } else { alarm.off_delay };
        let from_the_beginning = begins && from == 0 && !is;
        if from_the_beginning || held[end].0 - held[from].0 >= i64::from(delay) {
            return Some(is);
        }
    }
    begins.then_some(false)
}

fn fold(cluster: &Cluster) -> AlarmFold {
    AlarmFold::new(cluster.alarms().clone(), cluster.controllers().len())
}

fn active(fold: &AlarmFold) -> Vec<Option<bool>> {
    let conditions = fold.conditions.iter();
    conditions.map(|condition| condition.active).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn the_fold_equals_the_naive_evaluation(steps in steps()) {
        let cluster = cluster();
        let records = journal(&cluster, &steps);
        let mut fold = fold(&cluster);
        let mut told = active(&fold);
        let mut lasting = vec![false; told.len()];
        for (place, (cycle, record)) in records.iter().enumerate() {
            for change in fold.take(record, *cycle) {
                let before = std::mem::replace(&mut told[change.alarm], change.active);
                prop_assert_ne!(before, change.active);
                // Each end belongs to a beginning.
                if let Some(transition) = change.transition {
                    let begins = transition != AlarmTransition::Over;
                    prop_assert_eq!(change.active, Some(begins));
                    prop_assert_ne!(lasting[change.alarm], begins);
                    lasting[change.alarm] = begins;
                    let since_before = AlarmTransition::Raised { since_before: true };
                    prop_assert_eq!(begins && before.is_none(), transition == since_before);
                }
                prop_assert!(change.active.is_none_or(|active| active == lasting[change.alarm]));
            }
            let alarms = cluster.alarms().iter();
            let expected: Vec<_> = alarms
                .map(|alarm| naive(&records[..=place], alarm))
                .collect();
            prop_assert_eq!(&active(&fold), &expected, "after {:?}", record);
            prop_assert_eq!(&told, &expected);
        }
    }

    #[test]
    fn an_evaluation_from_the_middle_is_unknown_or_equal(steps in steps(), cut in 0usize..100) {
        let cluster = cluster();
        let records = journal(&cluster, &steps);
        let (mut whole, mut late) = (fold(&cluster), fold(&cluster));
        late.forget_all();
        let mut known = vec![false; cluster.alarms().len()];
        for (place, (cycle, record)) in records.iter().enumerate() {
            whole.take(record, *cycle);
            if place < cut {
                continue;
            }
            late.take(record, *cycle);
            for (index, (late, whole)) in active(&late).into_iter().zip(active(&whole)).enumerate() {
                prop_assert!(late.is_none() || late == whole, "{:?} {:?}", late, whole);
                // Once it is known, it stays equal.
                known[index] |= late.is_some();
                prop_assert!(!known[index] || late == whole, "{:?} {:?}", late, whole);
            }
        }
    }
}

#[test]
fn an_alarm_of_a_run_begins_in_its_cycle() {
    let cluster = cluster();
    let applied = |level| Step::Applied { after: 1, level, full: true, inlet: 0, missing: None };
    let levels = [50.0, 91.0, 91.0, 91.0, 91.0, 87.0, 85.0, 85.0, 85.0];
    let steps: Vec<Step> = std::iter::once(Step::StartedCold).chain(levels.map(applied)).collect();
    let mut fold = fold(&cluster);
    let mut changes = Vec::new();
    for (cycle, record) in journal(&cluster, &steps) {
        let of_high = fold.take(&record, cycle).into_iter();
        let of_high = of_high.filter(|change| change.alarm == 0);
        changes.extend(of_high.map(|change| (cycle, change.active, change.transition)));
    }
    // Above the limit from cycle 2 on, for three cycles; over from cycle 7 on, for two.
    let since_before = false;
    let raised = Some(AlarmTransition::Raised { since_before });
    let expected = [
        (0, Some(false), None),
        (5, Some(true), raised),
        (9, Some(false), Some(AlarmTransition::Over)),
    ];
    assert_eq!(changes, expected);
}
