//! Memory: addresses of places, what is known of them, what is read and written.

use understudy_typed::{Elementary, Place, Root, Type};

use super::super::facts::{inputs, outputs};
use super::super::program::{Action, Number, Role, Timer, Truth};
use super::values::Value;
use super::{Context, Found, Kind, Refusal, Unrolling, kind_of};

impl Unrolling<'_> {
    /// The address of a place: 64 · slot + bit, the slots of the frames behind those of the state.
    pub(super) fn address(&mut self, context: Context, place: &Place) -> Found<u64> {
        let state = u64::from(self.program.state);
        let base = match place.root {
            Root::Global(slot) => 64 * u64::from(slot),
            Root::Own(slot) => 64 * (context.own + u64::from(slot)),
            Root::Frame(slot) => 64 * (state + u64::from(slot)),
            Root::OwnReference(slot) => self.reference(64 * (context.own + u64::from(slot)))?,
            Root::FrameReference(slot) => self.reference(64 * (state + u64::from(slot)))?,
        };
        let mut address = base + 64 * u64::from(place.offset) + u64::from(place.bit);
        for index in &place.indices {
            let found = self.value(context, &index.value)?;
            let Some(value) = found.constant() else {
                return Err(self.refuse("it has an index that is computed"));
            };
            if value < index.low || value > index.high {
                let (low, high) = (index.low, index.high);
                let what = format!("it has the index {value} outside of {low}..{high}");
                return Err(self.refuse(what));
            }
            address += value.abs_diff(index.low) * index.stride;
        }
        Ok(address)
    }

    fn reference(&self, holder: u64) -> Found<u64> {
        match self.known_at(holder) {
            Some(Some(address)) if address != 0 => Ok(address),
            _ => Err(self.refuse("it follows a reference that depends on inputs")),
        }
    }

    fn known_at(&self, address: u64) -> Option<Option<u64>> {
        let mut overlays = self.known.iter().rev();
        overlays.find_map(|overlay| overlay.get(&address).copied())
    }

    pub(super) fn set_known(&mut self, address: u64, value: Option<u64>) {
        if let Some(overlay) = self.known.last_mut() {
            overlay.insert(address, value);
        }
    }

    /// What an address holds for sure.
    pub(super) fn known(&self, address: u64, of: Elementary) -> Option<u64> {
        if let Some(known) = self.known_at(address) {
            return known;
        }
        let fixed = !self.facts.written.contains(&address) && !self.inputs.contains_key(&address);
        fixed.then(|| self.initial_value(address, Some(of)))
    }

    /// The value at an address.
    pub(super) fn load(&mut self, address: u64, of: Elementary) -> Found<Value> {
        if let Some((block, part)) = self.parts.get(&address).copied()
            && self.facts.blocks[&block].is_native()
        {
            return self.load_part(block, part, address, of);
        }
        if let Some(value) = self.known(address, of) {
            return Ok(Value::Known(of, value));
        }
        self.load_cell(address, of)
    }

    fn load_cell(&mut self, address: u64, of: Elementary) -> Found<Value> {
        match kind_of(of) {
            Some(Kind::Truth) => {
                let cell = self.cell(address, of)?;
                Ok(Value::Truth(Truth::Cell(cell)))
            }
            Some(Kind::Number { .. }) => {
                let cell = self.cell(address, of)?;
                Ok(Value::Number(Number::Cell(cell)))
            }
            None if of == Elementary::Time => {
                let (name, _) = self.name(address, of);
                let what = format!("it uses the time `{name}`, which varies");
                Ok(Value::Unknown(what))
            }
            None => {
                let (name, _) = self.name(address, of);
                Err(self.refuse(format!("it uses `{name}`, {} {of}", of.article())))
            }
        }
    }

    fn load_part(
        &mut self,
        block: u64,
        part: &'static str,
        address: u64,
        of: Elementary,
    ) -> Found<Value> {
        let facts = &self.facts.blocks[&block];
        let word = facts.word;
        if outputs(word).contains(&part) {
            let cell = self.output(block, part, address)?;
            return Ok(Value::Truth(Truth::Cell(cell)));
        }
        if inputs(word).contains(&part) {
            self.hold(block, part);
            return self.load_cell(address, of);
        }
        if let "PT" | "PV" = part
            && let Some(value) = self.known(address, of)
        {
            return Ok(Value::Known(of, value));
        }
        if facts.is_timer() {
            let name = self.block_name(block);
            let what = format!("it uses `{name}.{part}`, a time that varies");
            return Ok(Value::Unknown(what));
        }
        if part == "CV" {
            return Ok(Value::Count(block));
        }
        self.expand(block);
        Ok(Value::Known(of, 0))
    }

    /// The cell of a native block's output.
    fn output(&mut self, block: u64, part: &'static str, address: u64) -> Found<usize> {
        if let Some(cell) = self.cells.get(&address) {
            return Ok(*cell);
        }
        let facts = &self.facts.blocks[&block];
        if facts.is_timer() && !facts.is_exclusive() {
            let timer = self.timer(block)?;
            return Ok(self.resolved.timers[timer].output);
        }
        let name = self.block_name(block);
        let cell = self.fresh(&format!("{name}.{part}"), Kind::Truth, Role::Pin)?;
        self.cells.insert(address, cell);
        Ok(cell)
    }

    /// The timer that not every execution calls once.
    pub(super) fn timer(&mut self, block: u64) -> Found<usize> {
        if let Some(timer) = self.timers.get(&block) {
            return Ok(*timer);
        }
        let name = self.block_name(block);
        let facts = &self.facts.blocks[&block];
        let (word, q) = (facts.word, facts.parts["Q"]);
        let started = self.fresh(&format!("{name}.started"), Kind::Truth, Role::Memory)?;
        let output = self.fresh(&format!("{name}.Q"), Kind::Truth, Role::Held)?;
        let timer = self.resolved.timers.len();
        self.resolved.timers.push(Timer { name, word, started, output });
        self.cells.insert(q, output);
        self.timers.insert(block, timer);
        Ok(timer)
    }

    pub(super) fn block_name(&mut self, block: u64) -> String {
        if let Some(name) = self.blocks.get(&block) {
            return name.clone();
        }
        // The first part of the block lies where the block does.
        let (name, _) = self.name(block, Elementary::Bool);
        let name = name.rsplit_once('.').map_or(name.as_str(), |(name, _)| name);
        let name = self.unique(name);
        self.blocks.insert(block, name.clone());
        name
    }

    /// An input of a block becomes a bit of its own.
    pub(super) fn hold(&mut self, block: u64, part: &'static str) {
        let entry = self.next.blocks.entry(block);
        let facts = entry.or_insert_with(|| self.facts.blocks[&block].uncalled());
        facts.held.insert(part);
    }

    /// A block's statements are executed.
    pub(super) fn expand(&mut self, block: u64) {
        let entry = self.next.blocks.entry(block);
        let facts = entry.or_insert_with(|| self.facts.blocks[&block].uncalled());
        facts.is_expanded = true;
    }

    /// Stores a value at an address.
    pub(super) fn store(&mut self, address: u64, of: Elementary, value: Value) -> Found<()> {
        if self.inputs.contains_key(&address) {
            let (name, _) = self.name(address, of);
            return Err(Refusal {
                code: "U1044",
                ..self.refuse(format!("it assigns the input `{name}`"))
            });
        }
        self.next.written.insert(address);
        if address >= 64 * u64::from(self.program.state) {
            self.next.frames.insert(address, of);
        }
        if let Some((block, part)) = self.parts.get(&address).copied()
            && self.facts.blocks[&block].is_native()
        {
            return self.store_part(block, part, address, of, value);
        }
        self.assign(address, of, value)
    }

    fn store_part(
        &mut self,
        block: u64,
        part: &'static str,
        address: u64,
        of: Elementary,
        value: Value,
    ) -> Found<()> {
        let facts = &self.facts.blocks[&block];
        if inputs(facts.word).contains(&part) {
            self.hold(block, part);
            return self.assign(address, of, value);
        }
        if let "PT" | "PV" = part {
            self.set_known(address, value.known());
            return Ok(());
        }
        if facts.is_timer() {
            let name = self.block_name(block);
            return Err(self.refuse(format!("it assigns `{name}.{part}`")));
        }
        self.expand(block);
        Ok(())
    }

    pub(super) fn assign(&mut self, address: u64, of: Elementary, value: Value) -> Found<()> {
        let known = value.known();
        match kind_of(of) {
            Some(Kind::Truth) => {
                let truth = self.truth_of(value)?;
                let cell = self.cell(address, of)?;
                self.push(Action::SetTruth(cell, truth))?;
            }
            Some(Kind::Number { .. }) => {
                let number = self.number_of(value)?;
                let cell = self.cell(address, of)?;
                self.push(Action::SetNumber(cell, number))?;
            }
            None => {
                self.unlocated(address, of)?;
                if let Value::Unknown(what) = &value {
                    self.unseen(address, of, what)?;
                }
            }
        }
        self.set_known(address, known);
        Ok(())
    }

    /// Others read what is written to a located variable, also where it is always the same.
    fn unlocated(&self, address: u64, of: Elementary) -> Found<()> {
        let mut variables = self.program.variables.iter();
        let found = variables.find(|variable| 64 * u64::from(variable.slot) == address);
        match found.and_then(|found| Some((&found.name, found.address.as_ref()?))) {
            Some((name, place)) => {
                Err(self.refuse(format!("`{name}` at {place} is {} {of}", of.article())))
            }
            None => Ok(()),
        }
    }

    /// A time that varies may stand in the memory of a chart or block; a variable that people see would be lost.
    fn unseen(&self, address: u64, of: Elementary, what: &str) -> Found<()> {
        let seen = self.program.part_at(address);
        let is_seen = seen.is_some_and(|part| !part.name.contains('.'));
        match of == Elementary::Time && !is_seen {
            true => Ok(()),
            false => Err(self.refuse(what)),
        }
    }

    /// Copies what has parts.
    pub(super) fn copy(&mut self, to: u64, from: u64, of: &Type) -> Found<()> {
        let mut parts = Vec::new();
        self.elements(0, of, &mut parts)?;
        for (offset, of) in parts {
            self.counted()?;
            let value = self.load(from + offset, of)?;
            self.store(to + offset, of, value)?;
        }
        Ok(())
    }

    fn elements(&self, at: u64, of: &Type, parts: &mut Vec<(u64, Elementary)>) -> Found<()> {
        match of {
            Type::Elementary(of) | Type::Enumeration(_, of) => parts.push((at, *of)),
            Type::Text(_) => return Err(self.refuse("it uses a STRING")),
            Type::Array(array) => {
                let length = array.length();
                if length > super::MAXIMUM_STEPS as u64 {
                    return Err(self.refuse("it copies a large array"));
                }
                for place in 0..length {
                    self.elements(at + place * array.stride(), &array.element, parts)?;
                }
            }
            Type::Structure(id, _) => {
                for field in &self.program.structures[id.0 as usize].fields {
                    if field.is_reference {
                        return Err(self.refuse("it copies a reference"));
                    }
                    self.elements(at + 64 * u64::from(field.slot), &field.of, parts)?;
                }
            }
        }
        Ok(())
    }
}
