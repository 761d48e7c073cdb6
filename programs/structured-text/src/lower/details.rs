//! What declarations say besides types: subranges, and LTIME, LDATE, LTOD and LDT. These have the values of TIME and the like, so only the names of their
//! types differ.

use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use understudy_typed::{Detail, Program, Type};

use super::Lowering;
use super::types::StructureInfo;
use crate::syntax::{Declaration, File, TypeKind, UnitKind};

/// Names of the long types.
const LONG: [&str; 6] = ["LTIME", "LDATE", "LTOD", "LTIME_OF_DAY", "LDT", "LDATE_AND_TIME"];

/// Types within types, and types that stand for others.
const DEEPEST: usize = 64;

/// What a name of a type stands for.
struct Types<'f> {
    kinds: HashMap<String, &'f TypeKind>,
    /// The declarations of function blocks.
    blocks: HashMap<String, &'f [Declaration]>,
}

impl Lowering<'_> {
    /// Notes it of all points and variables of the program. One with errors is not used, and may be larger than any that is.
    pub(super) fn mark_details(&mut self, file: &File) {
        if understudy_text::has_errors(&self.diagnostics) {
            return;
        }
        let types =
            file.types.iter().map(|definition| (definition.name.key(), &definition.of.kind));
        let blocks = file.units.iter().filter(|unit| unit.kind == UnitKind::FunctionBlock);
        let types = Types {
            kinds: types.collect(),
            blocks: blocks.map(|unit| (unit.name.key(), unit.declarations.as_slice())).collect(),
        };
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
        let Program { inputs, outputs, .. } = &mut self.program;
        for points in [inputs, outputs] {
            points.declare_long(|point| point.of.is_time() && declared(&point.name));
        }
        let mut walk = Walk {
            program: &self.program,
            structures: &self.structures,
            is_long: &declared,
            details: BTreeMap::new(),
        };
        for variable in &self.program.variables {
            let range = self.ranges.get(&variable.name).copied();
            walk.part(variable.name.clone(), &variable.of, range);
        }
        self.program.details = walk.details;
    }
}

/// Goes through the parts of variables.
struct Walk<'w> {
    program: &'w Program,
    structures: &'w [Rc<StructureInfo>],
    is_long: &'w dyn Fn(&str) -> bool,
    details: BTreeMap<String, Detail>,
}

impl Walk<'_> {
    /// A variable or a part, with the subrange of its declaration; `name` has `[]` for all indices.
    fn part(&mut self, name: String, of: &Type, range: Option<(i128, i128)>) {
        match of {
            Type::Structure(id, _) => {
                let fields = self.program.structures[id.0 as usize].fields.iter();
                for field in fields.filter(|field| !field.is_reference) {
                    let range = self.structures[id.0 as usize].ranges.get(&field.slot).copied();
                    self.part(format!("{name}.{}", field.name), &field.of, range);
                }
            }
            Type::Array(array) => self.part(format!("{name}[]"), &array.element, range),
            _ => {
                let is_time = of.elementary().is_some_and(|of| of.is_time());
                let detail = Detail { range, is_long: is_time && (self.is_long)(&name) };
                if detail != Detail::default() {
                    self.details.insert(name, detail);
                }
            }
        }
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

fn is_long(kind: &TypeKind, path: &[&str], types: &Types<'_>, deep: usize) -> bool {
    let Some(deeper) = deep.checked_sub(1) else {
        return false;
    };
    match (kind, path) {
        (TypeKind::Named(name), _) => match (types.kinds.get(&name.key()), path) {
            (Some(of), _) => is_long(of, path, types, deeper),
            (None, []) => LONG.iter().any(|long| name.is(long)),
            (None, [first, rest @ ..]) => {
                let declarations = types.blocks.get(&name.key()).copied().unwrap_or_default();
                let found = declarations.iter().find(|declaration| declaration.name.is(first));
                found.is_some_and(|found| is_long(&found.of.kind, rest, types, deeper))
            }
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
