//! Paths: variables, their parts, elements and bits.

use std::rc::Rc;
use std::sync::Arc;

use understudy_typed::{
    Array, Elementary, Expression, ExpressionKind, Index, Operation, Place, Root, Type,
};

use crate::syntax::{self, Class, Name, Path, Span, Step};

use super::Lowering;
use super::blocks::Parameter;
use super::convert::{as_bits, is_whole};
use super::fold::{apply, convert, reinterpret};
use super::names::{Symbol, Variable};

/// What a path leads to.
#[derive(Clone)]
pub(super) struct Target {
    pub(super) place: Place,
    /// The part of the place that is meant: its type and lowest bit.
    pub(super) bits: Option<(Elementary, u8)>,
    variable: Option<Rc<Variable>>,
    /// The class of the part, in a block that is not the one whose body this is.
    part: Option<Class>,
}

impl Target {
    /// A part of a block's memory.
    pub(super) fn part(&self, parameter: &Parameter) -> Place {
        let mut place = self.place.clone();
        place.offset += parameter.slot;
        Place { of: parameter.of.clone(), range: parameter.range, ..place }
    }

    pub(super) fn of(&self) -> Type {
        match self.bits {
            Some((part, _)) => Type::Elementary(part),
            None => self.place.of.clone(),
        }
    }
}

/// What is stored at a place.
pub(super) fn load(place: Place) -> Expression {
    Expression { of: place.of.clone(), kind: ExpressionKind::Load(Box::new(place)) }
}

pub(super) fn place(root: Root, of: Type) -> Place {
    Place::new(root, of)
}

impl Lowering<'_> {
    /// The value of a path: a variable, a constant or a value of an enumeration.
    pub(super) fn variable(&mut self, path: &Path, hint: Option<&Type>) -> Option<Expression> {
        let mut symbol = self.root_symbol(&path.root);
        let mut steps = path.steps.as_slice();
        // A list of global variables may stand in front of a constant.
        if let (None, [Step::Field(name), rest @ ..]) = (&symbol, steps)
            && self.enumeration_named(&path.root).is_none()
            && let Some(found @ Symbol::Constant(_)) = self.global(&name.key())
        {
            (symbol, steps) = (Some(found), rest);
        }
        match (&symbol, steps) {
            (Some(Symbol::Constant(constant)), []) => return Some(constant.expression()),
            (Some(Symbol::Constant(constant)), [Step::Bits { width, number, span }]) => {
                let value = constant.expression();
                let (part, at) = self.bits(&value.of, *width, *number, span)?;
                return Some(extract(value, part, at));
            }
            (None, []) => {
                if let Some(value) = self.enumerator(&path.root, hint) {
                    return Some(value);
                }
                self.unknown_name(&path.root);
                return None;
            }
            (None, [Step::Field(value)]) if self.enumeration_named(&path.root).is_some() => {
                return self.qualified(&path.root, value);
            }
            _ => {}
        }
        let target = self.target_of(symbol, path)?;
        Some(self.value_of(target))
    }

    pub(super) fn value_of(&mut self, target: Target) -> Expression {
        let value = load(target.place);
        match target.bits {
            Some((part, at)) => extract(value, part, at),
            None => value,
        }
    }

    fn root_symbol(&mut self, root: &Name) -> Option<Symbol> {
        if root.as_str().starts_with('%') {
            return Some(self.direct(root));
        }
        self.lookup(root)
    }

    /// Where a path leads.
    pub(super) fn target(&mut self, path: &Path) -> Option<Target> {
        let before = self.blamed;
        let symbol = self.root_symbol(&path.root);
        let found = self.target_of(symbol, path);
        self.accounted(before, found, &path.span)
    }

    fn target_of(&mut self, symbol: Option<Symbol>, path: &Path) -> Option<Target> {
        let mut steps = path.steps.as_slice();
        let variable = match symbol {
            Some(Symbol::Faulty) => {
                self.blamed += 1;
                return None;
            }
            Some(Symbol::Constant(_)) => {
                let message = format!("`{}` is a constant", path.root);
                self.error("U1044", message, path.root.span());
                return None;
            }
            Some(Symbol::Variable(variable)) => variable,
            None if path.root.is("THIS") || path.root.is("SUPER") => {
                return self.own_part(path);
            }
            None => {
                // A list of global variables may stand in front, but no misspelt name of a variable.
                let global = match steps.first() {
                    Some(Step::Field(name)) if self.spelt_alike(&path.root).is_none() => {
                        self.global(&name.key())
                    }
                    _ => None,
                };
                let Some(Symbol::Variable(variable)) = global else {
                    self.unknown_name(&path.root);
                    return None;
                };
                steps = &steps[1..];
                variable
            }
        };
        let target =
            Target { place: variable.place(), bits: None, variable: Some(variable), part: None };
        self.follow(target, steps, path)
    }

    /// `THIS^.speed`
    fn own_part(&mut self, path: &Path) -> Option<Target> {
        let own = self.own_block(&path.root)?;
        let steps = match path.steps.as_slice() {
            [Step::Follow, rest @ ..] => rest,
            rest => rest,
        };
        let mut target = self.follow(own, steps, path)?;
        target.part = None;
        Some(target)
    }

    /// The instance on which the body runs.
    pub(super) fn own_block(&mut self, word: &Name) -> Option<Target> {
        let class = self.scope.class.filter(|_| self.scope.symbols.is_some());
        let Some(class) = class else {
            let message = format!("`{word}` has a meaning in function blocks only");
            self.error("U1041", message, word.span());
            return None;
        };
        let block = self.block(class, &word.span())?;
        Some(Target {
            place: place(Root::Own(0), block.of.clone()),
            bits: None,
            variable: None,
            part: None,
        })
    }

    fn follow(&mut self, mut target: Target, steps: &[Step], path: &Path) -> Option<Target> {
        let mut at = 0;
        while let Some(step) = steps.get(at) {
            if let Some((_, _)) = target.bits {
                let message = "a bit has no parts";
                self.error("U1043", message, path.span.clone());
                return None;
            }
            at += 1;
            match step {
                Step::Field(name) => self.field(&mut target, name)?,
                Step::Bits { width, number, span } => {
                    target.bits = Some(self.bits(&target.place.of, *width, *number, span)?)
                }
                Step::Index(first) => {
                    let mut indices: Vec<&syntax::Expression> = first.iter().collect();
                    while let Some(Step::Index(more)) = steps.get(at) {
                        indices.extend(more);
                        at += 1;
                    }
                    self.index(&mut target, &indices, &path.span)?;
                }
                Step::Follow => {
                    let message = "pointers are not supported, so there is nothing to follow";
                    let help = "remove `^`, or pass the variable as VAR_IN_OUT";
                    self.error_with("U1040", message, path.span.clone(), help);
                    return None;
                }
            }
        }
        Some(target)
    }

    fn field(&mut self, target: &mut Target, name: &Name) -> Option<()> {
        let Type::Structure(id, _) = target.place.of else {
            let found = self.describe(&target.place.of);
            let message = format!("`{name}` is sought in {found}, which has no parts");
            self.error("U1043", message, name.span());
            return None;
        };
        let info = self.structures[id.0 as usize].clone();
        let Some(&field) = info.fields.get(&name.key()) else {
            let of = target.place.of.clone();
            self.no_such_part(name, &of);
            return None;
        };
        let field = self.program.structures[id.0 as usize].fields[field].clone();
        if let Some(unit) = info.unit {
            let block = self.block(unit, &name.span())?;
            let member = block.members.get(&name.key());
            target.part = member.map(|member| member.class);
        }
        if field.is_reference {
            let message = format!("`{name}` is a VAR_IN_OUT, which belongs to a call");
            let help = "use the variable that the call is given";
            self.error_with("U1044", message, name.span(), help);
            return None;
        }
        target.place.offset += field.slot;
        target.place.of = field.of;
        target.place.range = info.ranges.get(&field.slot).copied();
        Some(())
    }

    fn bits(&mut self, of: &Type, width: u8, number: u32, span: &Span) -> Option<(Elementary, u8)> {
        let found = of.elementary().filter(|of| is_whole(*of));
        let Some(whole) = found else {
            let found = self.describe(of);
            let message = format!("{found} has no bits to be named");
            let help = "use a BYTE, WORD, DWORD or LWORD";
            self.error_with("U1043", message, span.clone(), help);
            return None;
        };
        let part = match width {
            8 => Elementary::Byte,
            16 => Elementary::Word,
            32 => Elementary::Dword,
            64 => Elementary::Lword,
            _ => Elementary::Bool,
        };
        let count = whole.bits() / part.bits();
        if number >= count || part.bits() == whole.bits() && number > 0 {
            let message =
                format!("part {number} of {whole}, which has parts 0 to {}", count.max(1) - 1);
            self.error("U1036", message, span.clone());
            return None;
        }
        Some((part, (number * part.bits()) as u8))
    }

    fn index(
        &mut self,
        target: &mut Target,
        indices: &[&syntax::Expression],
        span: &Span,
    ) -> Option<()> {
        let mut rest = indices;
        while !rest.is_empty() {
            let Type::Array(array) = &target.place.of else {
                let found = self.describe(&target.place.of);
                let message = format!("{found} has no elements");
                let help = match target.place.of {
                    Type::Text(_) => "use MID(text, 1, position) for a character",
                    _ => "remove the index",
                };
                self.error_with("U1043", message, span.clone(), help);
                return None;
            };
            let array: Arc<Array> = array.clone();
            let dimensions = array.ranges.len();
            if rest.len() < dimensions {
                let message =
                    format!("the array has {dimensions} dimensions, and {} are given", rest.len());
                self.error("U1043", message, span.clone());
                return None;
            }
            let (own, more) = rest.split_at(dimensions);
            self.element_of(target, &array, own)?;
            rest = more;
        }
        Some(())
    }

    fn element_of(
        &mut self,
        target: &mut Target,
        array: &Array,
        indices: &[&syntax::Expression],
    ) -> Option<()> {
        let mut strides = vec![array.stride(); indices.len()];
        for at in (1..indices.len()).rev() {
            let (low, high) = array.ranges[at];
            strides[at - 1] = strides[at].saturating_mul(high.abs_diff(low).saturating_add(1));
        }
        let mut bits = u64::from(target.place.bit);
        for ((index, stride), (low, high)) in indices.iter().zip(strides).zip(&array.ranges) {
            let long = Type::Elementary(Elementary::Lint);
            let value = self.used(index, Some(&long))?;
            let Some(of) = value.of.elementary().filter(|of| is_whole(*of)) else {
                let found = self.describe(&value.of);
                let message = format!("an index is a whole number, and this is {found}");
                self.error("U1043", message, index.span.clone());
                return None;
            };
            if let ExpressionKind::Constant(stored) = value.kind {
                let at = of.signed(stored);
                if at < i128::from(*low) || at > i128::from(*high) {
                    let message = format!("index {at} is outside the array: {low} to {high}");
                    self.error("U1036", message, index.span.clone());
                    return None;
                }
                bits = bits.saturating_add(((at - i128::from(*low)) as u64).saturating_mul(stride));
                continue;
            }
            target.place.indices.push(Index {
                value: convert(value, Elementary::Lint),
                low: *low,
                high: *high,
                stride,
            });
        }
        target.place.offset = target.place.offset.saturating_add((bits / 64) as u32);
        target.place.bit = (bits % 64) as u32;
        target.place.is_packed = array.element.elementary().is_some();
        target.place.of = array.element.clone();
        Some(())
    }

    /// Whether a statement may write there; what is legal and unusual is a warning.
    pub(super) fn writable(&mut self, target: &Target, path: &Path) -> Option<()> {
        if let Some(variable) = &target.variable
            && variable.is_constant
        {
            let message = format!("`{}` is a constant", variable.name);
            let found = understudy_text::Diagnostic::error("U1044", message, path.span.clone());
            let found =
                found.with_help("remove CONSTANT from its declaration, or write another variable");
            let found = found.with_related(variable.span.clone(), "declared here");
            self.report(found);
            return None;
        }
        match target.part {
            Some(Class::Local | Class::Temporary | Class::Static) => {
                let message = format!("`{}` is an internal variable of the block", shown(path));
                let help = "declare it as VAR_INPUT of the block, and give it in the call";
                self.warn("U1081", message, path.span.clone(), help);
            }
            Some(Class::Output) => {
                let message =
                    format!("`{}` is an output, which the block writes itself", shown(path));
                let help = "use a VAR_INPUT of the block";
                self.warn("U1081", message, path.span.clone(), help);
            }
            Some(_) => {}
            None => {
                let variable = target.variable.as_ref();
                let variable =
                    variable.filter(|found| found.class == Class::Input || found.is_point);
                if let Some(variable) = variable {
                    let message = format!("`{}` is an input, and is written here", variable.name);
                    let help = match variable.is_point {
                        true => "the next scan reads it again: use a variable of its own",
                        false => "use a variable of its own",
                    };
                    self.warn("U1081", message, path.span.clone(), help);
                }
            }
        }
        Some(())
    }
}

/// Bits of a value.
fn extract(value: Expression, part: Elementary, at: u8) -> Expression {
    let whole = value.of.elementary().unwrap_or(Elementary::Lword);
    let from = as_bits(whole);
    let value = reinterpret(value, from);
    if part == from {
        return value;
    }
    let operation = Operation::Extract { from, to: part, at };
    apply(operation, vec![value], Type::Elementary(part))
}

/// A value with some of its bits replaced.
pub(super) fn insert(old: Expression, value: Expression, part: Elementary, at: u8) -> Expression {
    let whole = old.of.elementary().unwrap_or(Elementary::Lword);
    let of = as_bits(whole);
    if part == of {
        return reinterpret(value, whole);
    }
    let operands = vec![reinterpret(old, of), value];
    let value = apply(Operation::Insert { of, part, at }, operands, Type::Elementary(of));
    reinterpret(value, whole)
}

/// A path as it is written, with its indices left out.
pub(super) fn shown(path: &Path) -> String {
    let mut text = path.root.as_str().to_owned();
    for step in &path.steps {
        match step {
            Step::Field(name) => {
                text.push('.');
                text.push_str(name.as_str());
            }
            Step::Index(_) => text.push_str("[…]"),
            Step::Bits { number, .. } => text.push_str(&format!(".{number}")),
            Step::Follow => text.push('^'),
        }
    }
    text
}
