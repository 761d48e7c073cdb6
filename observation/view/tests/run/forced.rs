//! A forced output: everything that states a driven value states the forced one.

use std::sync::Arc;

use understudy_journal::{Happening, Record, moment};
use understudy_remote_io::{Event, ForceEnd};
use understudy_view::{Bounds, Model};
use understudy_wire::{Force, Image, Member, ProgramId, SignalPlace};

use crate::process_alarms::{PLAIN, ramp};
use crate::support::{records, scenario};

/// The input `level` and the output `far`.
const LEVEL: SignalPlace = SignalPlace::Input(0);
const FAR: SignalPlace = SignalPlace::Output(0);

fn force(signal: SignalPlace, value: bool, owner: &str) -> Force {
    let owner = owner.to_owned();
    Force {
        signal,
        value: value.into(),
        seconds: 60,
        owner,
        reason: "a test".to_owned(),
        points: None,
    }
}

/// A run in which `far` is forced from its hundredth deadline on, for a hundred deadlines; the cycles of both.
fn forced_run(value: bool) -> (Model, i64, i64) {
    let cluster = ramp();
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    let (mut deadlines, mut from, mut to) = (0, 0, 0);
    for record in records(&cluster, &scenario(&cluster, PLAIN), 1) {
        let Happening::RemoteIo(Event::Applied { outputs, .. }) = &record.event else {
            model.note(&record);
            continue;
        };
        deadlines += 1;
        let report = |event| Record { event: Happening::RemoteIo(event), ..record.clone() };
        let moment = moment(&record.event).expect("of a cycle");
        let mut driven = outputs.clone();
        driven.set(0, value);
        let mut own = record.clone();
        match deadlines {
            100 => {
                let force = force(FAR, value, "anna");
                model.note(&report(Event::Forced { moment, force }));
            }
            200 => model.note(&report(Event::Unforced { moment, signal: FAR, by: ForceEnd::Time })),
            _ => {}
        }
        if (100..200).contains(&deadlines)
            && let Happening::RemoteIo(Event::Applied { driven: forced, .. }) = &mut own.event
        {
            *forced = Some(driven).filter(|driven| driven != outputs);
        }
        model.note(&own);
        match deadlines {
            100 => from = moment.cycle.0,
            200 => to = moment.cycle.0,
            _ => {}
        }
    }
    let cycle = |of| model.cycle_of(Member::RemoteIo(ProgramId(0)), of).expect("remembered");
    let (from, to) = (cycle(from), cycle(to));
    (model, from, to)
}

#[test]
fn every_view_states_the_forced_value_while_an_output_is_forced() {
    for value in [false, true] {
        let (model, from, to) = forced_run(value);
        assert!(from < to);
        let mut unlike = 0;
        for cycle in from - 20..to + 20 {
            let is_forced = (from..to).contains(&cycle);
            let Some(snapshot) = model.snapshot_at(cycle) else {
                continue;
            };
            let program = &snapshot.programs[0];
            let why = model.why("keep.far", Some(cycle)).expect("it is known");
            let level = program.values["level"].as_f64().expect("a number");
            let scanned = level > 30.0;
            let driven = if is_forced { value } else { scanned };
            unlike += u32::from(driven != scanned);
            let outputs = program.outputs.as_deref().expect("driven");
            assert_eq!(program.values["far"], driven, "{cycle}");
            assert_eq!(outputs.starts_with('1'), driven, "{cycle}");
            let series = model.series().outputs(ProgramId(0)).expect("a program");
            let (_, image) = series.at(cycle).expect("remembered");
            assert_eq!(image.get(0), driven, "{cycle}");
            assert_eq!(why.value, driven, "{cycle}");
            let alarm = snapshot.process_alarms.iter().find(|alarm| alarm.name == "far");
            assert_eq!(alarm.and_then(|alarm| alarm.active), Some(driven), "{cycle}");
            assert_eq!(program.forced.len(), usize::from(is_forced), "{cycle}");
            let force = why.forced.as_ref();
            assert_eq!(force.is_some(), is_forced, "{cycle}");
            let text = why.to_text(understudy_view::Zone::UTC);
            assert_eq!(text.contains("forced by anna since cycle"), is_forced, "{text}");
            if let Some(force) = force {
                assert_eq!(
                    (force.since, &force.unforced),
                    (from, &Some(scanned.into())),
                    "{cycle}"
                );
            }
        }
        assert!(unlike > 10, "{unlike}");
    }
}

#[test]
fn the_alarm_of_forces_names_each_of_them() {
    let cluster = ramp();
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    let records = records(&cluster, &scenario(&cluster, PLAIN), 1);
    records.iter().take(2000).for_each(|record| model.note(record));
    let of = records.iter().find(|record| record.member == Some(Member::RemoteIo(ProgramId(0))));
    let of = of.expect("it reports").clone();
    let at = records.iter().take(2000).filter_map(|record| moment(&record.event)).next_back();
    let moment = at.expect("a cycle");
    let mut report = |event| {
        model.note(&Record { event: Happening::RemoteIo(event), ..of.clone() });
        let open: Vec<_> = model.alarms_at(i64::MAX).filter(|alarm| alarm.is_open()).collect();
        let of_forces = open.into_iter().filter(|alarm| alarm.alarm == "forced");
        of_forces.map(|alarm| (alarm.over.is_none(), alarm.text)).collect::<Vec<_>>()
    };
    let forced = |signal, owner| Event::Forced { moment, force: force(signal, true, owner) };
    let unforced = |signal| Event::Unforced { moment, signal, by: ForceEnd::Operator };
    let names = |alarms: &[(bool, String)], expected: &[&str]| {
        let [(lasts, text)] = alarms else { panic!("{alarms:?}") };
        assert!(lasts, "{text}");
        for name in ["anna", "bert"] {
            assert_eq!(text.contains(name), expected.contains(&name), "{text}");
        }
    };
    names(&report(forced(FAR, "anna")), &["anna"]);
    names(&report(forced(LEVEL, "bert")), &["anna", "bert"]);
    names(&report(unforced(FAR)), &["bert"]);
    let last = report(unforced(LEVEL));
    assert!(last.iter().all(|(lasts, _)| !lasts), "{last:?}");
}

#[test]
fn an_image_of_another_width_is_no_deadline() {
    let cluster = ramp();
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    for mut record in records(&cluster, &scenario(&cluster, PLAIN), 1).into_iter().take(3000) {
        if let Happening::RemoteIo(Event::Applied { driven, .. }) = &mut record.event {
            *driven = Some(Image::zero(0));
        }
        model.note(&record);
    }
    let snapshot = model.snapshot();
    assert_eq!((&snapshot.programs[0].outputs, snapshot.programs[0].source), (&None, None));
}

/// Journals before had `expired` in place of what has ended a force.
#[test]
fn the_end_of_a_force_is_read_from_older_journals() {
    let read = |end: &str| {
        let line = format!(
            r#"{{"event":"unforced","moment":{{"epoch":1,"cycle":5}},"signal":{{"input":0}},{end}}}"#
        );
        match serde_json::from_str(&line) {
            Ok(Event::Unforced { by, .. }) => by,
            other => panic!("{line}: {other:?}"),
        }
    };
    assert_eq!(read(r#""expired":true"#), ForceEnd::Time);
    assert_eq!(read(r#""expired":false"#), ForceEnd::Operator);
    assert_eq!(read(r#""by":"online-change""#), ForceEnd::OnlineChange);
}
