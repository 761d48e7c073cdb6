//! What is known about a supervisor's ladder: before it is generated, and proved after.
//!
//! [`findings`] looks at the supervisor alone and says where a scanning PLC could not follow it. [`prove`] puts a ladder and
//! its automata side by side: it explores every state that both can reach together, lowers the ladder to its
//! [`Circuit`](understudy_logic::Circuit) for that, and holds each scan to what the automata allow. It knows the ladder by its
//! bits only (a [`Correspondence`](crate::ladder::Correspondence)) and shares no code with what generates it. [`prove_hybrid`] does
//! the same for the ladder of a net with its supervisors.

mod environment;
mod explore;
mod findings;
mod hybrid;
mod reference;
mod relevant;
mod timers;
mod verdict;
mod view;

pub use explore::{ProofSettings, Proving, prove, prove_with_progress};
pub use findings::{
    Finding, FindingKind, FindingSeverity, HybridFindingsError, findings, hybrid_findings,
};
pub use hybrid::{HybridCounterexample, HybridDeviation, HybridProof, HybridVerdict, prove_hybrid};
pub use verdict::{Counterexample, Deviation, Proof, ProofError, ScanRecord, Verdict};
