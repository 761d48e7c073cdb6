//! A program as it is read by those who know addresses: every signal that has one is called by it.

use std::collections::HashMap;

use understudy_ladder::{Element, Name, Program, Series, Signal};

/// The same program under the addresses of its signals; its symbols become their meanings.
pub(crate) fn by_address(program: &Program) -> Program {
    let signals = program.inputs.iter().chain(program.writable());
    let addresses: HashMap<Name, Name> = signals
        .filter_map(|signal| {
            let address = signal.address.as_ref()?;
            Some((signal.name.clone(), Name::from(address.to_string())))
        })
        .collect();
    let mut renamed = program.clone();
    let rename = |name: &mut Name| {
        if let Some(address) = addresses.get(name) {
            *name = address.clone();
        }
    };
    for signal in renamed.inputs.iter_mut().chain(&mut renamed.outputs).chain(&mut renamed.memory) {
        rename_signal(signal, &rename);
    }
    for rung in &mut renamed.rungs {
        rename_series(&mut rung.network, &rename);
        rung.coils.iter_mut().for_each(|coil| rename(&mut coil.target));
    }
    renamed
}

fn rename_signal(signal: &mut Signal, rename: &impl Fn(&mut Name)) {
    let symbol = signal.name.to_string();
    rename(&mut signal.name);
    if signal.name.to_string() != symbol {
        let description = signal.description.take();
        signal.description = Some(match description {
            Some(description) => format!("{symbol}: {description}"),
            None => symbol,
        });
    }
}

fn rename_series(series: &mut Series, rename: &impl Fn(&mut Name)) {
    for element in series {
        match element {
            Element::Contact(contact) => rename(&mut contact.operand),
            Element::Branches(branches) => {
                branches.iter_mut().for_each(|branch| rename_series(branch, rename))
            }
            Element::Block(block) => {
                block.pins.iter_mut().for_each(|feed| rename_series(&mut feed.network, rename))
            }
            Element::Comparison(_) => {}
        }
    }
}
