//! The units of a file that a program uses.

use super::document::{Body, Pou, PouKind, Project, VariableType};

/// The unit and all units that it uses, itself first.
pub(crate) fn used<'a>(project: &'a Project, pou: &'a Pou) -> Vec<&'a Pou> {
    let mut used = vec![pou];
    let mut next = 0;
    while let Some(pou) = used.get(next).copied() {
        next += 1;
        for other in &project.pous {
            let is_new = !used.iter().any(|known| known.name == other.name);
            if is_new && other.kind != PouKind::Program && mentions(pou, &other.name) {
                used.push(other);
            }
        }
    }
    used
}

fn mentions(pou: &Pou, name: &str) -> bool {
    let typed = pou.variables.iter().any(|variable| {
        matches!(&variable.kind, VariableType::Derived(kind) if kind.eq_ignore_ascii_case(name))
    });
    let parts = pou.actions.iter().chain(&pou.transitions).filter_map(|part| part.body.as_ref());
    typed || pou.body.iter().chain(parts).any(|body| match body {
        Body::Graph(graph) => graph.objects.iter().any(|object| {
            matches!(&object.kind, super::document::Kind::Block(block) if block.type_name.eq_ignore_ascii_case(name))
        }),
        Body::StructuredText(text) | Body::InstructionList(text) => {
            words(text.as_str()).any(|word| word.eq_ignore_ascii_case(name))
        }
    })
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_')
}
