//! Output commands for combined states: the 0/1 integer program of section 6.
//!
//! ```text
//! min  Σ w_i z_i
//! (1)  y_b ≥ 1 − Σ (violated entries of row b)          a row that holds counts as holding
//! (2)  Σ y_b over rows that want output i off ≤ M (1 − z_i)
//! (3)  Σ y_b over rows that want output i on  ≤ M z_i
//! (4)  Σ y_b = 0 over the rows of an event that must not happen
//! (5)  Σ y_b ≥ 1 over the rows of an event that must be able to happen
//! ```
//!
//! Constraint (5) is posed for events with at least one row only; without that guard the filling line's own first case is
//! infeasible. Demands with equal rows are posed once. What the solver answers is checked against the rows before it is
//! used, so nothing rests on its arithmetic.

use std::sync::Arc;

#[cfg(feature = "highs")]
use good_lp::highs as solver;
#[cfg(not(feature = "highs"))]
use good_lp::microlp as solver;
use good_lp::{
    Expression, ProblemVariables, ResolutionError, Solution, SolverModel, constraint, variable,
};
use rustc_hash::FxHashMap;

use crate::relation::Row;
use crate::signals::{Bits, Event};

/// What Φ1 asks of one event at one member of a combined state.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Demand {
    /// Λ_e(x); at least one row.
    pub rows: Arc<[Row]>,
    /// Whether the event must be able to happen, (5), or must not, (4).
    pub enable: bool,
}

impl Demand {
    /// Whether `outputs` do what it asks.
    pub fn is_met(&self, outputs: &Bits) -> bool {
        self.rows.iter().any(|row| row.holds(outputs)) == self.enable
    }
}

/// A demand with the member and the event from which it comes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Posed {
    /// x.
    pub state: usize,
    /// e.
    pub event: Event,
    /// What is asked.
    pub demand: Demand,
}

/// Which of several safe commands is taken.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Objective {
    /// With the fewest active outputs, as in the paper.
    #[default]
    Fewest,
    /// With the fewest outputs that differ from what the members of the state command now.
    Nearest,
    /// With the least sum of these weights over the active outputs; one for each output.
    Weights(Vec<f64>),
}

/// Why a program has no solution.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unsolved {
    /// No outputs satisfy all; the places of demands of which already these have no solution together.
    Conflict(Vec<usize>),
    /// The solver gave up.
    Solver(String),
}

/// The least outputs that meet all of `demands` under `weights`, one for each output.
///
/// # Errors
/// None do, with a smallest set of demands that shows it; or the solver failed.
pub fn solve(demands: &[Demand], weights: &[f64]) -> Result<Bits, Unsolved> {
    match minimise(demands, weights)? {
        Some(outputs) => Ok(outputs),
        None => Err(Unsolved::Conflict(conflict(demands, weights.len())?)),
    }
}

/// One program; `None` where it is infeasible.
fn minimise(demands: &[Demand], weights: &[f64]) -> Result<Option<Bits>, Unsolved> {
    let mut variables = ProblemVariables::new();
    let outputs: Vec<_> = weights.iter().map(|_| variables.add(variable().binary())).collect();
    let held: Vec<Vec<_>> = demands
        .iter()
        .map(|demand| {
            let rows = demand.rows.iter();
            rows.map(|_| variables.add(variable().binary())).collect()
        })
        .collect();
    let mut objective = Expression::from(0.0);
    for (&output, &weight) in outputs.iter().zip(weights) {
        objective += weight * output;
    }
    let mut constraints = Vec::new();
    let mut wants_off = vec![(Expression::from(0.0), 0.0); outputs.len()];
    let mut wants_on = wants_off.clone();
    for (demand, held) in demands.iter().zip(&held) {
        let mut sum = Expression::from(0.0);
        for (row, &holds) in demand.rows.iter().zip(held) {
            let mut one = Expression::from(holds);
            for (place, entry) in row.0.iter().enumerate() {
                let Some(wanted) = *entry else { continue };
                let (uses, violated) = if wanted {
                    (&mut wants_on, 1.0 - outputs[place])
                } else {
                    (&mut wants_off, Expression::from(outputs[place]))
                };
                one += violated;
                uses[place].0 += holds;
                uses[place].1 += 1.0;
            }
            constraints.push(constraint!(one >= 1.0)); // (1)
            sum += holds;
        }
        constraints.push(if demand.enable {
            constraint!(sum >= 1.0) // (5)
        } else {
            constraint!(sum == 0.0) // (4)
        });
    }
    for (place, &output) in outputs.iter().enumerate() {
        let (off, count) = wants_off[place].clone();
        if count > 0.0 {
            constraints.push(constraint!(off <= count * (1.0 - output))); // (2)
        }
        let (on, count) = wants_on[place].clone();
        if count > 0.0 {
            constraints.push(constraint!(on <= count * output)); // (3)
        }
    }
    let mut model = variables.minimise(objective).using(solver);
    for one in constraints {
        model = model.with(one);
    }
    match model.solve() {
        Ok(solution) => {
            let bits = outputs.iter().map(|&output| solution.value(output) > 0.5);
            let found = Bits(bits.collect());
            if let Some(place) = demands.iter().position(|demand| !demand.is_met(&found)) {
                let message = format!("the solver's answer {found} breaks demand {place}");
                return Err(Unsolved::Solver(message));
            }
            Ok(Some(found))
        }
        Err(ResolutionError::Infeasible) => Ok(None),
        Err(error) => Err(Unsolved::Solver(error.to_string())),
    }
}

/// Leaves demands out, one after the other, as long as the rest has no solution: what stays is a conflict of which no demand
/// can be spared.
fn conflict(demands: &[Demand], outputs: usize) -> Result<Vec<usize>, Unsolved> {
    let weights = vec![1.0; outputs];
    let mut kept: Vec<usize> = (0..demands.len()).collect();
    for place in (0..demands.len()).rev() {
        let tried: Vec<usize> = kept.iter().copied().filter(|&other| other != place).collect();
        let rest: Vec<Demand> = tried.iter().map(|&other| demands[other].clone()).collect();
        if minimise(&rest, &weights)?.is_none() {
            kept = tried;
        }
    }
    Ok(kept)
}

/// Remembers what was solved: most combined states of a line pose the same few programs.
#[derive(Debug, Default)]
pub struct Solver {
    known: FxHashMap<(Vec<Demand>, Vec<u64>), Result<Bits, Unsolved>>,
}

impl Solver {
    /// As [`solve`], over what is posed; a conflict names the places in `posed`.
    ///
    /// # Errors
    /// As [`solve`].
    pub fn solve(&mut self, posed: &[Posed], weights: &[f64]) -> Result<Bits, Unsolved> {
        let mut demands: Vec<Demand> = posed.iter().map(|posed| posed.demand.clone()).collect();
        demands.sort_unstable();
        demands.dedup();
        let bits = weights.iter().map(|weight| weight.to_bits()).collect();
        let answer = self
            .known
            .entry((demands, bits))
            .or_insert_with_key(|(demands, _)| solve(demands, weights));
        match answer {
            Err(Unsolved::Conflict(_)) => {
                // Said again in the places of this question.
                let asked: Vec<Demand> = posed.iter().map(|posed| posed.demand.clone()).collect();
                let places = conflict(&asked, weights.len())?;
                Err(Unsolved::Conflict(places))
            }
            other => other.clone(),
        }
    }

    /// How many different programs were solved.
    pub fn program_count(&self) -> usize {
        self.known.len()
    }
}
