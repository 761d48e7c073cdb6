//! Which of several files belong together: those that use what another one declares.

use std::collections::{HashMap, HashSet};

use understudy_structured_text::print;
use understudy_structured_text::syntax::{Class, Declaration, File, TypeKind, Unit};

use super::{can_be_joined, is_part};
use crate::apart::words;
use crate::typed_text::parsed;

/// The files of each project among `files`, names with texts: two are of one project where one uses what the other declares and it does
/// not declare itself, and all parts of a TwinCAT project are. In the order of the files; a file that is alone is a group of one.
pub fn groups(files: &[(String, String)]) -> Vec<Vec<usize>> {
    let names: Vec<Names> = files.iter().map(|(name, text)| Names::of(name, text)).collect();
    let mut declaring: HashMap<&str, Vec<usize>> = HashMap::new();
    for (at, names) in names.iter().enumerate() {
        for name in &names.declared {
            declaring.entry(name).or_default().push(at);
        }
    }
    let mut group: Vec<usize> = (0..files.len()).collect();
    let join = |group: &mut Vec<usize>, one: usize, other: usize| {
        let (to, from) = (group[one].min(group[other]), group[one].max(group[other]));
        group.iter_mut().filter(|of| **of == from).for_each(|of| *of = to);
    };
    for (at, names) in names.iter().enumerate() {
        for name in names.used.difference(&names.declared) {
            for other in declaring.get(name.as_str()).into_iter().flatten() {
                join(&mut group, at, *other);
            }
        }
    }
    let parts: Vec<usize> = (0..files.len()).filter(|at| is_part(&files[*at].0)).collect();
    for pair in parts.windows(2) {
        join(&mut group, pair[0], pair[1]);
    }
    let members = |of: usize| (of..files.len()).filter(|at| group[*at] == of).collect::<Vec<_>>();
    (0..files.len()).map(members).filter(|members| !members.is_empty()).collect()
}

/// Names of a file, in capitals.
#[derive(Default)]
struct Names {
    /// Those that other files can use.
    declared: HashSet<String>,
    /// Those that it uses, its own variables left out.
    used: HashSet<String>,
}

impl Names {
    fn of(name: &str, text: &str) -> Self {
        let mut names = Self::default();
        if can_be_joined(name, text)
            && let Some((file, _)) = parsed(name, text)
        {
            names.declare(&file);
            names.r#use(&file);
        }
        names
    }

    fn declare(&mut self, file: &File) {
        let units = file.units.iter().map(|unit| &unit.name);
        let types = file.types.iter().map(|of| &of.name);
        let globals = file.globals.iter().map(|global| &global.name);
        let values = file.types.iter().flat_map(|of| match &of.of.kind {
            TypeKind::Enumeration(values, _) => values.as_slice(),
            _ => &[],
        });
        let values = values.map(|(name, _)| name);
        let interfaces = file.interfaces.iter();
        let all = units.chain(types).chain(globals).chain(values).chain(interfaces);
        self.declared.extend(all.map(|name| name.key()));
    }

    fn r#use(&mut self, file: &File) {
        for unit in &file.units {
            let own = own(unit);
            let used = words(&print::unit(unit));
            self.used.extend(used.into_iter().filter(|name| !own.contains(name)));
        }
        let rest = File { units: Vec::new(), ..file.clone() };
        self.used.extend(words(&print::file(&rest)));
    }
}

/// Variables of a unit that are its own.
fn own(unit: &Unit) -> HashSet<String> {
    let parts = std::iter::once(unit).chain(&unit.methods);
    let is_own = |declared: &&Declaration| declared.class != Class::External;
    let declared = parts.flat_map(|part| &part.declarations).filter(is_own);
    declared.map(|declared| declared.name.key()).collect()
}

#[cfg(test)]
mod tests {
    use super::groups;

    fn check(files: &[(&str, &str)], expected: &[&[usize]]) {
        let files: Vec<(String, String)> =
            files.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect();
        assert_eq!(groups(&files), expected);
    }

    const MAIN: &str = "PROGRAM main VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR VAR f : Lamp; END_VAR f(a := a); q := f.q; END_PROGRAM";
    const LAMP: &str = "FUNCTION_BLOCK Lamp VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR q := NOT a; END_FUNCTION_BLOCK";
    const OTHER: &str = "PROGRAM other VAR_INPUT lamp : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR q := lamp; END_PROGRAM";

    #[test]
    fn files_that_use_each_other_are_together() {
        check(&[("main.st", MAIN), ("lamp.st", LAMP)], &[&[0, 1]]);
        check(&[("lamp.st", LAMP), ("other.st", OTHER), ("main.st", MAIN)], &[&[0, 2], &[1]]);
        // What a file declares itself it does not use of another one.
        let both = format!("{LAMP} {MAIN}");
        check(&[("both.st", &both), ("lamp.st", LAMP)], &[&[0], &[1]]);
        let run = "CONFIGURATION c RESOURCE r ON p TASK t (INTERVAL := T#10ms); PROGRAM i WITH t : main; END_RESOURCE END_CONFIGURATION";
        check(&[("run.st", run), ("lamp.st", LAMP), ("main.st", MAIN)], &[&[0, 1, 2]]);
        let list = "VAR_GLOBAL limit : INT := 3; END_VAR";
        let reads = "PROGRAM p VAR_EXTERNAL limit : INT; END_VAR VAR_OUTPUT q : INT; END_VAR q := limit; END_PROGRAM";
        check(&[("a.st", reads), ("b.st", list)], &[&[0, 1]]);
        check(&[("a.ladder", "program a\n"), ("b.st", list)], &[&[0], &[1]]);
    }
}
