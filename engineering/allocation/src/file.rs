//! Catalogue files: a model a line (`vendor,model,...,digital_inputs,...`), or a figure a line (`...,figure,value,source`).
//!
//! The first is what people type; a line's figures share its source. The second keeps a source for every figure and has the figures of
//! families too; it is what [`write()`] writes, and [`read`] of it gives the same catalogue again. The header says which of the two a
//! file is. Both are described in `docs/reference/catalogue.md`.

mod long;
mod wide;

use std::collections::BTreeMap;
use std::ops::Range;

use understudy_text::spelling::suggestion;
use understudy_text::{Diagnostic, Report, has_errors};

use crate::controller::{Catalogue, Controller, Kind};
use crate::csv::{Field, line, records};
use crate::figures::{Quantity, Statement};

/// Larger files are not read.
pub const MAXIMUM_TEXT_BYTES: usize = 16 << 20;

/// Longest name of a vendor, a model or a family, in bytes.
pub const MAXIMUM_NAME_LENGTH: usize = 200;

/// The result of reading a catalogue file.
#[derive(Debug)]
pub struct Loaded {
    /// Nothing where the file has an error.
    pub catalogue: Option<Catalogue>,
    /// Everything that is wrong with it.
    pub report: Report,
}

/// Reads a catalogue file.
pub fn read(name: &str, text: &str) -> Loaded {
    let mut wrong = Vec::new();
    let catalogue = if text.len() > MAXIMUM_TEXT_BYTES {
        let message = format!("the file is larger than {} MiB", MAXIMUM_TEXT_BYTES >> 20);
        wrong.push(Diagnostic::error("U1113", message, 0..0));
        Catalogue::default()
    } else {
        read_records(text, &mut wrong)
    };
    wrong.sort_by_key(|diagnostic| diagnostic.span.start);
    Loaded {
        catalogue: (!has_errors(&wrong)).then_some(catalogue),
        report: Report { name: name.to_owned(), text: text.to_owned(), diagnostics: wrong },
    }
}

fn read_records(text: &str, wrong: &mut Vec<Diagnostic>) -> Catalogue {
    let records = records(text, wrong);
    let Some((header, rows)) = records.split_first() else {
        let message = "a catalogue file begins with a line that names its columns";
        let help = format!("for example: {}", wide::HEADER.join(","));
        wrong.push(Diagnostic::error("U1102", message, 0..0).with_help(help));
        return Catalogue::default();
    };
    let is_long = header.iter().any(|field| field.text == "figure");
    let known: &[&str] = if is_long { &long::HEADER } else { &wide::HEADER };
    let required: &[&str] = if is_long { &long::REQUIRED } else { &wide::REQUIRED };
    let before = wrong.len();
    let columns = Columns::of(header, known, required, wrong);
    let is_missing = |name: &&str| !columns.places.contains_key(*name);
    if wrong.len() > before && required.iter().any(is_missing) {
        // Every line would lack what the header lacks.
        return Catalogue::default();
    }
    let rows = rows.iter().filter_map(|row| {
        if row.len() == header.len() {
            return Some(columns.row(row));
        }
        let message =
            format!("this line has {} fields, and the header {}", row.len(), header.len());
        let help = "quote fields that contain a comma";
        wrong.push(Diagnostic::error("U1102", message, whole(row)).with_help(help));
        None
    });
    let rows: Vec<Row> = rows.collect();
    if is_long { long::catalogue(&rows, wrong) } else { wide::catalogue(&rows, wrong) }
}

/// A catalogue as a file, a figure a line.
pub fn write(catalogue: &Catalogue) -> String {
    long::write(catalogue)
}

/// The place of a whole line.
fn whole(row: &[Field]) -> Range<usize> {
    let start = row.first().map_or(0, |field| field.span.start);
    start..row.last().map_or(start, |field| field.span.end)
}

/// Position of each known column.
struct Columns {
    places: BTreeMap<&'static str, usize>,
}

impl Columns {
    fn of(
        header: &[Field],
        known: &[&'static str],
        required: &[&'static str],
        wrong: &mut Vec<Diagnostic>,
    ) -> Self {
        let mut places = BTreeMap::new();
        for (place, field) in header.iter().enumerate() {
            let Some(&name) = known.iter().find(|name| **name == field.text) else {
                let message = format!("there is no column `{}`", field.text);
                let help = suggestion(&field.text, known.iter().copied());
                wrong.push(Diagnostic::error("U1103", message, field.span.clone()).with_help(help));
                continue;
            };
            if places.insert(name, place).is_some() {
                let message = format!("the column `{name}` occurs twice");
                wrong.push(Diagnostic::error("U1104", message, field.span.clone()));
            }
        }
        for name in required {
            if !places.contains_key(name) {
                let message = format!("the column `{name}` is missing");
                wrong.push(Diagnostic::error("U1103", message, whole(header)));
            }
        }
        Self { places }
    }

    fn row<'a>(&self, fields: &'a [Field]) -> Row<'a> {
        let places = self.places.iter();
        Row {
            fields: places.map(|(&name, &place)| (name, &fields[place])).collect(),
            span: whole(fields),
        }
    }
}

/// One line, by the names of its columns.
struct Row<'a> {
    fields: BTreeMap<&'static str, &'a Field>,
    span: Range<usize>,
}

impl Row<'_> {
    /// The text of a column; empty where the file has no such column.
    fn text(&self, column: &str) -> &str {
        self.fields.get(column).map_or("", |field| field.text.as_str())
    }

    /// The place of a column; the line where the file has no such column.
    fn span(&self, column: &str) -> Range<usize> {
        let field = self.fields.get(column);
        field.map_or_else(|| self.span.clone(), |field| field.span.clone())
    }

    /// A text that must be there, and is no longer than a name may be.
    fn name(&self, column: &'static str, wrong: &mut Vec<Diagnostic>) -> Option<String> {
        let text = self.text(column);
        let message = if text.is_empty() {
            format!("this line has no {column}")
        } else if text.len() > MAXIMUM_NAME_LENGTH {
            format!("the {column} is longer than {MAXIMUM_NAME_LENGTH} bytes")
        } else if text.chars().any(char::is_control) {
            format!("the {column} has a line end or another control character in it")
        } else {
            return Some(text.to_owned());
        };
        wrong.push(Diagnostic::error("U1105", message, self.span(column)));
        None
    }

    /// The model that the line is about, without figures.
    fn controller(&self, wrong: &mut Vec<Diagnostic>) -> Option<Controller> {
        let vendor = self.name("vendor", wrong);
        let model = self.name("model", wrong);
        let family = self.name("family", wrong);
        let kind = Kind::of(self.text("kind"));
        if kind.is_none() {
            let message = format!("`{}` is not a kind of controller", self.text("kind"));
            let diagnostic = Diagnostic::error("U1106", message, self.span("kind"));
            wrong.push(diagnostic.with_help(format!("expected {}", Kind::WORDS)));
        }
        Some(Controller::new(&vendor?, &model?, &family?, kind?))
    }
}

/// A number of a model, or what is wrong with it.
fn number(
    quantity: Quantity,
    text: &str,
    span: Range<usize>,
    wrong: &mut Vec<Diagnostic>,
) -> Option<u64> {
    let value = quantity.parse(text);
    if value.is_none() {
        let message = format!(
            "`{text}` is not a valid {quantity}: expected a number from 0 to {}",
            quantity.text(quantity.most())
        );
        let help = "leave the field empty if the figure is unknown";
        wrong.push(Diagnostic::error("U1107", message, span).with_help(help));
    }
    value
}

/// Prices are numbers of some currency.
fn price_has_currency(controller: &Controller, span: Range<usize>, wrong: &mut Vec<Diagnostic>) {
    let has_price = controller.numbers.contains_key(&Quantity::Price);
    if has_price && !controller.texts.contains_key(&Statement::Currency) {
        let message = format!("the price of {controller} has no currency");
        wrong.push(Diagnostic::error("U1110", message, span));
    }
}
