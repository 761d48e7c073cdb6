//! A cluster as all its members know it.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::net::{SocketAddr, SocketAddrV4};
use std::sync::Arc;
use std::time::Duration;

use crate::address::Addresses;
use crate::alarm::AlarmDeclaration;
use crate::card::Cards;
use crate::code::Code;
use crate::device::FieldDevice;
use crate::notify::Notify;
use crate::source::{InputSource, OperatorDeclaration, SignalDeclaration};
use serde::{Deserialize, Serialize};
use understudy_bits::Inexact;
use understudy_cycle::{Agreement, Program};
use understudy_executable::Interface;
use understudy_ladder::Program as LadderProgram;
use understudy_logic::Circuit;
use understudy_parity::ParityController;
use understudy_plant::{Followed, Plant};
use understudy_remote_io::{Diagnosis, Fallback, PairedInput, SharedOutputs, StopPoints, Wiring};
use understudy_typed::{Points, Program as TypedProgram};
use understudy_wire::{Member, ProgramHash, ProgramId, ProgramSet, Roster, StationId, Via};

/// What carries the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Link {
    /// Plain UDP.
    #[default]
    Udp,
    /// Zenoh.
    Zenoh,
}

/// Who may speak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Security {
    /// Whoever has the keys of this cluster: frames carry authenticators.
    #[default]
    Keys,
    /// Everybody on the network.
    Off,
}

/// One of the N.
#[derive(Debug, Clone)]
pub struct Controller {
    /// The station's name.
    pub name: String,
    /// The file with its program, as the cluster file names it.
    pub file: String,
    /// Its program, under the station's name and for the period of the cluster.
    pub code: Code,
    /// u(i) and y(i), point by point.
    pub interface: Interface,
    /// Of the program.
    pub hash: ProgramHash,
    /// Where it listens, if the file says so.
    pub addresses: Addresses,
}

/// A generated parity controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Understudy {
    /// The station's name.
    pub name: String,
    /// Where it listens, if the file says so.
    pub addresses: Addresses,
    /// Whether this is the slot of a spare: absent until a spare wakes here.
    pub spare: bool,
}

/// A ladder that finds failed channels.
#[derive(Debug, Clone)]
pub struct DiagnosisPlace {
    /// Its file, as the cluster file names it.
    pub ladder: String,
    /// It, for the period of the cluster.
    pub circuit: Circuit,
    /// Bound to the signals of its program.
    pub compiled: Arc<Diagnosis>,
}

impl Controller {
    /// The ladder, of a program that is Boolean.
    pub fn ladder(&self) -> Option<&LadderProgram> {
        self.code.ladder()
    }

    /// Where its program reports a program fault, of one that can stop by a fault.
    pub(crate) fn stop_points(&self) -> Option<StopPoints> {
        let Interface { inputs, outputs } = &self.interface;
        let implied = |points: &Points, name| {
            points.find(name).filter(|point| point.slot == 0).map(|point| point.bit as usize)
        };
        Some(StopPoints {
            stopped: implied(outputs, TypedProgram::FAULT)?,
            reset: implied(inputs, TypedProgram::RESET)?,
        })
    }

    /// Whether its program can stop by a program fault.
    pub fn can_stop(&self) -> bool {
        self.stop_points().is_some()
    }

    /// The circuit that does in every scan what the program does, under the name of the controller.
    ///
    /// # Errors
    /// The values of the program that have no bits.
    pub fn exact_circuit(&self) -> Result<Cow<'_, Circuit>, Inexact> {
        let circuit = self.code.exact_circuit()?;
        Ok(match circuit.name() == self.name {
            true => circuit,
            false => Cow::Owned(circuit.into_owned().named(&self.name)),
        })
    }

    /// The circuit that stations execute, of a ladder.
    pub fn circuit(&self) -> Option<&Circuit> {
        self.code.circuit()
    }
}

impl DiagnosisPlace {
    /// Whether it drives this input of the program: the status of a channel.
    pub(crate) fn drives(&self, input: &str) -> bool {
        let channel = input.strip_suffix(".failed");
        let mut outputs = self.circuit.outputs().iter();
        channel.is_some_and(|channel| {
            outputs.any(|output| output.name.strip_suffix(".diagnosed") == Some(channel))
        })
    }
}

/// The plant's side of a controller.
#[derive(Debug, Clone)]
pub struct RemoteIo {
    /// Its name.
    pub name: String,
    /// What it does where nothing is proved.
    pub fallback: Fallback,
    /// Its section of the cluster file, from which it is read again; one of its own where the file has none.
    pub(crate) section: String,
    /// Its inputs that do not come from the field.
    pub inputs: Vec<InputSource>,
    /// The equipment behind it; without one its plant is simulated, or absent.
    pub field: Option<FieldDevice>,
    /// What finds failed channels that do not say so.
    pub diagnosis: Option<DiagnosisPlace>,
    /// The second remote I/O of its program.
    pub twin: Option<Twin>,
    /// Where it listens, if the file says so.
    pub addresses: Addresses,
}

/// The second remote I/O of a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Twin {
    /// Its name.
    pub name: String,
    /// Cycles without the author after which the other one takes over.
    pub take_over_after: u32,
    /// How the two are wired to the plant.
    pub wiring: Wiring,
    /// Inputs that modules of both read.
    pub paired_inputs: Vec<PairedInput>,
    /// Numbers that modules of both drive together.
    pub shared_outputs: SharedOutputs,
    /// The device of its own modules; none where the first one has none, or both are at one device.
    pub field: Option<FieldDevice>,
    /// Whether a cable joins it to the first remote I/O, apart from the networks.
    pub direct_link: bool,
    /// Where it listens, if the file says so.
    pub addresses: Addresses,
}

impl Twin {
    /// Whether both remote I/Os of its program have modules of their own.
    pub fn is_parallel(&self) -> bool {
        matches!(self.wiring, Wiring::Parallel { .. })
    }
}

impl RemoteIo {
    /// Declarations of the inputs that operators write.
    pub fn operator_inputs(&self) -> impl Iterator<Item = &OperatorDeclaration> {
        self.inputs.iter().filter_map(InputSource::operator)
    }

    /// Declarations of the inputs that are outputs of other programs.
    pub fn signals(&self) -> impl Iterator<Item = &SignalDeclaration> {
        self.inputs.iter().filter_map(InputSource::signal)
    }
}

/// A simulated plant behind a remote I/O.
#[derive(Debug, Clone)]
pub struct PlantPlace {
    /// Its name.
    pub name: String,
    /// "robot", "press" or the file of a ladder.
    pub model: String,
    /// Bound to its controller, in its initial state.
    pub plant: Plant,
    /// The program of the plant whose parts it takes.
    pub fed_by: Option<ProgramId>,
    /// What it follows, by number.
    pub follows: Vec<Followed>,
    /// Periods without an actuation after which the fail-safe outputs are in force.
    pub watchdog_cycles: u32,
    /// Where it listens, if the file says so.
    pub addresses: Addresses,
}

/// Programs, stations, remote I/Os and plants.
///
/// Invariant: names are unique over all members; controller i, remote I/O i and plant i stand at index i; every image of
/// the cluster fits into a frame.
#[derive(Debug, Clone)]
pub struct Cluster {
    pub(crate) name: String,
    pub(crate) link: Link,
    pub(crate) retain_every: Duration,
    pub(crate) spins: bool,
    pub(crate) multicast: Option<SocketAddrV4>,
    pub(crate) has_two_networks: bool,
    pub(crate) security: Security,
    pub(crate) agreement: Arc<Agreement>,
    pub(crate) canonical_text: String,
    /// The same without the programs, and without what remote I/Os do where nothing is proved: what an online change does not touch.
    pub(crate) frame_text: String,
    pub(crate) controllers: Vec<Controller>,
    pub(crate) understudies: Vec<Understudy>,
    pub(crate) remote_ios: Vec<RemoteIo>,
    pub(crate) plants: Vec<Option<PlantPlace>>,
    pub(crate) alarms: Arc<[AlarmDeclaration]>,
    pub(crate) notify: Option<Notify>,
    pub(crate) cards: Arc<Cards>,
    pub(crate) programs: Arc<[Program]>,
    pub(crate) parity: Option<ParityController>,
}

impl Cluster {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What carries the frames.
    pub fn link(&self) -> Link {
        self.link
    }

    /// The first multicast group of its frames, where the network has multicast; only for UDP.
    pub fn multicast(&self) -> Option<SocketAddrV4> {
        self.multicast.filter(|_| self.link == Link::Udp)
    }

    /// Whether stations and remote I/Os wait actively within the turn window, where each has a core of its own.
    pub fn spins(&self) -> bool {
        self.spins
    }

    /// Whether each frame is sent over two networks.
    pub fn has_two_networks(&self) -> bool {
        self.has_two_networks
    }

    /// Who may speak.
    pub fn security(&self) -> Security {
        self.security
    }

    /// What all members agree on.
    pub fn agreement(&self) -> &Arc<Agreement> {
        &self.agreement
    }

    /// The text that the configuration hash is of: what differs between two configurations can be read in it.
    pub fn canonical_text(&self) -> &str {
        &self.canonical_text
    }

    /// In the order of their programs.
    pub fn controllers(&self) -> &[Controller] {
        &self.controllers
    }

    /// In the order of their ranks.
    pub fn understudies(&self) -> &[Understudy] {
        &self.understudies
    }

    /// Number of the understudies that are no slots of spares.
    pub fn lasting_understudies(&self) -> usize {
        self.understudies.iter().filter(|understudy| !understudy.spare).count()
    }

    /// Whether a member is the slot of a spare.
    pub fn is_spare_slot(&self, member: Member) -> bool {
        matches!(member, Member::Station(station) if self.agreement.schedule.spare_slots().contains(station))
    }

    /// In the order of their programs.
    pub fn remote_ios(&self) -> &[RemoteIo] {
        &self.remote_ios
    }

    /// The programs that have a second remote I/O.
    pub fn twins(&self) -> ProgramSet {
        let programs = (0..).map(ProgramId).zip(&self.remote_ios);
        let paired = programs.filter(|(_, remote_io)| remote_io.twin.is_some());
        paired.map(|(program, _)| program).collect()
    }

    /// The programs whose two remote I/Os a direct link joins.
    pub fn direct_links(&self) -> ProgramSet {
        let programs = (0..).map(ProgramId).zip(&self.remote_ios);
        let is_joined = |twin: &Twin| twin.direct_link;
        let joined = programs.filter(|(_, it)| it.twin.as_ref().is_some_and(is_joined));
        joined.map(|(program, _)| program).collect()
    }

    /// The paths that a member's frames travel over.
    pub fn paths(&self, member: Member) -> impl Iterator<Item = Via> + use<> {
        let links = self.direct_links();
        let is_linked = member.sampled_program().is_some_and(|program| links.contains(program));
        let has_two_networks = self.has_two_networks;
        Via::ALL.into_iter().filter(move |via| match via {
            Via::First => true,
            Via::Second => has_two_networks,
            Via::Link => is_linked,
        })
    }

    /// In the order of their programs; nothing where a program has no simulated plant.
    pub fn plants(&self) -> &[Option<PlantPlace>] {
        &self.plants
    }

    /// Who receives what. Plant j receives from plant i where it takes its parts or follows its sensors, and remote I/O j from remote I/O i
    /// where it reads a signal of program i.
    pub fn roster(&self) -> Roster {
        let plants = self.plants.iter().enumerate();
        let pairs = plants.flat_map(|(listener, place)| {
            let place = place.iter();
            place.flat_map(move |place| {
                let followed = place.follows.iter().map(|followed| followed.from);
                let speakers = place.fed_by.into_iter().chain(followed);
                speakers.map(move |speaker| {
                    let listener = Member::Plant(ProgramId(listener as u8));
                    (Member::Plant(speaker), listener)
                })
            })
        });
        let readers = self.remote_ios.iter().enumerate();
        let signals = readers.flat_map(|(reader, remote_io)| {
            let sources = remote_io.signals().map(|signal| signal.input.from);
            sources.map(move |source| {
                let reader = Member::RemoteIo(ProgramId(reader as u8));
                (Member::RemoteIo(source), reader)
            })
        });
        let pairs: BTreeSet<_> = pairs.chain(signals).collect();
        let schedule = &self.agreement.schedule;
        let pairs = pairs.into_iter().collect();
        Roster::new(schedule.controllers(), schedule.stations(), pairs).with_twins(self.twins())
    }

    /// Alarms on signals of the programs, in the order of the file.
    pub fn alarms(&self) -> &Arc<[AlarmDeclaration]> {
        &self.alarms
    }

    /// Command that passes alarms on, where the file has one.
    pub fn notify(&self) -> Option<&Notify> {
        self.notify.as_ref()
    }

    /// All programs, compiled, in order.
    pub fn programs(&self) -> &Arc<[Program]> {
        &self.programs
    }

    /// The generated controller N+1, (7)-(9), where all programs are Boolean: the sum of programs with numbers is of their outputs' bits, and has no
    /// circuit.
    pub fn parity(&self) -> Option<&ParityController> {
        self.parity.as_ref()
    }

    /// The circuits that do in every scan what the programs do, in order.
    ///
    /// # Errors
    /// The name of the first controller whose program has none, and which of its values have no bits.
    pub fn circuits(&self) -> Result<Vec<Cow<'_, Circuit>>, (&str, Inexact)> {
        let circuits = self.controllers.iter().map(|controller| {
            controller.exact_circuit().map_err(|inexact| (controller.name.as_str(), inexact))
        });
        circuits.collect()
    }

    /// Every member: stations by rank, then remote I/Os, then plants, then twins.
    pub fn members(&self) -> impl Iterator<Item = Member> + '_ {
        let stations = 0..self.agreement.schedule.stations();
        let plants = self.plants.iter().enumerate();
        let plants = plants.filter(|(_, plant)| plant.is_some());
        stations
            .map(|rank| Member::Station(StationId(rank as u8)))
            .chain((0..self.remote_ios.len()).map(|index| Member::RemoteIo(ProgramId(index as u8))))
            .chain(plants.map(|(index, _)| Member::Plant(ProgramId(index as u8))))
            .chain(self.twins().iter().map(Member::Twin))
    }

    /// The name of a member; nothing where the cluster has no such member.
    pub fn member_name(&self, member: Member) -> Option<&str> {
        self.place(member).map(|(name, _)| name)
    }

    /// The member of a name.
    pub fn member(&self, name: &str) -> Option<Member> {
        self.members().find(|&member| self.member_name(member) == Some(name))
    }

    /// Where a member listens on the first network; nothing where the file does not say so.
    pub fn address(&self, member: Member) -> Option<SocketAddr> {
        self.addresses(member).first
    }

    /// Where a member listens, as far as the file says so.
    pub fn addresses(&self, member: Member) -> Addresses {
        self.place(member).map_or_else(Addresses::default, |(_, addresses)| addresses)
    }

    fn place(&self, member: Member) -> Option<(&str, Addresses)> {
        match member {
            Member::Station(station) => {
                let rank = station.index();
                let controller = self.controllers.get(rank);
                let controller = controller.map(|found| (found.name.as_str(), found.addresses));
                let understudy = rank.checked_sub(self.controllers.len());
                controller.or_else(|| {
                    let found = self.understudies.get(understudy?)?;
                    Some((&found.name, found.addresses))
                })
            }
            Member::RemoteIo(program) => {
                let found = self.remote_ios.get(program.index())?;
                Some((&found.name, found.addresses))
            }
            Member::Plant(program) => {
                let found = self.plants.get(program.index())?.as_ref()?;
                Some((&found.name, found.addresses))
            }
            Member::Twin(program) => {
                let found = self.remote_ios.get(program.index())?.twin.as_ref()?;
                Some((&found.name, found.addresses))
            }
        }
    }
}
