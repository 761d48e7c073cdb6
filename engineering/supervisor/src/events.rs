//! The events that a file declares: their names, their numbers, and by which signals of the PLC they are seen and made.

use std::collections::HashMap;
use understudy_text::tables::format::Table;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use understudy_ladder::Name;
use understudy_text::Diagnostic;

use crate::ads::MAXIMUM_LABEL;
use crate::alphabet::{Alphabet, Event, Label};
use crate::form::{Form, Place, Word};
use crate::labels::FreeLabels;
use crate::ladder::When;
use crate::model::Signal;

/// The events of a file by their names.
#[derive(Debug, Clone)]
pub(crate) struct Events {
    pub(crate) alphabet: Alphabet,
    labels: HashMap<String, Label>,
    pub(crate) signals: Vec<Signal>,
}

/// An event as far as it was read.
struct Declared {
    name: String,
    place: Place,
    label: Option<u32>,
    controllable: bool,
    signal: Option<Name>,
    when: Option<When>,
}

impl Events {
    /// Those of the table `events`, each in the form of `format`. Where no label is given it is the lowest free one that fits,
    /// in the order of the file; `others` are events that are known already, by the same names or by other ones.
    pub(crate) fn read(
        form: &mut Form<'_>,
        table: &DeTable,
        format: &Table,
        others: &Alphabet,
    ) -> Self {
        let mut entries: Vec<_> = match table.get("events") {
            None => Vec::new(),
            Some(value) => form.table("events", value).into_iter().flatten().collect(),
        };
        entries.sort_by_key(|(key, _)| key.span().start);
        let mut taken: HashMap<u32, Place> = HashMap::new();
        let mut declared = Vec::new();
        for (key, value) in entries {
            declared.extend(Declared::read(form, key, value, format, &mut taken));
        }
        let mut events =
            Self { alphabet: Alphabet::default(), labels: HashMap::new(), signals: Vec::new() };
        let mut named = Vec::new();
        for event in others.events() {
            events.labels.insert(event.name.clone(), event.label);
        }
        let mut free = FreeLabels::default();
        for event in declared {
            let known = events.labels.get(&event.name).copied();
            if let Some(known) = known
                && (known.is_controllable() != event.controllable
                    || event.label.is_some_and(|label| label != known.number()))
            {
                let message = format!("`{}` is event {known} of a net", event.name);
                form.error("U0827", message, event.place);
            }
            let label = event.label.or(known.map(Label::number)).unwrap_or_else(|| {
                let is_taken =
                    |number| taken.contains_key(&number) || others.contains(Label::new(number));
                free.take(event.controllable, is_taken).number()
            });
            let label = Label::new(label);
            events.signals.extend(event.signal.map(|signal| Signal {
                label,
                signal,
                when: event.when,
            }));
            events.labels.insert(event.name.clone(), label);
            named.push(Event { label, name: event.name });
        }
        events.alphabet = Alphabet::new(named.into_iter().chain(others.events().iter().cloned()));
        events
    }

    /// The event named by a word, or the error.
    pub(crate) fn find(&self, form: &mut Form<'_>, (name, place): &Word<'_>) -> Option<Label> {
        let label = self.get(name);
        if label.is_none() {
            form.error_near(
                "U0824",
                format!("there is no event {name}"),
                (name, place.clone()),
                self.labels.keys().map(String::as_str),
                Some("declare it under [events]".to_owned()),
            );
        }
        label
    }

    /// The event of that name.
    pub(crate) fn get(&self, name: &str) -> Option<Label> {
        self.labels.get(name).copied()
    }
}

impl Declared {
    fn read(
        form: &mut Form<'_>,
        key: &Spanned<std::borrow::Cow<'_, str>>,
        value: &Spanned<DeValue>,
        format: &Table,
        taken: &mut HashMap<u32, Place>,
    ) -> Option<Self> {
        let name = key.get_ref().to_string();
        if name.split_whitespace().count() != 1 {
            form.error("U0825", "the name of an event is one word", key.span());
        }
        let entry = form.table(key.get_ref(), value)?;
        form.check_keys(entry, format);
        let label = form.number(entry, "label", 0..=MAXIMUM_LABEL);
        let controllable = match form.flag(entry, "controllable") {
            Some(controllable) => controllable,
            None if entry.contains_key("controllable") => return None,
            None => match label {
                Some(label) => label % 2 == 1,
                None => {
                    if !entry.contains_key("label") {
                        form.missing("controllable", "an event", key.span());
                    }
                    return None;
                }
            },
        };
        if let (Some(number), Some(value)) = (label, entry.get("label")) {
            if (number % 2 == 1) != controllable {
                let message =
                    format!("label {number}: odd labels are controllable, even ones are not");
                form.error("U0827", message, value.span());
            } else if let Some(first) = taken.insert(number, value.span()) {
                let message = format!("label {number} stands for two events");
                let diagnostic = Diagnostic::error("U0827", message, value.span());
                form.diagnostics.push(diagnostic.with_related(first, "the other one"));
            }
        }
        Some(Self {
            name,
            place: key.span(),
            label,
            controllable,
            signal: form.optional(entry, "signal"),
            when: form.choice(entry, "when", &When::WORDS),
        })
    }
}
