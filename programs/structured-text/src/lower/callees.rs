//! What a call calls: an instance of a block, a method, a function.

use understudy_typed::Type;

use crate::syntax::{Name, Path, Step, UnitKind};

use super::Lowering;
use super::names::{Owner, Symbol};
use super::places::{Target, shown};

/// What is called.
pub(super) enum Callee {
    /// The body of a block on an instance.
    Block(Target, usize),
    /// A method on an instance, which is of this block; none for the one on which the body runs.
    Method(Option<Target>, usize, Owner),
    Function(usize),
    Standard(String),
}

impl Lowering<'_> {
    /// What a call calls; `None` where an error is reported.
    pub(super) fn callee(&mut self, path: &Path) -> Option<Callee> {
        match path.steps.as_slice() {
            [] => self.named_callee(&path.root),
            [Step::Follow] if path.root.is("SUPER") || path.root.is("THIS") => {
                let own = self.own_block(&path.root)?;
                let unit = self.scope.unit?;
                let unit = match path.root.is("SUPER") {
                    true => self.base_or_error(unit, &path.root)?,
                    false => unit,
                };
                Some(Callee::Block(own, unit))
            }
            [.., Step::Field(name)] => self.part_callee(path, name),
            _ => self.instance(path),
        }
    }

    fn base_or_error(&mut self, unit: usize, word: &Name) -> Option<usize> {
        let base = self.base_of(unit);
        if base.is_none() {
            let message = format!("`{word}` stands in a block that extends none");
            self.error("U1041", message, word.span());
        }
        base
    }

    fn named_callee(&mut self, name: &Name) -> Option<Callee> {
        let key = name.key();
        if self.runs_by_itself(name)
            && let Some(&unit) = self.unit_names.get(&key)
        {
            return self.unit_callee(unit, name);
        }
        let symbol = self.lookup(name);
        let is_result = self.owner().is_some_and(|owner| {
            let unit = self.unit_of(owner);
            unit.result.is_some() && unit.name.is(&key)
        });
        if let (Some(symbol), false) = (&symbol, is_result) {
            return match symbol {
                Symbol::Faulty => {
                    self.blamed += 1;
                    None
                }
                _ => self.instance(&Path {
                    root: name.clone(),
                    steps: Vec::new(),
                    span: name.span(),
                }),
            };
        }
        if let Some(class) = self.scope.class
            && let Some(method) = self.method(class, &key)
        {
            return Some(Callee::Method(None, class, method));
        }
        let unit = self.unit_names.get(&key).copied();
        let is_own = |unit: &usize| !self.units[*unit].is_library;
        if let Some(unit) = unit.filter(is_own) {
            return self.unit_callee(unit, name);
        }
        if super::standard::is_standard(&key) || self.enumerated(name).is_some() {
            return Some(Callee::Standard(key));
        }
        if let Some(unit) = unit {
            return self.unit_callee(unit, name);
        }
        if self.base_is_unknown() && self.follows_an_error() {
            return None;
        }
        let units = self.units.iter();
        let known = units.filter(|entry| entry.unit.kind == UnitKind::Function);
        let known = known.map(|entry| entry.unit.name.as_str());
        let known = known.chain(super::standard::NAMES.iter().copied());
        let help = understudy_text::spelling::question(name.as_str(), known).unwrap_or_else(|| {
            "declare it with FUNCTION, or an instance of a block with VAR".into()
        });
        let message = format!("`{name}` is neither a function nor an instance of a block");
        self.error_with("U1041", message, name.span(), help);
        None
    }

    fn unit_callee(&mut self, unit: usize, name: &Name) -> Option<Callee> {
        match self.units[unit].unit.kind {
            UnitKind::Function => Some(Callee::Function(unit)),
            UnitKind::FunctionBlock => {
                let message = format!("`{name}` is a block, and is called through an instance");
                let help = format!(
                    "declare one, such as `VAR my_{0} : {name}; END_VAR`, and call it",
                    name.as_str().to_lowercase()
                );
                self.error_with("U1049", message, name.span(), help);
                None
            }
            _ => {
                let message =
                    format!("the PROGRAM `{name}` runs by itself, and cannot be called too");
                let help = "take it from its task, or write a FUNCTION_BLOCK in its place";
                self.error_with("U1040", message, name.span(), help);
                None
            }
        }
    }

    /// `a.b(…)`: an instance in a structure, or a method.
    fn part_callee(&mut self, path: &Path, name: &Name) -> Option<Callee> {
        let prefix = Path {
            root: path.root.clone(),
            steps: path.steps[..path.steps.len() - 1].to_vec(),
            span: path.span.clone(),
        };
        let is_super =
            prefix.root.is("SUPER") && matches!(prefix.steps.as_slice(), [] | [Step::Follow]);
        if is_super {
            self.own_block(&prefix.root)?;
            let unit = self.scope.unit?;
            let base = self.base_or_error(unit, &prefix.root)?;
            let class = self.scope.class?;
            if let Some(method) = self.method(base, &name.key()) {
                return Some(Callee::Method(None, class, method));
            }
            return self.no_method(base, name);
        }
        let is_global_list = prefix.steps.is_empty()
            && !prefix.root.is("THIS")
            && self.lookup(&prefix.root).is_none();
        if is_global_list {
            if let Some(Symbol::Variable(_)) = self.global(&name.key()) {
                return self.instance(path);
            }
            // A namespace, or a library, may stand in front.
            return self.named_callee(name);
        }
        let target = self.target(&prefix)?;
        if let Type::Structure(id, _) = target.of() {
            let info = self.structures[id.0 as usize].clone();
            if let Some(unit) = info.unit
                && !info.fields.contains_key(&name.key())
            {
                return match self.method(unit, &name.key()) {
                    Some(method) => Some(Callee::Method(Some(target), unit, method)),
                    None => self.no_method(unit, name),
                };
            }
        }
        self.instance(path)
    }

    fn no_method<T>(&mut self, unit: usize, name: &Name) -> Option<T> {
        let found = self.units[unit].unit;
        let methods = found.methods.iter().map(|method| method.name.as_str());
        let help = understudy_text::spelling::suggestion(name.as_str(), methods);
        let message = format!("`{}` has no method `{name}`", found.name);
        self.error_with("U1041", message, name.span(), help);
        None
    }

    /// A method of a block or of one that it extends.
    pub(super) fn method(&self, class: usize, key: &str) -> Option<Owner> {
        let mut unit = class;
        for _ in 0..=self.units.len() {
            let methods = &self.units[unit].unit.methods;
            if let Some(at) = methods.iter().position(|method| method.name.is(key)) {
                return Some(Owner { unit, method: Some(at) });
            }
            unit = self.base_of(unit)?;
        }
        None
    }

    fn instance(&mut self, path: &Path) -> Option<Callee> {
        let target = self.target(path)?;
        if let Type::Structure(id, _) = target.of()
            && let Some(unit) = self.structures[id.0 as usize].unit
        {
            return Some(Callee::Block(target, unit));
        }
        let found = self.describe(&target.of());
        let message = format!("`{}` is called, and is {found}", shown(path));
        let help = "call an instance of a function block, or remove the brackets";
        self.error_with("U1049", message, path.span.clone(), help);
        None
    }
}
