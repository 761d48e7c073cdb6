//! One cycle of one program: what was sampled, and what was driven.

use understudy_remote_io::Missing;
use understudy_typed::Fault;
use understudy_wire::{Image, Lineage, Member, Moment, ProgramHash, Source, StationId, StationSet};

/// A sample and its effect on the program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sampled {
    /// The program that took it.
    pub program: ProgramHash,
    /// Whether x(t) is the state of another program, converted by an online change.
    pub is_taken_over: bool,
    /// Whether x(t) is the state in which the program begins.
    pub is_initial: bool,
    /// u(t).
    pub inputs: Image,
    /// L(t).
    pub before: Lineage,
    /// x(t).
    pub state: Image,
    /// L(t+1).
    pub after: Lineage,
    /// h(x(t), u(t)).
    pub outputs: Image,
    /// The program fault in x(t+1), of a program with numbers; none of another program that an online change has replaced.
    pub fault: Option<Fault>,
    /// Whether it occurred in this scan.
    pub fault_is_new: bool,
}

/// The outputs at a deadline.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Driven {
    /// The remote I/O that drove them: the first one of the program or its twin.
    pub by: Member,
    /// The version of the program whose points these inputs and outputs have.
    pub points: ProgramHash,
    /// y(i) as the device gets it, with the forced values.
    pub outputs: Image,
    /// y(i) before forces.
    pub unforced: Image,
    /// Source of the unforced outputs.
    pub source: Source,
    /// The station whose parity word they were reconstructed from.
    pub word_of: Option<StationId>,
    /// Why there was no provable output.
    pub missing: Option<Missing>,
    /// The stations that were received.
    pub heard: StationSet,
    /// u(i) as last sampled, in this cycle or before.
    pub inputs: Option<Image>,
    /// The fail-safe values of the remote I/O's configuration, where the outputs are fail-safe and these are known.
    pub fail_safe: Option<Image>,
}

/// One cycle of one program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// The cycle, counted from the origin of the run.
    pub cycle: i64,
    /// As the cluster counts it.
    pub moment: Moment,
    /// Nothing where no sample was taken, or where the state before it is not known.
    pub sampled: Option<Sampled>,
    /// Nothing before its deadline, or where the remote I/O died before it.
    pub driven: Option<Driven>,
    /// Whether no station received the sample, so that the program continued without it.
    pub void: bool,
}
