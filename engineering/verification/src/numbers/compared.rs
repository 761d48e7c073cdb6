//! Comparisons of numbers, as BOOLs that properties name.

use std::collections::{BTreeSet, HashMap};

use understudy_bits::{System, Term};
use understudy_executable::typed_value;
use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;
use understudy_typed::{Declared, Elementary};

use crate::assumed::SO_FAR;
use crate::property::{Compared, Formula, Named, Property};
use crate::symbolic::Signal;

/// Comparisons that are none, by what is written of them: why, and what is written instead.
pub(super) type Refused = HashMap<String, (String, String)>;

/// The names of numbers in comparisons.
pub(super) fn names(compared: &[&Named]) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for named in compared {
        names.insert(named.name.clone());
        names.extend(named.compared.iter().map(|it| it.with.clone()));
    }
    names
}

/// Adds comparisons to the BOOLs of a system that was made with their [`names`].
pub(super) fn add(system: &mut System, compared: &[&Named]) -> Refused {
    let mut refused = Refused::new();
    for named in compared {
        let text = named.to_string();
        if let Some(with) = &named.compared
            && system.observed.iter().all(|(known, _)| *known != text)
            && let Err(why) = add_one(system, &text, named, with)
        {
            refused.insert(text, why);
        }
    }
    refused
}

/// What a refused comparison is told.
pub(super) fn diagnostic(named: &Named, (message, help): &(String, String)) -> Diagnostic {
    Diagnostic::error("U0435", message.clone(), named.span.clone()).with_help(help.clone())
}

/// The type of the number of this name, if there is one.
pub(super) fn type_of(system: &System, name: &str) -> Option<Elementary> {
    let inputs = system.inputs.iter().map(|input| (&input.name, input.of));
    let shown = system.shown.iter().map(|(name, term)| (name, system.terms.of(*term)));
    let mut numbers = inputs.chain(shown).filter(|(_, of)| *of != Elementary::Bool);
    numbers.find(|(known, _)| *known == name).map(|(_, of)| of)
}

/// What is told of a number that stands where a BOOL does.
pub(super) fn number_alone(system: &System, named: &Named) -> Option<Diagnostic> {
    let name = &named.name;
    let of = type_of(system, name).filter(|_| named.compared.is_none())?;
    let message = format!("`{name}` is {of}, and stands where a BOOL does");
    let help = format!("compare it: `{name} > …`, `{name} = …`");
    Some(Diagnostic::error("U0435", message, named.span.clone()).with_help(help))
}

fn add_one(
    system: &mut System,
    text: &str,
    named: &Named,
    compared: &Compared,
) -> Result<(), (String, String)> {
    let left = number(system, &named.name)?;
    let Compared { comparison, with } = compared;
    let of = system.terms.of(left);
    let known = system.enumerated.get(&named.name).cloned();
    if let Some(right) = system.number(with) {
        if let Some(known) = known.as_ref().filter(|known| known.value_named(with).is_some()) {
            let message = format!("`{with}` is a variable, and a value of {known}");
            let help = match known.values.as_ref().map_or("", |known| known.name.as_str()) {
                "" => "give one of them another name".to_owned(),
                name => format!("write the type in front of the value: `{name}#{with}`"),
            };
            return Err((message, help));
        }
        let other = system.terms.of(right);
        if other != of {
            let message =
                format!("`{}` is {of} and `{with}` is {other}: they are not compared", named.name);
            return Err((message, "compare numbers of one type".to_owned()));
        }
        system.compare(text, left, *comparison, right);
        return Ok(());
    }
    let declared = known.unwrap_or(of.into());
    let stored = value(&declared, with).map_err(|help| {
        let name = &named.name;
        (
            format!("`{with}` is no value of `{name}` : {declared}, and no number has this name"),
            help,
        )
    })?;
    system.compare_with_value(text, left, *comparison, stored);
    Ok(())
}

/// The number of this name, or what is there instead.
fn number(system: &System, name: &str) -> Result<Term, (String, String)> {
    let found = system.number(name);
    let is_bool = |term: Term| system.terms.of(term) == Elementary::Bool;
    if found.is_some_and(is_bool) {
        let help = format!("write `{name}`, `!{name}` or `{name} <-> other`");
        return Err((format!("`{name}` is a BOOL, and numbers are compared"), help));
    }
    found.ok_or_else(|| {
        let inputs = system.inputs.iter().filter(|input| input.of != Elementary::Bool);
        let inputs = inputs.map(|input| input.name.as_str());
        let known = inputs.chain(system.shown.iter().map(|(name, _)| name.as_str()));
        (format!("`{name}` is not a number of `{}`", system.name()), suggestion(name, known))
    })
}

/// The stored value of what is written, or what is written instead.
fn value(declared: &Declared, text: &str) -> Result<u64, String> {
    typed_value(text, declared).map_err(|help| match declared.of {
        Elementary::Time => "write a duration, such as 1.5s".to_owned(),
        Elementary::Date => "write a date, such as D#2024-02-29".to_owned(),
        Elementary::TimeOfDay => "write a time of day, such as TOD#12:34:56".to_owned(),
        Elementary::DateAndTime => {
            "write a date and a time, such as DT#2024-02-29-12:34:56".to_owned()
        }
        _ => help,
    })
}

/// Adds whether all assumptions have held so far to the BOOLs of a system; nothing where there are none. What is no assumption is left out.
pub(super) fn assume(system: &mut System, assumed: &[&Property]) -> Option<Signal> {
    let mut all = None;
    for property in assumed {
        if wrong_assumption(system, property).is_empty()
            && let Some(holds) = term(system, &property.formula)
        {
            all = Some(match all {
                Some(all) => system.terms.and(all, holds),
                None => holds,
            });
        }
    }
    system.keep_holding(SO_FAR, all?);
    Some(Signal::Output(system.observed.len() - 1))
}

/// What keeps a property from being an assumption.
pub(super) fn wrong_assumption(system: &System, assumed: &Property) -> Vec<Diagnostic> {
    assumed.wrong_assumption(&|named| is_of_inputs(system, named))
}

/// Whether what is named is an input, or compares inputs alone.
pub(super) fn is_of_inputs(system: &System, named: &Named) -> bool {
    let is_input = |name: &str| system.inputs.iter().any(|input| input.name == name);
    let with = named.compared.as_ref().map(|compared| compared.with.as_str());
    let other = with.filter(|with| system.number(with).is_some());
    is_input(&named.name) && other.is_none_or(is_input)
}

/// A formula of one scan over inputs.
fn term(system: &mut System, formula: &Formula<Named>) -> Option<Term> {
    Some(match formula {
        Formula::Constant(value) => system.terms.boolean(*value),
        Formula::Signal(named) => {
            let name = named.to_string();
            let observed = system.observed.iter().find(|(known, _)| *known == name);
            let input = || system.inputs.iter().find(|input| input.name == name);
            observed.map(|(_, term)| *term).or_else(|| Some(input()?.term))?
        }
        Formula::Not(inner) => {
            let inner = term(system, inner)?;
            system.terms.not(inner)
        }
        Formula::And(left, right) => {
            let (left, right) = (term(system, left)?, term(system, right)?);
            system.terms.and(left, right)
        }
        Formula::Or(left, right) => {
            let (left, right) = (term(system, left)?, term(system, right)?);
            system.terms.or(left, right)
        }
        Formula::Implies(left, right) => {
            let (left, right) = (term(system, left)?, term(system, right)?);
            let not = system.terms.not(left);
            system.terms.or(not, right)
        }
        Formula::Same(left, right) => {
            let (left, right) = (term(system, left)?, term(system, right)?);
            let not = system.terms.not(right);
            system.terms.choose(left, right, not)
        }
        _ => return None,
    })
}
