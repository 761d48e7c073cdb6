//! What of a file was kept, and what was not.

use std::ops::Range;

use understudy_ladder::{Element, Program, visit};

use super::document::{ActionContent, Body, Condition, Ignored, Kind, Pou, Project, VariableType};
use super::units::used;
use super::within;

/// What was kept, and what was not.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Fidelity {
    /// How many of each kind the unit has in the file and in the program.
    pub counts: Vec<Count>,
    /// Contents of the file that are not kept, or not as they are, and do not change what the program does.
    pub notes: Vec<Note>,
}

/// A kind of content.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Count {
    /// Such as "contacts".
    pub what: &'static str,
    /// How many the file has.
    pub in_file: usize,
    /// How many the program has; it may have more, where a bit is kept or a branch is written twice.
    pub in_program: usize,
}

/// Something that is not kept as it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// What, and what becomes of it.
    pub message: String,
    /// Bytes of the file.
    pub span: Range<usize>,
}

impl Fidelity {
    pub(super) fn plan(&mut self, notes: Vec<(String, Range<usize>)>) {
        let notes = notes.into_iter().map(|(message, span)| Note { message, span });
        self.notes.extend(notes);
    }

    pub(super) fn ignored(&mut self, ignored: Vec<Ignored>) {
        let notes = ignored.into_iter().map(|ignored| Note {
            message: format!("{} is not kept", ignored.what),
            span: ignored.span,
        });
        self.notes.extend(notes);
    }

    pub(super) fn count(&mut self, project: &Project, pou: &Pou, program: &Program) {
        let parts = pou.actions.iter().chain(&pou.transitions);
        let mut bodies: Vec<&Body> = parts.filter_map(|part| part.body.as_ref()).collect();
        bodies.extend(&pou.body);
        let mut objects: Vec<&Kind> = Vec::new();
        while let Some(body) = bodies.pop() {
            if let Body::Graph(graph) = body {
                for object in &graph.objects {
                    bodies.extend(inner(&object.kind));
                    objects.push(&object.kind);
                }
            }
        }
        let in_file = |is: &dyn Fn(&Kind) -> bool| objects.iter().filter(|kind| is(kind)).count();
        let coils = program.rungs.iter().map(|rung| rung.coils.len()).sum();
        let signals = program.inputs.len() + program.outputs.len() + program.memory.len();
        let comments: usize =
            program.rungs.iter().map(|rung| usize::from(!rung.comments.is_empty())).sum();
        let mut contacts = 0;
        for rung in &program.rungs {
            visit(&rung.network, &mut |element| {
                contacts += usize::from(matches!(element, Element::Contact(_)));
            });
        }
        let count = |what, in_file, in_program| Count { what, in_file, in_program };
        self.counts = vec![
            count(
                "BOOL variables",
                pou.variables.iter().filter(|variable| variable.kind == VariableType::Bool).count(),
                signals,
            ),
            count("contacts", in_file(&|kind| matches!(kind, Kind::Contact(..))), contacts),
            count(
                "coils and written variables",
                in_file(&|kind| matches!(kind, Kind::Coil(..) | Kind::OutVariable(..))),
                coils,
            ),
            count(
                "blocks and functions",
                in_file(&|kind| matches!(kind, Kind::Block(_))),
                program.blocks().len(),
            ),
            count(
                "comments",
                in_file(&|kind| matches!(kind, Kind::Comment(text) if !text.is_empty())),
                comments,
            ),
        ];
        self.unused(project, pou);
        let used = used(project, pou);
        for global in &project.globals {
            let is_used = used.iter().flat_map(|pou| &pou.variables).any(|variable| {
                variable.is_external && variable.name.eq_ignore_ascii_case(&global.name)
            });
            if !is_used {
                let message = format!(
                    "the global variable `{}`, which `{}` does not declare as external, is not kept",
                    global.name, pou.name
                );
                self.notes.push(Note { message, span: global.name.span() });
            }
        }
    }

    /// Notes the units that a unit does not use.
    pub(super) fn unused(&mut self, project: &Project, pou: &Pou) {
        let used = used(project, pou);
        for other in &project.pous {
            if !used.iter().any(|known| known.name == other.name) {
                let message = format!("the unit `{}` is not used by `{}`", other.name, pou.name);
                self.notes.push(Note { message, span: other.name.span() });
            }
        }
    }

    /// Brings the places of notes to letters of the file, and the notes into its order.
    pub(super) fn finish(&mut self, text: &str) {
        for note in &mut self.notes {
            within(text, &mut note.span);
        }
        self.notes.sort_by_key(|note| note.span.start);
        self.notes.dedup();
    }
}

/// Bodies that stand in an object.
fn inner(kind: &Kind) -> Vec<&Body> {
    match kind {
        Kind::Transition(transition) => match &transition.condition {
            Condition::Inline(body) => vec![body],
            _ => Vec::new(),
        },
        Kind::Actions(actions) => actions
            .iter()
            .filter_map(|action| match &action.content {
                ActionContent::Inline(body) => Some(body),
                _ => None,
            })
            .collect(),
        _ => Vec::new(),
    }
}
