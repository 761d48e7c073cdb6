//! Scenario files: TOML text in, a [`Scenario`] and everything that is wrong with the text out.
//!
//! | code | what is wrong |
//! |---|---|
//! | U0301 | the text is no TOML |
//! | U0302 | a key that no scenario has |
//! | U0303 | a key that is missing |
//! | U0304 | a value of another type than expected |
//! | U0305 | a number out of its bounds |
//! | U0306 | an action or a source that does not exist |
//! | U0307 | a name that the cluster does not have |
//! | U0308 | a step that cannot be done in the state in which the party is then |
//! | U0309 | an action that does not fit its party |
//! | U0310 | a range of cycles that is empty or past the end |

mod steps;

use std::ops::Range;

use toml::de::DeTable;
use understudy_diagnostic::spelling::suggestion;
use understudy_diagnostic::{Diagnostic, Report, has_errors};
use understudy_simulator::{Disturbance, Network};
use understudy_wire::{Party, ProgramId, Source};

use crate::fields::Fields;
use crate::parties::Parties;
use crate::scenario::{During, Expectation, SOURCES, Scenario, source_word};

/// Cycles of one scenario, at most.
pub const MAXIMUM_CYCLES: u64 = 100_000_000;

/// Steps of one scenario, at most.
pub const MAXIMUM_STEPS: usize = 10_000;

/// A scenario file that was read.
#[derive(Debug, Clone)]
pub struct ReadScenario {
    /// Nothing where the report has errors.
    pub scenario: Option<Scenario>,
    /// The text and what was found in it.
    pub report: Report,
}

/// Reads the text of a scenario file; `parties` are those of the cluster that it is for.
///
/// Without a cluster, names are not known: then names are taken as they come and the scenario is only checked, not answered.
pub fn read(name: &str, text: &str, parties: Option<&Parties>) -> ReadScenario {
    let mut reader = Reader {
        parties,
        diagnostics: Vec::new(),
    };
    let (table, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let place = error.span().unwrap_or(text.len()..text.len());
        let message = format!("this is no TOML: {}", error.message());
        reader
            .diagnostics
            .push(Diagnostic::error("U0301", message, place));
    }
    // What the recovery made of a broken text would only bring errors that follow from the first ones.
    let scenario = if errors.is_empty() {
        reader.scenario(Fields::new(table.get_ref(), 0..0, "a scenario"))
    } else {
        None
    };
    let mut diagnostics = reader.diagnostics;
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span.start, diagnostic.span.end));
    ReadScenario {
        scenario: scenario.filter(|_| parties.is_some() && !has_errors(&diagnostics)),
        report: Report {
            name: name.to_owned(),
            text: text.to_owned(),
            diagnostics,
        },
    }
}

/// Whether a TOML text looks like a scenario rather than like another file of this project.
pub fn looks_like_a_scenario(text: &str) -> bool {
    let (table, _) = DeTable::parse_recoverable(text);
    ["step", "expect", "cycles"]
        .iter()
        .any(|key| table.get_ref().contains_key(*key))
}

/// Frames, bits and ages of a step, at most.
pub(crate) const MAXIMUM_NUMBER: u16 = 1000;

struct Reader<'p> {
    parties: Option<&'p Parties>,
    diagnostics: Vec<Diagnostic>,
}

impl Reader<'_> {
    fn scenario(&mut self, mut fields: Fields<'_, '_>) -> Option<Scenario> {
        let found = &mut self.diagnostics;
        let title = fields.text("title", found);
        let title = fields.required("title", title, found);
        let cycles = fields.count("cycles", found);
        let cycles = fields.required("cycles", cycles, found);
        let cycles = cycles.and_then(|(cycles, place)| {
            if (1..=MAXIMUM_CYCLES).contains(&cycles) {
                return Some(cycles);
            }
            let message = format!("{cycles} cycles: there must be 1 to {MAXIMUM_CYCLES}");
            found.push(Diagnostic::error("U0305", message, place));
            None
        });
        // Later checks need some end; an unknown one must not bring further errors.
        let end = cycles.unwrap_or(MAXIMUM_CYCLES);
        let seed = fields.count("seed", found);
        let steps = fields.tables("step", "a step", found);
        let network = fields.table("network", "the network", found);
        let expect = fields.table("expect", "the expectation", found);
        fields.finish(found);
        let steps = self.steps(steps, end);
        let disturbance = network.map(|network| self.network(network, end));
        let expect =
            expect.map_or_else(Expectation::default, |expect| self.expectation(expect, end));
        Some(Scenario {
            title: title?.0.to_owned(),
            cycles: cycles?,
            seed: seed.map(|(seed, _)| seed),
            steps,
            network: disturbance.as_ref().map(|disturbance| disturbance.network),
            network_cycles: disturbance.and_then(|disturbance| disturbance.cycles),
            expect,
        })
    }

    fn network(&mut self, mut fields: Fields<'_, '_>, end: u64) -> Disturbance {
        let found = &mut self.diagnostics;
        let usual = Network::default();
        let latency = fields.duration("latency", found);
        let jitter = fields.duration("jitter", found);
        let mut share = |key| fields.share(key, found).map_or(0.0, |(share, _)| share);
        let network = Network {
            loss: share("loss"),
            duplicate: share("duplicate"),
            corruption: share("corruption"),
            latency: latency.map_or(usual.latency, |(latency, _)| latency),
            jitter: jitter.map_or(usual.jitter, |(jitter, _)| jitter),
        };
        let from = fields.count("from", found);
        let to = fields.count("to", found);
        let place = fields.place();
        fields.finish(found);
        let cycles = (from.is_some() || to.is_some()).then(|| {
            let place = to
                .as_ref()
                .or(from.as_ref())
                .map_or(place, |(_, place)| place.clone());
            let from = from.map_or(0, |(from, _)| from);
            let to = to.map_or(end, |(to, _)| to);
            self.range(from, to, end, place)
        });
        Disturbance { network, cycles }
    }

    /// A range of cycles; an error where it is empty or past the end.
    fn range(&mut self, from: u64, to: u64, end: u64, place: Range<usize>) -> Range<u64> {
        if from >= to || to > end {
            let why = if from >= to {
                "no cycle"
            } else {
                "past the end"
            };
            let message =
                format!("cycles {from} up to, not including, {to} of a run of {end}: {why}");
            self.diagnostics
                .push(Diagnostic::error("U0310", message, place));
        }
        from..to
    }

    fn expectation(&mut self, mut fields: Fields<'_, '_>, end: u64) -> Expectation {
        let found = &mut self.diagnostics;
        let mut count = |key| fields.count(key, found).map(|(count, _)| count);
        let wrong = count("wrong").unwrap_or(0);
        let held = count("held");
        let fail_safe = count("fail_safe");
        let mishaps = count("mishaps");
        let protected = fields.flag("protected", found);
        let functional = fields.texts("functional", found);
        let finished = fields.counts("finished", found);
        let during = fields.tables("during", "a range", found);
        fields.finish(found);
        Expectation {
            wrong,
            held,
            fail_safe,
            mishaps,
            protected: protected.is_some_and(|(protected, _)| protected),
            functional: functional
                .into_iter()
                .filter_map(|(name, place)| self.plant(name, &place))
                .collect(),
            finished: finished
                .into_iter()
                .filter_map(|((name, place), parts)| Some((self.plant(name, &place)?, parts)))
                .collect(),
            during: during
                .into_iter()
                .filter_map(|fields| self.during(fields, end))
                .collect(),
        }
    }

    fn during(&mut self, mut fields: Fields<'_, '_>, end: u64) -> Option<During> {
        let found = &mut self.diagnostics;
        let from = fields.count("from", found);
        let from = fields.required("from", from, found);
        let to = fields.count("to", found);
        let to = fields.required("to", to, found);
        let remote_io = fields.text("remote_io", found);
        let remote_io = fields.required("remote_io", remote_io, found);
        let words = fields.texts("source", found);
        fields.required("source", Some(()), found);
        fields.finish(found);
        let mut sources = Vec::new();
        for (word, place) in words {
            match SOURCES
                .into_iter()
                .find(|source| source_word(*source) == word)
            {
                Some(source) => sources.push(source),
                None => {
                    let message = format!("there is no source `{word}`");
                    let help = suggestion(word, SOURCES.into_iter().map(source_word));
                    found.push(Diagnostic::error("U0306", message, place).with_help(help));
                }
            }
        }
        let ((from, _), (to, to_place)) = (from?, to?);
        self.range(from, to, end, to_place);
        let (name, place) = remote_io?;
        let remote_io = match self.party(name, &place)? {
            Party::RemoteIo(program) => program,
            _ => {
                let known = self.parties.map(|parties| {
                    let names = parties.remote_ios().map(|(_, name)| name);
                    suggestion(name, names)
                });
                self.unfit(name, "a remote I/O", place, known);
                return None;
            }
        };
        Some(During {
            from,
            to,
            remote_io,
            sources: sources_or_any(sources),
        })
    }

    fn plant(&mut self, name: &str, place: &Range<usize>) -> Option<ProgramId> {
        match self.party(name, place)? {
            Party::Plant(program) => Some(program),
            _ => {
                let known = self.parties.map(|parties| {
                    let names = parties.plants().map(|(_, name)| name);
                    suggestion(name, names)
                });
                self.unfit(name, "a plant", place.clone(), known);
                None
            }
        }
    }

    fn unfit(&mut self, name: &str, wanted: &str, place: Range<usize>, help: Option<String>) {
        let message = format!("`{name}` is not {wanted}");
        let mut diagnostic = Diagnostic::error("U0309", message, place);
        diagnostic.help = help;
        self.diagnostics.push(diagnostic);
    }

    /// Nothing without a cluster, too, where no name can be wrong.
    fn party(&mut self, name: &str, place: &Range<usize>) -> Option<Party> {
        let parties = self.parties?;
        let party = parties.find(name);
        if party.is_none() {
            let message = format!("the cluster has no station, remote I/O or plant `{name}`");
            let help = suggestion(name, parties.iter().map(|(_, name)| name));
            self.diagnostics
                .push(Diagnostic::error("U0307", message, place.clone()).with_help(help));
        }
        party
    }
}

/// An empty list only comes with an error or a missing key, which are reported; then anything would do.
fn sources_or_any(sources: Vec<Source>) -> Vec<Source> {
    if sources.is_empty() {
        SOURCES.to_vec()
    } else {
        sources
    }
}
