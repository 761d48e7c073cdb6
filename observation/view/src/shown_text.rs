//! The text of a program with numbers as a scan executed it: which lines, and the values in each line.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use serde_json::Value;
use understudy_typed::{Effect, Program, Trace, is_within_in_any_case};
use understudy_wire::ProgramId;

use crate::error::ViewError;
use crate::model::Model;
use crate::source_text::{Line, SourceText, Use};
use crate::value;

/// A line of a program's text, in one scan.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ShownLine {
    /// From 1.
    pub line: u32,
    /// The line of the file, from 1: the same for a text; of a document that of the element whose statement begins here.
    pub file_line: Option<u32>,
    /// As it is written.
    pub text: String,
    /// Whether a statement in it was executed.
    pub executed: bool,
    /// Whether the program fault of this scan occurred in it.
    pub failed: bool,
    /// The variables that it names, with their values after the scan; in the order of the text.
    pub values: Vec<NamedValue>,
}

/// A variable and its value.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct NamedValue {
    /// Its name, or a part of it, as the text has it.
    pub name: String,
    /// A BOOL as true or false, a number as a number, null where it is not finite, a time in nanoseconds.
    pub value: Value,
    /// Its type, such as `TIME`.
    #[serde(rename = "type")]
    pub of: String,
}

/// Where a variable is assigned and read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Uses {
    /// Its name.
    pub name: String,
    /// Its address, such as `%QW4`.
    pub address: Option<String>,
    /// Its description.
    pub description: Option<String>,
    /// Lines that assign it, from 1.
    pub written: Vec<u32>,
    /// Lines that read it, from 1.
    pub read: Vec<u32>,
}

impl Model {
    /// The text of a program with numbers and the values of a cycle; without values where the state is not known, which the second part says.
    /// Nothing for a Boolean program.
    pub fn text_at(
        &self,
        program: ProgramId,
        cycle: i64,
    ) -> Option<(Vec<ShownLine>, Option<ViewError>)> {
        let version = self.version_in(program, Some(cycle))?;
        let (typed, source) = (version.controller().code.typed(), version.text()?);
        Some(match self.trace(program, cycle) {
            Ok(trace) => (lines(typed, &source, Some(&trace)), None),
            Err(error) => (lines(typed, &source, None), Some(error)),
        })
    }

    /// The variables of a program with numbers, and the lines that use them, of the one that runs.
    pub fn uses(&self, program: ProgramId) -> Option<Vec<Uses>> {
        let version = self.version_in(program, None)?;
        let (typed, source) = (version.controller().code.typed(), version.text()?);
        let uses = typed.variables.iter().map(|variable| {
            let (mut written, mut read) = (BTreeSet::new(), BTreeSet::new());
            let numbered = (1..).zip(source.lines());
            for (number, line) in
                numbered.filter_map(|(number, line)| Some((source.file_line(number)?, line)))
            {
                for (name, kind) in line.names.iter().filter(|_| line.is_program) {
                    match (kind, is_of(line, name, &variable.name)) {
                        (Use::Written, true) => drop(written.insert(number)),
                        (Use::Read, true) => drop(read.insert(number)),
                        _ => {}
                    }
                }
            }
            Uses {
                name: variable.name.clone(),
                address: variable.address.clone(),
                description: variable.description.clone(),
                written: written.into_iter().collect(),
                read: read.into_iter().collect(),
            }
        });
        Some(uses.collect())
    }
}

/// Whether a name in a line is a variable or a part of it. Where a text has several programs, a variable stands behind the name of its program.
fn is_of(line: &Line<'_>, name: &str, variable: &str) -> bool {
    let behind_unit = || {
        let (unit, own) = variable.split_once('.')?;
        let is_own = line.unit.is_some_and(|it| it.eq_ignore_ascii_case(unit));
        is_own.then_some(own)
    };
    is_within_in_any_case(name, behind_unit().unwrap_or(variable))
}

fn lines(typed: &Program, source: &SourceText<'_>, trace: Option<&Trace>) -> Vec<ShownLine> {
    let mut executed = BTreeSet::new();
    let mut temporary = BTreeMap::new();
    for done in trace.iter().flat_map(|trace| &trace.done) {
        let routine = &typed.routine(done.routine).name;
        if !source.declares(routine) {
            continue;
        }
        // Of a line of a file with several statements.
        let target = match done.effect {
            Effect::Assigned { address, .. } if source.is_listing() => {
                typed.part_at(address).map(|part| part.name)
            }
            _ => None,
        };
        executed.extend(source.shown_line(done.line, target.as_deref()));
        // A variable of a frame has no name but in the text.
        if let Effect::Assigned { address, value: Some((of, stored)), .. } = done.effect
            && address / 64 >= u64::from(typed.state)
            && let Some(target) = source.assigned(done.line)
        {
            let key = (routine.to_lowercase(), target.to_lowercase());
            temporary.insert(key, (of, stored));
        }
    }
    let failed = trace.and_then(|trace| trace.fault);
    let failed = failed.filter(|fault| {
        let routine = fault.routine.map(|routine| &typed.routine(routine).name);
        routine.is_some_and(|routine| source.declares(routine))
    });
    let value = |line: &Line<'_>, name: &str| {
        let memory = &trace?.memory;
        let unit = line.unit.filter(|_| line.is_program)?;
        let behind_program = format!("{unit}.{name}");
        let part = typed.part(&behind_program).or_else(|| typed.part(name));
        let stored = part.and_then(|part| Some((part.declared()?, part.stored(memory)?.1)));
        let key = (unit.to_lowercase(), name.to_lowercase());
        stored.or_else(|| temporary.get(&key).map(|(of, stored)| ((*of).into(), *stored)))
    };
    let shown = (1..).zip(source.lines()).map(|(number, line)| {
        let mut values: Vec<NamedValue> = Vec::new();
        let shown = |kind| !matches!(kind, Use::Unit | Use::Parameter | Use::Typed);
        for (name, _) in line.names.iter().filter(|(_, kind)| shown(*kind)) {
            let known = values.iter().any(|known| known.name == *name);
            if let Some((declared, stored)) = value(line, name).filter(|_| !known) {
                let value = value::shown(&declared, stored);
                let of = declared.to_string();
                values.push(NamedValue { name: (*name).to_owned(), value, of });
            }
        }
        ShownLine {
            line: number,
            file_line: source.file_line(number),
            text: line.text.to_owned(),
            executed: executed.contains(&number),
            failed: failed.is_some_and(|fault| source.shown_line(fault.line, None) == Some(number)),
            values,
        }
    });
    shown.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_of_its_own_variable_alone() {
        let source = SourceText::new("PROGRAM level\n  inlet := level;\nEND_PROGRAM\n");
        let line = &source.lines()[1];
        assert!(is_of(line, "Level", "level") && is_of(line, "level.part", "level"));
        assert!(is_of(line, "level[2]", "level") && !is_of(line, "levels[2]", "level"));
        assert!(is_of(line, "inlet", "level.inlet"));
        // The program has the name of its variable.
        assert!(!is_of(line, "inlet", "level"));
        assert!(!is_of(line, "levels", "level") && !is_of(line, "inlet", "other.inlet"));
    }
}
