//! The cards of signals as they are written.

use toml::de::DeTable;
use understudy_text::Diagnostic;
use understudy_text::tables::{Constant, Value};

use crate::fields::{CODES, Fields, Placed};
use crate::format::{SIGNAL, SIGNALS};

/// The card of a signal.
#[derive(Debug)]
pub(crate) struct SignalSection {
    /// Controller and signal.
    pub(crate) name: Placed<String>,
    pub(crate) unit: Option<Placed<String>>,
    pub(crate) decimals: Option<Placed<u8>>,
    pub(crate) low: Option<Placed<Constant>>,
    pub(crate) high: Option<Placed<Constant>>,
    pub(crate) description: Option<Placed<String>>,
    pub(crate) group: Option<Placed<String>>,
}

/// All cards of a file.
pub(super) fn read(root: &DeTable<'_>, diagnostics: &mut Vec<Diagnostic>) -> Vec<SignalSection> {
    let Some(value) = root.get(SIGNALS) else {
        return Vec::new();
    };
    let expected = "a table from signals to cards, such as { \"tank.level\" = { unit = \"m\" } }";
    let entries = Value::new(SIGNALS, value, &CODES).entries(expected, diagnostics);
    let mut sections: Vec<SignalSection> = Vec::new();
    for (name, value) in entries {
        let table = value.table("a table, such as { unit = \"m\", decimals = 2 }", diagnostics);
        let Some(table) = table else {
            continue;
        };
        let name = name.map(str::to_owned);
        // `[signals.tank.level]` is a table in the table of a controller.
        let nested = table.value.iter().find(|(_, value)| value.get_ref().is_table());
        if let (Some((inner, _)), false) = (nested, name.value.contains('.')) {
            let message = format!("`{}` names no signal of a controller", name.value);
            let help = format!(
                "write the name in quotes: [signals.\"{}.{}\"]",
                name.value,
                inner.get_ref()
            );
            diagnostics.push(Diagnostic::error("U0209", message, name.span).with_help(help));
            continue;
        }
        let fields = Fields::new(&SIGNAL, table, diagnostics);
        sections.push(SignalSection {
            name,
            unit: fields.text("unit", diagnostics),
            decimals: fields.digits("decimals", diagnostics),
            low: fields.constant("low", diagnostics),
            high: fields.constant("high", diagnostics),
            description: fields.text("description", diagnostics),
            group: fields.text("group", diagnostics),
        });
    }
    sections.sort_by_key(|section| section.name.span.start);
    sections
}
