//! All groups of a plant: which lack protection, and where each spare is.

use std::sync::Arc;

use understudy_bus::HostEvent;
use understudy_cluster::{PlantFile, read_plant_file};
use understudy_journal::{Happening, Record};
use understudy_view::{
    Bounds, GroupState, GroupView, Model, PlantOverview, Snapshot, SpareSnapshot, SpareState,
    StationState,
};
use understudy_wire::{Member, ProgramId};

use crate::support::{example, model, records, scenario};

/// What the outputs of a group are comes before what protects them.
#[test]
fn a_group_whose_outputs_are_fail_safe_says_so() {
    let cluster = example("shared-spare/line-1");
    let lost = scenario(&cluster, include_str!("../../../../examples/press-cell/lost-state.toml"));
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    let mut told = Vec::new();
    for record in records(&cluster, &lost, 1) {
        model.note(&record);
        if !model.has_origin() || !matches!(record.member, Some(Member::RemoteIo(_))) {
            continue;
        }
        let views = [GroupView::Present(Box::new(model.snapshot()))];
        for alarm in PlantOverview::new(&plant(""), &views).alarms {
            if !told.iter().any(|(kind, _)| *kind == alarm.alarm) {
                told.push((alarm.alarm, alarm.text));
            }
        }
    }
    for (kind, wanted) in
        [("fail-safe", "line-1: robot: fail-safe outputs"), ("state-lost", "line-1: ")]
    {
        let found = told.iter().find(|(of, _)| *of == kind);
        assert!(found.is_some_and(|(_, text)| text.starts_with(wanted)), "{kind}: {told:?}");
    }
}

/// The example, with more lines of the plant file.
fn plant(more: &str) -> PlantFile {
    let text = include_str!("../../../../examples/shared-spare/plant.toml");
    let mut open = |name: &str| {
        let folder = name.trim_end_matches("/cluster.toml");
        Ok(example(&format!("shared-spare/{folder}")))
    };
    let loaded = read_plant_file("plant.toml", &format!("{text}{more}"), &mut open);
    loaded.plant.unwrap_or_else(|| panic!("{:?}", loaded.report))
}

/// A group in which these stations do not publish; `spare` is the state of the slot, and `reports` where the spare says that it is.
fn group(name: &str, failed: &[&str], spare: StationState, reports: Option<&str>) -> GroupView {
    let cluster = example(&format!("shared-spare/{name}"));
    let calm = scenario(&cluster, "title = \"calm\"\ncycles = 20");
    let mut snapshot = model(&cluster, &calm, 1).snapshot();
    for station in &mut snapshot.stations {
        if failed.contains(&station.name.as_str()) {
            station.state = StationState::Flagged;
        } else if station.name == "spare" {
            station.state = spare;
        }
    }
    let helps = usize::from(spare == StationState::Publishing);
    let survives = (1 + helps).saturating_sub(failed.len()) as u8;
    snapshot.margin.survives = survives;
    for program in &mut snapshot.programs {
        program.protection.as_mut().expect("reported").protected = survives > 0;
    }
    snapshot.spares = reports
        .map(|group| SpareSnapshot {
            name: "spare-1".to_owned(),
            received: true,
            serves: (!group.is_empty()).then(|| group.to_owned()),
            flagged_slots: Vec::new(),
        })
        .into_iter()
        .collect();
    GroupView::Present(Box::new(snapshot))
}

fn check(views: [GroupView; 2], spare: (SpareState, Option<&str>), alarms: &[&str]) {
    let overview = PlantOverview::new(&plant(""), &views);
    let found = &overview.spares[0];
    assert_eq!((found.state, found.group.as_deref()), spare, "{}", overview.text());
    let texts: Vec<&str> = overview.alarms.iter().map(|alarm| alarm.text.as_str()).collect();
    assert_eq!(texts, alarms);
    for alarm in alarms {
        assert!(overview.text().contains(alarm), "{}", overview.text());
    }
}

#[test]
fn the_overview_says_which_group_is_unprotected_and_where_the_spare_is() {
    use StationState::{Joining, Publishing, Standby};
    let calm = |name| group(name, &[], Standby, Some(""));
    check([calm("line-1"), calm("line-2")], (SpareState::Asleep, None), &[]);
    check(
        [group("line-1", &["robot"], Standby, Some("")), calm("line-2")],
        (SpareState::Asleep, None),
        &[
            "line-1 is UNPROTECTED (failed: robot): spare-1 wakes when a station has been flagged for 50 cycles",
        ],
    );
    // It has started its station, which the group does not show yet.
    check(
        [group("line-1", &["robot"], Standby, Some("line-1")), calm("line-2")],
        (SpareState::Waking, Some("line-1")),
        &["line-1 is UNPROTECTED (failed: robot): spare-1 is waking"],
    );
    check(
        [group("line-1", &["robot"], Joining, Some("line-1")), calm("line-2")],
        (SpareState::Waking, Some("line-1")),
        &["line-1 is UNPROTECTED (failed: robot): spare-1 is waking"],
    );
    // The machine of the spare has failed while it served: its last report is some seconds old.
    let GroupView::Present(mut failed) = group("line-1", &["robot"], Standby, Some("line-1"))
    else {
        unreachable!("it is present")
    };
    failed.spares[0].flagged_slots.push("spare".to_owned());
    check(
        [GroupView::Present(failed), calm("line-2")],
        (SpareState::NotReceived, Some("line-1")),
        &[
            "line-1 is UNPROTECTED (failed: robot): spare-1 has served line-1, and its station there is not received any more",
            "spare-1 has served line-1, and its station there is not received any more",
        ],
    );
    let served = || group("line-1", &["robot"], Publishing, Some("line-1"));
    check([served(), calm("line-2")], (SpareState::Serving, Some("line-1")), &[]);
    // Two failures in two groups, and capacity for one.
    check(
        [served(), group("line-2", &["press"], Standby, Some("line-1"))],
        (SpareState::Serving, Some("line-1")),
        &["line-2 is UNPROTECTED (failed: press): spare-1 serves line-1"],
    );
    check(
        [group("line-1", &["robot", "understudy"], Publishing, Some("line-1")), calm("line-2")],
        (SpareState::Serving, Some("line-1")),
        &[
            "line-1 is UNPROTECTED (failed: robot, understudy): spare-1 serves it, which is not enough",
        ],
    );
    // This viewer has no keys for the station of the spare.
    let GroupView::Present(mut unread) = group("line-1", &["robot"], Publishing, Some("line-1"))
    else {
        unreachable!("it is present")
    };
    unread.margin.survives = 0;
    unread
        .stations
        .iter_mut()
        .filter(|it| it.name == "spare")
        .for_each(|it| it.link.detached = true);
    check(
        [GroupView::Present(unread), calm("line-2")],
        (SpareState::Serving, Some("line-1")),
        &[
            "line-1 is UNPROTECTED (failed: robot): spare-1 serves it, and its station is not received here: what it protects is not known",
        ],
    );
    check(
        [group("line-1", &["robot", "press", "understudy"], Standby, Some("")), calm("line-2")],
        (SpareState::Asleep, None),
        &[
            "line-1 is UNPROTECTED (failed: robot, press, understudy): no station publishes, so there is no state that a spare could adopt",
        ],
    );
}

/// What is not known is not well: neither a group without a present state nor a spare that nothing receives.
#[test]
fn nothing_that_is_not_observed_counts_as_protected() {
    use StationState::Standby;
    let unknown = || GroupView::Unknown("no record for 9 s".to_owned());
    let calm = |name| group(name, &[], Standby, Some(""));
    check(
        [calm("line-1"), unknown()],
        (SpareState::Asleep, None),
        &["line-2 is not observed: no record for 9 s"],
    );
    check(
        [calm("line-1"), group("line-2", &[], Standby, None)],
        (SpareState::Asleep, None),
        &["spare-1 is not received in line-2: it may not wake there"],
    );
    check(
        [group("line-1", &[], Standby, None), group("line-2", &["press"], Standby, None)],
        (SpareState::NotReceived, None),
        &[
            "line-2 is UNPROTECTED (failed: press): spare-1 is not received",
            "spare-1 is not received by any group: it may not wake",
        ],
    );
    // A remote I/O that does not report: the protection of its program is not known.
    let GroupView::Present(mut silent) = calm("line-2") else { unreachable!("it is present") };
    silent.programs[1].protection = None;
    silent.margin.survives = 0;
    check(
        [calm("line-1"), GroupView::Present(silent)],
        (SpareState::Asleep, None),
        &["line-2 is not observed: protection of press: press-io has not reported it yet"],
    );
    let overview = PlantOverview::new(&plant(""), &[unknown(), unknown()]);
    assert!(overview.groups.iter().all(|group| group.state == GroupState::NotObserved));
    assert_eq!(overview.spares[0].state, SpareState::NotReceived);
}

#[test]
fn a_group_beyond_the_capacity_says_so() {
    let small = plant("").spares[0].clone();
    let mut plant = plant("");
    plant.spares[0].serves[1].fits = false;
    let calm = group("line-1", &[], StationState::Standby, Some(""));
    let failed = group("line-2", &["press"], StationState::Standby, Some(""));
    let overview = PlantOverview::new(&plant, &[calm, failed]);
    let reason = overview.groups[1].reason.as_deref();
    assert_eq!(reason, Some("the group is too large for spare-1"), "{small:?}");
}

/// A model, and how it takes what a remote I/O says of the spare.
fn told(model: &mut Model, program: u8, event: HostEvent) {
    let member = Member::RemoteIo(ProgramId(program));
    let name = model.members().name(member).to_owned();
    model.note(&Record {
        at_ns: u64::MAX / 2,
        name,
        member: Some(member),
        event: Happening::Host(event),
    });
}

/// The spare is lost where no remote I/O receives its reports; that is an alarm until one receives them again.
#[test]
fn a_spare_that_reports_to_no_member_is_an_alarm() {
    let cluster = example("shared-spare/line-1");
    let calm = scenario(&cluster, "title = \"calm\"\ncycles = 20");
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    records(&cluster, &calm, 1).iter().for_each(|record| model.note(record));
    let spare = || "spare-1".to_owned();
    let received = |serves: Option<&str>| HostEvent::SpareReceived {
        spare: spare(),
        serves: serves.map(str::to_owned),
    };
    let lost = || HostEvent::SpareLost { spare: spare() };
    let known = |snapshot: &Snapshot| {
        let found = &snapshot.spares[0];
        (found.received, found.serves.clone())
    };
    let alarms = |model: &Model| {
        let alarms = model.alarms().filter(|alarm| alarm.alarm == "spare-lost");
        alarms.filter(|alarm| alarm.over.is_none()).count()
    };
    assert!(model.snapshot().spares.is_empty());
    let elsewhere = Some("line-2".to_owned());
    let steps = [
        (0, received(None), (true, None), 0),
        (1, received(Some("line-2")), (true, elsewhere.clone()), 0),
        (0, lost(), (true, elsewhere), 0),
        (1, lost(), (false, None), 1),
        (1, received(None), (true, None), 0),
        (1, lost(), (false, None), 1),
        (0, received(None), (true, None), 0),
    ];
    for (step, (program, event, expected, open)) in steps.into_iter().enumerate() {
        told(&mut model, program, event);
        assert_eq!(known(&model.snapshot()), expected, "step {step}");
        assert_eq!(alarms(&model), open, "step {step}");
    }
}
