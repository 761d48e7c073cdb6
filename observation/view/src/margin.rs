//! The remaining redundancy: which further failures would be masked, and which not.
//!
//! The rule itself is not repeated here. For every possible failure the turns are made that would then be received, with the parity words of
//! the stations ([`words_of_controller`], [`words_of_understudy`]), and the selection of the remote I/O is asked ([`Foreseen`]). An output
//! that is not provable already is not a loss of that failure.

use std::sync::Arc;

use understudy_cycle::Mode;
use understudy_node::{words_of_controller, words_of_understudy};
use understudy_remote_io::{Foreseen, Missing};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Digest, Frame, Header, Holding, Image, Lineage, Member,
    Moment, ProgramId, ProgramSet, StationId, StationSet, Turn, Word,
};

/// The living members and the states that they hold.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Holders {
    /// Mode of the cluster.
    pub mode: Mode,
    /// The width of y(i), by program.
    pub widths: Vec<usize>,
    /// By rank: the programs that a station publishes for; none for one that is not received.
    pub holds: Vec<ProgramSet>,
    /// By program: the stations that its remote I/O receives.
    pub heard: Vec<StationSet>,
    /// By program: the stations that its remote I/O has excluded.
    pub excluded: Vec<StationSet>,
    /// Programs without a provable output for a reason that no station can remove: outputs not released, sensors not readable.
    pub blocked: ProgramSet,
}

/// Consequence of a failure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// The members that fail at once.
    pub failed: Vec<Member>,
    /// The programs that would lose their provable outputs; none where it is masked.
    pub lost: Vec<Loss>,
}

/// A program that would lose its provable outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loss {
    /// The program.
    pub program: ProgramId,
    /// Why there would be no provable output; nothing where its own remote I/O fails.
    pub missing: Option<Missing>,
}

impl Outcome {
    /// Whether every program that has provable outputs keeps them.
    pub fn is_masked(&self) -> bool {
        self.lost.is_empty()
    }
}

/// The remaining redundancy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Margin {
    /// Programs with provable outputs.
    pub served: ProgramSet,
    /// Each member alone: the publishing stations by rank, then the remote I/Os of the served programs.
    pub singles: Vec<Outcome>,
    /// Each pair of publishing stations.
    pub pairs: Vec<Outcome>,
    /// Further failures of stations that are masked whichever they are: 0, 1, or 2 and perhaps more.
    pub survives: u8,
}

impl Holders {
    /// The remaining redundancy. It takes some thousand selections for a cluster of 72 stations.
    pub fn margin(&self) -> Margin {
        let served = self.served(StationSet::EMPTY);
        let publishing: Vec<StationId> = (0..)
            .map(StationId)
            .zip(&self.holds)
            .filter(|(_, holds)| !holds.is_empty())
            .map(|(station, _)| station)
            .collect();
        let stations: Vec<Outcome> = publishing
            .iter()
            .map(|&station| self.outcome(served, StationSet::only(station)))
            .collect();
        let mut pairs = Vec::new();
        for (place, &first) in publishing.iter().enumerate() {
            for &second in &publishing[place + 1..] {
                pairs.push(self.outcome(served, [first, second].into_iter().collect()));
            }
        }
        let all_masked = |outcomes: &[Outcome]| outcomes.iter().all(Outcome::is_masked);
        let survives = match (all_masked(&stations), all_masked(&pairs)) {
            _ if served.is_empty() => 0,
            (false, _) => 0,
            (true, false) => 1,
            (true, true) => 2,
        };
        let remote_ios = served.iter().map(|program| Outcome {
            failed: vec![Member::RemoteIo(program)],
            lost: vec![Loss { program, missing: None }],
        });
        Margin {
            served,
            singles: stations.iter().cloned().chain(remote_ios).collect(),
            pairs,
            survives,
        }
    }

    /// Programs with provable outputs if these stations failed too.
    pub fn served(&self, failed: StationSet) -> ProgramSet {
        let sources = self.sources(failed);
        let served = sources.iter().filter(|(_, source)| source.is_ok());
        let served: ProgramSet = served.map(|(program, _)| *program).collect();
        served.without(self.blocked)
    }

    fn outcome(&self, served: ProgramSet, failed: StationSet) -> Outcome {
        let sources = self.sources(failed);
        let lost = sources.into_iter().filter_map(|(program, source)| {
            let missing = source.err().filter(|_| served.contains(program))?;
            Some(Loss { program, missing: Some(missing) })
        });
        Outcome { failed: failed.iter().map(Member::Station).collect(), lost: lost.collect() }
    }

    /// What each remote I/O would select.
    fn sources(&self, failed: StationSet) -> Vec<(ProgramId, Result<(), Missing>)> {
        let turns = self.turns(failed);
        let programs = (0..).map(ProgramId).zip(&self.widths);
        programs
            .map(|(program, &width)| {
                let place = program.index();
                let heard: Vec<Option<Arc<Frame>>> = (0..)
                    .map(StationId)
                    .zip(&turns)
                    .map(|(station, turn)| {
                        let turn = turn.as_ref()?;
                        self.heard[place].contains(station).then(|| Arc::clone(turn))
                    })
                    .collect();
                let foreseen =
                    Foreseen { turns: &heard, controllers: self.widths.len(), mode: self.mode };
                let truth = lineage(program);
                let source = foreseen.source(program, truth, width, self.excluded[place]);
                (program, source.map(|_| ()))
            })
            .collect()
    }

    /// The turns of a cycle in which `failed` do not publish.
    fn turns(&self, failed: StationSet) -> Vec<Option<Arc<Frame>>> {
        let controllers = self.widths.len();
        let all = ProgramSet::first(controllers);
        let outputs: Vec<Image> = self.widths.iter().map(|&width| Image::zero(width)).collect();
        let publishes = |station: StationId| {
            let holds = self.holds[station.index()];
            (!failed.contains(station) && !holds.is_empty()).then_some(holds)
        };
        let published: ProgramSet = all
            .iter()
            .filter(|program| {
                publishes(program.controller()).is_some_and(|holds| holds.contains(*program))
            })
            .collect();
        let ranks = (0..self.holds.len()).map(|rank| StationId(rank as u8));
        ranks
            .map(|station| {
                let holds = publishes(station)?;
                let words = if station.index() < controllers {
                    let own = station.controlled();
                    words_of_controller(own, outputs.get(own.index())?)
                } else {
                    words_of_understudy(self.mode, all, holds, published, |program| {
                        outputs.get(program.index())
                    })
                };
                Some(turn(station, holds, words.into_iter().collect()))
            })
            .collect()
    }
}

/// Every holder of a state is on its one true history: others do not publish.
fn lineage(program: ProgramId) -> Lineage {
    Lineage(u64::from(program.0) + 1)
}

fn turn(station: StationId, holds: ProgramSet, words: Vec<Word>) -> Arc<Frame> {
    let holdings = holds.iter().map(|program| Holding {
        program,
        born: Moment::default(),
        lineage: lineage(program),
        stepped: Moment::default(),
        digest: Digest::default(),
        version: None,
    });
    Arc::new(Frame {
        header: Header {
            cluster: ClusterHash::default(),
            configuration: ConfigurationHash::default(),
            prepared: None,
            moment: Moment::default(),
            sender: Member::Station(station),
            alone: false,
        },
        body: Body::Turn(Turn {
            heard: StationSet::EMPTY,
            holdings: holdings.collect(),
            words: words.into_iter().collect(),
            recalled: Vec::new(),
            lacks: ProgramSet::EMPTY,
            relayed: Vec::new(),
        }),
    })
}
