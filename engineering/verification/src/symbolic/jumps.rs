//! Many scans at once, for timers that count hundreds or thousands of them.
//!
//! With unchanged inputs u a scan is a function of the registers, and so are 2^j scans; each comes from the one before by substitution:
//!
//! ```text
//! F(0) = f(x, u)        F(j + 1) = F(j)(F(j)(x, u), u)
//! ```
//!
//! While timers count, these functions are sums and bounds, no larger than f, so a set is followed back over 4096 scans in 12 steps. They are runs of the
//! circuit: what they find is what single scans find, and a fixed point of single scans still ends the search. Where they grow, fewer scans are taken at once.

use understudy_logic::Variable;
use understudy_logic::bdd::{Diagram, Substitution};

use super::model::Model;
use crate::effort::Stopped;

/// The most scans at once, as a power of two.
const POWERS: u32 = 20;

/// Nodes of all functions of one jump, for each that f has, and for small ones in all.
const GROWTH: usize = 8;
const SMALL: usize = 20_000;

/// 2^j scans with the inputs of the first.
pub(super) struct Jump {
    pub(super) scans: usize,
    /// x := F(j)
    pub(super) step: Substitution,
}

impl Jump {
    /// Jumps of 2, 4 and more scans, as long as they change anything and are not too large.
    pub(super) fn all(model: &Model<'_>) -> Result<Vec<Self>, Stopped> {
        let mut functions = model.next.clone();
        let room = (GROWTH * nodes(&functions)).max(SMALL);
        let mut jumps: Vec<Self> = Vec::new();
        for power in 1..=POWERS {
            let Some(next) = twice(model, &functions, jumps.last(), room)? else {
                break;
            };
            if next == functions {
                break;
            }
            jumps.push(Self {
                scans: 1 << power,
                step: model.diagrams.substitution(next.iter().cloned())?,
            });
            functions = next;
        }
        Ok(jumps)
    }
}

/// The functions of twice as many scans; nothing where they are too large.
fn twice(
    model: &Model<'_>,
    functions: &[(Variable, Diagram)],
    last: Option<&Jump>,
    room: usize,
) -> Result<Option<Vec<(Variable, Diagram)>>, Stopped> {
    let step = last.map_or(&model.step, |last| &last.step);
    let mut next = Vec::with_capacity(functions.len());
    let mut used = 0;
    for (variable, function) in functions {
        model.goes_on()?;
        let later = match model.diagrams.substitute(function, step) {
            Ok(later) => later,
            Err(_) => return Ok(None),
        };
        used += later.node_count();
        if used > room {
            return Ok(None);
        }
        next.push((*variable, later));
    }
    Ok(Some(next))
}

fn nodes(functions: &[(Variable, Diagram)]) -> usize {
    let nodes = functions.iter().map(|(_, function)| function.node_count());
    nodes.sum()
}
