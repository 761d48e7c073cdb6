//! Two networks, as views show them.

use std::sync::Arc;

use understudy_bus::{HostEvent, LinkKind, Rights};
use understudy_cluster::Cluster;
use understudy_journal::{Happening, Record, RunEvent};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_view::{Bounds, Model};
use understudy_wire::{Member, ProgramId, Source, StationId, Via};

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
        let (lost, impaired) = (lost.to_vec(), impaired.to_vec());
        self.host(by, HostEvent::NetworkReception { network: Via::Second, lost, impaired });
    }

    /// A member tells of its link over a network: why it cannot be opened, or that it is open.
    fn link(&mut self, by: Member, network: Option<Via>, failure: Option<&str>) {
        let (silence_ms, peer) = (0, None);
        self.host(
            by,
            match failure {
                Some(reason) => {
                    let reason = reason.to_owned();
                    HostEvent::LinkFailed { network, silence_ms, peer, reason }
                }
                None => HostEvent::LinkReopened { network, silence_ms, peer },
            },
        );
    }

    fn host(&mut self, by: Member, event: HostEvent) {
        self.at_ns += 1_000_000;
        let name = self.model.members().name(by).to_owned();
        let event = Happening::Host(event);
        self.model.note(&Record { at_ns: self.at_ns, name, member: Some(by), event });
    }

    /// The texts of the alarms of a cycle that last.
    fn lasting(&self, cycle: i64) -> Vec<String> {
        let alarms = self.model.alarms_at(cycle);
        alarms.filter(|alarm| alarm.over.is_none()).map(|alarm| alarm.text).collect()
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
    assert_eq!(alarms[0].text, "network 2 was not in order; now it is");
}

/// The direct link is an alarm of its own, and takes nothing from the two networks; next to one network it is a path like that.
#[test]
fn the_direct_link_is_an_alarm_of_its_own() {
    let linked = |networks: u32| {
        let text = format!(
            "[cluster]\nname = \"linked\"\nnetworks = {networks}\n\
             [[controller]]\nname = \"pump\"\nladder = \"pump.ladder\"\n\
             [[remote_io]]\nname = \"io\"\ncontroller = \"pump\"\n\
             twin = {{ name = \"io-2\", wiring = \"exclusive\", direct_link = true }}\n"
        );
        let ladder = "program pump\ninput full\noutput run\nrung \"run\"\n  /full ( run )\n";
        let mut open = |_: &str| Ok(ladder.to_owned());
        understudy_cluster::read("cluster.toml", &text, &mut open).cluster.expect("right")
    };
    let (io, twin) = (Member::RemoteIo(ProgramId(0)), Member::Twin(ProgramId(0)));
    for networks in [1, 2] {
        let model = Model::new(Arc::new(linked(networks)), Bounds::default());
        let mut told = Told { model, at_ns: 1 };
        let shown = |told: &Told| {
            let snapshot = told.model.snapshot();
            let failed = snapshot.networks.iter().filter(|network| !network.in_order);
            let failed: Vec<String> = failed.map(|network| network.name.clone()).collect();
            (snapshot.networks.len(), failed, snapshot.networks_text())
        };
        let receives = |network, lost: &[Member]| {
            let lost = lost.to_vec();
            HostEvent::NetworkReception { network, lost, impaired: Vec::new() }
        };
        let paths = networks as usize + 1;
        let quiet = (networks == 2).then(|| "either network may fail".to_owned());
        assert_eq!(shown(&told), (paths, Vec::new(), quiet.clone()));
        told.host(io, receives(Via::Link, &[twin]));
        let text = "over the direct link no frames arrive from io-2 to io";
        let expected = quiet.iter().map(String::as_str).chain([text]).collect::<Vec<_>>();
        let failed = vec!["direct link".to_owned()];
        assert_eq!(shown(&told), (paths, failed, Some(expected.join("; "))));
        assert_eq!(told.lasting(0), [text]);
        told.host(io, receives(Via::Link, &[]));
        assert_eq!(shown(&told), (paths, Vec::new(), quiet));
        told.host(twin, receives(Via::First, &[io]));
        let (_, failed, text) = shown(&told);
        assert_eq!(failed, ["network 1"]);
        let left = if networks == 2 { "all depends on network 2: " } else { "" };
        let expected = format!("{left}over network 1 no frames arrive from io to io-2");
        assert_eq!(text, Some(expected));
    }
}

/// One network that is open again says nothing of the other one.
#[test]
fn a_link_that_is_open_again_ends_no_alarm_of_the_other_network() {
    let model = Model::new(Arc::new(on_two_networks()), Bounds::default());
    let mut told = Told { model, at_ns: 1 };
    let robot = station(0);
    let failed = |network, reason| format!("cannot open its link over network {network}: {reason}");
    let (first, second) = (failed(1, "no such device"), failed(2, "down"));
    told.link(robot, Some(Via::First), Some("no such device"));
    assert_eq!(told.lasting(i64::MAX), std::slice::from_ref(&first));
    told.link(robot, Some(Via::Second), Some("down"));
    assert_eq!(told.lasting(i64::MAX), [format!("{first}; {second}")]);
    told.link(robot, Some(Via::First), None);
    assert_eq!(told.lasting(i64::MAX), [second]);
    told.link(robot, Some(Via::Second), None);
    assert_eq!(told.lasting(i64::MAX), Vec::<String>::new());
    let alarms = told.model.snapshot().alarms;
    assert_eq!(alarms.len(), 1, "one member, one alarm: {alarms:?}");
    assert_eq!(alarms[0].text, "could not open a link; now all of its links are open");
    // The links of a process end with it.
    told.link(robot, Some(Via::First), Some("no such device"));
    let ready = HostEvent::Ready {
        version: 1,
        process: 1,
        address: ([127, 0, 0, 1], 1).into(),
        link: LinkKind::Udp,
        rights: Rights { real_time: false, locked_memory: false, core: None, lacking: Vec::new() },
    };
    told.host(robot, ready);
    assert_eq!(told.lasting(i64::MAX), Vec::<String>::new());
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
