use std::collections::HashMap;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use understudy_text::tables::Codes;
use understudy_text::{Diagnostic, Report, has_errors};

use super::Model;
use super::component::read_component;
use crate::ads::read_ads;
use crate::alphabet::Alphabet;
use crate::automaton::Automaton;
use crate::events::Events;
use crate::form::{self, Form, Place};
use crate::format;
use crate::ladder::{check_signals, read_addresses};
use crate::petri::{Net, NetFile, buffers, read_net, reduce};

/// What was read from a model file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReadModel {
    /// The model; none where there are errors in it or in a file that it names.
    pub model: Option<Model>,
    /// What is wrong with it, in the order of the places.
    pub diagnostics: Vec<Diagnostic>,
    /// The files that it names, with what is wrong with them.
    pub files: Vec<Report>,
}

const CODES: Codes = Codes {
    no_toml: "U0820",
    unknown_key: "U0821",
    missing_key: "U0822",
    wrong_type: "U0823",
    out_of_bounds: "U0823",
    unknown_word: "U0823",
};

/// Nets of more markings need capacities to be plants.
const MAXIMUM_MARKINGS: usize = 1_000_000;

const ROLES: [&str; 3] = ["plant", "specification", "supervisor"];

/// Reads a model and finds everything that is wrong with it (U0820 to U0829); `load` gives the text of a file by the name that stands in
/// the model, or says why it cannot.
pub fn read_model(text: &str, mut load: impl FnMut(&str) -> Result<String, String>) -> ReadModel {
    let mut files = Vec::new();
    let (model, diagnostics) = form::read(text, &CODES, |form, table| {
        let mut loader = Loader { load: &mut load, files: &mut files };
        model(form, table, &mut loader)
    });
    let right = !has_errors(&diagnostics) && !files.iter().any(Report::has_errors);
    ReadModel { model: model.filter(|_| right), diagnostics, files }
}

/// Files named by a model.
pub(super) struct Loader<'l> {
    load: &'l mut dyn FnMut(&str) -> Result<String, String>,
    files: &'l mut Vec<Report>,
}

impl Loader<'_> {
    /// The name and the text of the file that `value` names.
    fn text(
        &mut self,
        form: &mut Form<'_>,
        key: &str,
        value: &Spanned<DeValue>,
    ) -> Option<(String, String)> {
        let path = form.string(key, value)?;
        match (self.load)(&path) {
            Ok(text) => Some((path, text)),
            Err(error) => {
                let message = format!("{path} cannot be read: {error}");
                form.error("U0829", message, value.span());
                None
            }
        }
    }

    /// The net of a file, with its file's name and its errors as a report.
    fn net(&mut self, form: &mut Form<'_>, value: &Spanned<DeValue>) -> Option<NetFile> {
        let (path, text) = self.text(form, "net", value)?;
        let read = read_net(&text);
        self.files.push(Report { name: path, text, diagnostics: read.diagnostics });
        read.file
    }

    /// The automaton of a file of TCT.
    pub(super) fn automaton(
        &mut self,
        form: &mut Form<'_>,
        value: &Spanned<DeValue>,
        name: Option<String>,
    ) -> Option<Automaton> {
        let (path, text) = self.text(form, "file", value)?;
        let read = read_ads(&text);
        self.files.push(Report { name: path, text, diagnostics: read.diagnostics });
        let automaton = read.automaton?;
        Some(match name {
            Some(name) => automaton.with_name(name),
            None => automaton,
        })
    }
}

fn model(form: &mut Form<'_>, table: &DeTable, loader: &mut Loader<'_>) -> Model {
    form.check_keys(table, &format::MODEL);
    let name = form.optional(table, "name").unwrap_or_default();
    let nets = nets(form, table, loader);
    let others = Alphabet::default().union(nets.values().map(|net| &net.events));
    let events = Events::read(form, table, &format::SIGNAL_EVENT, &others);
    check_signals(form, &events.signals);
    let addresses = read_addresses(form, table);
    let [plants, specifications, supervisors] = ROLES.map(|role| {
        let read = form.list(table, role, |form, component, place| {
            match component.get("net").filter(|_| role == ROLES[0]) {
                Some(value) => {
                    form.check_keys(component, &format::NET_PLANT);
                    let net = nets.get(&value.span().start);
                    net.map_or_else(Vec::new, |net| plants_of(form, net, value.span()))
                }
                None => {
                    let read = read_component(form, component, place, &events, loader);
                    read.into_iter().collect()
                }
            }
        });
        read.into_iter().flatten().collect::<Vec<_>>()
    });
    if ROLES.iter().all(|role| !table.contains_key(*role)) {
        let end = form.text.trim_end().len();
        let message = "the model has no [[plant]], [[specification]] or [[supervisor]]";
        form.error("U0822", message, end..end);
    }
    let all = plants.iter().chain(&specifications).chain(&supervisors);
    let alphabet = events.alphabet.union(all.map(Automaton::alphabet));
    let named = |automata: Vec<Automaton>| {
        let named = automata.into_iter();
        named.map(|one| one.with_event_names(&alphabet)).collect()
    };
    Model {
        name: name.to_string(),
        signals: events.signals,
        addresses,
        plants: named(plants),
        specifications: named(specifications),
        supervisors: named(supervisors),
        alphabet,
    }
}

/// The nets that are plants, by the place of their key.
fn nets(form: &mut Form<'_>, table: &DeTable, loader: &mut Loader<'_>) -> HashMap<usize, NetFile> {
    let plants = table.get("plant").and_then(|plants| plants.get_ref().as_array());
    let mut nets = HashMap::new();
    for plant in plants.into_iter().flatten() {
        let value = plant.get_ref().as_table().and_then(|plant| plant.get("net"));
        if let Some(value) = value
            && let Some(net) = loader.net(form, value)
        {
            nets.insert(value.span().start, net);
        }
    }
    nets
}

/// The places of a net, reduced, as buffers: steps 2 to 4 of the hybrid method. U0889 where that cannot be.
fn plants_of(form: &mut Form<'_>, file: &NetFile, place: Place) -> Vec<Automaton> {
    let (net, _) = reduce(&file.net);
    let made = bounds(&net).and_then(|bounds| {
        if let Some(silent) = net.transitions().iter().find(|one| one.label.is_none()) {
            return Err(format!("its transition `{}` is no event", silent.name));
        }
        buffers(&net, &bounds).map_err(|error| error.to_string())
    });
    match made {
        Ok(plants) => plants,
        Err(error) => {
            let message = format!("the net `{}` is no plant: {error}", net.name());
            form.error("U0889", message, place);
            Vec::new()
        }
    }
}

/// The most that each place can hold: its capacity where all have one, and else what the markings show.
fn bounds(net: &Net) -> Result<Vec<u32>, String> {
    let capacities: Option<Vec<u32>> = net.places().iter().map(|place| place.capacity).collect();
    match capacities {
        Some(capacities) => Ok(capacities),
        None => match net.explore(MAXIMUM_MARKINGS) {
            Ok(exploration) => Ok(exploration.bounds()),
            Err(error) => Err(error.to_string()),
        },
    }
}
