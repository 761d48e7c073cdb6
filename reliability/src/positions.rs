//! Positions with more than one box, such as a remote I/O and its twin, or two copies of a controller: which of them lack a box.
//!
//! ```text
//!   a pair:                complete ──► one is down ──► the system has failed
//!
//!   two remote I/Os with modules of their own, two lanes of which one is needed:
//!
//!              ┌──► a remote I/O is down ──┐
//!   complete ──┤                           ├──► both of one lane are down
//!              └──► a module is down ──────┘
//!              and from each of them to the failure of the system with anything of the other lane
//! ```
//!
//! Positions that are alike are counted by their condition, so their chain is exactly lumped. Condition 0 is the complete position.

use crate::chain::{Chain, explore};
use crate::error::ReliabilityError;
use crate::system::MAXIMUM_MODEL_STATES;

/// Positions that are alike, with the conditions of one of them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Positions {
    /// Number of positions.
    pub(crate) count: u32,
    /// By condition from 1 on: boxes that wait for a repair or are repaired.
    waiting: Vec<u32>,
    steps: Vec<Step>,
}

/// A step of one position.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    from: usize,
    /// Nothing: the system fails.
    to: Option<usize>,
    /// Per hour.
    rate: f64,
    /// Whether a crew is needed.
    is_repair: bool,
}

/// For each kind of positions in turn: how many are in each of its conditions from 1 on.
pub(crate) type Lacking = Vec<u32>;

/// Rates of a position of which one box may be down, per hour.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PairRates {
    /// Failures of a complete position that are masked.
    pub(crate) masked: f64,
    /// Failures of a complete position that fail the system.
    pub(crate) unmasked: f64,
    /// Failures of a position that lacks a box.
    pub(crate) lacking: f64,
    /// Repair, while a crew is there.
    pub(crate) repair: f64,
    /// Detection of a failure, before which no repair starts; nothing: at once.
    pub(crate) detection: Option<f64>,
}

/// A box of one of two lanes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneBox {
    /// Failures, per hour.
    pub(crate) failure: f64,
    /// Repair, per hour.
    pub(crate) repair: f64,
    /// Probability that a failure is masked.
    pub(crate) coverage: f64,
}

impl Positions {
    /// Positions of which one box may be down.
    pub(crate) fn pairs(count: u32, rates: PairRates) -> Self {
        let mut positions = Self { count, waiting: vec![1], steps: Vec::new() };
        positions.fails(0, rates.unmasked);
        positions.fails(1, rates.lacking);
        positions.repairs(1, 0, rates.repair);
        match rates.detection {
            None => positions.goes(0, 1, rates.masked),
            Some(detection) => {
                positions.waiting.push(0);
                positions.goes(0, 2, rates.masked);
                positions.goes(2, 1, detection);
                positions.fails(2, rates.lacking);
            }
        }
        positions
    }

    /// Positions of two lanes, each a remote I/O with a module of its own: one lane is enough. The failure of the remote I/O that is the author is masked
    /// with its coverage, that of a follower always; the failure of a module with its coverage, while its remote I/O is up.
    pub(crate) fn lanes(count: u32, remote_io: LaneBox, module: LaneBox) -> Self {
        const COMPLETE: usize = 0;
        const REMOTE_IO: usize = 1;
        const BOTH: usize = 2;
        // A module is down, next to the follower or next to the author.
        const AT_FOLLOWER: usize = 3;
        const AT_AUTHOR: usize = 4;
        // Where each switchover succeeds, it is of no importance which of the two is the author.
        let is_sure = remote_io.coverage >= 1.0;
        let at_author = if is_sure { AT_FOLLOWER } else { AT_AUTHOR };
        let waiting = if is_sure { vec![1, 2, 1] } else { vec![1, 2, 1, 1] };
        let mut positions = Self { count, waiting, steps: Vec::new() };
        let lane = remote_io.failure + module.failure;
        let masked_author = remote_io.failure * remote_io.coverage;
        let unmasked_author = remote_io.failure - masked_author;
        let masked_module = module.failure * module.coverage;
        let unmasked_module = module.failure - masked_module;

        positions.goes(COMPLETE, REMOTE_IO, remote_io.failure + masked_author);
        positions.goes(COMPLETE, AT_FOLLOWER, masked_module);
        positions.goes(COMPLETE, at_author, masked_module);
        positions.fails(COMPLETE, unmasked_author + 2.0 * unmasked_module);

        positions.goes(REMOTE_IO, BOTH, module.failure);
        positions.fails(REMOTE_IO, lane);
        positions.repairs(REMOTE_IO, COMPLETE, remote_io.repair);

        positions.goes(AT_FOLLOWER, BOTH, remote_io.failure);
        positions.fails(AT_FOLLOWER, lane);
        positions.repairs(AT_FOLLOWER, COMPLETE, module.repair);
        if !is_sure {
            positions.goes(AT_AUTHOR, BOTH, masked_author);
            positions.fails(AT_AUTHOR, lane + unmasked_author);
            positions.repairs(AT_AUTHOR, COMPLETE, module.repair);
        }

        positions.fails(BOTH, lane);
        positions.repairs(BOTH, AT_FOLLOWER, remote_io.repair);
        positions.repairs(BOTH, REMOTE_IO, module.repair);
        positions
    }

    /// The same for one position.
    pub(crate) fn one(&self) -> Self {
        Self { count: 1, ..self.clone() }
    }

    /// Whether the positions of both cannot be told apart.
    pub(crate) fn are_like(&self, other: &Self) -> bool {
        (&self.waiting, &self.steps) == (&other.waiting, &other.steps)
    }

    /// Boxes that wait for a repair at the same time, at most.
    pub(crate) fn most_waiting(&self) -> u32 {
        self.count * self.waiting.iter().max().copied().unwrap_or(0)
    }

    fn goes(&mut self, from: usize, to: usize, rate: f64) {
        self.steps.push(Step { from, to: Some(to), rate, is_repair: false });
    }

    fn fails(&mut self, from: usize, rate: f64) {
        self.steps.push(Step { from, to: None, rate, is_repair: false });
    }

    fn repairs(&mut self, from: usize, to: usize, rate: f64) {
        self.steps.push(Step { from, to: Some(to), rate, is_repair: true });
    }
}

/// All positions are complete.
pub(crate) fn complete(kinds: &[Positions]) -> Lacking {
    vec![0; kinds.iter().map(|kind| kind.waiting.len()).sum()]
}

/// By kind: its positions, and how many are in each condition from 1 on.
fn by_kind<'a>(
    kinds: &'a [Positions],
    state: &'a [u32],
) -> impl Iterator<Item = (&'a Positions, usize, &'a [u32])> {
    let first = kinds.iter().scan(0, |next, kind| {
        let first = *next;
        *next += kind.waiting.len();
        Some(first)
    });
    kinds.iter().zip(first).map(|(kind, first)| {
        let conditions = &state[first..first + kind.waiting.len()];
        (kind, first, conditions)
    })
}

/// By kind: positions that are not complete.
pub(crate) fn incomplete<'a>(
    kinds: &'a [Positions],
    state: &'a [u32],
) -> impl Iterator<Item = u32> + 'a {
    by_kind(kinds, state).map(|(_, _, conditions)| conditions.iter().sum())
}

/// Boxes of positions that wait for a repair or are repaired.
pub(crate) fn waiting(kinds: &[Positions], state: &[u32]) -> u32 {
    let each = by_kind(kinds, state).flat_map(|(kind, _, conditions)| {
        kind.waiting.iter().zip(conditions).map(|(boxes, count)| boxes * count)
    });
    each.sum()
}

/// The steps out of a state: to another one, or to the failure of the system. `attended` is the share of failed boxes with a crew.
pub(crate) fn steps(
    kinds: &[Positions],
    state: &[u32],
    attended: f64,
    found: &mut Vec<(Option<Lacking>, f64)>,
) {
    let mut failing = 0.0;
    for (kind, first, conditions) in by_kind(kinds, state) {
        let complete = kind.count - conditions.iter().sum::<u32>();
        for step in &kind.steps {
            let there = if step.from == 0 { complete } else { conditions[step.from - 1] };
            let crew = if step.is_repair { attended } else { 1.0 };
            let rate = f64::from(there) * step.rate * crew;
            let Some(to) = step.to.filter(|_| rate > 0.0) else {
                failing += rate;
                continue;
            };
            let mut after = state.to_vec();
            if step.from > 0 {
                after[first + step.from - 1] -= 1;
            }
            if to > 0 {
                after[first + to - 1] += 1;
            }
            found.push((Some(after), rate));
        }
    }
    if failing > 0.0 {
        found.push((None, failing));
    }
}

/// Chain of positions alone, and what fails the system at this rate from every state; `attended` is the part of the repair rate that crews give to this
/// number of boxes that wait: 1 where each box has a crew.
pub(crate) fn chain_of(
    kinds: &[Positions],
    lethal: f64,
    attended: impl Fn(u32) -> f64,
) -> Result<Chain, Vec<ReliabilityError>> {
    let (chain, _) = explore(
        complete(kinds),
        MAXIMUM_MODEL_STATES,
        |_| String::new(),
        |state, found| {
            if lethal > 0.0 {
                found.push((None, lethal));
            }
            steps(kinds, state, attended(waiting(kinds, state)), found);
        },
    )?;
    Ok(chain)
}
