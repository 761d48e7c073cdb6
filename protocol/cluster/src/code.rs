//! What a controller runs.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use understudy_bits::{Exact, Inexact, Layout, exact};
use understudy_executable::{Executable, Interface};
use understudy_ladder::{Executed, LowerError, Observer, Program as LadderProgram};
use understudy_logic::{Circuit, Register};
use understudy_typed::{
    CarriedPath, CarriedState, EdgeMemory, Elementary, Fate, Program as TypedProgram, Renamed,
    Successor, Told, is_within, is_within_in_any_case,
};
use understudy_wire::ProgramHash;

use crate::canonical::{circuit_text, typed_text};
use crate::source_text::SourceText;

/// A program, read.
#[derive(Debug, Clone)]
pub struct Code {
    typed: Arc<TypedProgram>,
    source: Arc<SourceText>,
    body: Body,
}

/// Which way an online change goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// From the program before to the one after.
    There,
    /// From the program after back to the one before: the change is cancelled, or taken back.
    Back,
}

/// What a program is written in.
#[derive(Debug, Clone)]
enum Body {
    /// Rungs. They are executed as the circuit for the period of the cluster, and what is proved is proved of it.
    Rungs(Box<Rungs>),
    /// Statements, charts and networks. A program fault names lines of the text.
    Text,
}

/// Why the states of a program cannot be those of a changed one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unnamed {
    /// Memory that has no name.
    #[error("has memory without a name, such as that of a block without an instance")]
    Memory,
    /// Several memories of the same edges.
    #[error("sees the same edges of `{0}` at several places")]
    SeveralEdges(String),
}

/// Rungs and their circuit.
#[derive(Debug, Clone)]
struct Rungs {
    ladder: LadderProgram,
    /// What stations execute but for the signals that it keeps and does not read.
    circuit: Circuit,
    /// The circuit with all signals in its state, as stations execute it.
    kept: Circuit,
    executable: Executable,
    /// What its registers are in the state of the program.
    layout: Layout,
    /// The registers that a warm start keeps, packed.
    retentive: Vec<u64>,
}

impl Code {
    /// The program of a file, for the period of the cluster, with the rungs that it is written in, of one that is.
    ///
    /// # Errors
    /// Rungs that are too large for a circuit.
    pub fn of(
        typed: Arc<TypedProgram>,
        ladder: Option<LadderProgram>,
        source: Arc<SourceText>,
    ) -> Result<Self, LowerError> {
        let Some(ladder) = ladder else {
            return Ok(Self { typed, source, body: Body::Text });
        };
        let Executed { circuit, kept } = Executed::new(&typed, &ladder)?;
        let circuit = circuit.named(ladder.name.as_str());
        let Exact { circuit: kept, layout, .. } = kept;
        let retentive = layout.retentive_mask(&typed);
        let executable = Executable::from(&kept).keeping(retentive.clone());
        let rungs = Rungs { ladder, circuit, kept, executable, layout, retentive };
        Ok(Self { typed, source, body: Body::Rungs(Box::new(rungs)) })
    }

    /// The same program, after one in which some paths had other names.
    #[must_use]
    pub fn with_renamed(self, renamed: Vec<Renamed>) -> Self {
        let source = SourceText { renamed, ..(*self.source).clone() };
        Self { source: Arc::new(source), ..self }
    }

    /// The file that it was read from.
    pub fn source(&self) -> &SourceText {
        &self.source
    }

    /// The program.
    pub fn typed(&self) -> &Arc<TypedProgram> {
        &self.typed
    }

    /// Its rungs, of one that is written in rungs.
    pub fn ladder(&self) -> Option<&LadderProgram> {
        match &self.body {
            Body::Rungs(rungs) => Some(&rungs.ladder),
            Body::Text => None,
        }
    }

    /// The observer of the power in its rungs, of one that is written in them.
    pub fn observer(&self) -> Option<Observer> {
        match &self.body {
            Body::Rungs(rungs) => {
                Observer::new(&rungs.ladder, rungs.layout.clone(), self.source.period).ok()
            }
            Body::Text => None,
        }
    }

    /// The registers that have the names of its signals in a state as stations hold it; none where the state is the memory of its variables.
    pub fn registers(&self) -> &[Register] {
        self.circuit().map_or(&[], Circuit::registers)
    }

    /// The circuit of one that is written in rungs: its registers are the first ones of a state, behind which stand signals that no scan reads.
    pub fn circuit(&self) -> Option<&Circuit> {
        match &self.body {
            Body::Rungs(rungs) => Some(&rungs.circuit),
            Body::Text => None,
        }
    }

    /// The circuit that does in every scan what the program does.
    ///
    /// # Errors
    /// The values of the program that have no bits.
    pub fn exact_circuit(&self) -> Result<Cow<'_, Circuit>, Inexact> {
        match self.circuit() {
            Some(circuit) => Ok(Cow::Borrowed(circuit)),
            None => exact(&self.typed).map(Cow::Owned),
        }
    }

    /// The bit of a state, as stations hold it, that a BOOL of the program is; none where no state has it.
    pub fn bit_of(&self, path: &str) -> Option<usize> {
        match &self.body {
            Body::Rungs(rungs) => {
                let mut registers = rungs.kept.registers().iter();
                registers.position(|register| register.name == path)
            }
            Body::Text => {
                let part = self.typed.part(path)?;
                let is_bit = part.of.elementary() == Some(Elementary::Bool);
                usize::try_from(part.address).ok().filter(|_| is_bit)
            }
        }
    }

    /// Its inputs and its outputs.
    pub fn interface(&self) -> Interface {
        self.typed.as_ref().into()
    }

    /// As stations execute it.
    pub fn executable(&self) -> Executable {
        match &self.body {
            Body::Rungs(rungs) => rungs.executable.clone(),
            Body::Text => self.typed.as_ref().into(),
        }
    }

    /// The state with which it starts warm from a state of the program before it, both as stations hold them, and what has become of each retentive path.
    ///
    /// # Panics
    /// If `state` is shorter than a state of `before`.
    pub fn carried(&self, before: &Self, state: &[u64]) -> CarriedState {
        let state = before.typed_state(state);
        let renamed = self.renamed(before, Way::There);
        let mut carried =
            self.told(before, |told| self.typed.carried(&before.typed, &state, told, &renamed));
        if let Body::Rungs(rungs) = &self.body {
            let initial = rungs.executable.initial();
            let registers = rungs.layout.registers(&self.typed, &carried.state, initial);
            carried.paths.retain(|path| !registers.lost.contains(&path.path));
            carried.paths.extend(registers.lost.iter().map(|path| self.without_registers(path)));
            carried.state = registers.packed;
        }
        carried
    }

    /// The state with which it goes on from a state of the program before it, in an online change.
    ///
    /// # Panics
    /// As [`Self::carried`].
    pub(crate) fn changed(&self, before: &Self, state: &[u64], by: &Successor) -> Vec<u64> {
        let state = before.typed_state(state);
        let changed = self.told(before, |told| by.state(&state, told));
        match &self.body {
            Body::Rungs(rungs) => {
                let initial = rungs.executable.initial();
                rungs.layout.nearest_registers(by.program(), &changed, initial)
            }
            Body::Text => changed,
        }
    }

    /// What becomes of each variable in an online change from the program before it.
    pub(crate) fn fates(&self, before: &Self, way: Way) -> Vec<CarriedPath> {
        let successor = self.successor(before, way);
        let executable = before.executable();
        let state = before.typed_state(executable.initial());
        let mut paths = self.told(before, |told| successor.carried(&state, told)).paths;
        // What no register holds is written before it is read: nothing of it begins anew, and nothing is lost.
        paths.retain(|path| match path.fate {
            Fate::New => self.holds(&path.path),
            Fate::Dropped if path.now.is_none() => before.holds(&path.path),
            _ => true,
        });
        let narrowed = self
            .layout()
            .map(|layout| layout.narrowed(successor.program(), (&before.typed, before.layout())));
        for name in narrowed.into_iter().flatten() {
            for path in paths.iter_mut().filter(|path| is_within(&name, &path.path)) {
                if matches!(path.fate, Fate::Kept | Fate::Converted) {
                    path.fate = Fate::Narrowed;
                }
            }
        }
        paths
    }

    /// A variable whose value becomes, in an online change from the program before it, the nearest one that the circuit of this one has; only circuits
    /// lack values.
    pub(crate) fn nearest(&self, before: &Self) -> Option<String> {
        self.layout()?;
        let narrowed =
            self.fates(before, Way::There).into_iter().find(|path| path.fate == Fate::Narrowed);
        narrowed.map(|path| path.path)
    }

    /// Whether the states that stations hold have any of what a path stands for.
    fn holds(&self, path: &str) -> bool {
        self.typed.part(path).is_none_or(|part| {
            (0..part.of.slots()).any(|slot| self.holds_address(part.address + 64 * slot))
        })
    }

    /// Whether the states that stations hold have the value at an address.
    pub(crate) fn holds_address(&self, address: u64) -> bool {
        self.layout().is_none_or(|layout| layout.holds(address))
    }

    /// Asks with what the state before tells, and with what of it is read.
    fn told<R>(&self, before: &Self, ask: impl FnOnce(Told<'_>) -> R) -> R {
        ask(Told {
            is_known: &|address| before.holds_address(address),
            is_read: &|address| self.holds_address(address),
        })
    }

    /// Why the states of this program cannot be those of a changed one; nothing where they can.
    pub(crate) fn why_not_changed(&self) -> Option<Unnamed> {
        let fields = self.typed.structures.iter().flat_map(|of| &of.fields);
        let fields = fields.map(|field| field.name.as_str());
        let variables = self.typed.variables.iter().map(|variable| variable.name.as_str());
        let mut names = variables.clone().chain(fields.clone());
        if let Some(edges) = names.find_map(|name| self.several_edges(name)) {
            return Some(Unnamed::SeveralEdges(edges.to_owned()));
        }
        // Of several programs, each name of theirs stands behind the instance; of one that is counted, another change may count others.
        let is_plain = |name: &str| !name.contains('#');
        // Parts of a chart have names that stay where other parts change.
        let is_of_chart = |name: &str| {
            let parts = ["begun.", "timer.", "stored.", "fires."];
            parts.iter().any(|part| name.starts_with(part))
        };
        let stays = |name: &str| {
            !name.contains('.') || is_of_chart(name) || EdgeMemory::named(name).is_some()
        };
        let is_hidden_of_chart = |name: &str| {
            let own = name.split_once('.').map_or(name, |(_, own)| own);
            is_of_chart(name) || is_of_chart(own)
        };
        let mut hidden = self.typed.hidden.iter().map(|variable| variable.name.as_str());
        // Of rungs, all other memory is that of their signals and blocks.
        let is_named = self.ladder().is_some()
            || variables.into_iter().all(is_plain)
                && fields.into_iter().all(stays)
                && hidden.all(is_hidden_of_chart)
                && self.typed.has_names_for_all();
        (!is_named).then_some(Unnamed::Memory)
    }

    /// What has the edges that a memory sees, where several see the same ones at different places of a scan: which is which cannot be told from the
    /// names. All contacts of an input of a ladder see the same.
    fn several_edges<'n>(&self, name: &'n str) -> Option<&'n str> {
        let edges = EdgeMemory::named(name).filter(|edges| edges.number > 1)?;
        let is_of_input = self.ladder().is_some() && self.typed.inputs.find(edges.of).is_some();
        (!is_of_input).then_some(edges.of)
    }

    /// Memories of edges that the program before has under another number, by their names in this one.
    fn same_edges(&self, before: &Self) -> HashMap<String, String> {
        if self.ladder().is_none() || before.ladder().is_none() {
            return HashMap::new();
        }
        let names = self.typed.variables.iter().map(|variable| &variable.name);
        let same = names.filter_map(|name| {
            let edges = EdgeMemory::named(name).filter(|edges| edges.number > 1)?;
            let first = name.strip_suffix(&format!("_{}", edges.number))?;
            Some((name.clone(), first.to_owned()))
        });
        same.collect()
    }

    /// The way from the program before it to this one, by the names and types of its variables.
    pub(crate) fn successor(&self, before: &Self, way: Way) -> Successor {
        let (others, renamed) = (self.same_edges(before), self.renamed(before, way));
        Successor::new(&before.typed, &self.typed, &others, renamed)
    }

    /// Paths that have another name in this program than in the one before it.
    ///
    /// Each path is in one pair at most. On the way there the pairs of this program count, and then those of the other one the other way, for what these
    /// leave. The way back is by the same pairs the other way, whatever pairs the older program has from an earlier change.
    pub(crate) fn renamed(&self, before: &Self, way: Way) -> Vec<Renamed> {
        let other_way = |(old, new): Renamed| (new, old);
        if way == Way::Back {
            return before.renamed(self, Way::There).into_iter().map(other_way).collect();
        }
        let (was, is) = (&before.typed, &self.typed);
        let counts = |(old, new): &&Renamed| {
            was.has_path(old) && is.has_path(new) && !is.has_path(old) && !was.has_path(new)
        };
        let own = &self.source.renamed;
        let counting: Vec<&Renamed> = own.iter().filter(counts).collect();
        let overlap = |one: &str, other: &str| {
            is_within_in_any_case(one, other) || is_within_in_any_case(other, one)
        };
        let is_left = |(old, new): &Renamed| {
            counting.iter().all(|pair| !overlap(&pair.0, old) && !overlap(&pair.1, new))
        };
        let others = before.source.renamed.iter().cloned().map(other_way).filter(is_left);
        own.iter().cloned().chain(others).collect()
    }

    /// A state of the program in the order of its variables, for one as stations hold it.
    ///
    /// # Panics
    /// If `state` is shorter than a state of the program.
    pub fn typed_state<'s>(&self, state: &'s [u64]) -> Cow<'s, [u64]> {
        match self.layout() {
            Some(layout) => Cow::Owned(layout.state(state)),
            None => Cow::Borrowed(state),
        }
    }

    fn layout(&self) -> Option<&Layout> {
        match &self.body {
            Body::Rungs(rungs) => Some(&rungs.layout),
            Body::Text => None,
        }
    }

    /// The entry of a path whose value the circuit cannot hold.
    fn without_registers(&self, path: &str) -> CarriedPath {
        let part = self.typed.part(path);
        let of = part.map(|part| self.typed.type_name(&part.of));
        CarriedPath {
            path: path.to_owned(),
            fate: Fate::Dropped,
            renamed_from: None,
            before: of.clone(),
            now: of,
        }
    }

    /// The canonical text that its hash is of: equal texts mean equal behaviour, equal states, and the same values of the program before it.
    pub(crate) fn text(&self) -> String {
        let mut text = match &self.body {
            Body::Rungs(rungs) => circuit_text(&rungs.kept, &rungs.retentive),
            Body::Text => typed_text(&self.typed),
        };
        for (old, new) in &self.source.renamed {
            text += &format!("renamed {old:?} {new:?}\n");
        }
        text
    }

    /// Of the canonical text; the program's own name is not in it, its role is the cluster's affair.
    pub(crate) fn hash(&self) -> ProgramHash {
        ProgramHash::of(self.text().as_bytes())
    }
}
