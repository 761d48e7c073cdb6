//! Variables at addresses: `%I` is an input point, `%Q` an output point, `%M` memory.

use std::rc::Rc;

use understudy_typed::{Elementary, Root, Type};

use crate::syntax::{Class, Declaration, Name};

use super::Lowering;
use super::images::initial;
use super::names::{Symbol, Variable};
use super::types::Resolved;

impl Lowering<'_> {
    /// A variable at an address: `%I` is an input point, `%Q` an output point, `%M` memory.
    pub(super) fn located(&mut self, declaration: &Declaration, resolved: &Resolved) -> Symbol {
        let Some(address) = &declaration.address else {
            return Symbol::Faulty;
        };
        let name = &declaration.name;
        let key = normal(address.as_str());
        // An incomplete address is one of its own.
        let key = match key.contains('*') {
            true => format!("{key} {}", name.key()),
            false => key,
        };
        if let Some(known) = self.addresses.get(&key).cloned() {
            if let Symbol::Variable(first) = &known
                && first.of != resolved.of
            {
                let (own, other) = (self.describe(&resolved.of), self.describe(&first.of));
                let message = format!(
                    "`{name}` is {own} at {address}, where `{}` is {other}",
                    first.name
                );
                let found = understudy_text::Diagnostic::error("U1083", message, address.span());
                let found = found.with_related(first.span.clone(), "declared here");
                self.report(found.with_help("give both one type, or two addresses"));
                return Symbol::Faulty;
            }
            return known;
        }
        let symbol = self
            .at_address(name, address, resolved)
            .unwrap_or(Symbol::Faulty);
        self.addresses.insert(key, symbol.clone());
        symbol
    }

    fn at_address(&mut self, name: &Name, address: &Name, resolved: &Resolved) -> Option<Symbol> {
        let kind = address
            .as_str()
            .chars()
            .nth(1)
            .map(|kind| kind.to_ascii_uppercase());
        let is_input = kind == Some('I');
        let is_point = is_input || kind == Some('Q');
        if !is_point && kind != Some('M') {
            let message = format!("`{address}` is not an address");
            let help =
                "write an input such as %IX0.0, an output such as %QW3 or a memory such as %MD8";
            self.error_with("U1083", message, address.span(), help);
            return None;
        }
        let elementary = resolved.of.elementary();
        if is_point && elementary.is_none() {
            let found = self.describe(&resolved.of);
            let message =
                format!("`{name}` at {address} is {found}; a point is one number, bit or time");
            let help = "declare each element as a variable with an address of its own";
            self.error_with("U1083", message, name.span(), help);
            return None;
        }
        if let Some(of) = elementary {
            self.fits_address(name, address, of);
        }
        let slot = self.state(resolved.of.slots(), &name.span())?;
        self.program.initial.extend(initial(&resolved.image, slot));
        if let Some(of) = elementary.filter(|_| is_point) {
            let points = match is_input {
                true => &mut self.program.inputs,
                false => &mut self.program.outputs,
            };
            let mut shown = name.as_str().to_owned();
            if points
                .iter()
                .any(|point| point.name.eq_ignore_ascii_case(&shown))
            {
                shown = format!("{name} {address}");
            }
            points.push(shown, of, slot);
        }
        Some(Symbol::Variable(Rc::new(Variable {
            name: name.as_str().to_owned(),
            root: Root::Global(slot),
            of: resolved.of.clone(),
            class: Class::Local,
            is_constant: false,
            is_point: is_input,
            span: name.span(),
        })))
    }

    /// Warns where the size in an address is not that of the variable.
    fn fits_address(&mut self, name: &Name, address: &Name, of: Elementary) {
        let size = normal(address.as_str()).chars().nth(2);
        let bits = match size {
            Some('X') => 1,
            Some('B') => 8,
            Some('W') => 16,
            Some('D') => 32,
            Some('L') => 64,
            _ => return,
        };
        if bits != of.bits() {
            let message = format!("`{name}` is {of}, and {address} has {bits} bits");
            let help = "the type counts: write the letter of its width, X, B, W, D or L";
            self.warn("U1083", message, address.span(), help);
        }
    }

    /// An address in a body.
    pub(super) fn direct(&mut self, address: &Name) -> Symbol {
        let key = normal(address.as_str());
        if let Some(known) = self.addresses.get(&key) {
            return known.clone();
        }
        let of = match key.chars().nth(2) {
            Some('B') => Elementary::Byte,
            Some('W') => Elementary::Word,
            Some('D') => Elementary::Dword,
            Some('L') => Elementary::Lword,
            _ => Elementary::Bool,
        };
        let resolved: Resolved = Type::Elementary(of).into();
        let symbol = self
            .at_address(address, address, &resolved)
            .unwrap_or(Symbol::Faulty);
        self.addresses.insert(key, symbol.clone());
        symbol
    }
}

/// An address in capitals, with the X that may be left out.
fn normal(address: &str) -> String {
    let mut key = address.to_ascii_uppercase();
    if key
        .chars()
        .nth(2)
        .is_some_and(|digit| digit.is_ascii_digit())
    {
        key.insert(2, 'X');
    }
    key
}
