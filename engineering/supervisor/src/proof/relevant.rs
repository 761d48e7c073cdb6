//! The rungs of a ladder that can change what a proof compares.

use std::borrow::Cow;
use std::collections::HashSet;

use understudy_ladder::{Name, Program, Rung};

use crate::ladder::{Correspondence, InputOutputMap};

/// `program` without the rungs that no state bit, command or waiting event depends on, such as counters of what was lost.
pub(super) fn relevant<'p>(
    program: &'p Program,
    map: &InputOutputMap,
    correspondence: &Correspondence,
) -> Cow<'p, Program> {
    let positions = map.switches.iter().flat_map(|switch| &switch.positions);
    let names = correspondence.states.iter().flatten().chain(correspondence.waiting.values());
    let names = names.chain(positions.map(|position| &position.signal));
    let names = names.chain(map.pulses.iter().map(|pulse| &pulse.signal));
    let mut needed: HashSet<&str> = names.map(Name::as_str).collect();
    let rungs: Vec<(HashSet<&str>, HashSet<&str>)> = program.rungs.iter().map(uses).collect();
    let mut kept = vec![false; rungs.len()];
    loop {
        let more = (0..rungs.len()).filter(|&place| !kept[place]);
        let more: Vec<usize> = more.filter(|&place| !rungs[place].0.is_disjoint(&needed)).collect();
        if more.is_empty() {
            break;
        }
        for place in more {
            kept[place] = true;
            needed.extend(&rungs[place].1);
        }
    }
    if kept.iter().all(|&kept| kept) {
        return Cow::Borrowed(program);
    }
    let mut part = program.clone();
    let mut places = kept.into_iter();
    part.rungs.retain(|_| places.next().unwrap_or(true));
    Cow::Owned(part)
}

/// The names that a rung writes, and those that it reads; a pin of a block is the block.
fn uses(rung: &Rung) -> (HashSet<&str>, HashSet<&str>) {
    let (read, written) = rung.names();
    let pins = read.iter().filter_map(|name| name.rsplit_once('.'));
    let blocks: Vec<&str> = pins.map(|(block, _)| block).collect();
    (written.into_iter().collect(), read.into_iter().chain(blocks).collect())
}
