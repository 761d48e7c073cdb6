//! Which points are declared as LTIME, LDATE, LTOD or LDT. These have the values of TIME and the like, so only the names of their types differ.

use std::collections::HashMap;

use understudy_typed::Program;

use crate::syntax::{Declaration, File, TypeKind, UnitKind};

/// Their names.
const LONG: [&str; 6] = ["LTIME", "LDATE", "LTOD", "LTIME_OF_DAY", "LDT", "LDATE_AND_TIME"];

/// Types within types, and types that stand for others.
const DEEPEST: usize = 64;

/// Marks the points of a program that are declared so.
pub(super) fn mark(program: &mut Program, file: &File) {
    let types = file.types.iter().map(|definition| (definition.name.key(), &definition.of.kind));
    let types: HashMap<String, &TypeKind> = types.collect();
    let runs = file.instances.iter().map(|run| (run.name.key(), run.of.key()));
    let runs: HashMap<String, String> = runs.collect();
    let named = |declarations: &[Declaration], path: &[&str]| {
        let (first, rest) = path.split_first()?;
        let found = declarations.iter().find(|declaration| declaration.name.is(first))?;
        Some(is_long(&found.of.kind, rest, &types, DEEPEST))
    };
    let of_unit = |unit: Option<&str>, path: &[&str]| {
        let mut programs = file.units.iter().filter(|found| found.kind == UnitKind::Program);
        let mut programs =
            programs.by_ref().filter(|found| unit.is_none_or(|unit| found.name.is(unit)));
        programs.find_map(|found| named(&found.declarations, path))
    };
    let declared = |name: &str| {
        // Behind a blank stands an address.
        let name = name.split(' ').next().unwrap_or(name);
        let path = parts(name);
        // Of several programs each name stands behind that of the instance.
        let behind = path.split_first().and_then(|(first, rest)| {
            let unit = runs.get(&first.to_ascii_uppercase()).map_or(*first, String::as_str);
            of_unit(Some(unit), rest)
        });
        behind
            .or_else(|| of_unit(None, &path))
            .or_else(|| named(&file.globals, &path))
            .unwrap_or(false)
    };
    for points in [&mut program.inputs, &mut program.outputs] {
        points.declare_long(|point| point.of.is_time() && declared(&point.name));
    }
}

/// The names and indices of a path: `mot`, `wait`, `[0]` of `mot.wait[0]`.
fn parts(name: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    for part in name.split('.') {
        let at = part.find('[').unwrap_or(part.len());
        parts.push(&part[..at]);
        if at < part.len() {
            parts.push(&part[at..]);
        }
    }
    parts
}

fn is_long(
    kind: &TypeKind,
    path: &[&str],
    types: &HashMap<String, &TypeKind>,
    deep: usize,
) -> bool {
    let Some(deeper) = deep.checked_sub(1) else {
        return false;
    };
    match (kind, path) {
        (TypeKind::Named(name), _) => match types.get(&name.key()) {
            Some(of) => is_long(of, path, types, deeper),
            None => path.is_empty() && LONG.iter().any(|long| name.is(long)),
        },
        (TypeKind::Array(_, element), [_, rest @ ..]) => {
            is_long(&element.kind, rest, types, deeper)
        }
        (TypeKind::Structure(fields), [name, rest @ ..]) => {
            let field = fields.iter().find(|field| field.name.is(name));
            field.is_some_and(|field| is_long(&field.of.kind, rest, types, deeper))
        }
        _ => false,
    }
}
