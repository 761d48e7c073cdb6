//! Two networks, as views show them.

use std::sync::Arc;

use understudy_bus::HostEvent;
use understudy_cluster::Cluster;
use understudy_journal::{Happening, Record, RunEvent};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_view::{Bounds, Model};
use understudy_wire::{Member, Source, StationId, Via};

use super::support::{example, records, scenario};

fn on_two_networks() -> Cluster {
    example("two-networks")
}

fn station(rank: u8) -> Member {
    Member::Station(StationId(rank))
}

struct Told {
    model: Model,
    at_ns: u64,
}

impl Told {
    /// A member tells what it receives over the second network.
    fn receives(&mut self, by: Member, lost: &[Member], impaired: &[Member]) {
        self.at_ns += 1_000_000;
        let event = HostEvent::NetworkReception {
            network: Via::Second,
            lost: lost.to_vec(),
            impaired: impaired.to_vec(),
        };
        let name = self.model.members().name(by).to_owned();
        let event = Happening::Host(event);
        self.model.note(&Record { at_ns: self.at_ns, name, member: Some(by), event });
    }

    fn check(&self, expected: Option<&str>) {
        let snapshot = self.model.snapshot();
        let open = snapshot.alarms.iter().filter(|alarm| alarm.over.is_none());
        let open: Vec<&str> = open.map(|alarm| alarm.text.as_str()).collect();
        assert_eq!(open, expected.into_iter().collect::<Vec<_>>());
        assert!(snapshot.networks[0].in_order);
        assert_eq!(snapshot.networks[1].in_order, expected.is_none());
        let text = expected.unwrap_or("either network may fail");
        assert_eq!(snapshot.networks_text().as_deref(), Some(text));
    }
}

#[test]
fn a_network_is_one_alarm_however_many_members_report_it() {
    let model = Model::new(Arc::new(on_two_networks()), Bounds::default());
    let mut told = Told { model, at_ns: 1 };
    let (robot, press, understudy) = (station(0), station(1), station(2));
    told.check(None);
    told.receives(robot, &[press], &[]);
    told.check(Some(
        "all depends on network 1: over network 2 no frames arrive from press to robot",
    ));
    told.receives(understudy, &[press], &[]);
    told.check(Some("all depends on network 1: over network 2 no frames arrive at press"));
    told.receives(press, &[], &[robot, understudy]);
    told.check(Some(
        "all depends on network 1: over network 2 no frames arrive, or some are lost or late at press",
    ));
    told.receives(robot, &[press, understudy], &[]);
    told.check(Some(
        "all depends on network 1: over network 2 no frames arrive, or some are lost or late between robot, press, understudy",
    ));
    told.receives(robot, &[], &[]);
    told.receives(press, &[], &[]);
    told.receives(understudy, &[], &[]);
    told.check(None);
    let alarms = told.model.snapshot().alarms;
    assert_eq!(alarms.len(), 1, "one, over and not acknowledged: {alarms:?}");
}

/// No output is held in a simulated run where either network fails; with one network all are.
#[test]
fn a_simulated_cluster_survives_either_network() {
    let cluster = on_two_networks();
    for (network, both) in [(1, false), (2, false), (1, true)] {
        let step = |network| {
            format!(
                "[[step]]\nat = 10\naction = \"unplug\"\nstation = \"robot\"\nnetwork = {network}\nothers = true\n"
            )
        };
        let more = if both { step(2) } else { String::new() };
        let text =
            format!("title = \"fails\"\ncycles = 60\n{}{more}[expect]\nwrong = 0\n", step(network));
        let all = records(&cluster, &scenario(&cluster, &text), 1);
        let before =
            |record: &&Record| !matches!(record.event, Happening::Run(RunEvent::Fault { .. }));
        let is_held = all.iter().skip_while(before).any(|record| {
            matches!(&record.event, Happening::RemoteIo(RemoteIoEvent::Applied { source, .. })
                if matches!(source, Source::Held | Source::FailSafe))
        });
        assert_eq!(is_held, both, "network {network}");
    }
}
