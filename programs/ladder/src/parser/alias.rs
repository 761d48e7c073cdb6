//! The names that other makers give to the outputs of blocks: `t.DN` is `t.Q` of a timer or the first output of a counter, and `parts.ACC` is
//! `parts.CV`.

use std::collections::{HashMap, HashSet};

use crate::program::{BlockKind, Element, Name, Program};

/// Replaces other names of outputs by their own; a signal that has such a name keeps it.
pub(super) fn resolve(program: &mut Program) {
    let blocks: HashMap<String, BlockKind> =
        program.blocks().into_iter().map(|block| (block.name.to_string(), block.kind)).collect();
    let signals = program.inputs.iter().chain(program.writable());
    let signals: HashSet<String> = signals.map(|signal| signal.name.to_string()).collect();
    let own = |operand: &Name| {
        let block = operand.strip_suffix(".DN")?;
        let kind = blocks.get(block)?;
        let counts = kind.preset_time().is_some() || kind.preset_value().is_some();
        let is_signal = signals.contains(operand.as_str());
        let pin = kind.outputs()[0];
        (counts && !is_signal).then(|| Name::at(format!("{block}.{pin}"), operand.span()))
    };
    for rung in &mut program.rungs {
        rename(&mut rung.network, &own);
    }
}

fn rename(series: &mut [Element], own: &impl Fn(&Name) -> Option<Name>) {
    for element in series {
        match element {
            Element::Contact(contact) => {
                if let Some(name) = own(&contact.operand) {
                    contact.operand = name;
                }
            }
            Element::Branches(branches) => {
                branches.iter_mut().for_each(|branch| rename(branch, own));
            }
            Element::Block(block) => {
                block.pins.iter_mut().for_each(|feed| rename(&mut feed.network, own));
            }
            Element::Comparison(_) => {}
        }
    }
}
