//! The tables of a cluster file as [`crate::format`] describes them: its keys, their types, bounds and defaults.
//!
//! Invariant: a value that leaves here has the type and the bounds of its [`Key`]; where the text has another one, that is
//! reported and the default goes on in its place, so that the rest is still checked.

mod command;
mod digits;

use std::collections::BTreeMap;
use std::net::{SocketAddr, SocketAddrV4};
use std::ops::Range;
use std::time::Duration;

use toml::de::DeTable;
use understudy_text::Diagnostic;
pub(crate) use understudy_text::tables::Placed;
use understudy_text::tables::{Codes, Constant, Value, unknown_key};

use crate::address::{
    Addresses, MAXIMUM_NAME_LENGTH, MULTICAST_GROUPS, is_multicast_range, is_name, why_unreachable,
};
use crate::format::{Key, Kind, OPERATOR_INPUT, POINT, SIGNAL_INPUT, Section};
use crate::place::{ByteOrder, Place, PlaceError, Registers, register};

/// Names of one place that are looked up and not found; those past it are only counted, so that no file takes long.
pub(crate) const MAXIMUM_MISFITS: usize = 100;

pub(crate) const CODES: Codes = Codes {
    no_toml: "U0201",
    unknown_key: "U0202",
    missing_key: "U0203",
    wrong_type: "U0204",
    out_of_bounds: "U0205",
    unknown_word: "U0207",
};

/// A signal with its place in a device.
#[derive(Debug)]
pub(crate) struct PlaceEntry {
    /// Where its name is.
    pub(crate) name: Range<usize>,
    /// Where its place is.
    pub(crate) span: Range<usize>,
    /// Nothing where it has errors.
    pub(crate) place: Option<Place>,
}

/// An input with its source, as it is written.
#[derive(Debug)]
pub(crate) struct SourceEntry {
    pub(crate) name: Placed<String>,
    pub(crate) source: SourceText,
}

/// Source of an input, as it is written.
#[derive(Debug)]
pub(crate) enum SourceText {
    /// Operators write it.
    Operator(OperatorText),
    /// It is an output of another program.
    Signal { from: Option<Placed<String>>, default: Option<Placed<Constant>>, stale_after: u32 },
}

/// An input that operators write, as it is written.
#[derive(Debug)]
pub(crate) struct OperatorText {
    pub(crate) span: Range<usize>,
    /// Index into [`crate::format::OPERATOR_INPUTS`]; nothing where it is absent.
    pub(crate) kind: Option<usize>,
    pub(crate) title: Option<String>,
    /// Index into [`crate::format::ROLES`].
    pub(crate) role: usize,
    pub(crate) confirm: bool,
    pub(crate) retain: bool,
    pub(crate) duration: Duration,
    pub(crate) low: Option<Placed<Constant>>,
    pub(crate) high: Option<Placed<Constant>>,
    pub(crate) unit: Option<String>,
    pub(crate) initial: Option<Placed<Constant>>,
    /// Keys that only some kinds have, with their places.
    pub(crate) special: Vec<Placed<&'static str>>,
}

/// How a device is reached, as it is written.
#[derive(Debug)]
pub(crate) enum ConnectionText {
    /// Modbus TCP.
    Tcp(SocketAddr),
    /// The terminal device of Modbus RTU.
    Rtu(String),
}

/// One table of the file.
pub(crate) struct Fields<'a, 't> {
    section: &'static Section,
    table: &'a DeTable<'t>,
    pub(crate) span: Range<usize>,
}

impl<'a, 't> Fields<'a, 't> {
    /// Reports the unknown and the missing keys at once.
    pub(crate) fn new(
        section: &'static Section,
        table: Placed<&'a DeTable<'t>>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Self {
        let Placed { value: table, span } = table;
        let known: Vec<&str> = section.keys.iter().map(|key| key.name).collect();
        for key in table.keys() {
            if !known.contains(&key.get_ref().as_ref()) {
                diagnostics.push(unknown_key(&CODES, &section.header(), key, &known));
            }
        }
        for key in section.keys {
            if key.required && !table.contains_key(key.name) {
                let message = format!("{} has no `{}`", section.header(), key.name);
                diagnostics.push(
                    Diagnostic::error("U0203", message, span.clone()).with_help(format!(
                        "add `{} = …`: {}",
                        key.name,
                        key.kind.expected()
                    )),
                );
            }
        }
        Self { section, table, span }
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.table.contains_key(name)
    }

    fn get(&self, name: &'static str) -> (&'static Key, Option<Value<'a, 't>>) {
        let value = self.table.get(name);
        let value = value.map(|value| Value::new(name, value, &CODES));
        (self.section.key(name), value)
    }

    /// Any text.
    pub(crate) fn text(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<String>> {
        let (key, value) = self.get(name);
        let text = value?.text_as(&key.kind.expected(), diagnostics)?;
        Some(text.map(str::to_owned))
    }

    /// The name of a member.
    pub(crate) fn name(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<String>> {
        let text = self.text(name, diagnostics)?;
        if !is_name(&text.value) {
            let message = format!("{:?} is no name", text.value);
            diagnostics.push(
                Diagnostic::error("U0206", message, text.span.clone()).with_help(format!(
                    "a name starts with a letter and has letters, digits, `-` and `_`, {MAXIMUM_NAME_LENGTH} at most"
                )),
            );
        }
        Some(text)
    }

    /// Where a member listens.
    pub(crate) fn addresses(
        &self,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Addresses<Placed<SocketAddr>> {
        Addresses {
            first: self.address("address", diagnostics),
            second: self.address("second_address", diagnostics),
            link: self
                .section
                .knows("link_address")
                .then(|| self.address("link_address", diagnostics))
                .flatten(),
        }
    }

    fn address(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<SocketAddr>> {
        let Placed { value, span } = self.text(name, diagnostics)?;
        match value.parse() {
            Ok(address) => {
                if let Some(why) = why_unreachable(address) {
                    let message = format!("{address} is not the address of one device: {why}");
                    let help = "the address and the port at which the others reach it";
                    diagnostics.push(Diagnostic::error("U0210", message, span).with_help(help));
                    return None;
                }
                Some(Placed { value: address, span })
            }
            Err(_) => {
                let message = format!("invalid address {value:?}");
                let expected = self.section.key(name).kind.expected();
                diagnostics.push(
                    Diagnostic::error("U0210", message, span)
                        .with_label(format!("expected {expected}"))
                        .with_help("a numeric host, a colon and a port; an IPv6 host is in brackets, as in [fd00::1]:7450"),
                );
                None
            }
        }
    }

    /// The first of the multicast groups of a cluster.
    pub(crate) fn multicast(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<SocketAddrV4> {
        let Placed { value, span } = self.text(name, diagnostics)?;
        let first = value.parse().ok();
        let first = first.filter(|first| is_multicast_range(*first));
        if first.is_none() {
            let message =
                format!("{value:?} is not the first of {MULTICAST_GROUPS} multicast groups");
            let help = "an IPv4 address from 224.0.0.0 to 239.255.255.223, a colon and a port; an organisation may assign 239.192.0.0 to 239.195.255.255";
            diagnostics.push(Diagnostic::error("U0210", message, span).with_help(help));
        }
        first
    }

    /// An address, or a serial line.
    pub(crate) fn connection(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<ConnectionText> {
        let (key, value) = self.get(name);
        let text = value?.text_as(&key.kind.expected(), diagnostics)?;
        match text.value.strip_prefix("rtu:") {
            Some(path) if path.starts_with('/') => Some(ConnectionText::Rtu(path.to_owned())),
            Some(path) => {
                let message = format!("{path:?} is not a path from the root");
                diagnostics
                    .push(Diagnostic::error("U0210", message, text.span).with_help(
                        "the terminal device of the line, such as \"rtu:/dev/ttyUSB0\"",
                    ));
                None
            }
            None => {
                self.address(name, diagnostics).map(|address| ConnectionText::Tcp(address.value))
            }
        }
    }

    /// Where the value of a key is; nothing where the key is absent.
    pub(crate) fn place_of(&self, name: &str) -> Option<Range<usize>> {
        self.table.get(name).map(|value| value.span())
    }

    /// A number in its bounds; its default where absent or wrong.
    fn number(&self, name: &'static str, diagnostics: &mut Vec<Diagnostic>) -> f64 {
        let (key, value) = self.get(name);
        let Kind::Number { most, default } = key.kind else {
            unreachable!("`{name}` is a number in its table");
        };
        let number = value.and_then(|value| value.number(-most..=most, diagnostics));
        number.map_or(default, |number| number.value)
    }

    /// A table from signals to places in a device.
    pub(crate) fn places(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> BTreeMap<String, PlaceEntry> {
        let entries = self.entries(name, diagnostics).into_iter();
        entries
            .map(|(name, value)| {
                let entry = PlaceEntry {
                    name: name.span,
                    span: value.span(),
                    place: place(value, diagnostics),
                };
                (name.value, entry)
            })
            .collect()
    }

    /// A whole number in its bounds; its default where absent or wrong.
    pub(crate) fn count(&self, name: &'static str, diagnostics: &mut Vec<Diagnostic>) -> u32 {
        let (key, value) = self.get(name);
        let Kind::Count { least, most, default } = key.kind else {
            unreachable!("`{name}` is a count in its table");
        };
        let bounds = u64::from(least)..=u64::from(most);
        let count = value.and_then(|value| value.count(bounds, diagnostics));
        count.map_or(default, |count| count.value as u32)
    }

    /// A time in its bounds; its default where absent or wrong.
    pub(crate) fn time(&self, name: &'static str, diagnostics: &mut Vec<Diagnostic>) -> Duration {
        let (key, value) = self.get(name);
        let Kind::Time { least, most, default } = key.kind else {
            unreachable!("`{name}` is a time in its table");
        };
        let time = value.and_then(|value| value.time(least..=most, diagnostics));
        time.map_or(default, |time| time.value)
    }

    /// The index of one of the words of the key; 0 where absent or wrong.
    pub(crate) fn word(&self, name: &'static str, diagnostics: &mut Vec<Diagnostic>) -> usize {
        let (key, value) = self.get(name);
        let Kind::Word { words, .. } = key.kind else {
            unreachable!("`{name}` is a word in its table");
        };
        let word = value.and_then(|value| value.word(words, diagnostics));
        word.map_or(0, |word| word.value)
    }

    /// The value of a signal.
    pub(crate) fn constant(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<Constant>> {
        self.get(name).1?.constant(diagnostics)
    }

    /// `true` or `false`; `false` where absent or wrong.
    pub(crate) fn flag(&self, name: &'static str, diagnostics: &mut Vec<Diagnostic>) -> bool {
        let value = self.get(name).1;
        let flag = value.and_then(|value| value.flag(diagnostics));
        flag.is_some_and(|flag| flag.value)
    }

    /// A table from inputs to their sources, in the order of its places.
    pub(crate) fn sources(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<SourceEntry> {
        let entries = self.entries(name, diagnostics).into_iter();
        let mut sources: Vec<SourceEntry> = entries
            .filter_map(|(name, value)| {
                let wanted = "a table, such as { operator = \"level\" }";
                let table = value.table(wanted, diagnostics)?;
                let source = source(table, diagnostics);
                Some(SourceEntry { name, source })
            })
            .collect();
        sources.sort_by_key(|entry| entry.name.span.start);
        sources
    }

    /// A table from names to values, in the order of its places.
    pub(crate) fn values(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<(Placed<String>, Constant)> {
        let entries = self.entries(name, diagnostics).into_iter();
        let mut values: Vec<_> = entries
            .filter_map(|(name, value)| Some((name, value.constant(diagnostics)?.value)))
            .collect();
        values.sort_by_key(|(name, _)| name.span.start);
        values
    }

    /// A table from names to names.
    pub(crate) fn names(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> BTreeMap<String, (Range<usize>, Placed<String>)> {
        let entries = self.entries(name, diagnostics).into_iter();
        entries
            .filter_map(|(name, value)| {
                let text = value.text_as("a name in quotes", diagnostics)?;
                Some((name.value, (name.span, text.map(str::to_owned))))
            })
            .collect()
    }

    fn entries(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<(Placed<String>, Value<'a, 't>)> {
        let (key, value) = self.get(name);
        let entries =
            value.map_or_else(Vec::new, |value| value.entries(&key.kind.expected(), diagnostics));
        let entries = entries.into_iter();
        entries.map(|(name, value)| (name.map(str::to_owned), value)).collect()
    }

    /// A table with keys of its own; an empty one where absent or wrong.
    pub(crate) fn table(
        &self,
        name: &'static str,
        section: &'static Section,
        empty: &'a DeTable<'t>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Fields<'a, 't> {
        let (key, value) = self.get(name);
        let table = value.and_then(|value| value.table(&key.kind.expected(), diagnostics));
        let empty = Placed { value: empty, span: self.span.clone() };
        Fields::new(section, table.unwrap_or(empty), diagnostics)
    }
}

/// A source of an input.
fn source(table: Placed<&DeTable<'_>>, diagnostics: &mut Vec<Diagnostic>) -> SourceText {
    if table.value.contains_key("from") {
        let fields = Fields::new(&SIGNAL_INPUT, table, diagnostics);
        return SourceText::Signal {
            from: fields.text("from", diagnostics),
            default: fields.constant("default", diagnostics),
            stale_after: fields.count("stale_after", diagnostics),
        };
    }
    let fields = Fields::new(&OPERATOR_INPUT, table, diagnostics);
    let before = diagnostics.len();
    let kind = fields.word("operator", diagnostics);
    let is_known = fields.has("operator") && diagnostics.len() == before;
    let text = |text: Option<Placed<String>>| text.map(|text| text.value);
    let special = ["duration", "low", "high", "unit", "retain"].into_iter();
    let special = special.filter_map(|value| {
        let span = fields.place_of(value)?;
        Some(Placed { value, span })
    });
    SourceText::Operator(OperatorText {
        kind: is_known.then_some(kind),
        title: text(fields.text("title", diagnostics)),
        role: fields.word("role", diagnostics),
        confirm: fields.flag("confirm", diagnostics),
        retain: fields.flag("retain", diagnostics),
        duration: fields.time("duration", diagnostics),
        low: fields.constant("low", diagnostics),
        high: fields.constant("high", diagnostics),
        unit: text(fields.text("unit", diagnostics)),
        initial: fields.constant("initial", diagnostics),
        special: special.collect(),
        span: fields.span.clone(),
    })
}

/// A place of a device, in the short or in the long form.
fn place(value: Value<'_, '_>, diagnostics: &mut Vec<Diagnostic>) -> Option<Place> {
    let Some(table) = value.as_table() else {
        let text = value.text_as("a place in quotes, or its table", diagnostics)?;
        let place = text.value.parse::<Place>();
        if let Err(error) = &place {
            let diagnostic = Diagnostic::error("U0222", error.to_string(), text.span);
            diagnostics.push(match error {
                PlaceError::Type(_) | PlaceError::Order(_) => diagnostic,
                _ => diagnostic.with_help(format!("write {}", Place::EXAMPLES)),
            });
        }
        return place.ok();
    };
    let before = diagnostics.len();
    let fields = Fields::new(&POINT, table, diagnostics);
    let at = fields.text("at", diagnostics);
    let first = at.as_ref().and_then(|at| {
        let first = register(&at.value);
        if first.is_none() {
            let message = format!("{:?} is not a register of a Modbus device", at.value);
            diagnostics.push(
                Diagnostic::error("U0222", message, at.span.clone())
                    .with_help("write \"input:10\" or \"holding:10\"; a BOOL has no table"),
            );
        }
        first
    });
    let of = fields.word("as", diagnostics);
    let order = fields.word("order", diagnostics);
    let scale = fields.number("scale", diagnostics);
    let offset = fields.number("offset", diagnostics);
    if scale == 0.0 {
        let span = fields.place_of("scale").unwrap_or_else(|| value.span());
        diagnostics.push(
            Diagnostic::error("U0205", "`scale` is 0", span)
                .with_help("each value of the signal needs a number of its own"),
        );
    }
    let (table, address) = first?;
    let registers = Registers {
        table,
        address,
        of: Registers::TYPES[of],
        order: ByteOrder::ALL[order],
        scale,
        offset,
    };
    if !registers.is_in_table() {
        let message = format!("`{registers}` ends behind register 65535");
        diagnostics.push(Diagnostic::error("U0222", message, value.span()));
    }
    (diagnostics.len() == before).then_some(Place::Number(registers))
}
