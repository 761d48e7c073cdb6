//! Protection as the remote I/O reports it, and what is left of a state that is lost.

use std::sync::Arc;

use understudy_journal::{Record, RunEvent};
use understudy_view::{Bounds, LostState, Model, Protection};
use understudy_wire::{Member, ProgramId, StationId};

use crate::support::{cell, records, scenario};

const LOST_STATE: &str = include_str!("../../../../examples/press-cell/lost-state.toml");

/// What was known of the robot's program whenever this changed, with the open alarms of its remote I/O.
fn changes(records: &[Record]) -> Vec<String> {
    let mut model = Model::new(Arc::new(cell()), Bounds::default());
    let mut told: Vec<String> = Vec::new();
    for record in records {
        model.note(record);
        if !model.has_origin() {
            continue;
        }
        let robot = ProgramId(0);
        let protection = model.protection(robot).map(Protection::text);
        let lost = model.lost_state(robot).map(LostState::text);
        let alarms = model.alarms().filter(|alarm| {
            let of_protection = ["unprotected", "state-lost"].contains(&alarm.alarm);
            of_protection && alarm.over.is_none() && alarm.name == "robot-io"
        });
        let alarms: Vec<&str> = alarms.map(|alarm| alarm.alarm).collect();
        let text = format!("{protection:?} {lost:?} {alarms:?}");
        if told.last().is_none_or(|last| !last.ends_with(&text)) {
            told.push(format!("{}: {text}", model.cycle().expect("a cycle")));
        }
    }
    told
}

/// The understudy is cut off from the robot, its remote I/O and the press; then the robot is killed; then the operator chooses.
#[test]
fn a_loss_of_protection_and_of_a_state_are_alarms_with_their_causes() {
    let cell = cell();
    let records = records(&cell, &scenario(&cell, LOST_STATE), 1);
    insta::assert_snapshot!("protection", changes(&records).join("\n"));
}

/// A remote I/O that is killed reports nothing: neither the lamp nor the question stays as it was.
#[test]
fn of_a_dead_remote_io_nothing_is_known() {
    let cell = cell();
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    for record in records(&cell, &scenario(&cell, LOST_STATE), 1) {
        model.note(&record);
        if model.lost_state(ProgramId(0)).is_some() {
            break;
        }
    }
    assert!(
        model
            .protection(ProgramId(0))
            .is_some_and(|of| !of.protected)
    );
    let ended = |member| RunEvent::Ended {
        member,
        how: "signal: 9 (SIGKILL)".to_owned(),
        said: Vec::new(),
    };
    let note = |model: &mut Model, member| {
        let record = Record::of_run(model.at_ns(), ended(member));
        model.note(&record);
    };
    note(&mut model, Member::Station(StationId(2)));
    assert!(model.lost_state(ProgramId(0)).is_some(), "another member");
    note(&mut model, Member::RemoteIo(ProgramId(0)));
    assert_eq!(model.lost_state(ProgramId(0)), None);
    assert_eq!(model.protection(ProgramId(0)), None);
}
