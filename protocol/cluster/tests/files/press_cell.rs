//! The cell of section V as it comes with the program: it loads, and it works.

use std::time::Duration;

use crate::common::{findings, load, run, split};
use understudy_cluster::{Cluster, Link, press_cell};
use understudy_cycle::Mode;
use understudy_wire::{Epoch, Image, Member, Moment, ProgramId, StationId};

fn cell() -> Cluster {
    let (cluster, ladders) = split(press_cell());
    let loaded = load(cluster, &ladders);
    assert_eq!(findings(&loaded.reports), "");
    assert_eq!(loaded.reports.len(), 3);
    loaded.cluster.expect("nothing is wrong with it")
}

#[test]
fn every_member_has_a_name_a_place_and_settings() {
    let cell = cell();
    let named: Vec<String> = cell
        .members()
        .map(|member| {
            let name = cell.member_name(member).expect("it has a name");
            assert_eq!(cell.member(name), Some(member));
            format!("{member:?} {name}")
        })
        .collect();
    insta::assert_snapshot!(named.join("\n"), @r"
    Station(StationId(0)) robot
    Station(StationId(1)) press
    Station(StationId(2)) understudy
    RemoteIo(ProgramId(0)) robot-io
    RemoteIo(ProgramId(1)) press-io
    Plant(ProgramId(0)) arm
    Plant(ProgramId(1)) ram
    ");
    for rank in 0..3 {
        let settings =
            cell.station_settings(StationId(rank), Moment { epoch: Epoch(7), ..Moment::default() });
        let settings = settings.expect("there are three stations");
        assert_eq!((settings.founds.epoch, settings.programs.len()), (Epoch(7), 2));
    }
    assert!(
        cell.station_settings(StationId(3), Moment { epoch: Epoch(7), ..Moment::default() })
            .is_none()
    );
    assert_eq!(cell.member("nobody"), None);
    assert_eq!(cell.member_name(Member::Plant(ProgramId(2))), None);
    let robot = cell.remote_io_settings(ProgramId(0)).expect("it is there");
    assert_eq!(robot.fallback.fail_safe.to_string(), "00001", "the gripper stays closed");
    assert_eq!(robot.layout.input_width(), 6);
    let ram = cell.plant_settings(ProgramId(1)).expect("it is there");
    assert_eq!(ram.fed_by, Some(ProgramId(0)));
    assert_eq!(ram.fail_safe, Image::zero(2));
}

#[test]
fn its_agreement_and_its_understudy_are_those_of_the_paper() {
    let cell = cell();
    let agreement = cell.agreement();
    assert_eq!(agreement.schedule.period(), Duration::from_millis(10));
    assert_eq!((agreement.mode, cell.link()), (Mode::Full, Link::Udp));
    let parity = cell.parity().expect("all Boolean").circuit();
    let shape = (parity.registers().len(), parity.inputs().len(), parity.outputs().len());
    assert_eq!(shape, (9, 10, 5), "x31 to x39, u10 to u23, y31 to y35");
    assert_eq!(parity.inputs()[6], "press.part_present");
}

#[test]
fn six_parts_are_pressed_in_300_cycles() {
    assert_eq!(run(&cell(), 300), [(6, 0), (6, 0)]);
}
