//! What the paper's XML does not declare: which symbols are inputs and which are outputs, and names that a ladder can have.

use std::collections::{HashMap, HashSet};

use understudy_ladder::{
    Address, Area, KEYWORDS, Name, Program, Signal, legal_name, parse_address,
};
use understudy_text::Diagnostic;

/// An edge's symbol and what it is used for.
pub(super) struct Use {
    /// As a ladder can have it; none for blocks and comparisons.
    pub(super) name: Option<Name>,
    /// As it was written.
    pub(super) symbol: Name,
    pub(super) is_written: bool,
    pub(super) block: Option<String>,
    pub(super) address: Option<Name>,
}

/// Names as they are written to names that a ladder can have.
#[derive(Debug, Default)]
pub(super) struct Names {
    known: HashMap<String, String>,
    taken: HashSet<String>,
}

impl Names {
    /// The same name for the same letters; what had to be changed is said once.
    pub(super) fn legal(&mut self, name: &Name, diagnostics: &mut Vec<Diagnostic>) -> Name {
        if let Some(known) = self.known.get(name.as_str()) {
            return Name::at(known.clone(), name.span());
        }
        let base = legal(name);
        let mut unique = base.clone();
        let mut count = 2;
        while !self.taken.insert(unique.clone()) {
            unique = format!("{base}_{count}");
            count += 1;
        }
        if unique != name.as_str() {
            let message = format!("`{}` is called `{unique}` in the ladder", name.as_str());
            diagnostics.push(Diagnostic::warning("U1067", message, name.span()));
        }
        self.known.insert(name.to_string(), unique.clone());
        Name::at(unique, name.span())
    }
}

fn legal(name: &str) -> String {
    let mut legal = legal_name(name);
    if KEYWORDS.contains(&legal.as_str()) {
        legal.push('_');
    }
    legal
}

/// Declares what is used: what an output writes is an output, what is only read is an input.
pub(super) fn signals(used: &[Use], program: &mut Program, diagnostics: &mut Vec<Diagnostic>) {
    let written = used.iter().filter(|used| used.is_written).filter_map(|used| used.name.as_ref());
    let written: HashSet<&str> = written.map(Name::as_str).collect();
    let blocks: HashSet<&str> = used.iter().filter_map(|used| used.block.as_deref()).collect();
    let mut declared = HashSet::new();
    for used in used {
        let Some(name) = &used.name else { continue };
        let of_block = name.rsplit_once('.').is_some_and(|(block, _)| blocks.contains(block));
        if of_block || !declared.insert(name.to_string()) {
            continue;
        }
        let is_output = written.contains(name.as_str());
        let area = if is_output { Area::Output } else { Area::Input };
        let address = used.address.as_ref().and_then(|text| {
            let found = address(text, area);
            if found.is_none() {
                let message = format!("the address `{}` is not kept", text.as_str());
                diagnostics.push(Diagnostic::warning("U1068", message, text.span()));
            }
            found
        });
        let symbol = used.symbol.trim_start_matches('!').trim();
        let signal = Signal {
            name: name.clone(),
            address,
            description: (symbol != name.as_str()).then(|| symbol.to_owned()),
            ..Signal::default()
        };
        if is_output {
            program.outputs.push(signal);
        } else {
            program.inputs.push(signal);
        }
    }
}

/// Says where the address of an edge is not the one that its symbol is declared with.
pub(super) fn contradictions(used: &[Use], program: &Program, diagnostics: &mut Vec<Diagnostic>) {
    let signals = program.inputs.iter().chain(&program.outputs).chain(&program.memory);
    let declared: HashMap<&str, Option<&Address>> =
        signals.map(|signal| (signal.name.as_str(), signal.address.as_ref())).collect();
    for used in used {
        let (Some(name), Some(text)) = (&used.name, &used.address) else {
            continue;
        };
        let Some(known) = declared.get(name.as_str()) else {
            continue;
        };
        let area = known.map_or(Area::Input, |known| known.area);
        if address(text, area).as_ref() != *known {
            let message = format!(
                "the address `{}` is not kept: `{name}` is declared with {}",
                text.as_str(),
                known.map_or("no address".to_owned(), Address::to_string)
            );
            diagnostics.push(Diagnostic::warning("U1068", message, text.span()));
        }
    }
}

/// The paper's `000.02`, word and bit, or an address of the standard.
fn address(text: &str, area: Area) -> Option<Address> {
    if let Some(text) = text.strip_prefix('%') {
        return parse_address(text);
    }
    let (word, bit) = text.split_once('.')?;
    Some(Address { area, path: vec![word.parse().ok()?, bit.parse().ok()?] })
}
