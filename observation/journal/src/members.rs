//! The members of a cluster by name.

use understudy_cluster::{Card, Cluster, InputSource};
use understudy_remote_io::OperatorInput;
use understudy_typed::{Declared, Point};
use understudy_wire::{Member, ProgramId, ProgramSet, SignalPlace, StationId, StationSet};

/// Every member of a cluster with its name: stations by rank, then remote I/Os, then plants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Members {
    members: Vec<(Member, String)>,
    /// Inputs that operators write.
    operator_inputs: Vec<NamedInput>,
    /// Signals of each program; empty where only the members are known.
    signals: Vec<Vec<NamedSignal>>,
    spare_slots: StationSet,
    have_two_networks: bool,
    /// Programs whose two remote I/Os a direct link joins.
    linked: ProgramSet,
}

/// Input or output of a program, by name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedSignal {
    /// Place in the process image.
    pub place: SignalPlace,
    /// Name in the program.
    pub name: String,
    /// How the program declares it.
    pub declared: Declared,
    /// How it is shown.
    pub card: Card,
    /// The output of another program that it is, such as `press.done`.
    pub from: Option<String>,
}

/// Input that operators write, by name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedInput {
    /// Program of the input.
    pub program: ProgramId,
    /// Name of the input.
    pub name: String,
    /// Place and behaviour.
    pub input: OperatorInput,
    /// How the program declares it.
    pub declared: Declared,
}

impl Members {
    /// All members of a cluster.
    pub fn of(cluster: &Cluster) -> Self {
        let name = |member| cluster.member_name(member).unwrap_or_default().to_owned();
        let programs = (0..).map(ProgramId).zip(cluster.remote_ios());
        let inputs = programs.flat_map(|(program, remote_io)| {
            let sources = remote_io.inputs.iter();
            sources.filter_map(move |source| {
                let operator = source.operator()?;
                Some(NamedInput {
                    program,
                    name: source.name.clone(),
                    input: operator.input,
                    declared: operator.declared.clone(),
                })
            })
        });
        Self {
            operator_inputs: inputs.collect(),
            signals: (0..cluster.controllers().len())
                .map(|program| signals(cluster, ProgramId(program as u8)))
                .collect(),
            spare_slots: cluster.agreement().schedule.spare_slots(),
            have_two_networks: cluster.has_two_networks(),
            linked: cluster.direct_links(),
            ..Self::new(cluster.members().map(|member| (member, name(member))))
        }
    }

    /// From all members; names are unique, which the reader of cluster files has checked.
    pub fn new(members: impl IntoIterator<Item = (Member, String)>) -> Self {
        let mut members: Vec<_> = members.into_iter().collect();
        members.sort();
        Self {
            members,
            operator_inputs: Vec::new(),
            signals: Vec::new(),
            spare_slots: StationSet::EMPTY,
            have_two_networks: false,
            linked: ProgramSet::EMPTY,
        }
    }

    /// Whether each frame is sent over two networks.
    pub fn have_two_networks(&self) -> bool {
        self.have_two_networks
    }

    /// Whether a direct link joins a member with the other remote I/O of its program.
    pub fn is_linked(&self, member: Member) -> bool {
        member.sampled_program().is_some_and(|program| self.linked.contains(program))
    }

    /// Members with their names, in ascending order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (Member, &str)> {
        self.members.iter().map(|(member, name)| (*member, name.as_str()))
    }

    /// Its name; for a member that is none of this cluster, its rank.
    pub fn name(&self, member: Member) -> &str {
        self.members
            .iter()
            .find(|(known, _)| *known == member)
            .map_or("(unknown)", |(_, name)| name)
    }

    /// The member of a name.
    pub fn find(&self, name: &str) -> Option<Member> {
        self.iter().find(|(_, known)| *known == name).map(|(member, _)| member)
    }

    /// Inputs of a program that operators write.
    pub fn operator_inputs(&self, program: ProgramId) -> impl Iterator<Item = &NamedInput> {
        let inputs = self.operator_inputs.iter();
        inputs.filter(move |input| input.program == program)
    }

    /// The signal of a program at a place.
    pub fn signal(&self, program: ProgramId, place: SignalPlace) -> Option<&NamedSignal> {
        let mut signals = self.signals.get(program.index())?.iter();
        signals.find(|signal| signal.place == place)
    }

    /// Inputs of a program in the order of its process image.
    pub fn inputs(&self, program: ProgramId) -> impl Iterator<Item = &NamedSignal> {
        let signals = self.signals.get(program.index()).into_iter().flatten();
        signals.filter(|signal| matches!(signal.place, SignalPlace::Input(_)))
    }

    /// Outputs of a program in the order of its process image.
    pub fn outputs(&self, program: ProgramId) -> impl Iterator<Item = &NamedSignal> {
        let signals = self.signals.get(program.index()).into_iter().flatten();
        signals.filter(|signal| matches!(signal.place, SignalPlace::Output(_)))
    }

    /// Whether a member is the slot of a spare.
    pub fn is_spare_slot(&self, member: Member) -> bool {
        matches!(member, Member::Station(station) if self.spare_slots.contains(station))
    }

    /// Stations in rank order.
    pub fn stations(&self) -> impl Iterator<Item = (StationId, &str)> {
        self.iter().filter_map(|(member, name)| match member {
            Member::Station(station) => Some((station, name)),
            _ => None,
        })
    }

    /// Remote I/Os in the order of programs.
    pub fn remote_ios(&self) -> impl Iterator<Item = (ProgramId, &str)> {
        self.iter().filter_map(|(member, name)| match member {
            Member::RemoteIo(program) => Some((program, name)),
            _ => None,
        })
    }

    /// Plants in the order of programs.
    pub fn plants(&self) -> impl Iterator<Item = (ProgramId, &str)> {
        self.iter().filter_map(|(member, name)| match member {
            Member::Plant(program) => Some((program, name)),
            _ => None,
        })
    }
}

/// Inputs and outputs of a program of the cluster.
fn signals(cluster: &Cluster, of: ProgramId) -> Vec<NamedSignal> {
    let program = of.index();
    let interface = &cluster.controllers()[program].interface;
    let sources = cluster.remote_ios().get(program);
    let sources = sources.map_or(&[][..], |remote_io| &remote_io.inputs);
    let named = |place: fn(u16) -> SignalPlace, point: &Point| {
        let place = place(u16::try_from(point.bit).unwrap_or(u16::MAX));
        let is_input = matches!(place, SignalPlace::Input(_));
        let mut sources = sources.iter().filter(|_| is_input);
        let source = sources.find(|source| source.name == point.name);
        let signal = source.and_then(InputSource::signal);
        NamedSignal {
            place,
            name: point.name.clone(),
            declared: point.declared(),
            card: cluster.card(of, &point.name),
            from: signal.map(|signal| {
                let from = &cluster.controllers()[signal.input.from.index()].name;
                format!("{from}.{}", signal.output)
            }),
        }
    };
    let inputs = interface.inputs.iter();
    let outputs = interface.outputs.iter();
    inputs
        .map(|point| named(SignalPlace::Input, point))
        .chain(outputs.map(|point| named(SignalPlace::Output, point)))
        .collect()
}
