//! Local-modular synthesis: a supervisor for each specification, on the plants that it concerns.
//!
//! After M. de Queiroz and J. Cury, *Modular supervisory control of large scale discrete event systems* (2000). Plants that share
//! events are one group, so that groups share none; the local plant of a specification is what groups it has events of. The local
//! supervisors together are the monolithic one exactly when they do not conflict, and that is tested here.

use crate::automaton::Automaton;
use crate::explicit::{Bounds, TooLarge};
use crate::operations::{Conflict, Supcon, nonconflict};
use crate::symbolic::{SymbolicBounds, nonconflicting_symbolically};
use crate::synthesis::synthesise;

/// The supervisor of one specification.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LocalSupervisor {
    /// Specification; none for plants that must only be nonblocking.
    pub specification: Option<usize>,
    /// Which plants.
    pub plants: Vec<usize>,
    /// What synthesis said.
    pub result: Supcon,
}

/// Whether local supervisors get in each other's way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Together {
    /// They do not: together they are the monolithic supervisor.
    Nonconflicting,
    /// They do, here.
    Conflicting(Conflict),
    /// They do; the product does not fit, so there is no word.
    ConflictingSomewhere,
    /// Too large for either engine.
    Undecided,
}

/// Local supervisors for all specifications.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModularSupervisor {
    /// One for each specification; then one for each group of plants that no specification concerns.
    pub local: Vec<LocalSupervisor>,
    /// How they get on together.
    pub together: Together,
}

/// A supervisor for each specification, and whether they conflict.
///
/// # Errors
/// A local product passes the bounds.
pub fn synthesise_modularly(
    plants: &[&Automaton],
    specifications: &[&Automaton],
    bounds: Bounds,
) -> Result<ModularSupervisor, TooLarge> {
    let groups = groups(plants);
    let share = |group: &[usize], specification: &Automaton| {
        group.iter().any(|&plant| share_events(plants[plant], specification))
    };
    let mut local = Vec::new();
    for (number, specification) in specifications.iter().enumerate() {
        let concerned = groups.iter().filter(|group| share(group, specification));
        let concerned: Vec<usize> = concerned.flatten().copied().collect();
        let automata: Vec<&Automaton> = concerned.iter().map(|&plant| plants[plant]).collect();
        local.push(LocalSupervisor {
            specification: Some(number),
            plants: concerned,
            result: synthesise(&automata, &[specification], bounds)?,
        });
    }
    for group in &groups {
        if !specifications.iter().any(|specification| share(group, specification)) {
            let automata: Vec<&Automaton> = group.iter().map(|&plant| plants[plant]).collect();
            local.push(LocalSupervisor {
                specification: None,
                plants: group.clone(),
                result: synthesise(&automata, &[], bounds)?,
            });
        }
    }
    let supervisors: Vec<&Automaton> = local.iter().map(|one| &one.result.supervisor).collect();
    let together = together(&supervisors, bounds);
    Ok(ModularSupervisor { local, together })
}

fn together(supervisors: &[&Automaton], bounds: Bounds) -> Together {
    match nonconflict(supervisors, bounds) {
        Ok(None) => Together::Nonconflicting,
        Ok(Some(conflict)) => Together::Conflicting(conflict),
        Err(_) => match nonconflicting_symbolically(supervisors, SymbolicBounds::default()) {
            Ok(true) => Together::Nonconflicting,
            Ok(false) => Together::ConflictingSomewhere,
            Err(_) => Together::Undecided,
        },
    }
}

fn share_events(left: &Automaton, right: &Automaton) -> bool {
    left.alphabet().labels().any(|label| right.alphabet().contains(label))
}

/// Plants that share events, directly or through others, are one group.
fn groups(plants: &[&Automaton]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (number, plant) in plants.iter().enumerate() {
        let concerns =
            |group: &Vec<usize>| group.iter().any(|&other| share_events(plants[other], plant));
        let (joined, apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(concerns);
        let mut group: Vec<usize> = joined.into_iter().flatten().collect();
        group.push(number);
        group.sort_unstable();
        groups = apart;
        groups.push(group);
    }
    groups.sort_unstable();
    groups
}
