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
//! | U0308 | a step that cannot be done in the state in which the member is then |
//! | U0309 | an action that does not fit its member |
//! | U0310 | a range of cycles that is empty or past the end |

mod steps;

use std::ops::Range;

use toml::de::DeTable;
use understudy_journal::{Members, SOURCES, source_word};
use understudy_simulator::{Disturbance, Network};
use understudy_text::spelling::suggestion;
use understudy_text::tables::{Codes, Fields, Placed, parse};
use understudy_text::{Diagnostic, Report, has_errors};
use understudy_wire::{Member, ProgramId, Source, Via};

pub use crate::format::MAXIMUM_CYCLES;
use crate::format::SCENARIO;
use crate::scenario::{During, Expectation, Scenario};

/// Something about one of two networks, in a cluster that has one.
fn one_network(span: Range<usize>, instead: &str) -> Diagnostic {
    let help = format!("{instead}, or add `networks = 2` to `[cluster]` in the cluster file");
    Diagnostic::error("U0309", "the cluster has one network", span).with_help(help)
}

/// Steps of one scenario, at most.
pub const MAXIMUM_STEPS: usize = 10_000;

const CODES: Codes = Codes {
    no_toml: "U0301",
    unknown_key: "U0302",
    missing_key: "U0303",
    wrong_type: "U0304",
    out_of_bounds: "U0305",
    unknown_word: "U0306",
};

/// A scenario file that was read.
#[derive(Debug, Clone)]
pub struct ReadScenario {
    /// Nothing where the report has errors.
    pub scenario: Option<Scenario>,
    /// The text and what was found in it.
    pub report: Report,
}

/// Reads the text of a scenario file; `members` are those of the cluster that it is for.
///
/// Without a cluster, names are not known: then names are taken as they come and the scenario is only checked, not answered.
pub fn read(name: &str, text: &str, members: Option<&Members>) -> ReadScenario {
    let mut reader = Reader { members, diagnostics: Vec::new() };
    let root = parse(text, &CODES, &mut reader.diagnostics);
    let scenario = root.as_ref().and_then(|root| {
        let table = Placed { value: root.get_ref(), span: 0..0 };
        reader.scenario(Fields::of(&SCENARIO, table, &CODES))
    });
    let mut diagnostics = reader.diagnostics;
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span.start, diagnostic.span.end));
    ReadScenario {
        scenario: scenario.filter(|_| members.is_some() && !has_errors(&diagnostics)),
        report: Report { name: name.to_owned(), text: text.to_owned(), diagnostics },
    }
}

/// Whether a TOML text looks like a scenario rather than like another file of this project.
pub fn looks_like_a_scenario(text: &str) -> bool {
    let (table, _) = DeTable::parse_recoverable(text);
    ["step", "expect", "cycles"].iter().any(|key| table.get_ref().contains_key(*key))
}

struct Reader<'p> {
    members: Option<&'p Members>,
    diagnostics: Vec<Diagnostic>,
}

impl Reader<'_> {
    fn scenario(&mut self, mut fields: Fields<'_, '_>) -> Option<Scenario> {
        let found = &mut self.diagnostics;
        fields.require_all(found);
        let title = fields.text("title", found);
        let cycles = fields.format_count("cycles", found);
        let cycles = cycles.map(|cycles| cycles.value);
        // Later checks need some end; an unknown one must not bring further errors.
        let end = cycles.unwrap_or(MAXIMUM_CYCLES);
        let seed = fields.format_count("seed", found);
        let spare_after = fields.format_count("spare_after", found);
        let steps = fields.format_tables("step", found);
        let network = fields.format_table("network", found);
        let expect = fields.format_table("expect", found);
        fields.finish(found);
        let steps = self.steps(steps, end);
        let disturbance = network.map(|network| self.network(network, end));
        let expect =
            expect.map_or_else(Expectation::default, |expect| self.expectation(expect, end));
        Some(Scenario {
            title: title?.value.to_owned(),
            cycles: cycles?,
            seed: seed.map(|seed| seed.value),
            spare_after: spare_after.map(|cycles| cycles.value as u32),
            steps,
            network: disturbance.as_ref().map(|disturbance| disturbance.network),
            network_cycles: disturbance.and_then(|disturbance| disturbance.cycles),
            expect,
        })
    }

    fn network(&mut self, mut fields: Fields<'_, '_>, end: u64) -> Disturbance {
        let found = &mut self.diagnostics;
        let usual = Network::default();
        let latency = fields.format_time("latency", found);
        let jitter = fields.format_time("jitter", found);
        let mut share = |key| {
            let share = fields.format_number(key, found);
            share.map_or(0.0, |share| share.value)
        };
        let shares = [share("loss"), share("duplicate"), share("corruption")];
        let over = fields.format_count("network", found);
        let has_two = self.members.is_none_or(|members| members.have_two_networks());
        if let Some(over) = over.as_ref().filter(|_| !has_two) {
            found.push(one_network(over.span.clone(), "leave `network` out"));
        }
        let [loss, duplicate, corruption] = shares;
        let network = Network {
            loss,
            duplicate,
            corruption,
            over: over.and_then(|over| Via::try_from(over.value as u8).ok()),
            latency: latency.unwrap_or(usual.latency),
            jitter: jitter.unwrap_or(usual.jitter),
        };
        let from = fields.format_count("from", found);
        let to = fields.format_count("to", found);
        let place = fields.span();
        fields.finish(found);
        let cycles = (from.is_some() || to.is_some()).then(|| {
            let place = to.as_ref().or(from.as_ref()).map_or(place, |bound| bound.span.clone());
            let from = from.map_or(0, |from| from.value);
            let to = to.map_or(end, |to| to.value);
            self.range(from, to, end, place)
        });
        Disturbance { network, cycles }
    }

    /// A range of cycles; an error where it is empty or past the end.
    fn range(&mut self, from: u64, to: u64, end: u64, place: Range<usize>) -> Range<u64> {
        if from >= to || to > end {
            let why = if from >= to { "no cycle" } else { "past the end" };
            let message =
                format!("cycles {from} up to, not including, {to} of a run of {end}: {why}");
            self.diagnostics.push(Diagnostic::error("U0310", message, place));
        }
        from..to
    }

    fn expectation(&mut self, mut fields: Fields<'_, '_>, end: u64) -> Expectation {
        let found = &mut self.diagnostics;
        let mut count = |key| Some(fields.format_count(key, found)?.value);
        let wrong = count("wrong").unwrap_or(0);
        let held = count("held");
        let fail_safe = count("fail_safe");
        let missed = count("missed");
        let plant_faults = count("plant_faults");
        let protected = fields.flag("protected", found);
        let functional = fields.texts("functional", found);
        let finished = fields.get("finished").map_or_else(Vec::new, |finished| {
            let wanted = "a table from names to numbers, such as { ram = 15 }";
            finished.entries(wanted, found)
        });
        let finished: Vec<_> = finished
            .into_iter()
            .filter_map(|(name, parts)| Some((name, parts.count(0..=u64::MAX, found)?.value)))
            .collect();
        let during = fields.format_tables("during", found);
        fields.finish(found);
        Expectation {
            wrong,
            held,
            fail_safe,
            missed,
            plant_faults,
            protected: protected.unwrap_or(false),
            functional: functional.iter().filter_map(|name| self.plant(name)).collect(),
            finished: finished
                .iter()
                .filter_map(|(name, parts)| Some((self.plant(name)?, *parts)))
                .collect(),
            during: during.into_iter().filter_map(|fields| self.during(fields, end)).collect(),
        }
    }

    fn during(&mut self, mut fields: Fields<'_, '_>, end: u64) -> Option<During> {
        let found = &mut self.diagnostics;
        fields.require_all(found);
        let from = fields.format_count("from", found);
        let to = fields.format_count("to", found);
        let remote_io = fields.text("remote_io", found);
        let words = fields.texts("source", found);
        fields.finish(found);
        let mut sources = Vec::new();
        for Placed { value: word, span } in words {
            match SOURCES.into_iter().find(|source| source_word(*source) == word) {
                Some(source) => sources.push(source),
                None => {
                    let message = format!("there is no source `{word}`");
                    let help = suggestion(word, SOURCES.into_iter().map(source_word));
                    found.push(Diagnostic::error("U0306", message, span).with_help(help));
                }
            }
        }
        let (from, to) = (from?.value, to?);
        self.range(from, to.value, end, to.span);
        let name = remote_io?;
        let remote_io = match self.member(&name)? {
            Member::RemoteIo(program) => program,
            _ => {
                let known = self.members.map(|members| {
                    let names = members.remote_ios().map(|(_, name)| name);
                    suggestion(name.value, names)
                });
                self.unfit(&name, "a remote I/O", known);
                return None;
            }
        };
        Some(During { from, to: to.value, remote_io, sources: sources_or_any(sources) })
    }

    fn plant(&mut self, name: &Placed<&str>) -> Option<ProgramId> {
        match self.member(name)? {
            Member::Plant(program) => Some(program),
            _ => {
                let known = self.members.map(|members| {
                    let names = members.plants().map(|(_, name)| name);
                    suggestion(name.value, names)
                });
                self.unfit(name, "a plant", known);
                None
            }
        }
    }

    fn unfit(&mut self, name: &Placed<&str>, wanted: &str, help: Option<String>) {
        let message = format!("`{}` is not {wanted}", name.value);
        let mut diagnostic = Diagnostic::error("U0309", message, name.span.clone());
        diagnostic.help = help;
        self.diagnostics.push(diagnostic);
    }

    /// Nothing without a cluster, too, where no name can be wrong.
    fn member(&mut self, name: &Placed<&str>) -> Option<Member> {
        let members = self.members?;
        let Placed { value: name, span } = name;
        let member = members.find(name);
        if member.is_none() {
            let message = format!("the cluster has no station, remote I/O or plant `{name}`");
            let help = suggestion(name, members.iter().map(|(_, name)| name));
            self.diagnostics
                .push(Diagnostic::error("U0307", message, span.clone()).with_help(help));
        }
        member
    }
}

/// An empty list only comes with an error or a missing key, which are reported; then anything would do.
fn sources_or_any(sources: Vec<Source>) -> Vec<Source> {
    if sources.is_empty() { SOURCES.to_vec() } else { sources }
}
