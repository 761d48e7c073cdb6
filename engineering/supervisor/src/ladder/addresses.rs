//! Where signals are in the PLC: the table `[addresses]` of maps, models and nets.

use toml::de::DeTable;
use understudy_ladder::{Address, Area, Name, Program, parse_address};
use understudy_text::Diagnostic;
use understudy_text::spelling;

use super::names::{ILLEGAL_NAME, is_legal};
use crate::form::Form;
use crate::model::Signal;

/// A signal with its address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Located {
    /// The signal.
    pub signal: Name,
    /// Its address, such as `%IX0.3`.
    pub address: Address,
}

impl Located {
    /// The same, not read from a text.
    #[must_use]
    pub fn without_place(self) -> Self {
        Self { signal: Name::from(self.signal.as_str()), ..self }
    }
}

/// Addresses under the key `addresses`; U0867 for an invalid one.
pub(crate) fn read_addresses(form: &mut Form<'_>, table: &DeTable) -> Vec<Located> {
    let entries = table.get("addresses").and_then(|value| form.table("addresses", value));
    let mut located = Vec::new();
    for (name, value) in entries.into_iter().flatten() {
        let Some(text) = form.string(name.get_ref(), value) else {
            continue;
        };
        match text.strip_prefix('%').and_then(parse_address) {
            Some(address) => located
                .push(Located { signal: Name::at(name.get_ref().as_ref(), name.span()), address }),
            None => form.diagnostics.push(
                Diagnostic::error(
                    "U0867",
                    format!("{text:?} is no address of a bit"),
                    value.span(),
                )
                .with_help("addresses look like %IX0.3, %QX1.0 or %MX2.7"),
            ),
        }
    }
    located.sort_by_key(|located| located.signal.span().start);
    located
}

/// Gives the signals of a program their addresses.
///
/// # Errors
/// U0866 a signal that the program does not have, U0867 an address of the wrong area or of two signals.
pub fn locate(program: &mut Program, addresses: &[Located]) -> Result<(), Vec<Diagnostic>> {
    let mut diagnostics = Vec::new();
    for (number, located) in addresses.iter().enumerate() {
        let Located { signal, address } = located;
        if let Some(first) = addresses[..number].iter().find(|first| first.address == *address) {
            let message =
                format!("{address} is the address of `{signal}` and of `{}`", first.signal);
            diagnostics.push(
                Diagnostic::error("U0867", message, signal.span())
                    .with_related(first.signal.span(), "the first is here"),
            );
        }
        let areas = [
            (Area::Input, &mut program.inputs),
            (Area::Output, &mut program.outputs),
            (Area::Memory, &mut program.memory),
        ];
        let found = areas.into_iter().find_map(|(area, signals)| {
            let declared = signals.iter_mut().find(|known| known.name == *signal)?;
            Some((area, declared))
        });
        match found {
            None => diagnostics.push(unknown(program, signal)),
            Some((area, _)) if area != address.area => {
                let message = format!(
                    "{address} is not the address of `{signal}`, which needs one of %{}X",
                    area.letter()
                );
                diagnostics.push(Diagnostic::error("U0867", message, signal.span()));
            }
            Some((_, declared)) => declared.address = Some(address.clone()),
        }
    }
    if diagnostics.is_empty() { Ok(()) } else { Err(diagnostics) }
}

fn unknown(program: &Program, signal: &Name) -> Diagnostic {
    let message = format!("the ladder has no signal `{signal}`");
    let known = program.inputs.iter().chain(&program.outputs);
    let near = spelling::question(signal, known.map(|known| known.name.as_str()));
    let mut diagnostic = Diagnostic::error("U0866", message, signal.span());
    diagnostic.help = near;
    diagnostic
}

/// Checks the signals of a model's events: U0855 an illegal name, U0856 one signal for two events in the same way.
pub(crate) fn check_signals(form: &mut Form<'_>, signals: &[Signal]) {
    for (number, signal) in signals.iter().enumerate() {
        let place = signal.signal.span();
        if !is_legal(&signal.signal) {
            let message = format!("{:?} cannot be a name in a ladder", signal.signal.as_str());
            form.diagnostics
                .push(Diagnostic::error("U0855", message, place.clone()).with_help(ILLEGAL_NAME));
        }
        let shared = |other: &&Signal| {
            let both_in = !signal.label.is_controllable() && !other.label.is_controllable();
            other.signal == signal.signal && !(both_in && other.when() != signal.when())
        };
        if let Some(other) = signals[..number].iter().find(shared) {
            let message = format!("`{}` is the signal of two events", signal.signal);
            form.diagnostics.push(
                Diagnostic::error("U0856", message, place)
                    .with_related(other.signal.span(), "the first is here")
                    .with_help(
                        "one uncontrollable event for `rising` and one for `falling` are possible",
                    ),
            );
        }
    }
}
