//! A figure a line, each with its source. A line without a model is about its family.

use std::collections::HashMap;
use std::ops::Range;

use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;

use super::{Row, line, number, price_has_currency};
use crate::controller::{Catalogue, Family};
use crate::figures::{FamilyQuantity, Figure, Quantity, Statement};

pub(super) const HEADER: [&str; 8] =
    ["vendor", "model", "family", "kind", "figure", "value", "source", "notes"];

pub(super) const REQUIRED: [&str; 7] =
    ["vendor", "model", "family", "kind", "figure", "value", "source"];

pub(super) fn catalogue(rows: &[Row<'_>], wrong: &mut Vec<Diagnostic>) -> Catalogue {
    let mut catalogue = Catalogue::default();
    let mut seen: HashMap<[&str; 4], Range<usize>> = HashMap::new();
    for row in rows {
        let key = ["vendor", "model", "family", "figure"].map(|column| row.text(column));
        let figure = row.text("figure");
        if let Some(first) = seen.get(&key) {
            let message = if figure.is_empty() {
                "this line occurs twice".to_owned()
            } else {
                format!("the figure `{figure}` occurs twice")
            };
            let diagnostic = Diagnostic::error("U1108", message, row.span("figure"));
            wrong.push(diagnostic.with_related(first.clone(), "first occurrence"));
            continue;
        }
        seen.insert(key, row.span("figure"));
        if !figure.is_empty() && row.text("source").is_empty() {
            let message = "a figure without a source";
            wrong.push(Diagnostic::error("U1109", message, row.span("source")));
        }
        if row.text("model").is_empty() {
            family(row, &mut catalogue, wrong);
        } else {
            model(row, &mut catalogue, wrong);
        }
    }
    for controller in catalogue.rows() {
        let of_it = |row: &&Row<'_>| {
            row.text("vendor") == controller.vendor
                && row.text("model") == controller.model
                && row.text("figure") == Quantity::Price.name()
        };
        let place = rows.iter().find(of_it).map(|row| row.span.clone());
        price_has_currency(controller, place.unwrap_or_default(), wrong);
    }
    catalogue
}

fn family(row: &Row<'_>, catalogue: &mut Catalogue, wrong: &mut Vec<Diagnostic>) {
    for column in ["vendor", "kind"] {
        if !row.text(column).is_empty() {
            let message = format!("a line about a family has no {column}");
            let help = "a line about a model names the model";
            let diagnostic = Diagnostic::error("U1105", message, row.span(column));
            wrong.push(diagnostic.with_help(help));
        }
    }
    let name = row.name("family", wrong);
    let known = FamilyQuantity::ALL.map(FamilyQuantity::name);
    let text = row.text("figure");
    let Some(quantity) = FamilyQuantity::of(text) else {
        let message = format!("`{text}` is not a figure of a family");
        let diagnostic = Diagnostic::error("U1111", message, row.span("figure"));
        wrong.push(diagnostic.with_help(suggestion(text, known)));
        return;
    };
    let value = row.text("value");
    let Some(value) = FamilyQuantity::parse(value) else {
        let message = format!(
            "`{value}` is not a valid {quantity}: expected a number from 0 to {}",
            FamilyQuantity::MOST
        );
        wrong.push(Diagnostic::error("U1107", message, row.span("value")));
        return;
    };
    let Some(name) = name else { return };
    let mut family = Family { notes: row.text("notes").to_owned(), ..Family::default() };
    let source = row.text("source").to_owned();
    family.numbers.insert(quantity, Figure { value, source });
    catalogue.put_family(&name, family);
}

fn model(row: &Row<'_>, catalogue: &mut Catalogue, wrong: &mut Vec<Diagnostic>) {
    let Some(mut controller) = row.controller(wrong) else {
        return;
    };
    if let Some(known) = catalogue.get(&controller.vendor, &controller.model) {
        for (column, agree) in
            [("family", known.family == controller.family), ("kind", known.kind == controller.kind)]
        {
            if !agree {
                let message = format!("another line says another {column} of {known}");
                wrong.push(Diagnostic::error("U1112", message, row.span(column)));
            }
        }
    }
    let (figure, value) = (row.text("figure"), row.text("value"));
    let source = row.text("source").to_owned();
    if let Some(quantity) = Quantity::of(figure) {
        if let Some(value) = number(quantity, value, row.span("value"), wrong) {
            controller.numbers.insert(quantity, Figure { value, source });
        }
    } else if let Some(statement) = Statement::of(figure) {
        if value.is_empty() {
            let message = format!("no {statement} is said");
            wrong.push(Diagnostic::error("U1107", message, row.span("value")));
        }
        let value = value.to_owned();
        controller.texts.insert(statement, Figure { value, source });
    } else if !figure.is_empty() {
        let names: Vec<&str> = Quantity::ALL
            .map(Quantity::name)
            .into_iter()
            .chain(Statement::ALL.map(Statement::name))
            .collect();
        let message = format!("`{figure}` is not a figure of a controller");
        let diagnostic = Diagnostic::error("U1111", message, row.span("figure"));
        wrong.push(diagnostic.with_help(suggestion(figure, names)));
    }
    controller.notes = row.text("notes").to_owned();
    catalogue.put(controller);
}

/// Families first, then models; each figure with its source. The first line of a model, or of a family, has its notes.
pub(super) fn write(catalogue: &Catalogue) -> String {
    let mut text = line(&HEADER);
    for (name, family) in &catalogue.families {
        let mut notes = family.notes.as_str();
        for (quantity, figure) in &family.numbers {
            let value = figure.value.to_string();
            let fields = ["", "", name, "", quantity.name(), &value, &figure.source];
            push(&mut text, fields, &mut notes);
        }
    }
    for controller in catalogue.rows() {
        let mut notes = controller.notes.as_str();
        let numbers = controller.numbers.iter().map(|(quantity, figure)| {
            let value = quantity.text(figure.value);
            (quantity.name(), value, &figure.source)
        });
        let texts = controller.texts.iter().map(|(statement, figure)| {
            let value = figure.value.clone();
            (statement.name(), value, &figure.source)
        });
        let figures: Vec<_> = numbers.chain(texts).collect();
        let nothing = String::new();
        let none = [("", String::new(), &nothing)];
        let lines = if figures.is_empty() { &none[..] } else { &figures };
        for (name, value, source) in lines {
            let fields = [
                &controller.vendor,
                &controller.model,
                &controller.family,
                controller.kind.name(),
                name,
                value,
                source,
            ];
            push(&mut text, fields, &mut notes);
        }
    }
    text
}

fn push(text: &mut String, fields: [&str; 7], notes: &mut &str) {
    let mut fields = fields.to_vec();
    fields.push(std::mem::take(notes));
    text.push_str(&line(&fields));
}
