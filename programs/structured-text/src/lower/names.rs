//! Names: what they mean at a place.

use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use understudy_text::spelling;
use understudy_typed::{EnumerationId, Expression, ExpressionKind, Place, Root, Type};

use crate::syntax::{Class, Declaration, Name, Span, Unit};

use super::Lowering;
use super::constants::ConstantState;

/// Whose declarations are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Owner {
    pub(super) unit: usize,
    pub(super) method: Option<usize>,
}

/// Where an expression or a type stands.
#[derive(Clone, Default)]
pub(super) struct Scope {
    pub(super) unit: Option<usize>,
    pub(super) method: Option<usize>,
    /// The block on whose instance the body runs.
    pub(super) class: Option<usize>,
    /// The variables of the body; `None` where only constants are known.
    pub(super) symbols: Option<Rc<HashMap<String, Symbol>>>,
    /// The routine that is being lowered.
    pub(super) routine: u32,
    /// Loops around the statement.
    pub(super) loops: u32,
}

/// What a name means.
#[derive(Clone)]
pub(super) enum Symbol {
    Variable(Rc<Variable>),
    Constant(Constant),
    /// Its declaration has an error, which is reported.
    Faulty,
}

/// A variable in memory.
pub(super) struct Variable {
    pub(super) name: String,
    pub(super) root: Root,
    pub(super) of: Type,
    pub(super) class: Class,
    pub(super) is_constant: bool,
    /// It is an input point.
    pub(super) is_point: bool,
    /// The subrange that it is declared with, or that its elements are.
    pub(super) range: Option<(i128, i128)>,
    pub(super) span: Span,
}

impl Variable {
    pub(super) fn place(&self) -> Place {
        Place { range: self.range, ..Place::new(self.root, self.of.clone()) }
    }
}

/// A value that is known when the program is read.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Constant {
    /// A value without parts, as it is stored.
    Number(Type, u64),
    Text(u16, Arc<[u8]>),
}

impl Constant {
    pub(super) fn expression(&self) -> Expression {
        match self {
            Self::Number(of, value) => {
                Expression { of: of.clone(), kind: ExpressionKind::Constant(*value) }
            }
            Self::Text(capacity, bytes) => {
                Expression { of: Type::Text(*capacity), kind: ExpressionKind::Text(bytes.clone()) }
            }
        }
    }
}

impl<'a> Lowering<'a> {
    /// Goes to where only global names are known, and answers with the scope that was left.
    pub(super) fn leave_unit(&mut self) -> Scope {
        std::mem::take(&mut self.scope)
    }

    pub(super) fn owner(&self) -> Option<Owner> {
        let method = self.scope.method;
        self.scope.unit.map(|unit| Owner { unit, method })
    }

    pub(super) fn unit_of(&self, owner: Owner) -> &'a Unit {
        let unit = self.units[owner.unit].unit;
        match owner.method {
            Some(method) => &unit.methods[method],
            None => unit,
        }
    }

    /// The unit that a unit extends.
    pub(super) fn base_of(&self, unit: usize) -> Option<usize> {
        let base = self.units[unit].unit.extends.as_ref()?;
        let found = self.unit_names.get(&base.key()).copied();
        found.filter(|base| *base != unit)
    }

    /// What a variable's name means here.
    pub(super) fn lookup(&mut self, name: &Name) -> Option<Symbol> {
        let key = name.key();
        if let Some(symbols) = &self.scope.symbols {
            if let Some(symbol) = symbols.get(&key) {
                return Some(symbol.clone());
            }
        } else if let Some(symbol) = self.declared_constant(&key) {
            return Some(symbol);
        }
        let global = self.global(&key);
        if global.is_none() && self.scope.symbols.is_some() {
            return self.named_program(&key);
        }
        global
    }

    fn declared_constant(&mut self, key: &str) -> Option<Symbol> {
        let mut owner = self.owner();
        let mut most = self.units.len();
        while let Some(at) = owner {
            let declarations: &'a [Declaration] = &self.unit_of(at).declarations;
            let is_it = |found: &&Declaration| found.constant && found.name.is(key);
            if let Some(declaration) = declarations.iter().find(is_it) {
                return Some(self.constant_symbol(Some(at), declaration));
            }
            let base = self.base_of(at.unit).filter(|_| most > 0);
            most = most.saturating_sub(1);
            owner = match at.method {
                Some(_) => Some(Owner { unit: at.unit, method: None }),
                None => base.map(|unit| Owner { unit, method: None }),
            };
        }
        None
    }

    /// A global variable or constant.
    pub(super) fn global(&mut self, key: &str) -> Option<Symbol> {
        if let Some(declaration) = self.global_declarations.get(key).copied()
            && declaration.constant
        {
            match self.constant_symbol(None, declaration) {
                Symbol::Faulty if self.globals.contains_key(key) => {}
                symbol => return Some(symbol),
            }
        }
        self.globals.get(key).cloned()
    }

    /// The value of an enumeration that a name stands for; `None` where it is none.
    pub(super) fn enumerator(&mut self, name: &Name, hint: Option<&Type>) -> Option<Expression> {
        let known = self.enumerators.get(&name.key())?;
        let chosen = match hint {
            Some(Type::Enumeration(id, _)) => known.iter().find(|found| found.0 == *id),
            _ => None,
        };
        let (id, elementary, value) = *chosen.or(known.first())?;
        if chosen.is_none() && known.iter().any(|found| found.2 != value) {
            let types = known.iter().map(|(id, _, _)| self.enumeration_name(*id));
            let types: Vec<String> = types.collect();
            let message = format!("`{name}` is a value of {}", types.join(" and of "));
            let help = format!("write the type in front, such as `{}#{name}`", types[0]);
            self.error_with("U1041", message, name.span(), help);
        }
        Some(number(Type::Enumeration(id, elementary), value as u64 & elementary.mask()))
    }

    fn enumeration_name(&self, id: EnumerationId) -> String {
        let found = self.program.enumerations.get(id.0 as usize);
        found.map_or_else(String::new, |found| found.name.clone())
    }

    /// `Colour#red`
    pub(super) fn qualified(&mut self, of: &Name, value: &Name) -> Option<Expression> {
        let resolved = self.enumeration_named(of);
        let Some(Type::Enumeration(id, elementary)) = resolved else {
            let message = format!("`{of}` is not an enumeration");
            self.error("U1041", message, of.span());
            return None;
        };
        let known = self.enumerators.get(&value.key());
        let found = known.and_then(|known| known.iter().find(|found| found.0 == id));
        if let Some((_, _, found)) = found {
            let stored = *found as u64 & elementary.mask();
            return Some(number(Type::Enumeration(id, elementary), stored));
        }
        let values = &self.program.enumerations[id.0 as usize].values;
        let help =
            spelling::suggestion(value.as_str(), values.iter().map(|(name, _)| name.as_str()));
        let message = format!("`{of}` has no value `{value}`");
        self.error_with("U1041", message, value.span(), help);
        None
    }

    /// The enumeration of a name.
    pub(super) fn enumeration_named(&mut self, name: &Name) -> Option<Type> {
        if !self.types.contains_key(&name.key()) {
            return None;
        }
        let kind = crate::syntax::TypeKind::Named(name.clone());
        let span = name.span();
        let resolved = self.resolve(&crate::syntax::TypeName { kind, span })?;
        matches!(resolved.of, Type::Enumeration(..)).then_some(resolved.of)
    }

    /// Whether names here can be those of a base that is not known.
    pub(super) fn base_is_unknown(&self) -> bool {
        let mut unit = self.scope.class.or(self.scope.unit);
        // As many steps as there are units, where blocks extend each other in a circle.
        for _ in &self.units {
            let Some(found) = unit.filter(|unit| self.units[*unit].unit.extends.is_some()) else {
                return false;
            };
            unit = self.base_of(found);
            if unit.is_none() {
                return true;
            }
        }
        false
    }

    /// Reports a name that nothing has.
    pub(super) fn unknown_name(&mut self, name: &Name) {
        if self.base_is_unknown() && self.follows_an_error() {
            return;
        }
        let help = self.spelt_alike(name);
        let help = help.unwrap_or_else(|| "declare it, such as `VAR … : INT; END_VAR`".to_owned());
        let message = format!("`{name}` is not declared");
        self.error_with("U1041", message, name.span(), help);
    }

    /// The question whether a declared name that is spelt alike is meant.
    pub(super) fn spelt_alike(&self, name: &Name) -> Option<String> {
        let own = self.scope.symbols.iter().flat_map(|symbols| symbols.iter());
        let own = own.filter_map(|(_, symbol)| match symbol {
            Symbol::Variable(variable) => Some(variable.name.as_str()),
            _ => None,
        });
        let globals = self.global_declarations.values();
        let globals = globals.map(|declaration| declaration.name.as_str());
        let mut known: Vec<&str> = own.chain(globals).collect();
        known.sort_unstable();
        spelling::question(name.as_str(), known)
    }

    pub(super) fn constant_state(&mut self, key: (Option<Owner>, String)) -> Option<ConstantState> {
        self.constants.get(&key).cloned()
    }
}

/// A value of a type.
pub(super) fn number(of: Type, value: u64) -> Expression {
    Expression { of, kind: ExpressionKind::Constant(value) }
}
