//! A plant's controllers, their understudies and what else can fail, as one chain.
//!
//! Boxes of one kind are alike, so only how many of each kind are down is kept, and groups that are alike are only counted: the
//! chain is exactly lumped. Two rules say when a group has failed:
//!
//! - [`Rule::Paper`]: at the second failure, (14);
//! - [`Rule::AsBuilt`]: when all its understudies and at least one of its controllers are down. An understudy holds the state of every
//!   controller, so while one lives all outputs can be restored.
//!
//! A failed box is repaired after it was detected; it is masked from the first cycle on, so detection costs time to repair and nothing
//! else. The system fails with its first group, with a failure that is not covered, with a common cause, or with a shared part (`parts.rs`).

use std::collections::HashMap;

use serde::Serialize;

use crate::chain::{Chain, explore};
use crate::error::ReliabilityError;
use crate::parts::SharedPart;
use crate::positions::{Lacking, Positions, complete, incomplete, steps, waiting};
use crate::quantity::{Hours, Probability};

/// Maximum number of stations of one system.
pub const MAXIMUM_BOXES: u32 = 1_000_000;

/// States of one model, at most.
pub const MAXIMUM_MODEL_STATES: usize = 300_000;

/// Stations of one kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoxKind {
    /// Name of the kind, such as `robot`.
    pub name: String,
    /// Number of stations in the whole system.
    pub count: u32,
    /// Mean time between failures of one.
    pub mtbf: Hours,
    /// Mean time to repair one, from its detection on, while a crew is at it.
    pub mttr: Hours,
}

/// The rule by which a group fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// The group fails at the second failure of any of its stations, (14).
    Paper,
    /// The group fails when all understudies and at least one controller are down.
    AsBuilt,
}

/// Convention for the common-cause factor beta.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CommonCauseConvention {
    /// Stations fail at λ; in addition, all of them fail together at β λ.
    Additive,
    /// Stations fail at (1 - β) λ, and all of them together at β λ. In a large system this can *raise* the MTTF, because λ counts N
    /// times and β λ once.
    Split,
}

/// Common-cause failures. λ is that of the kind with the highest failure rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CommonCause {
    /// β
    pub beta: Probability,
    /// Convention for β.
    pub convention: CommonCauseConvention,
}

/// The description of a system, from which its model is made.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct System {
    /// Controllers; their counts are of the whole system and divide by `groups`.
    pub controllers: Vec<BoxKind>,
    /// Understudies; the count is of one group.
    pub understudies: BoxKind,
    /// Groups that are alike, each with its own understudies.
    pub groups: u32,
    /// The rule by which a group fails.
    pub rule: Rule,
    /// Boxes that are repaired at the same time, at most; nothing: a crew for each box. Where more are down, each is as likely to be
    /// worked on as any other.
    pub crews: Option<u32>,
    /// Probability that a failure is masked at all.
    pub coverage: Probability,
    /// Mean time from a failure to its detection, after which repair starts.
    pub detection: Option<Hours>,
    /// Common-cause failures.
    pub common_cause: Option<CommonCause>,
    /// Parts in series with the stations.
    pub shared: Vec<SharedPart>,
}

/// Boxes of one kind within one group.
struct Kind {
    count: u32,
    failure_rate: f64,
    repair_rate: f64,
    understudy: bool,
}

/// Boxes of a group that are down, by kind: undetected, then detected.
type GroupState = Vec<(u32, u32)>;

/// How many groups are in which state, by number of the state.
type GroupsState = Vec<(u32, u32)>;

/// The groups, and the pairs of shared parts that lack one.
type SystemState = (GroupsState, Lacking);

impl System {
    /// Controllers in all.
    pub fn controller_count(&self) -> u32 {
        self.controllers.iter().map(|kind| kind.count).sum()
    }

    /// Number of stations, understudies included.
    pub fn boxes(&self) -> u32 {
        self.controller_count() + self.groups * self.understudies.count
    }

    /// Every fault of the description.
    ///
    /// # Errors
    /// Counts out of bounds, groups that do not divide.
    pub fn check(&self) -> Result<(), Vec<ReliabilityError>> {
        let mut errors = Vec::new();
        let mut count = |what: &str, count: u32, minimum: u64, maximum: u32| {
            if !(minimum..=u64::from(maximum)).contains(&u64::from(count)) {
                errors.push(ReliabilityError::Count {
                    what: what.into(),
                    count: u64::from(count),
                    minimum,
                    maximum: u64::from(maximum),
                });
            }
        };
        count("the number of groups", self.groups, 1, MAXIMUM_BOXES);
        for kind in &self.controllers {
            count(&format!("the number of {}", kind.name), kind.count, 1, MAXIMUM_BOXES);
        }
        let total: u64 = self.controllers.iter().map(|kind| u64::from(kind.count)).sum();
        let boxes = total + u64::from(self.groups) * u64::from(self.understudies.count);
        let boxes = u32::try_from(boxes).unwrap_or(u32::MAX);
        count("the number of boxes", boxes, 1, MAXIMUM_BOXES);
        if self.controllers.is_empty() {
            count("the number of controllers", 0, 1, MAXIMUM_BOXES);
        }
        for part in &self.shared {
            count(&format!("the number of {}", part.name), part.count, 1, MAXIMUM_BOXES);
        }
        if let Some(crews) = self.crews {
            count("the number of repair crews", crews, 1, MAXIMUM_BOXES);
        }
        for kind in &self.controllers {
            if self.groups > 0 && !kind.count.is_multiple_of(self.groups) {
                errors.push(ReliabilityError::Groups {
                    controllers: u64::from(kind.count),
                    groups: u64::from(self.groups),
                });
            }
        }
        if errors.is_empty() { Ok(()) } else { Err(errors) }
    }

    /// Markov chain of this system. In its first state all stations work; its last state is `failed`.
    ///
    /// # Errors
    /// The errors of [`System::check`], and more states than [`MAXIMUM_MODEL_STATES`].
    pub fn chain(&self) -> Result<Chain, Vec<ReliabilityError>> {
        self.check()?;
        let mut groups =
            Groups { kinds: self.kinds(), numbers: HashMap::new(), states: Vec::new() };
        let whole = groups.number(vec![(0, 0); groups.kinds.len()]);
        let pairs: Vec<Positions> = self.pairs().collect();
        let first: SystemState = (vec![(whole, self.groups)], complete(&pairs));
        let names = std::cell::RefCell::new(groups);
        let (chain, _) = explore(
            first,
            MAXIMUM_MODEL_STATES,
            |state| names.borrow().name(state, &pairs, self),
            |state, found| self.successors(&mut names.borrow_mut(), &pairs, state, found),
        )?;
        Ok(chain)
    }

    /// Kinds of one group. Boxes that cannot be told apart are one kind; under the paper's rule that holds for the understudy too.
    fn kinds(&self) -> Vec<Kind> {
        let split = match self.common_cause {
            Some(CommonCause { beta, convention: CommonCauseConvention::Split }) => {
                1.0 - beta.get()
            }
            _ => 1.0,
        };
        let mut kinds: Vec<Kind> = Vec::new();
        let controllers =
            self.controllers.iter().map(|kind| (kind, kind.count / self.groups, false));
        let understudies =
            (&self.understudies, self.understudies.count, self.rule == Rule::AsBuilt);
        for (kind, count, understudy) in controllers.chain([understudies]) {
            let failure_rate = kind.mtbf.rate() * split;
            let repair_rate = kind.mttr.rate();
            let alike = kinds.iter_mut().find(|known| {
                (known.failure_rate, known.repair_rate, known.understudy)
                    == (failure_rate, repair_rate, understudy)
            });
            match alike {
                Some(known) => known.count += count,
                None => kinds.push(Kind { count, failure_rate, repair_rate, understudy }),
            }
        }
        kinds
    }

    /// Rate of what fails the system from every state.
    fn lethal_rate(&self) -> f64 {
        let kinds = self
            .controllers
            .iter()
            .chain((self.understudies.count > 0).then_some(&self.understudies));
        let fastest = kinds.map(|kind| kind.mtbf.rate()).fold(0.0, f64::max);
        self.lethal_rate_of_parts()
            + self.common_cause.map_or(0.0, |cause| cause.beta.get() * fastest)
    }

    /// Rate at which shared parts fail the system from every state.
    pub(crate) fn lethal_rate_of_parts(&self) -> f64 {
        self.shared.iter().map(SharedPart::lethal_rate).sum()
    }

    /// Shared parts of which one of two may be down.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = Positions> + '_ {
        self.shared.iter().filter_map(SharedPart::positions)
    }

    /// Share of `detected` failed boxes that a crew works on: each is as likely to be worked on as any other.
    pub(crate) fn attended(&self, detected: u32) -> f64 {
        match self.crews {
            Some(crews) if crews < detected => f64::from(crews) / f64::from(detected),
            _ => 1.0,
        }
    }

    fn group_fails(&self, kinds: &[Kind], state: &GroupState) -> bool {
        let down = |understudy: bool| -> u32 {
            let kinds = kinds.iter().zip(state).filter(|(kind, _)| kind.understudy == understudy);
            kinds.map(|(_, (undetected, detected))| undetected + detected).sum()
        };
        match self.rule {
            Rule::Paper => down(false) > 1,
            Rule::AsBuilt => down(true) == self.understudies.count && down(false) > 0,
        }
    }

    fn successors(
        &self,
        groups: &mut Groups,
        pairs: &[Positions],
        state: &SystemState,
        found: &mut Vec<(Option<SystemState>, f64)>,
    ) {
        let lethal = self.lethal_rate();
        if lethal > 0.0 {
            found.push((None, lethal));
        }
        let (of_groups, lacking) = state;
        let stations: u32 = of_groups
            .iter()
            .map(|&(number, count)| {
                let group = &groups.states[number as usize];
                count * group.iter().map(|(_, detected)| detected).sum::<u32>()
            })
            .sum();
        let attended = self.attended(stations + waiting(pairs, lacking));
        let mut of_pairs = Vec::new();
        steps(pairs, lacking, attended, &mut of_pairs);
        found.extend(
            of_pairs
                .into_iter()
                .map(|(to, rate)| (to.map(|lacking| (of_groups.clone(), lacking)), rate)),
        );
        for &(number, count) in of_groups {
            let group = groups.states[number as usize].clone();
            for index in 0..groups.kinds.len() {
                let kind = &groups.kinds[index];
                let (failure_rate, repair_rate) = (kind.failure_rate, kind.repair_rate);
                let (hidden, known) = group[index];
                let failing = f64::from(count * (kind.count - hidden - known)) * failure_rate;
                let mut after = group.clone();
                if failing > 0.0 {
                    match self.detection {
                        Some(_) => after[index].0 += 1,
                        None => after[index].1 += 1,
                    }
                    let covered = failing * self.coverage.get();
                    let uncovered = failing * (1.0 - self.coverage.get());
                    if self.group_fails(&groups.kinds, &after) {
                        found.push((None, failing));
                    } else {
                        if covered > 0.0 {
                            let to = groups.moved(state, number, after);
                            found.push((Some(to), covered));
                        }
                        if uncovered > 0.0 {
                            found.push((None, uncovered));
                        }
                    }
                }
                if let (Some(latency), true) = (self.detection, hidden > 0) {
                    let mut after = group.clone();
                    after[index] = (hidden - 1, known + 1);
                    let to = groups.moved(state, number, after);
                    found.push((Some(to), f64::from(count * hidden) * latency.rate()));
                }
                if known > 0 {
                    let mut after = group.clone();
                    after[index].1 -= 1;
                    let to = groups.moved(state, number, after);
                    found.push((Some(to), f64::from(count * known) * repair_rate * attended));
                }
            }
        }
    }
}

struct Groups {
    kinds: Vec<Kind>,
    numbers: HashMap<GroupState, u32>,
    states: Vec<GroupState>,
}

impl Groups {
    fn number(&mut self, state: GroupState) -> u32 {
        let next = self.states.len() as u32;
        *self.numbers.entry(state).or_insert_with_key(|state| {
            self.states.push(state.clone());
            next
        })
    }

    /// The system after one group has gone from state `from` to `to`.
    fn moved(&mut self, system: &SystemState, from: u32, to: GroupState) -> SystemState {
        let to = self.number(to);
        let (mut after, lacking) = system.clone();
        if let Ok(place) = after.binary_search_by_key(&from, |&(number, _)| number) {
            after[place].1 -= 1;
            if after[place].1 == 0 {
                after.remove(place);
            }
        }
        match after.binary_search_by_key(&to, |&(number, _)| number) {
            Ok(place) => after[place].1 += 1,
            Err(place) => after.insert(place, (to, 1)),
        }
        (after, lacking)
    }

    /// What is down, such as `2 controllers, 1 understudy`.
    fn name(&self, (state, lacking): &SystemState, kinds: &[Positions], system: &System) -> String {
        if self.kinds.len() > 3 || state.len() > 3 {
            return String::new();
        }
        let said = |count: u32, kind: &Kind, what: &str| {
            let one = match (kind.understudy, system.rule) {
                (true, _) => "understudy",
                (false, Rule::AsBuilt) => "controller",
                (false, Rule::Paper) => "box",
            };
            let many = match (kind.understudy, system.rule) {
                (true, _) => "understudies",
                (false, Rule::AsBuilt) => "controllers",
                (false, Rule::Paper) => "boxes",
            };
            format!("{count} {} {what}", if count == 1 { one } else { many })
        };
        let mut parts = Vec::new();
        for &(number, count) in state {
            let mut down = Vec::new();
            for (kind, &(hidden, known)) in self.kinds.iter().zip(&self.states[number as usize]) {
                if hidden > 0 {
                    down.push(said(hidden, kind, "undetected"));
                }
                if known > 0 {
                    down.push(said(known, kind, "down"));
                }
            }
            if !down.is_empty() && system.groups > 1 {
                parts.push(format!("{count} × ({})", down.join(", ")));
            } else if !down.is_empty() {
                parts.push(down.join(", "));
            }
        }
        let pairs = system.shared.iter().filter(|part| part.pair.is_some());
        for (pair, down) in pairs.zip(incomplete(kinds, lacking)).filter(|(_, down)| *down > 0) {
            parts.push(format!("{down} × half of a {}", pair.name));
        }
        if parts.is_empty() { "all work".into() } else { parts.join("; ") }
    }
}
