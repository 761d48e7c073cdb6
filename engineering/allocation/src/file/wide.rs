//! A model a line; all figures of a line have its source.

use std::collections::HashMap;
use std::ops::Range;

use understudy_text::Diagnostic;

use super::{Row, number, price_has_currency};
use crate::controller::Catalogue;
use crate::figures::{Figure, Quantity, Statement};

/// Columns; those of figures may be left out.
pub(super) const HEADER: [&str; 28] = [
    "vendor",
    "model",
    "family",
    "kind",
    "digital_inputs",
    "digital_outputs",
    "analog_in",
    "analog_out",
    "program_memory_bytes",
    "data_memory_bytes",
    "timers",
    "counters",
    "bool_instruction_ns",
    "comm_ports",
    "max_expansion_io",
    "expansion_modules",
    "languages",
    "price",
    "currency",
    "clock_khz",
    "address_bus_bits",
    "data_bus_bits",
    "mtbf_hours",
    "support",
    "support_software",
    "accessories",
    "source_url",
    "notes",
];

pub(super) const REQUIRED: [&str; 5] = ["vendor", "model", "family", "kind", "source_url"];

pub(super) fn catalogue(rows: &[Row<'_>], wrong: &mut Vec<Diagnostic>) -> Catalogue {
    let mut catalogue = Catalogue::default();
    let mut seen: HashMap<(&str, &str), Range<usize>> = HashMap::new();
    for row in rows {
        let source = row.text("source_url");
        let mut numbers = Vec::new();
        for quantity in Quantity::ALL {
            let text = row.text(quantity.name());
            if !text.is_empty() {
                let value = number(quantity, text, row.span(quantity.name()), wrong);
                numbers.extend(value.map(|value| (quantity, figure(value, source))));
            }
        }
        let texts = Statement::ALL.into_iter().filter_map(|statement| {
            let text = row.text(statement.name());
            (!text.is_empty()).then(|| (statement, figure(text.to_owned(), source)))
        });
        let texts: Vec<_> = texts.collect();
        if source.is_empty() && !(numbers.is_empty() && texts.is_empty()) {
            let message = "figures without a source";
            wrong.push(Diagnostic::error("U1109", message, row.span("source_url")));
        }
        let Some(mut controller) = row.controller(wrong) else {
            continue;
        };
        controller.numbers.extend(numbers);
        controller.texts.extend(texts);
        controller.notes = row.text("notes").to_owned();
        price_has_currency(&controller, row.span("price"), wrong);
        let key = (row.text("vendor"), row.text("model"));
        if let Some(first) = seen.get(&key) {
            let message = format!("{controller} stands twice");
            let diagnostic = Diagnostic::error("U1108", message, row.span("model"));
            wrong.push(diagnostic.with_related(first.clone(), "first occurrence"));
            continue;
        }
        seen.insert(key, row.span("model"));
        catalogue.put(controller);
    }
    catalogue
}

fn figure<T>(value: T, source: &str) -> Figure<T> {
    Figure { value, source: source.to_owned() }
}
