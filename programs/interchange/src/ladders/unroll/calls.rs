//! Calls: frames, bodies in place of their calls, and the standard blocks that a ladder has.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::time::Duration;

use understudy_ladder::BlockKind;
use understudy_typed::{Argument, Call, Elementary, Place, RoutineId, Type};

use super::super::facts::{BlockFacts, STANDARD, inputs, outputs, preset};
use super::super::program::{Action, Truth};
use super::values::Value;
use super::{Context, Found, Refusal, Unrolling};

/// What a call gives to the inputs of a block.
pub(super) type GivenParts = Vec<(&'static str, Value)>;

impl Unrolling<'_> {
    /// Begins the frame of a routine, but for what the call gives.
    pub(super) fn begin(&mut self, routine: RoutineId, given: &[u64]) -> Found<()> {
        let (first, slots) = self.program.routine(routine).frame;
        let first = u64::from(self.program.state) + u64::from(first);
        let range = 64 * first..64 * (first + u64::from(slots));
        let frames = self.facts.frames.range(range);
        let frames: Vec<(u64, Elementary)> = frames.map(|(at, of)| (*at, *of)).collect();
        for (address, of) in frames {
            if !given.contains(&address) {
                let initial = self.initial_value(address, Some(of));
                self.store(address, of, Value::Known(of, initial))?;
            }
        }
        Ok(())
    }

    /// A call of a function or a method.
    pub(super) fn call(&mut self, context: Context, call: &Call) -> Found<Option<Value>> {
        self.counted()?;
        let own = match &call.own {
            Some(place) => self.address(context, place)? / 64,
            None => 0,
        };
        let inner = Context { routine: call.routine, own };
        let expressions = call.arguments.iter().filter_map(|argument| match argument {
            Argument::Value(_, value) if value.of.elementary().is_some() => Some(value),
            _ => None,
        });
        let mut values = self.operands(context, expressions)?;
        let mut references = Vec::new();
        let mut copies = Vec::new();
        for argument in &call.arguments {
            match argument {
                Argument::Reference(to, from) => {
                    let from = self.address(context, from)?;
                    references.push((self.holder(inner, to)?, from));
                }
                Argument::Value(to, value) if value.of.elementary().is_none() => {
                    let understudy_typed::ExpressionKind::Load(from) = &value.kind else {
                        return Err(self.refuse("it uses a value with parts"));
                    };
                    let from = self.address(context, from)?;
                    copies.push((self.address(inner, to)?, from, to.of.clone()));
                }
                Argument::Value(..) => {}
            }
        }
        let mut taken = Vec::new();
        for (from, to) in &call.outputs {
            taken.push((from, self.address(context, to)?, to.of.clone()));
        }
        let frame = self.frame_cells(call.routine);
        self.held_off(&mut values, &frame)?;
        let mut given = Vec::new();
        let mut targets = Vec::new();
        for argument in &call.arguments {
            if let Argument::Value(to, _) = argument
                && let Some(of) = to.of.elementary()
            {
                let address = self.address(inner, to)?;
                given.push(address);
                targets.push((address, of));
            }
        }
        self.begin(call.routine, &given)?;
        for ((address, of), value) in targets.into_iter().zip(values) {
            self.store(address, of, value)?;
        }
        for (holder, from) in references {
            self.next.written.insert(holder);
            self.set_known(holder, Some(from));
        }
        for (to, from, of) in copies {
            self.copy(to, from, &of)?;
        }
        self.body(inner)?;
        for (from, to, of) in taken {
            let from = self.address(inner, from)?;
            self.copy(to, from, &of)?;
        }
        let Some(result) = &call.result else {
            return Ok(None);
        };
        let Some(of) = result.of.elementary() else {
            return Err(self.refuse("it calls a function whose result has parts"));
        };
        let address = self.address(inner, result)?;
        self.load(address, of).map(Some)
    }

    /// The slot that holds a reference.
    pub(super) fn holder(&mut self, context: Context, place: &Place) -> Found<u64> {
        let mut holder = place.clone();
        holder.root = match place.root {
            understudy_typed::Root::OwnReference(slot) => understudy_typed::Root::Own(slot),
            understudy_typed::Root::FrameReference(slot) => understudy_typed::Root::Frame(slot),
            root => root,
        };
        self.address(context, &holder)
    }

    fn frame_cells(&self, routine: RoutineId) -> HashSet<usize> {
        let (first, slots) = self.program.routine(routine).frame;
        let first = u64::from(self.program.state) + u64::from(first);
        let range = 64 * first..64 * (first + u64::from(slots));
        let cells = self.cells.iter();
        cells.filter(|(address, _)| range.contains(address)).map(|(_, cell)| *cell).collect()
    }

    /// Runs the body of a block on an instance.
    pub(super) fn invoke(
        &mut self,
        context: Context,
        routine: RoutineId,
        place: &Place,
        given: GivenParts,
    ) -> Found<()> {
        self.counted()?;
        let address = self.address(context, place)?;
        if let Some(word) = self.standard(routine)
            && address < 64 * u64::from(self.program.state)
        {
            self.called(address, word, place, &given);
            match self.facts.blocks.get(&address) {
                // Known from the next unrolling on.
                None => return Ok(()),
                Some(facts) if facts.is_native() => return self.native(address, given),
                Some(_) => {}
            }
        }
        self.begin(routine, &[])?;
        self.body(Context { routine, own: address / 64 })
    }

    /// The word of a routine that is one of the ladder's standard blocks.
    fn standard(&self, routine: RoutineId) -> Option<&'static str> {
        let is_library = self.around.names.library.get(routine.0 as usize);
        let name = &self.program.routine(routine).name;
        let mut known = STANDARD.into_iter();
        let found = known.find(|word| word == name);
        found.filter(|_| is_library == Some(&true))
    }

    fn called(&mut self, address: u64, word: &'static str, place: &Place, given: &GivenParts) {
        let mut parts = BTreeMap::new();
        if let Type::Structure(id, _) = place.of {
            for field in &self.program.structures[id.0 as usize].fields {
                let known = inputs(word).iter().chain(outputs(word)).copied();
                let known = known.chain(preset(word)).chain(["ET", "CV", "M", "LAST", "STATE"]);
                let found = known.chain(["START", "LAST_UP", "LAST_DOWN"]);
                let mut found = found.filter(|part| field.name.eq_ignore_ascii_case(part));
                if let Some(part) = found.next() {
                    parts.insert(part, address + 64 * u64::from(field.slot));
                }
            }
        }
        let given: BTreeSet<&'static str> = given.iter().map(|(part, _)| *part).collect();
        let known = self.facts.blocks.get(&address);
        let known = known.map(|facts| facts.given.clone()).unwrap_or_default();
        let is_conditional = self.depth > 0;
        let facts = self.next.blocks.entry(address).or_insert(BlockFacts {
            word,
            parts,
            calls: 0,
            is_conditional: false,
            is_expanded: false,
            given: BTreeSet::new(),
            held: BTreeSet::new(),
        });
        facts.calls = (facts.calls + 1).min(2);
        facts.is_conditional |= is_conditional;
        for part in inputs(word) {
            if known.contains(part) && !given.contains(part) {
                facts.held.insert(part);
            }
        }
        facts.given.extend(given);
    }

    /// A call of a block of the ladder.
    fn native(&mut self, block: u64, given: GivenParts) -> Found<()> {
        let facts = self.facts.blocks[&block].clone();
        let mut fed = Vec::new();
        for &part in inputs(facts.word) {
            let address = facts.parts[part];
            let value = given.iter().find(|(name, _)| *name == part);
            let value = value.map(|(_, value)| value.clone());
            let truth = match value {
                Some(value) if facts.held.contains(part) => {
                    let is_known = value.known().is_some();
                    let truth = self.truth_of(value.clone())?;
                    self.assign(address, Elementary::Bool, value)?;
                    match is_known {
                        true => truth,
                        false => Truth::Cell(self.cell(address, Elementary::Bool)?),
                    }
                }
                Some(value) => self.truth_of(value)?,
                None => match self.known(address, Elementary::Bool) {
                    Some(value) => Truth::Constant(value == 1),
                    None => Truth::Cell(self.cell(address, Elementary::Bool)?),
                },
            };
            fed.push((part, truth));
        }
        let mut setting = None;
        if let Some(part) = preset(facts.word) {
            let of = match part {
                "PT" => Elementary::Time,
                _ => Elementary::Int,
            };
            let address = facts.parts[part];
            for (name, value) in &given {
                if *name == part {
                    self.set_known(address, value.known());
                    self.next.written.insert(address);
                }
            }
            let is_given = given.iter().any(|(name, _)| *name == part);
            setting = self.known(address, of).map(|value| of.signed(value) as i64);
            if setting.is_none() && (is_given || !facts.is_timer()) {
                if facts.is_timer() {
                    let name = self.block_name(block);
                    return Err(Refusal {
                        code: "U1045",
                        ..self.refuse(format!("the time PT of `{name}` varies"))
                    });
                }
                self.expand(block);
                return Ok(());
            }
        }
        let (_, wire) = fed.remove(0);
        if facts.is_timer() && !facts.is_exclusive() {
            let timer = self.timer(block)?;
            let preset = setting.map(|time| Duration::from_nanos(time.max(0) as u64));
            return self.push(Action::Timer { timer, wire, preset });
        }
        let name = self.block_name(block);
        let Some(kind) = self.block_kind(&facts, &wire, setting) else {
            if facts.is_timer() {
                return Err(Refusal {
                    code: "U1045",
                    ..self.refuse(format!("the time PT of `{name}` varies"))
                });
            }
            self.expand(block);
            return Ok(());
        };
        self.push(Action::Block { name, kind, wire, feeds: fed })
    }

    fn block_kind(
        &self,
        facts: &BlockFacts,
        wire: &Truth,
        setting: Option<i64>,
    ) -> Option<BlockKind> {
        // What is never started needs no time.
        let is_idle = matches!(wire, Truth::Constant(false));
        let setting = setting.or(is_idle.then_some(0));
        let time = setting.map(|time| Duration::from_nanos(time.max(0) as u64));
        let value = setting.and_then(|value| u16::try_from(value).ok());
        Some(match facts.word {
            "TON" => BlockKind::Ton(time?),
            "TOF" => BlockKind::Tof(time?),
            "TP" => BlockKind::Tp(time?),
            "CTU" => BlockKind::Ctu(value?),
            "CTD" => BlockKind::Ctd(value?),
            "CTUD" => BlockKind::Ctud(value?),
            "SR" => BlockKind::Sr,
            "RS" => BlockKind::Rs,
            "R_TRIG" => BlockKind::RTrig,
            _ => BlockKind::FTrig,
        })
    }
}
