//! The steps of a scenario: what is done to whom, and whether it can be done then.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use understudy_cluster::{stored_value, value_text};
use understudy_journal::{NamedInput, NamedSignal};
use understudy_remote_io::{OperatorInputKind, ValueMismatch};
use understudy_simulator::{Action, Fault};
use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;
use understudy_text::tables::{Fields, Placed};
use understudy_wire::{Member, PointValue, ProgramId, StateChoice, Via};

use super::{MAXIMUM_STEPS, Reader, one_network};
use crate::format::{STEP, action_keys};
use crate::scenario::{ACTIONS, action_word};

/// A step with the name of its member. One step of a file may be several: a cut to many, or both ways.
type Step = Placed<(Vec<Fault>, String)>;

impl Reader<'_> {
    pub(super) fn steps(&mut self, tables: Vec<Fields<'_, '_>>, end: u64) -> Vec<Fault> {
        if let Some(first_too_many) = tables.get(MAXIMUM_STEPS) {
            let message = format!("{} steps: {MAXIMUM_STEPS} at most", tables.len());
            let place = first_too_many.span();
            self.diagnostics.push(Diagnostic::error("U0305", message, place));
        }
        let mut placed: Vec<Step> = tables
            .into_iter()
            .take(MAXIMUM_STEPS)
            .filter_map(|fields| self.step(fields, end))
            .collect();
        let time = |step: &Step| {
            let fault = step.value.0.first();
            fault.map_or((0, 0.0), |fault| (fault.at_cycle, fault.phase))
        };
        placed.sort_by(|left, right| {
            let (left, right) = (time(left), time(right));
            left.0.cmp(&right.0).then(left.1.total_cmp(&right.1))
        });
        self.steps_are_possible(&placed);
        placed.into_iter().flat_map(|step| step.value.0).collect()
    }

    fn step(&mut self, mut fields: Fields<'_, '_>, end: u64) -> Option<Step> {
        let found = &mut self.diagnostics;
        let span = fields.span();
        fields.require_all(found);
        let at = fields.format_count("at", found);
        let phase = fields.format_number("phase", found);
        let action = fields.text("action", found);
        let station = fields.text("station", found);
        if let Some(Placed { value: at, span }) = &at
            && *at >= end
        {
            let message =
                format!("this step is at cycle {at}, and the run ends before cycle {end}");
            found.push(Diagnostic::error("U0305", message, span.clone()));
        }
        if let Some(Placed { value: phase, span }) = &phase
            && *phase >= 1.0
        {
            let message = format!("a phase of {phase} is the next cycle; it is below 1");
            found.push(Diagnostic::error("U0305", message, span.clone()));
        }
        let word = action.and_then(|Placed { value: word, span }| {
            let known = ACTIONS.into_iter().find(|known| *known == word);
            if known.is_none() {
                let message = format!("there is no action `{word}`");
                let help = suggestion(word, ACTIONS);
                found.push(Diagnostic::error("U0306", message, span).with_help(help));
            }
            known
        });
        let member = station.as_ref().and_then(|name| self.member(name));
        let actions = match (word, &station) {
            (Some(word), Some(name)) => self.actions(word, &mut fields, member, name),
            _ => {
                fields.ignore(&action_keys());
                None
            }
        };
        fields.finish(&mut self.diagnostics);
        let (member, at_cycle) = (member?, at?.value);
        let phase = phase.map_or(0.0, |phase| phase.value);
        let faults = actions?.into_iter().map(|(by, action)| Fault {
            at_cycle,
            phase,
            member: by.unwrap_or(member),
            action,
        });
        let value = (faults.collect(), station?.value.to_owned());
        Some(Placed { value, span })
    }

    /// What an action is in full: each with the member that does it, where that is another one than the step names.
    fn actions(
        &mut self,
        word: &'static str,
        fields: &mut Fields<'_, '_>,
        member: Option<Member>,
        station: &Placed<&str>,
    ) -> Option<Vec<(Option<Member>, Action)>> {
        let one = |action| Some(vec![(None, action)]);
        let any = |_: Member| true;
        let in_cluster = |member: Member| !matches!(member, Member::Plant(_));
        let of_remote_io = |member: Member| matches!(member, Member::RemoteIo(_));
        let of_either = |member: Member| member.sampled_program().is_some();
        let of_station = |member: Member| matches!(member, Member::Station(_));
        let (fits, wanted): (fn(Member) -> bool, &str) = match word {
            "crash" | "restart" | "stop" | "continue" => (any, ""),
            // The one that asks, or has excluded something, may be a twin.
            "release" | "cold-start" | "accept-state" | "stick-input" | "free-input" => {
                (of_either, "names a remote I/O")
            }
            "write" | "set" => (of_remote_io, "names the first remote I/O of a program"),
            "flip-state" | "flip-word" => (of_station, "names a controller or an understudy"),
            _ => (in_cluster, "names a station or a remote I/O, and no plant"),
        };
        if let Some(member) = member.filter(|&member| !fits(member)) {
            let name = station.value;
            let message = match (word, member) {
                ("write" | "set", Member::Twin(_)) => {
                    format!(
                        "`{name}` is the twin of a remote I/O, and `{word}` concerns the first one"
                    )
                }
                (
                    "release" | "cold-start" | "accept-state" | "stick-input" | "free-input"
                    | "write" | "set",
                    _,
                ) => {
                    format!("`{name}` is not a remote I/O, and `{word}` concerns one")
                }
                _ => format!("`{name}` cannot be the target of `{word}`"),
            };
            self.diagnostics.push(
                Diagnostic::error("U0309", message, station.span.clone())
                    .with_help(format!("{word} {wanted}")),
            );
            fields.ignore(&action_keys());
            return None;
        }
        match word {
            "crash" => one(Action::Crash),
            "restart" => one(Action::Restart),
            "restart-misconfigured" => one(Action::RestartMisconfigured),
            "restart-wrong-program" => one(Action::RestartWrongProgram),
            "restart-in-epoch" => {
                fields.require(&["epoch"], &mut self.diagnostics);
                let epoch = fields.format_count("epoch", &mut self.diagnostics)?;
                one(Action::RestartInEpoch { epoch: epoch.value })
            }
            "stop" => one(Action::Stop),
            "continue" => one(Action::Continue),
            "release" if fields.has("input") => {
                one(Action::Unset { input: self.input(fields, member)?.value.place.first_bit() })
            }
            "release" => one(Action::Release),
            "cold-start" => one(Action::Choose { choice: StateChoice::Cold }),
            "accept-state" => one(Action::Choose { choice: StateChoice::Newest { cycle: None } }),
            "write" => one(self.written(fields, member)?),
            "set" => {
                fields.require(&["value"], &mut self.diagnostics);
                let value = fields.get("value");
                let value = value.and_then(|value| value.constant(&mut self.diagnostics));
                let Placed { value: signal, .. } = self.input(fields, member)?;
                let Placed { value, span } = value?;
                match stored_value(&value, &signal.declared) {
                    Ok(stored) => one(Action::Set {
                        input: signal.place.first_bit(),
                        value: PointValue::new(signal.declared.of.bits(), stored),
                    }),
                    Err(problem) => {
                        let message =
                            format!("`{}` is {}: {problem}", signal.name, signal.declared);
                        let error = Diagnostic::error("U0304", message, span);
                        self.diagnostics.push(error);
                        None
                    }
                }
            }
            "stick-input" => {
                fields.require(&["value"], &mut self.diagnostics);
                let value = fields.flag("value", &mut self.diagnostics);
                let input = self.module_input(fields, member)?;
                one(Action::StickInput { input, value: value? })
            }
            "free-input" => one(Action::FreeInput { input: self.module_input(fields, member)? }),
            "slow" => one(Action::Slow { by: self.slowness(fields)? }),
            "cut" => self.cut(fields, member, |to| Action::Cut { to }),
            "heal" => self.cut(fields, member, |to| Action::Heal { to }),
            "unplug" => self.cable(fields, member, |network| Action::Unplug { network }),
            "plug" => self.cable(fields, member, |network| Action::Plug { network }),
            "delay" => {
                let by = self.slowness(fields);
                let links =
                    self.cut(fields, member, |to| Action::Delay { to, by: by.unwrap_or_default() });
                by.and(links)
            }
            "forge" => one(Action::Forge),
            "corrupt" => one(Action::Corrupt { frames: self.number(fields, "frames")? }),
            "replay" => one(Action::Replay { age: self.number(fields, "age")? }),
            "flip-state" => {
                let program = self.program(fields, member);
                let bit = self.number(fields, "bit")?;
                one(Action::FlipState { program: program?, bit })
            }
            _ => {
                let bit = self.number(fields, "bit");
                let frames = self.number(fields, "frames");
                let (bit, frames) = (bit?, frames?);
                one(match word {
                    "flip-sample" => Action::FlipSample { bit, frames },
                    _ => Action::FlipWord { bit, frames },
                })
            }
        }
    }

    /// The input that a step sets.
    fn input(
        &mut self,
        fields: &mut Fields<'_, '_>,
        member: Option<Member>,
    ) -> Option<Placed<&NamedSignal>> {
        fields.require(&["input"], &mut self.diagnostics);
        let name = fields.text("input", &mut self.diagnostics)?;
        let program = member.and_then(Member::sampled_program)?;
        let inputs = || self.members.into_iter().flat_map(|it| it.inputs(program));
        let found = inputs().find(|signal| signal.name == name.value);
        if found.is_none() {
            let help = suggestion(name.value, inputs().map(|signal| signal.name.as_str()));
            let message = format!("the program has no input `{}`", name.value);
            let error = Diagnostic::error("U0309", message, name.span.clone());
            self.diagnostics.push(error.with_help(help));
        }
        Some(Placed { value: found?, span: name.span })
    }

    /// The input of a module that is stuck: one bit.
    fn module_input(&mut self, fields: &mut Fields<'_, '_>, member: Option<Member>) -> Option<u16> {
        let Placed { value: signal, span } = self.input(fields, member)?;
        let (place, of) = (signal.place.first_bit(), signal.declared.of);
        if of.bits() == 1 {
            return Some(place);
        }
        let message = format!("`{}` is {of}: an input module is stuck at a BOOL only", signal.name);
        self.diagnostics.push(Diagnostic::error("U0304", message, span));
        None
    }

    /// An input that operators write, and its value.
    fn written(&mut self, fields: &mut Fields<'_, '_>, member: Option<Member>) -> Option<Action> {
        fields.require(&["input", "value"], &mut self.diagnostics);
        let name = fields.text("input", &mut self.diagnostics);
        let value = fields.get("value");
        let value = value.and_then(|value| value.constant(&mut self.diagnostics));
        let (name, value) = (name?, value?);
        let Some(Member::RemoteIo(program)) = member else {
            return None;
        };
        let mut inputs = self.members?.operator_inputs(program);
        let Some(named) = inputs.find(|input| input.name == name.value) else {
            let known = self.members?.operator_inputs(program);
            let help = suggestion(name.value, known.map(|input| input.name.as_str()));
            let message = format!("operators write no input `{}` there", name.value);
            self.diagnostics.push(Diagnostic::error("U0309", message, name.span).with_help(help));
            return None;
        };
        let place = named.input.place;
        let problem = match stored_value(&value.value, &named.declared) {
            Ok(stored) => {
                let value = PointValue::new(place.of.bits(), stored);
                match named.input.check(value) {
                    Ok(()) => {
                        let input = place.bit;
                        return Some(Action::Write { input, value });
                    }
                    Err(ValueMismatch::Limits) => outside(named),
                    Err(ValueMismatch::Type) => "the value has another type".to_owned(),
                }
            }
            Err(expected) => expected,
        };
        let message = format!("`{}` is {}: {problem}", named.name, named.declared);
        self.diagnostics.push(Diagnostic::error("U0304", message, value.span));
        None
    }

    /// A small number; its least value where the step does not say.
    fn number(&mut self, fields: &mut Fields<'_, '_>, key: &'static str) -> Option<u16> {
        let number = if fields.has(key) {
            fields.format_count(key, &mut self.diagnostics)?.value
        } else {
            fields.ignore(&[key]);
            *STEP.kind(key).counts().start()
        };
        u16::try_from(number).ok()
    }

    fn slowness(&mut self, fields: &mut Fields<'_, '_>) -> Option<Duration> {
        fields.require(&["by"], &mut self.diagnostics);
        fields.format_time("by", &mut self.diagnostics)
    }

    /// One action for each member that is named by `to`, or for all others where nobody is; with `both_ways`, one for each of
    /// them as well.
    fn cut(
        &mut self,
        fields: &mut Fields<'_, '_>,
        member: Option<Member>,
        action: impl Fn(Member) -> Action,
    ) -> Option<Vec<(Option<Member>, Action)>> {
        let names = fields.texts("to", &mut self.diagnostics);
        let both_ways = fields.flag("both_ways", &mut self.diagnostics);
        let both_ways = both_ways.unwrap_or(false);
        let mut peers = Vec::new();
        for name in &names {
            match self.member(name) {
                Some(peer) if Some(peer) != member && !matches!(peer, Member::Plant(_)) => {
                    peers.push(peer);
                }
                Some(_) => {
                    let message = format!("`{}` cannot receive from it", name.value);
                    self.diagnostics.push(
                        Diagnostic::error("U0309", message, name.span.clone())
                            .with_help("another station, a remote I/O or its twin"),
                    );
                }
                None => {}
            }
        }
        let member = member?;
        if names.is_empty() {
            let all = self.members?.iter().map(|(peer, _)| peer);
            peers.extend(all.filter(|&peer| peer != member && !matches!(peer, Member::Plant(_))));
        }
        let there = peers.iter().map(|&peer| (None, action(peer)));
        let back = peers.iter().map(|&peer| (Some(peer), action(member)));
        let both = there.clone().chain(back.take(if both_ways { peers.len() } else { 0 }));
        Some(both.collect())
    }

    /// One action for the cable of this member to a network, or for its direct link; with `others`, one for each of the others too.
    fn cable(
        &mut self,
        fields: &mut Fields<'_, '_>,
        member: Option<Member>,
        action: impl Fn(Via) -> Action,
    ) -> Option<Vec<(Option<Member>, Action)>> {
        let is_link = fields.flag("direct_link", &mut self.diagnostics).unwrap_or(false);
        if !is_link {
            fields.require(&["network"], &mut self.diagnostics);
        } else if fields.has("network") {
            let message = "a cable is that of a network or the direct link, not both";
            let help = "write one step for each, or remove `network`";
            let found = Diagnostic::error("U0309", message, fields.span());
            self.diagnostics.push(found.with_help(help));
            fields.ignore(&["network"]);
        }
        let others = fields.flag("others", &mut self.diagnostics).unwrap_or(false);
        let place = fields.span();
        let network = match is_link {
            true => None,
            false => Some(fields.format_count("network", &mut self.diagnostics)?),
        };
        let members = self.members?;
        let via = match network {
            None if member.is_some_and(|member| !members.is_linked(member)) => {
                let message = "no direct link joins this member with another one";
                let help =
                    "name a remote I/O whose twin has `direct_link = true` in the cluster file";
                self.diagnostics.push(Diagnostic::error("U0309", message, place).with_help(help));
                return None;
            }
            None => Via::Link,
            Some(network) if !members.have_two_networks() => {
                self.diagnostics.push(one_network(network.span, "use `cut`"));
                return None;
            }
            Some(network) => Via::try_from(network.value as u8).ok()?,
        };
        let all = members.iter().map(|(peer, _)| peer);
        let is_on = |peer: Member| match via {
            Via::Link => members.is_linked(peer),
            _ => !matches!(peer, Member::Plant(_)),
        };
        let peers = all.filter(|&peer| Some(peer) != member && is_on(peer));
        let others: Vec<Member> = if others { peers.collect() } else { Vec::new() };
        let own = (None, action(via));
        Some(
            [own]
                .into_iter()
                .chain(others.into_iter().map(|peer| (Some(peer), action(via))))
                .collect(),
        )
    }

    /// The program whose state it is: named by its controller; a controller's own where the step does not say.
    fn program(
        &mut self,
        fields: &mut Fields<'_, '_>,
        member: Option<Member>,
    ) -> Option<ProgramId> {
        let named = fields.text("program", &mut self.diagnostics);
        let programs = self.members?.remote_ios().count();
        let controller = |member: Option<Member>| match member {
            Some(Member::Station(station)) if station.index() < programs => {
                Some(station.controlled())
            }
            _ => None,
        };
        let (asked, place) = match named {
            Some(name) => (self.member(&name), name.span),
            None => (member, fields.span()),
        };
        let program = controller(asked);
        if program.is_none() && asked.is_some() {
            let message = "whose state is it? `program` names a controller".to_owned();
            let names = self.members?.stations().take(programs);
            let help = suggestion("", names.map(|(_, name)| name));
            self.diagnostics.push(Diagnostic::error("U0309", message, place).with_help(help));
        }
        program
    }

    /// Nobody is crashed twice without a restart between, and nobody is restarted who runs.
    fn steps_are_possible(&mut self, placed: &[Step]) {
        let mut last: BTreeMap<&str, (Action, Range<usize>)> = BTreeMap::new();
        for Placed { value, span } in placed {
            let (faults, name) = value;
            let Some(step) = faults.first() else {
                continue;
            };
            // A process that was restarted runs, whatever it was restarted with.
            let action = match step.action {
                Action::RestartMisconfigured
                | Action::RestartWrongProgram
                | Action::RestartInEpoch { .. } => Action::Restart,
                Action::Crash | Action::Restart | Action::Stop | Action::Continue => step.action,
                _ => continue,
            };
            let before = last.get(name.as_str());
            let is_slot = self.members.is_some_and(|members| {
                members.find(name).is_some_and(|member| members.is_spare_slot(member))
            });
            // The slot of a spare is empty at first.
            let at_first = is_slot.then_some(Action::Crash);
            let possible = matches!(
                (before.map(|(action, _)| *action).or(at_first), action),
                (None | Some(Action::Restart | Action::Continue), Action::Crash | Action::Stop)
                    | (Some(Action::Stop), Action::Continue | Action::Crash)
                    | (Some(Action::Crash), Action::Restart)
            );
            if !possible {
                let why = match before {
                    None if is_slot => "is the empty slot of a spare; restart it first",
                    Some((Action::Crash, _)) => "has crashed by then; restart it first",
                    Some((Action::Stop, _)) => "is suspended by then; continue it first",
                    _ => "runs by then",
                };
                let message = format!(
                    "{} at cycle {}: `{name}` {why}",
                    action_word(step.action),
                    step.at_cycle
                );
                let mut diagnostic = Diagnostic::error("U0308", message, span.clone());
                if let Some((_, before)) = before {
                    diagnostic = diagnostic.with_related(before.clone(), "its last step");
                }
                self.diagnostics.push(diagnostic);
            }
            last.insert(name, (action, span.clone()));
        }
    }
}

/// What is wrong with a value outside the limits of an operator input.
fn outside(named: &NamedInput) -> String {
    let text = |stored| value_text(&named.declared, stored);
    match named.input.kind {
        OperatorInputKind::Setpoint { low, high } => format!(
            "the value is outside the limits: write one from {} to {}",
            text(low),
            text(high)
        ),
        _ => "the value is outside the limits".to_owned(),
    }
}
