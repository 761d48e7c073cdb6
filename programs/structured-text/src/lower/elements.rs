//! Arrays of inputs and outputs: each element is a point.
//!
//! Elements share slots of the state, and a point has one of its own. So inputs are copied into the array before the programs run, and
//! outputs from it behind them.

use std::collections::HashMap;
use std::sync::Arc;

use understudy_typed::{
    Array, Declared, Elementary, Initial, Place, Root, Routine, RoutineId, RoutineKind, Statement,
    StatementKind, Task, Type, indices,
};

use crate::syntax::{Name, Span};

use super::Lowering;
use super::addresses::{at_slot, bits_of, normal};
use super::images::initial;
use super::names::Symbol;
use super::places::{load, place};
use super::types::Resolved;

/// Elements that an array of points may have.
const MAXIMUM_ELEMENTS: u64 = 1_000;

/// What is known of the elements of all arrays at addresses.
#[derive(Default)]
pub(super) struct Elements {
    /// By their addresses: the element, such as `lamps[3]`, and where its array is declared.
    known: HashMap<String, (String, Span)>,
    /// Statements that copy points into the arrays of inputs.
    before: Vec<Statement>,
    /// Statements that copy the arrays of outputs into points.
    behind: Vec<Statement>,
}

impl Lowering<'_> {
    /// An array whose elements are points.
    pub(super) fn array_at(
        &mut self,
        name: &Name,
        address: &Name,
        resolved: &Resolved,
        of: Elementary,
        is_input: bool,
    ) -> Option<Symbol> {
        let key = normal(address.as_str());
        let Type::Array(array) = &resolved.of else {
            return None;
        };
        let declared = self.program.declared(&array.element)?;
        let declared = Declared { range: resolved.range, ..declared };
        if array.length() > MAXIMUM_ELEMENTS {
            let message = format!(
                "`{name}` at {address} has {} elements; at most {MAXIMUM_ELEMENTS} are points",
                array.length()
            );
            let help = "divide it into several arrays, each at an address of its own";
            self.error_with("U1083", message, name.span(), help);
            return None;
        }
        if let Some(bits) = bits_of(&key).filter(|bits| *bits != of.bits()) {
            let message =
                format!("the elements of `{name}` are {of}, and {address} has {bits} bits");
            let help = "write the letter of their width, X, B, W, D or L";
            self.error_with("U1083", message, address.span(), help);
            return None;
        }
        let slot = self.state(resolved.of.slots(), &name.span())?;
        self.program.initial.extend(initial(&resolved.image, slot));
        for at in 0..array.length() {
            let shown = format!("{name}{}", indices(array, at)?);
            for key in keys(&key, at) {
                self.is_free(&shown, name, address, &key)?;
                self.elements.known.insert(key, (shown.clone(), name.span()));
            }
        }
        let root = (array.as_ref(), &declared, slot);
        for (shown, own) in self.elements_of(name.as_str(), root, &name.span(), is_input)? {
            self.point_at(shown, address, declared.clone(), own, is_input);
        }
        self.overlap(name, address, resolved)?;
        Some(at_slot(name, slot, resolved, is_input))
    }

    /// A slot for the point of each element of an array at a slot of the state, with its name, and the copies between them. The slots begin as the
    /// elements do.
    pub(super) fn elements_of(
        &mut self,
        name: &str,
        (array, declared, slot): (&Array, &Declared, u32),
        span: &Span,
        is_input: bool,
    ) -> Option<Vec<(String, u32)>> {
        let (line, of, range) = (self.line(span), declared.of, declared.range);
        let behind = slot + Type::Array(Arc::new(array.clone())).slots() as u32;
        let begins = self.program.initial.iter().filter(|it| (slot..behind).contains(&it.slot));
        let begins: HashMap<u32, u64> = begins.map(|it| (it.slot, it.value)).collect();
        let mut points = Vec::new();
        for at in 0..array.length() {
            let own = self.state(1, span)?;
            let bit = at * array.stride();
            let (offset, bit) = ((bit / 64) as u32, (bit % 64) as u32);
            let word = begins.get(&(slot + offset)).copied().unwrap_or(0);
            let value = word >> bit & of.mask();
            if value != 0 {
                self.program.initial.push(Initial { slot: own, value });
            }
            let root = place(Root::Global(slot), Type::Elementary(of));
            let within = Place { offset, bit, is_packed: true, range, ..root };
            let point = place(Root::Global(own), Type::Elementary(of));
            let (to, from, list) = match is_input {
                true => (within, point, &mut self.elements.before),
                false => (point, within, &mut self.elements.behind),
            };
            list.push(Statement { line, kind: StatementKind::Assign(to, load(from)) });
            points.push((format!("{name}{}", indices(array, at)?), own));
        }
        Some(points)
    }

    /// Refuses an element at an address that is taken.
    fn is_free(&mut self, shown: &str, name: &Name, address: &Name, key: &str) -> Option<()> {
        let other = match (self.elements.known.get(key), self.addresses.get(key)) {
            (Some((other, span)), _) => Some((other.clone(), span.clone())),
            (None, Some(Symbol::Variable(other))) => Some((other.name.clone(), other.span.clone())),
            _ => None,
        };
        let Some((other, span)) = other.filter(|(_, span)| *span != name.span()) else {
            return Some(());
        };
        self.share(format!("`{shown}` and `{other}` can be at {key}"), address.span(), span)
    }

    /// Refuses a variable or an address at an element of an array.
    pub(super) fn is_no_element(&mut self, name: &Name, address: &Name, key: &str) -> Option<()> {
        let Some((element, span)) = self.elements.known.get(key).cloned() else {
            return Some(());
        };
        // The array itself.
        if self.addresses.contains_key(key) {
            return Some(());
        }
        self.share(format!("`{name}` and `{element}` can be at {key}"), address.span(), span)
    }

    fn share(&mut self, message: String, at: Span, other: Span) -> Option<()> {
        let found = understudy_text::Diagnostic::error("U1083", message, at);
        let found = found.with_related(other, "the array");
        self.report(found.with_help(
            "use the element, or give them addresses apart: bits of an array are counted one by one, and a byte each",
        ));
        None
    }

    /// Copies between points and arrays around the programs.
    pub(super) fn copy_elements(&mut self) {
        let Elements { before, behind, .. } = std::mem::take(&mut self.elements);
        if before.is_empty() && behind.is_empty() {
            return;
        }
        if let [task] = self.program.tasks.as_slice()
            && task.every == 1
        {
            let (called, own) = (task.routine, task.own);
            let body = self.program.routines.get(called.0 as usize);
            let line = body.and_then(|routine| routine.body.first()).map_or(1, |first| first.line);
            let name = body.map_or_else(String::new, |routine| routine.name.clone());
            let of = self.named_programs.values().find_map(|symbol| match symbol {
                Symbol::Variable(found) if matches!(found.root, Root::Global(slot) if slot == own) => {
                    Some(found.of.clone())
                }
                _ => None,
            });
            if let Some(of) = of {
                let kind = StatementKind::Invoke(called, place(Root::Own(0), of));
                let mut body = before;
                body.push(Statement { line, kind });
                body.extend(behind);
                let routine = self.copying(name, body, Some(called));
                self.program.tasks = vec![Task { routine, own, every: 1 }];
                return;
            }
        }
        let own = self.program.tasks.first().map_or(0, |task| task.own);
        let routine = self.copying("inputs".to_owned(), before, None);
        self.program.tasks.insert(0, Task { routine, own, every: 1 });
        let routine = self.copying("outputs".to_owned(), behind, None);
        self.program.tasks.push(Task { routine, own, every: 1 });
    }

    fn copying(
        &mut self,
        name: String,
        body: Vec<Statement>,
        called: Option<RoutineId>,
    ) -> RoutineId {
        let id = RoutineId(self.program.routines.len() as u32);
        self.calls.push(called.map(|called| (called.0, 0..0)).into_iter().collect());
        self.program.routines.push(Routine {
            name,
            kind: RoutineKind::Block,
            frame: (self.program.frames, 0),
            initial: Vec::new(),
            body,
            timer: None,
        });
        id
    }
}

/// The addresses that an element can have: one after the other in the size of the address, and for bits also one in each byte, as CODESYS
/// stores a BOOL.
fn keys(key: &str, at: u64) -> Vec<String> {
    let Some((area, numbers)) = key.split_at_checked(3) else {
        return Vec::new();
    };
    let numbers: Result<Vec<u64>, _> = numbers.split('.').map(str::parse).collect();
    let Ok(numbers) = numbers else {
        return Vec::new();
    };
    let written = |numbers: &[u64]| {
        let numbers: Vec<String> = numbers.iter().map(u64::to_string).collect();
        format!("{area}{}", numbers.join("."))
    };
    let mut found = Vec::new();
    match (area.ends_with('X'), numbers.as_slice()) {
        (true, [levels @ .., byte, bit]) => {
            let bits = bit.saturating_add(at);
            for (byte, bit) in [(byte + bits / 8, bits % 8), (byte.saturating_add(at), *bit)] {
                found.push(written(&[levels, &[byte, bit]].concat()));
            }
        }
        (_, [levels @ .., last]) => {
            found.push(written(&[levels, &[last.saturating_add(at)]].concat()));
        }
        _ => {}
    }
    found.dedup();
    found
}
