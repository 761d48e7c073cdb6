//! The facts that viewers share, as a snapshot has them.

use understudy_view::Snapshot;

#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Facts {
    pub(crate) cycle: i64,
    pub(crate) cycle_master: Option<u8>,
    pub(crate) stations: Vec<StationFacts>,
    pub(crate) programs: Vec<ProgramFacts>,
    pub(crate) host_stalls: u64,
}

#[derive(Debug, PartialEq, Eq)]
pub(crate) struct StationFacts {
    pub(crate) state: String,
    pub(crate) flagged: bool,
    pub(crate) excluded_from: Vec<u8>,
}

#[derive(Debug, PartialEq, Eq)]
pub(crate) struct ProgramFacts {
    pub(crate) source: Option<String>,
    pub(crate) outputs: Option<String>,
    pub(crate) counts: [u64; 4],
    pub(crate) awaits_release: bool,
    pub(crate) forced: usize,
    pub(crate) protected: Option<bool>,
    pub(crate) lost: bool,
    pub(crate) finished: Option<u64>,
    pub(crate) remote_io: String,
}

impl Facts {
    pub(crate) fn of(snapshot: &Snapshot) -> Self {
        let rank = |name: &String| {
            let mut stations = snapshot.stations.iter();
            stations.position(|station| station.name == *name)
        };
        let programs = |names: &[String]| -> Vec<u8> {
            let ranks = names.iter().filter_map(rank);
            ranks.map(|rank| rank as u8).collect()
        };
        let stations = snapshot.stations.iter().map(|station| StationFacts {
            state: station.state.word().to_owned(),
            flagged: station.flagged,
            excluded_from: programs(&station.excluded_from),
        });
        let both = snapshot.programs.iter().zip(&snapshot.remote_ios);
        let programs = both.map(|(program, remote_io)| ProgramFacts {
            source: program.source.map(str::to_owned),
            outputs: program.outputs.clone(),
            counts: [program.direct, program.reconstructed, program.held, program.fail_safe],
            awaits_release: program.awaits_release,
            forced: program.forced.len(),
            protected: program.protection.as_ref().map(|of| of.protected),
            lost: program.lost.is_some(),
            finished: program.finished,
            remote_io: remote_io.state.word().to_owned(),
        });
        Self {
            cycle: snapshot.cycle.unwrap_or_default(),
            cycle_master: snapshot.cycle_master.as_ref().and_then(rank).map(|rank| rank as u8),
            stations: stations.collect(),
            programs: programs.collect(),
            host_stalls: snapshot.host_stalls,
        }
    }
}
