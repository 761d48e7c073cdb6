//! The members of a cluster by name.

use understudy_cluster::Cluster;
use understudy_remote_io::OperatorInput;
use understudy_wire::{Member, ProgramId, StationId};

/// Every member of a cluster with its name: stations by rank, then remote I/Os, then plants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Members {
    members: Vec<(Member, String)>,
    /// Inputs that operators write.
    operator_inputs: Vec<NamedInput>,
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
}

impl Members {
    /// All members of a cluster.
    pub fn of(cluster: &Cluster) -> Self {
        let name = |member| cluster.member_name(member).unwrap_or_default().to_owned();
        let programs = (0..).map(ProgramId).zip(cluster.remote_ios());
        let inputs = programs.flat_map(|(program, remote_io)| {
            let sources = remote_io.inputs.iter();
            sources.filter_map(move |source| {
                Some(NamedInput {
                    program,
                    name: source.name.clone(),
                    input: source.operator()?.input,
                })
            })
        });
        Self {
            operator_inputs: inputs.collect(),
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
        }
    }

    /// Members with their names, in ascending order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (Member, &str)> {
        self.members
            .iter()
            .map(|(member, name)| (*member, name.as_str()))
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
        self.iter()
            .find(|(_, known)| *known == name)
            .map(|(member, _)| member)
    }

    /// Inputs of a program that operators write.
    pub fn operator_inputs(&self, program: ProgramId) -> impl Iterator<Item = &NamedInput> {
        let inputs = self.operator_inputs.iter();
        inputs.filter(move |input| input.program == program)
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
