//! Why an output has its value: the chain of contacts or statements that caused it, through memory and earlier cycles; for a reconstructed output
//! the parity word, its mask and the lineage that proves it.

mod explain;
mod power;
mod statements;
mod text;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use serde_json::Value;
use understudy_cluster::Controller;
use understudy_journal::source_word;
use understudy_journal::{TimeOfDay, TimesOfDay};
use understudy_parity::reconstruct;
use understudy_remote_io::Missing;
use understudy_text::spelling::suggestion;
use understudy_typed::Declared;
use understudy_wire::{Image, Member, ProgramId, Source, StationId};

use crate::describe::missing_text;
use crate::error::ViewError;
use crate::history::{Driven, History, Step};
use crate::model::Model;
use crate::value::{self, forced_point, forced_value, has_numbers, named_text, value_in};
use explain::Explainer;

/// Parts of a block, a structure or an array that an error lists.
const PARTS: usize = 6;

/// Why an output or a variable of a program has its value.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Why {
    /// Its name.
    pub signal: String,
    /// Its program.
    pub program: String,
    /// The remote I/O of its program that drove in this cycle; an output is driven by it.
    pub remote_io: String,
    /// From the origin of the run.
    pub cycle: i64,
    /// Time of day of the cycle; nothing where no wall clock was recorded, as in a simulated run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<TimeOfDay>,
    /// Cycles since then, where it is the last one that the remote I/O reported and that does not report any more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub age_cycles: Option<u64>,
    /// Its value as driven, of a variable after the scan: a BOOL as true or false, a number as a number, null where it is not finite, a time in
    /// nanoseconds.
    pub value: Value,
    /// Where a force is in effect: its value is the one of the operator, whatever the program computes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forced: Option<WhyForced>,
    /// The cycle whose value the device kept, where the deadline of this one is not in the journal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept_since: Option<i64>,
    /// `direct`, `reconstructed`, `held` or `fail-safe`, of an output, before forces; nothing for a cycle whose deadline is not in the journal, and
    /// for other signals.
    pub source: Option<&'static str>,
    /// Why there was no provable output, in a missed cycle.
    pub missing: Option<&'static str>,
    /// The value of the program's own scan, where it was not driven.
    pub scanned: Option<Value>,
    /// The inputs that were sampled in this cycle, by name.
    pub inputs: BTreeMap<String, Value>,
    /// The same as people read them, of a program with points that are numbers.
    #[serde(skip)]
    pub inputs_text: Option<String>,
    /// Type of the signal.
    #[serde(
        rename = "type",
        skip_serializing_if = "Option::is_none",
        serialize_with = "type_name"
    )]
    #[schemars(with = "Option<String>")]
    pub of: Option<Declared>,
    /// Unit of the values, of an input or output that has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// How it was reconstructed.
    pub reconstructed: Option<Reconstructed>,
    /// Configured fail-safe value, where the output is on a ramp to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ramp_to: Option<Value>,
    /// The chain of contacts or statements; nothing for a fail-safe value, unless a program fault led to it.
    pub because: Option<Reason>,
}

/// A force of a signal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct WhyForced {
    /// Person who forced it.
    pub owner: String,
    /// Reason.
    pub reason: String,
    /// Duration in seconds.
    pub seconds: u32,
    /// The cycle in which it was forced.
    pub since: i64,
    /// The value of an output without the force.
    pub unforced: Option<Value>,
}

fn type_name<S: Serializer>(of: &Option<Declared>, serializer: S) -> Result<S::Ok, S::Error> {
    of.as_ref().map(Declared::to_string).serialize(serializer)
}

/// How an output was reconstructed: equation (12) with its numbers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Reconstructed {
    /// The station that sent the parity word.
    pub word_of: String,
    /// The programs in its mask.
    pub mask: Vec<String>,
    /// The parity word, element 1 first.
    pub word: String,
    /// The outputs of the other programs in the mask, as their controllers published them.
    pub others: Vec<Addend>,
    /// The sum of them all.
    pub sum: String,
    /// The sum as outputs of the program, by name.
    pub values: BTreeMap<String, Value>,
    /// The same as people read them, where the program has numbers.
    #[serde(skip)]
    pub values_text: Option<String>,
    /// L(t+1) of the program: a station at this lineage has the same inputs since the same start.
    pub lineage: String,
    /// Whether the sum equals the outputs that the samples yield.
    pub proved: bool,
    /// The stations that were not received in that cycle.
    pub not_received: Vec<String>,
}

/// The outputs of one program in the mask.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Addend {
    /// The controller that published them.
    pub published_by: String,
    /// Element 1 first.
    pub outputs: String,
    /// The same by name.
    pub values: BTreeMap<String, Value>,
    /// The same as people read them, where the program has numbers.
    #[serde(skip)]
    pub values_text: Option<String>,
}

/// A signal in a cycle, and the reason for its value.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Reason {
    /// A signal, a pin of a block, or a comparison.
    pub signal: String,
    /// Its value at that place of the scan.
    pub value: Value,
    /// Its type, of a program with numbers.
    #[serde(
        rename = "type",
        skip_serializing_if = "Option::is_none",
        serialize_with = "type_name"
    )]
    #[schemars(with = "Option<String>")]
    pub of: Option<Declared>,
    /// Unit of the value, of an input or output that has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// From the origin of the run.
    pub cycle: i64,
    /// Time of day of the cycle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<TimeOfDay>,
    /// The rung that determined it, counted from 1.
    pub rung: Option<usize>,
    /// The title of that rung.
    pub title: Option<String>,
    /// The line of the statement that determined it, of a program with numbers, counted from 1.
    pub line: Option<u32>,
    /// That line of its text.
    pub statement: Option<String>,
    /// The reason in words.
    pub text: String,
    /// The reasons behind it.
    pub because: Vec<Reason>,
}

impl Reason {
    fn is_timed(&mut self, times: &TimesOfDay) {
        self.at = times.of_cycle(self.cycle);
        self.because.iter_mut().for_each(|reason| reason.is_timed(times));
    }

    fn has_units(&mut self, unit: &impl Fn(&str) -> Option<String>) {
        self.unit = unit(&self.signal);
        self.because.iter_mut().for_each(|reason| reason.has_units(unit));
    }
}

impl Model {
    /// Why a signal has its value: `ram_down`, or `press.ram_down` where several programs have one of that name; an address such as
    /// `%QX0.0` will do. Without a cycle, in the newest one that is known.
    ///
    /// # Errors
    /// Where there is no such signal, or nothing is known of the cycle.
    pub fn why(&self, signal: &str, cycle: Option<i64>) -> Result<Why, ViewError> {
        let (program, name) = self.find_signal(signal, cycle)?;
        let history = self.history_of(program)?;
        let place = match cycle {
            Some(cycle) => history.place_of(cycle),
            None => {
                let decided = |step: &Step| step.driven.is_some();
                history.steps().iter().rposition(decided)
            }
        };
        let place = place.ok_or_else(|| self.no_cycle(program, cycle.unwrap_or(0)))?;
        let mut why = self.why_at(program, history, &name, place)?;
        why.at = self.times.of_cycle(why.cycle);
        let points = self.points_in(Some(why.cycle));
        why.unit = points.cluster().card(program, &why.signal).unit;
        if let Some(reason) = &mut why.because {
            reason.is_timed(&self.times);
            reason.has_units(&|name| points.cluster().card(program, name).unit);
        }
        if cycle.is_none() {
            let newest = self.newest();
            let standing = self.standing(newest.unwrap_or(i64::MAX));
            why.age_cycles = self.silent_cycles(&standing, program, newest);
        }
        Ok(why)
    }

    fn why_at(
        &self,
        program: ProgramId,
        history: &History,
        name: &str,
        place: usize,
    ) -> Result<Why, ViewError> {
        let step = &history.steps()[place];
        let version = self.version_at(history, place)?;
        let controller = version.controller();
        let drove = self.driver_at(program, step);
        let named_by = |driven: &Driven| self.present().controller_of(program, driven.points);
        // By the points of this cycle.
        let named = step.driven.as_ref().map_or(Some(controller), named_by);
        let named = named.ok_or_else(|| self.not_known(program, step.cycle))?;
        let output = named.interface.outputs.find(name);
        let decided = step.driven.as_ref().filter(|_| output.is_some());
        let source = decided.map(|driven| driven.source);
        let missing = decided.and_then(|driven| driven.missing);
        // A deadline that was missed: the device kept the values of the one before it.
        let steps = || history.steps().iter();
        let is_missed = step.driven.is_none() && steps().skip(place).any(|it| it.driven.is_some());
        let kept = steps().take(place).rfind(|it| it.driven.is_some());
        let kept = kept.filter(|_| is_missed && output.is_some());
        // What is held was true in an earlier cycle; the fail-safe values were never computed.
        let explained = match source {
            Some(Source::Held) if output.is_some() => last_true(history, place),
            Some(Source::FailSafe) if output.is_some() => None,
            _ => Some(place),
        };
        let of_scan = output.and_then(|_| controller.interface.outputs.find(name));
        let scanned = match (of_scan, &step.sampled) {
            (Some(output), Some(sampled)) => Some(value_in(output, &sampled.outputs)),
            _ => None,
        };
        let drives = decided.or(kept.and_then(|kept| kept.driven.as_ref()));
        let value_of = |driven: &Driven, image: &Image| {
            let output = named_by(driven)?.interface.outputs.find(name);
            output.filter(|_| decided.is_some() || kept.is_some()).map(|it| value_in(it, image))
        };
        let driven = drives.and_then(|driven| value_of(driven, &driven.outputs));
        let unforced = drives.and_then(|driven| value_of(driven, &driven.unforced));
        let typed = controller.code.typed();
        // What is held may have been proved by another program, before an online change.
        let stopped = missing == Some(Missing::ProgramFault);
        let failed = if stopped { history.fault_before(place) } else { None };
        let explained_by = self.version_at(history, failed.or(explained).unwrap_or(place))?;
        let code = &explained_by.controller().code;
        let part = code.typed().part(name);
        let because = match (code.ladder(), explained_by.text()) {
            (Some(ladder), _) => part
                .zip(explained)
                .map(|(part, explained)| {
                    Explainer::new(self, history, ladder).root(&part, explained)
                })
                .transpose()?,
            (None, None) => None,
            (None, Some(text)) => {
                let typed = code.typed();
                let mut explainer = statements::Explainer::new(self, history, typed, text);
                let value = unforced.clone().unwrap_or_default();
                match (failed, explained, part) {
                    (Some(_), ..) => explainer.fault(name, value, place),
                    (None, Some(explained), Some(part)) => Some(explainer.root(&part, explained)?),
                    _ => None,
                }
            }
        };
        let fail_safe = decided.and_then(|driven| driven.fail_safe.as_ref());
        let configured = output.zip(fail_safe).map(|(output, values)| value_in(output, values));
        let on_ramp = configured.is_some() && configured != unforced;
        let value =
            driven.or(because.as_ref().map(|reason| reason.value.clone())).unwrap_or_default();
        let sampled = step.sampled.as_ref().into_iter();
        let inputs =
            sampled.clone().flat_map(|it| value::named(&controller.interface.inputs, &it.inputs));
        let has_numbers = has_numbers(controller);
        let mut sampled = sampled.filter(|_| has_numbers);
        let points = self.points_in(Some(step.cycle));
        let card = |name: &str| points.cluster().card(program, name);
        Ok(Why {
            at: None,
            signal: name.to_owned(),
            program: controller.name.clone(),
            remote_io: self.members().name(drove).to_owned(),
            cycle: step.cycle,
            age_cycles: None,
            forced: self.why_forced(program, name, step.cycle, &value, unforced.as_ref()),
            kept_since: kept.map(|kept| kept.cycle),
            source: source.map(source_word),
            missing: missing.map(missing_text),
            scanned: scanned.filter(|scanned| *scanned != value),
            inputs: inputs.collect(),
            inputs_text: sampled
                .next()
                .map(|it| named_text(&controller.interface.inputs, &it.inputs, card)),
            of: match output {
                Some(output) => Some(output.declared()),
                None => typed.part(name).and_then(|part| part.declared()),
            },
            unit: None,
            ramp_to: configured.filter(|_| on_ramp),
            value,
            reconstructed: decided.and_then(|driven| self.reconstructed(program, step, driven)),
            because,
        })
    }

    /// The force that a value comes from; nothing where the signal is not forced, or was forced after this cycle.
    fn why_forced(
        &self,
        program: ProgramId,
        name: &str,
        cycle: i64,
        value: &Value,
        unforced: Option<&Value>,
    ) -> Option<WhyForced> {
        let standing = self.standing(cycle);
        let forced = standing.program(program)?.forced.iter().find(|forced| {
            let controller = self.present().controller_of(program, forced.points);
            let point = controller.and_then(|controller| forced_point(controller, &forced.force));
            point.is_some_and(|point| {
                point.name == name && forced_value(point, &forced.force) == *value
            })
        })?;
        Some(WhyForced {
            owner: forced.force.owner.clone(),
            reason: forced.force.reason.clone(),
            seconds: forced.force.seconds,
            since: forced.since,
            unforced: unforced.cloned(),
        })
    }

    /// The program and the name of an output, a variable or a part of one, as in a cycle or in the newest one.
    fn find_signal(
        &self,
        asked: &str,
        cycle: Option<i64>,
    ) -> Result<(ProgramId, String), ViewError> {
        let programs = (0..self.cluster.controllers().len() as u8).map(ProgramId);
        let controllers = programs.filter_map(|program| self.controller_at(program, cycle));
        let controllers: Vec<&Controller> = controllers.collect();
        let mut found = Vec::new();
        let mut known = Vec::new();
        let mut parts = Vec::new();
        for (place, controller) in controllers.iter().enumerate() {
            let program = ProgramId(place as u8);
            let prefix = format!("{}.", controller.name);
            let name = asked.strip_prefix(&prefix).unwrap_or(asked);
            let is_named = name != asked;
            let typed = controller.code.typed();
            known.extend(typed.variables.iter().map(|it| it.name.clone()));
            let (part, whole) = match typed.part(name) {
                Some(part) if part.of.elementary().is_none() => (None, Some(part)),
                part => (part, None),
            };
            let leaves = whole.map(|whole| typed.leaves(whole, PARTS)).unwrap_or_default();
            parts.extend(leaves.into_iter().map(|leaf| leaf.name));
            let point = typed.outputs.find(name).map(|point| point.name.clone());
            let name = point.or(part.map(|part| part.name));
            found.extend(name.map(|name| (program, name, is_named)));
        }
        if found.iter().any(|(_, _, named)| *named) {
            found.retain(|(_, _, named)| *named);
        }
        // An input is that of its program where no other one computes a signal of its name.
        let is_computed = |(program, name, _): &(ProgramId, String, bool)| {
            controllers[program.index()].interface.inputs.find(name).is_none()
        };
        if found.iter().any(is_computed) {
            found.retain(is_computed);
        }
        match found.as_slice() {
            [] if !parts.is_empty() => {
                parts.truncate(PARTS);
                Err(ViewError::NoValue { name: asked.to_owned(), parts })
            }
            [] => Err(ViewError::NoOutput {
                name: asked.to_owned(),
                hint: suggestion(asked, known.iter().map(String::as_str)),
            }),
            [(program, name, _)] => Ok((*program, name.clone())),
            several => Err(ViewError::SeveralOutputs {
                name: asked.to_owned(),
                programs: several
                    .iter()
                    .map(|(program, _, _)| self.program_name(*program).to_owned())
                    .collect(),
            }),
        }
    }

    /// The parity word that the outputs of a program were reconstructed from, with its addends.
    fn reconstructed(
        &self,
        program: ProgramId,
        step: &Step,
        driven: &Driven,
    ) -> Option<Reconstructed> {
        let station = driven.word_of.filter(|_| driven.source == Source::Reconstructed)?;
        let turns = self.sent_turns(step.moment);
        let turn = turns.iter().find(|turn| turn.station == station)?;
        let word = turn.words.iter().find(|word| word.mask.contains(program))?;
        let published = |other: ProgramId| {
            let turn = turns.iter().find(|turn| turn.station == other.controller())?;
            turn.words.first().map(|word| &word.sum)
        };
        let sum = reconstruct(word, program, driven.outputs.width(), published).ok()?;
        let others = word.mask.iter().filter(|other| *other != program);
        let named_by = |program: ProgramId, image: &Image| {
            let controller = self.points_of(program, step.moment)?;
            (image.width() >= controller.interface.outputs.width()).then_some(controller)
        };
        let values = |program: ProgramId, image: &Image| {
            let controller = named_by(program, image).into_iter();
            controller.flat_map(|it| value::named(&it.interface.outputs, image)).collect()
        };
        let points = self.points_in(Some(step.cycle));
        let values_text = |program: ProgramId, image: &Image| {
            let controller = named_by(program, image).filter(|it| has_numbers(it))?;
            let card = |name: &str| points.cluster().card(program, name);
            Some(named_text(&controller.interface.outputs, image, card))
        };
        let others = others.filter_map(|other| {
            let outputs = published(other)?;
            Some(Addend {
                published_by: self.program_name(other).to_owned(),
                outputs: outputs.to_string(),
                values: values(other, outputs),
                values_text: values_text(other, outputs),
            })
        });
        let not_received = (0..self.cluster.agreement().schedule.stations() as u8)
            .map(StationId)
            .filter(|station| !driven.heard.contains(*station))
            .map(|station| self.members().name(Member::Station(station)).to_owned());
        let sampled = step.sampled.as_ref();
        Some(Reconstructed {
            word_of: self.members().name(Member::Station(station)).to_owned(),
            mask: word.mask.iter().map(|member| self.program_name(member).to_owned()).collect(),
            word: word.sum.to_string(),
            others: others.collect(),
            lineage: sampled.map_or_else(String::new, |sampled| sampled.after.to_string()),
            proved: sampled.is_some_and(|sampled| sampled.outputs == sum),
            values: values(program, &sum),
            values_text: values_text(program, &sum),
            sum: sum.to_string(),
            not_received: not_received.collect(),
        })
    }
}

/// Why there is nothing before the step at `place` that a program is explained with.
fn end_of_history(history: &History, place: usize) -> String {
    if history.is_taken_over_at(place) {
        let cycle = history.steps()[place].cycle;
        format!("unchanged since the online change of cycle {cycle}")
    } else if history.begins_at(place) {
        "its initial value".to_owned()
    } else {
        "unchanged since before the oldest cycle that is remembered".to_owned()
    }
}

/// The place of the cycle whose outputs are held at `place`.
fn last_true(history: &History, place: usize) -> Option<usize> {
    let found = (0..place).rev().find(|&earlier| {
        let driven = history.steps()[earlier].driven.as_ref();
        driven.is_some_and(|driven| driven.missing.is_none())
    });
    if found.is_none() {
        history.end().reach();
    }
    found
}
