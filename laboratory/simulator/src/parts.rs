//! What a cluster consists of, ready to be started again and again.

use std::sync::Arc;

use understudy_cluster::Cluster;
use understudy_cycle::OnlineChange;
use understudy_plant::{Followed, Plant};
use understudy_wire::{Configurations, Member, Moment, ProgramId, ProgramSet, Roster, StationId};

/// The settings of every member. Remote I/Os and plants are indexed by program.
#[derive(Debug, Clone)]
pub struct Parts {
    /// By rank.
    pub stations: Vec<understudy_node::Settings>,
    /// By program; a second one has the settings of the first.
    pub remote_ios: Vec<understudy_remote_io::Settings>,
    /// By program; one without a plant sees zeros.
    pub plants: Vec<Option<Plant>>,
    /// For each plant, the program of the plant that it gets its parts from.
    pub fed_by: Vec<Option<ProgramId>>,
    /// For each plant, what it follows.
    pub follows: Vec<Vec<Followed>>,
    /// Whether each frame is sent over two networks.
    pub has_two_networks: bool,
    /// Programs whose two remote I/Os a direct link joins.
    pub direct_links: ProgramSet,
    /// The online change that an engineer may make in a run.
    pub change: Option<Arc<OnlineChange>>,
}

impl Parts {
    /// Whether a member with these configurations takes part with the others: one of them is that of the cluster, or what its online change leads to.
    pub(crate) fn are_right(&self, configurations: Configurations) -> bool {
        let before = self.stations[0].agreement.configuration;
        let after = self.change.as_ref().map_or(before, |change| change.after);
        let Configurations { own, prepared } = configurations;
        [Some(own), prepared].iter().flatten().any(|it| *it == before || *it == after)
    }

    /// Who receives what; plants are not on the network.
    pub(crate) fn roster(&self) -> Roster {
        let pairs = self.remote_ios.iter().flat_map(|reader| {
            let sources = reader.layout.signals.iter().map(|signal| signal.from);
            sources.map(|source| (Member::RemoteIo(source), Member::RemoteIo(reader.program)))
        });
        let paired = self.remote_ios.iter().filter(|settings| settings.pair.is_some());
        let twins = paired.map(|settings| settings.program).collect();
        Roster::new(self.remote_ios.len(), self.stations.len(), pairs.collect()).with_twins(twins)
    }
}

/// The members of a cluster; the simulation gives each station its own epoch.
pub fn parts(cluster: &Cluster) -> Parts {
    let stations = 0..cluster.agreement().schedule.stations();
    let programs = (0..cluster.controllers().len()).map(|index| ProgramId(index as u8));
    Parts {
        stations: stations
            .filter_map(|rank| cluster.station_settings(StationId(rank as u8), Moment::default()))
            .collect(),
        remote_ios: programs.filter_map(|program| cluster.remote_io_settings(program)).collect(),
        plants: cluster
            .plants()
            .iter()
            .map(|place| place.as_ref().map(|place| place.plant.clone()))
            .collect(),
        fed_by: cluster
            .plants()
            .iter()
            .map(|place| place.as_ref().and_then(|place| place.fed_by))
            .collect(),
        follows: cluster
            .plants()
            .iter()
            .map(|place| match place {
                Some(place) => place.follows.clone(),
                None => Vec::new(),
            })
            .collect(),
        has_two_networks: cluster.has_two_networks(),
        direct_links: cluster.direct_links(),
        change: None,
    }
}
