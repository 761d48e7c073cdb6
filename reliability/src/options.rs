//! What is asked about a cluster of alike boxes, from a command line or a cluster file, and the system that it means.

use serde::Serialize;

use crate::error::ReliabilityError;
use crate::quantity::{Hours, Probability};
use crate::system::{BoxKind, CommonCause, CommonCauseConvention, Rule, SharedPart, System};

/// Options of `understudy reliability`, as they are given; [`Options::system`] checks them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Options {
    /// N
    pub controllers: u32,
    /// Understudies of each group, S.
    pub spares: u32,
    /// Groups that share no understudy.
    pub groups: u32,
    /// Of each box.
    pub mtbf: Hours,
    /// Of each box, from its detection on.
    pub mttr: Hours,
    /// Repair crews; nothing: one for each box.
    pub crews: Option<u32>,
    /// Probability that a failure is masked.
    pub coverage: f64,
    /// Mean time to detect a failure.
    pub detection: Option<Hours>,
    /// Share β of failures that hit all boxes at once.
    pub beta: f64,
    /// How β is counted.
    pub convention: CommonCauseConvention,
    /// Parts that everything depends on.
    pub shared: Vec<SharedPart>,
    /// The time over which it has to work.
    pub mission: Option<Hours>,
}

impl Options {
    /// One understudy, a crew each, perfect coverage, nothing shared.
    pub fn new(controllers: u32, mtbf: Hours, mttr: Hours) -> Self {
        Self {
            controllers,
            spares: 1,
            groups: 1,
            mtbf,
            mttr,
            crews: None,
            coverage: 1.0,
            detection: None,
            beta: 0.0,
            convention: CommonCauseConvention::Additive,
            shared: Vec::new(),
            mission: None,
        }
    }

    /// The cluster as it is built.
    ///
    /// # Errors
    /// Everything that is wrong with the options.
    pub fn system(&self) -> Result<System, Vec<ReliabilityError>> {
        let coverage = Probability::new("the coverage", self.coverage);
        let beta = Probability::new("the share beta of common causes", self.beta);
        let mut errors: Vec<ReliabilityError> = [&coverage, &beta]
            .into_iter()
            .filter_map(|found| found.clone().err())
            .collect();
        let kind = |name: &str, count| BoxKind {
            name: name.into(),
            count,
            mtbf: self.mtbf,
            mttr: self.mttr,
        };
        let system = System {
            controllers: vec![kind("controllers", self.controllers)],
            understudies: kind("understudies", self.spares),
            groups: self.groups,
            rule: Rule::AsBuilt,
            crews: self.crews,
            coverage: coverage.unwrap_or(Probability::ONE),
            detection: self.detection,
            common_cause: beta
                .ok()
                .filter(|beta| beta.get() > 0.0)
                .map(|beta| CommonCause {
                    beta,
                    convention: self.convention,
                }),
            shared: self.shared.clone(),
        };
        if let Err(found) = system.check() {
            errors.extend(found);
        }
        if errors.is_empty() {
            Ok(system)
        } else {
            Err(errors)
        }
    }
}

impl System {
    /// The same boxes under the paper's rule, with one spare: S2 after any second failure, (14).
    pub fn as_paper(&self) -> Self {
        let mut paper = self.clone();
        paper.rule = Rule::Paper;
        paper.groups = 1;
        paper.understudies.count = 1;
        paper
    }

    /// The controllers alone.
    pub fn as_simplex(&self) -> Self {
        let mut simplex = self.clone();
        simplex.rule = Rule::AsBuilt;
        simplex.groups = 1;
        simplex.understudies.count = 0;
        simplex
    }

    /// Each controller with `copies` - 1 more of its kind, of which one may be down: 2 is the full duplex of (21), 3 is TMR. Nothing where
    /// the controllers differ.
    pub fn as_copies(&self, copies: u32) -> Option<Self> {
        let [kind] = &self.controllers[..] else {
            return None;
        };
        let mut copied = self.clone();
        copied.rule = Rule::Paper;
        copied.groups = kind.count;
        copied.controllers[0].count = kind.count.checked_mul(copies - 1)?;
        copied.understudies = kind.clone();
        copied.understudies.count = 1;
        Some(copied)
    }
}
