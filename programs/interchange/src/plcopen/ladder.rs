//! A plan as rungs: Boolean networks and standard blocks stay the ladder that they were.
//!
//! What has no rung of its own shape (whole numbers, units of the file, EN, sequences) is said to be *general*, with its place;
//! Structured Text has statements for it.

mod calls;
mod scope;
mod series;

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::time::Duration;

use understudy_ladder::{
    Coil, CoilKind, Contact, ContactKind, Element, Name, Program, Rung, Series, Signal,
};
use understudy_text::Diagnostic;

use self::calls::Pending;
use self::scope::{Binding, Scope};
use super::document::{Edge, Ignored, Modifier, Pou, Project, Storage};
use super::plan::{Action, Plan};
use super::power::Power;

/// Misspelt names for which the nearest known one is searched.
const MAXIMUM_SUGGESTIONS: usize = 50;

/// A program, and what was found on the way to it.
pub(crate) struct Drawn {
    pub(crate) program: Program,
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// What is not kept.
    pub(crate) ignored: Vec<Ignored>,
    /// What rungs have no shape for.
    pub(crate) general: Vec<Ignored>,
}

/// Draws the plan of a program that runs every `period`.
pub(crate) fn draw(project: &Project, pou: &Pou, plan: &Plan, period: Duration) -> Drawn {
    let mut drawing = Drawing {
        project,
        scope: Scope::new(pou, project),
        plan,
        period,
        program: Program {
            name: Name::at(pou.name.as_str(), pou.name.span()),
            description: pou.documentation.clone(),
            footer: plan.footer.clone(),
            ..Program::default()
        },
        kept: HashMap::new(),
        drawn: HashSet::new(),
        suggestions: 0,
        pending: Vec::new(),
        diagnostics: Vec::new(),
        ignored: Vec::new(),
        general: Vec::new(),
        comments: Vec::new(),
        never: None,
        always: None,
    };
    drawing.program.name = drawing.scope.program_name(pou);
    for step in &plan.steps {
        drawing.flush_before(&step.action);
        drawing.comments.extend(step.comments.iter().cloned());
        match &step.action {
            Action::Write { targets, power, guard } => {
                if guard.is_some() {
                    drawing.general("a function with EN", step.span.clone());
                }
                drawing.write(targets, power, &step.span);
            }
            Action::Call(call) => drawing.call(call, &step.span),
            Action::Keep { object, power, edge, guard } => {
                if guard.is_some() {
                    drawing.general("a function with EN", step.span.clone());
                }
                let contact =
                    drawing.kept_edge(power, *edge, &format!("power_{object}"), &step.span);
                drawing.kept.insert(*object, contact);
            }
            Action::Jump { .. } | Action::Label(_) => {
                drawing.general("a jump", step.span.clone());
            }
        }
    }
    drawing.flush();
    drawing.finish()
}

struct Drawing<'a> {
    project: &'a Project,
    scope: Scope<'a>,
    plan: &'a Plan,
    /// From one scan to the next.
    period: Duration,
    program: Program,
    /// The bits of objects whose power is kept.
    kept: HashMap<usize, Name>,
    /// Blocks that have been drawn.
    drawn: HashSet<String>,
    /// Suggestions that have been made for misspelt names.
    suggestions: usize,
    /// Blocks that will stand in the wire of what comes next.
    pending: Vec<Pending>,
    diagnostics: Vec<Diagnostic>,
    ignored: Vec<Ignored>,
    general: Vec<Ignored>,
    /// For the next rung.
    comments: Vec<String>,
    /// Constant bits, once they are needed.
    never: Option<Name>,
    always: Option<Name>,
}

impl Drawing<'_> {
    fn general(&mut self, what: impl Into<String>, span: Range<usize>) {
        self.general.push(Ignored { what: what.into(), span });
    }

    fn error(&mut self, code: &'static str, message: String, span: Range<usize>) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    fn rung(&mut self, network: Series, coils: Vec<Coil>) {
        self.program.rungs.push(Rung {
            title: None,
            comments: std::mem::take(&mut self.comments),
            network,
            coils,
        });
    }

    /// A new memory bit that takes a power in a rung of its own.
    fn kept_in(&mut self, power: &Power, wanted: &str, span: &Range<usize>) -> Name {
        self.kept_edge(power, None, wanted, span)
    }

    /// A new memory bit for a power or its edge.
    fn kept_edge(
        &mut self,
        power: &Power,
        edge: Option<Edge>,
        wanted: &str,
        span: &Range<usize>,
    ) -> Name {
        let network = self.series(power);
        let kind = match edge {
            None => CoilKind::Plain,
            Some(Edge::Rising) => CoilKind::Rising,
            Some(Edge::Falling) => CoilKind::Falling,
        };
        self.bit_of(network, kind, wanted, span)
    }

    fn bit_of(
        &mut self,
        network: Series,
        kind: CoilKind,
        wanted: &str,
        span: &Range<usize>,
    ) -> Name {
        let name = Name::at(self.scope.fresh(wanted), span.clone());
        self.program.memory.push(Signal::new(name.clone()));
        let target = name.clone();
        self.rung(network, vec![Coil { kind, target }]);
        name
    }

    /// A bit that no rung writes.
    fn constant(&mut self, value: bool) -> Name {
        let known = if value { &self.always } else { &self.never };
        if let Some(name) = known {
            return name.clone();
        }
        let name = Name::from(self.scope.fresh(if value { "always" } else { "never" }));
        self.program.memory.push(Signal { initial: Some(value), ..Signal::new(name.clone()) });
        if value {
            self.always = Some(name.clone());
        } else {
            self.never = Some(name.clone());
        }
        name
    }

    fn constant_contact(&mut self, value: bool) -> Element {
        Element::Contact(Contact { kind: ContactKind::NormallyOpen, operand: self.constant(value) })
    }

    fn write(&mut self, targets: &[(Name, Modifier)], power: &Power, span: &Range<usize>) {
        let mut coils = Vec::new();
        for (target, modifier) in targets {
            match self.scope.find(target) {
                Some(Binding::Bit(name)) => {
                    let kind = coil_kind(*modifier);
                    if kind.is_none() {
                        self.general("a coil that is changed in more than one way", span.clone());
                    }
                    let target = Name::at(name.as_str(), target.span());
                    let kind = kind.unwrap_or(CoilKind::Plain);
                    coils.push(Coil { kind, target });
                }
                Some(Binding::Other(_) | Binding::Time(_) | Binding::Number(_))
                    if matches!(power, Power::Output(..))
                        && self.scope.is_private(target)
                        && !self.is_read(target) =>
                {
                    let what = format!(
                        "`{target}`, which shows a number or time of a block and which nothing reads,"
                    );
                    self.ignored.push(Ignored { what, span: target.span() });
                }
                Some(Binding::Instance(_)) => {
                    let message = format!("`{target}` is a block and cannot be written");
                    self.error("U1004", message, target.span());
                }
                Some(Binding::Other(_) | Binding::Time(_) | Binding::Number(_)) => {
                    self.general(format!("`{target}` is not a BOOL"), target.span());
                }
                None => self.undefined(target),
            }
        }
        if coils.is_empty() {
            return;
        }
        let network = self.series(power);
        self.rung(network, coils);
    }

    /// Whether any step reads the variable.
    fn is_read(&self, variable: &Name) -> bool {
        let mut found = false;
        for step in &self.plan.steps {
            for power in step.action.powers() {
                power.visit(&mut |part| {
                    found |= matches!(part, Power::Read(read) if read.text.eq_ignore_ascii_case(variable));
                });
            }
        }
        found
    }

    fn undefined(&mut self, name: &Name) {
        let mut error =
            Diagnostic::error("U1004", format!("nothing is called `{name}`"), name.span());
        if name.is_empty() {
            return;
        }
        self.suggestions += 1;
        if self.suggestions <= MAXIMUM_SUGGESTIONS
            && let Some(near) = self.scope.nearest(name)
        {
            error = error.with_help(format!("did you mean `{near}`?"));
        }
        self.diagnostics.push(error);
    }

    fn finish(mut self) -> Drawn {
        // An output is read by the world, whatever writes it.
        for output in self.scope.outputs_of_numbers() {
            let what = format!("the output `{}`, a {},", output.name, output.kind.text());
            self.general(what, output.name.span());
        }
        let (inputs, outputs, memory) =
            self.scope.signals(&mut self.ignored, &mut self.diagnostics);
        self.program.inputs = inputs;
        self.program.outputs = outputs;
        self.program.memory.splice(0..0, memory);
        self.program.footer.splice(0..0, self.comments);
        Drawn {
            program: self.program,
            diagnostics: self.diagnostics,
            ignored: self.ignored,
            general: self.general,
        }
    }
}

fn coil_kind(modifier: Modifier) -> Option<CoilKind> {
    Some(match (modifier.negated, modifier.edge, modifier.storage) {
        (false, None, None) => CoilKind::Plain,
        (true, None, None) => CoilKind::Negated,
        (false, Some(Edge::Rising), None) => CoilKind::Rising,
        (false, Some(Edge::Falling), None) => CoilKind::Falling,
        (false, None, Some(Storage::Set)) => CoilKind::Set,
        (false, None, Some(Storage::Reset)) => CoilKind::Reset,
        _ => return None,
    })
}
