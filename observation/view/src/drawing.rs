//! A program with numbers as function blocks or as a chart, with the values of one scan.
//!
//! A value at a connection is what the statement read or assigned in this scan, not what the variable is at the end of it. What an operation
//! between two blocks came to is shown where the operations of the scan are those of the drawing, one by one; else it is left out.

use std::collections::BTreeMap;

use understudy_diagram::Picture;
use understudy_diagram::blocks::{Coil, Contacts, Kind, Network};
use understudy_diagram::chart::Chart;
use understudy_interchange::DrawnBody;
use understudy_text::Lines;
use understudy_typed::{
    Comparison, Declared, Done, Effect, Elementary, Made, Operation, Program, RealFunction, Trace,
};
use understudy_wire::ProgramId;

use crate::error::ViewError;
use crate::model::Model;
use crate::shown_text::ShownLine;
use crate::value::value_text;

impl Model {
    /// The programs of a controller with numbers as SVG, with the values of a cycle; without values where the state is not known, which the second
    /// part says. Nothing for a Boolean program.
    pub fn drawing_at(
        &self,
        program: ProgramId,
        cycle: i64,
    ) -> Option<(String, Option<ViewError>)> {
        let version = self.version_in(program, Some(cycle))?;
        let code = &version.controller().code;
        let units = version.drawing();
        if units.is_empty() {
            return None;
        }
        let typed = code.typed();
        let (trace, error) = match self.trace(program, cycle) {
            Ok(trace) => (Some(trace), None),
            Err(error) => (None, Some(error)),
        };
        let lines = Lines::new(&code.source().text);
        let mut picture = Picture::new();
        for unit in units.iter().filter(|unit| unit.is_program) {
            let mut unit = unit.clone();
            let scan = trace.as_ref().map(|trace| Scan::new(typed, trace, &unit.name));
            let mut about = String::new();
            if let Some(scan) = &scan {
                match &mut unit.body {
                    DrawnBody::Networks(networks) => {
                        let mut networks = networks.iter_mut();
                        networks.by_ref().for_each(|it| scan.network(it, &lines));
                    }
                    DrawnBody::Chart(chart) => about = scan.chart(chart),
                    DrawnBody::Text(text, _) => {
                        let shown = self.text_at(program, cycle);
                        let shown = shown.map(|(lines, _)| scan.body(&lines));
                        *text = shown.filter(|it| !it.is_empty()).unwrap_or_else(|| text.clone());
                    }
                }
            }
            picture.heading(&unit.heading);
            if let DrawnBody::Text(_, Some(reason)) = &unit.body {
                picture.note(&format!("as text, since it has {reason}"));
            }
            unit.paint_body(&mut picture);
            picture.note(&about);
        }
        Some((picture.svg(&typed.name), error))
    }
}

/// What one program did in a scan.
struct Scan<'t> {
    typed: &'t Program,
    trace: &'t Trace,
    unit: &'t str,
    /// The assignments of each line.
    lines: BTreeMap<u32, Vec<&'t Done>>,
}

impl<'t> Scan<'t> {
    fn new(typed: &'t Program, trace: &'t Trace, unit: &'t str) -> Self {
        let mut lines: BTreeMap<u32, Vec<&Done>> = BTreeMap::new();
        for done in &trace.done {
            let is_own = typed.routine(done.routine).name.eq_ignore_ascii_case(unit);
            if is_own && matches!(done.effect, Effect::Assigned { .. }) {
                lines.entry(done.line).or_default().push(done);
            }
        }
        Self { typed, trace, unit, lines }
    }

    /// The address of a variable of the program.
    fn part(&self, name: &str) -> Option<understudy_typed::Part> {
        let behind_program = format!("{}.{name}", self.unit);
        let part = self.typed.part(&behind_program);
        part.or_else(|| self.typed.part(name))
    }

    /// A variable at the end of the scan.
    fn after(&self, name: &str) -> Option<String> {
        let part = self.part(name)?;
        let (_, stored) = part.stored(&self.trace.memory)?;
        Some(drawn(&part.declared()?, stored))
    }

    fn network(&self, network: &mut Network, lines: &Lines) {
        for at in 0..network.objects.len() {
            let Some(source) = network.objects[at].source else {
                continue;
            };
            let line = u32::try_from(lines.position(source).line).unwrap_or(0);
            let done = self.lines.get(&line).map_or(&[][..], Vec::as_slice);
            let object = &mut network.objects[at];
            // A call that is given nothing assigns nothing: it is not known here whether it was made.
            let is_silent = matches!(&object.kind, Kind::Block { instance: Some(_), .. })
                && object.inputs.iter().all(|input| input.name == "EN");
            object.executed = (!is_silent).then_some(!done.is_empty());
            match &mut object.kind {
                Kind::Contacts(contacts) => contacts.each(&mut |name, value| {
                    let read = self.read(name, done);
                    *value = read.as_deref().and_then(power);
                }),
                Kind::Value(text) => {
                    let value = self.read(text, done);
                    object.outputs[0].value = value.filter(|_| is_name(text));
                }
                Kind::Block { instance: Some(instance), .. } => {
                    let instance = instance.clone();
                    for output in &mut object.outputs {
                        output.value = self.after(&format!("{instance}.{}", output.name));
                    }
                }
                _ => {}
            }
        }
        self.results(network, lines);
        for at in 0..network.objects.len() {
            let object = &network.objects[at];
            let Kind::Contacts(contacts) = &object.kind else {
                continue;
            };
            let inputs = object.inputs.iter().filter_map(|input| input.from);
            let inputs = inputs.map(|(from, output)| {
                let value = &network.objects[from].outputs[output].value;
                value.as_deref().and_then(power)
            });
            let passes = contacts.passes(&inputs.collect::<Vec<_>>());
            let value = passes.map(|passes| if passes { "TRUE" } else { "FALSE" });
            if object.executed.is_some() {
                network.objects[at].outputs[0].value = value.map(str::to_owned);
            }
        }
    }

    /// What a statement read of a variable; where it was not executed, the variable at the end of the scan.
    fn read(&self, name: &str, done: &[&Done]) -> Option<String> {
        let part = self.part(name)?;
        let mut reads = done.iter().flat_map(|done| &done.reads);
        match reads.find(|read| read.address == part.address) {
            Some(read) => Some(drawn(&part.declared()?, read.value)),
            None => self.after(name),
        }
    }

    /// The outputs of functions: of those that feed a variable, and of those that feed an input of an instance.
    fn results(&self, network: &mut Network, lines: &Lines) {
        for at in 0..network.objects.len() {
            let object = network.objects[at].clone();
            let Some(source) = object.source else {
                continue;
            };
            let line = u32::try_from(lines.position(source).line).unwrap_or(0);
            let done = self.lines.get(&line).map_or(&[][..], Vec::as_slice);
            for input in object.inputs.iter().filter(|input| input.name != "EN") {
                let assigned = match &object.kind {
                    Kind::Target(name) | Kind::Coil(name, Coil::Plain) => name.clone(),
                    Kind::Block { instance: Some(instance), .. } => {
                        format!("{instance}.{}", input.name)
                    }
                    _ => continue,
                };
                if let (Some(from), Some(part)) = (input.from, self.part(&assigned)) {
                    fill(network, from, input.negated, assignment(done, part.address));
                }
            }
        }
    }

    /// Marks the active steps and what the conditions of transitions came to; the times of the active steps and the values that these conditions read,
    /// line by line.
    fn chart(&self, chart: &mut Chart) -> String {
        let mut about = String::new();
        for step in &mut chart.steps {
            let part = self.part(&format!("{}.X", step.name));
            let stored = part.and_then(|part| part.stored(&self.trace.memory));
            step.active = stored.map(|(_, value)| value != 0);
            if let (Some(true), Some(time)) = (step.active, self.after(&format!("{}.T", step.name)))
            {
                about += &format!("step {}: active for {}\n", step.name, time.replace("T#", ""));
            }
        }
        let mut known: BTreeMap<String, usize> = BTreeMap::new();
        for transition in &mut chart.transitions {
            let steps = |places: &[usize]| {
                let names = places.iter().map(|place| chart.steps[*place].name.as_str());
                names.collect::<Vec<_>>().join("+")
            };
            let (from, to) = (steps(&transition.from), steps(&transition.to));
            let fires = format!("fires.{from}.{to}");
            let number = known.entry(fires.to_lowercase()).or_insert(0);
            *number += 1;
            let fires = if *number > 1 { format!("{fires}.{number}") } else { fires };
            let Some((truth, values)) = self.transition(&fires, transition.from.len()) else {
                continue;
            };
            transition.truth = Some(truth);
            let truth = if truth { "TRUE" } else { "FALSE" };
            let condition = &transition.condition;
            about += &format!("transition {from} to {to}: {condition} is {truth}{values}\n");
        }
        about
    }

    /// What the condition of a transition came to, and the values that it read; nothing where a step before it was not active, or one of higher priority
    /// fired. The statement is `fires := step.X AND NOT other AND_THEN condition`, with `steps` steps.
    fn transition(&self, fires: &str, steps: usize) -> Option<(bool, String)> {
        let is_named = |known: &str| {
            let own = known.strip_prefix(self.unit).and_then(|name| name.strip_prefix('.'));
            own.unwrap_or(known).eq_ignore_ascii_case(fires)
        };
        let mut hidden = self.typed.hidden.iter();
        let address = 64 * u64::from(hidden.find(|known| is_named(&known.name))?.slot);
        let is_it = |done: &&Done| matches!(done.effect, Effect::Assigned { address: at, .. } if at == address);
        let done = self.trace.done.iter().find(is_it)?;
        let Effect::Assigned { value: Some((_, truth)), .. } = done.effect else {
            return None;
        };
        let mut values = Vec::new();
        let mut is_before = true;
        for (place, read) in done.reads.iter().enumerate() {
            let mut hidden = self.typed.hidden.iter();
            let is_other = hidden.any(|known| 64 * u64::from(known.slot) == read.address);
            is_before &= place < steps || is_other;
            if is_before && read.value != u64::from(!is_other) {
                return None;
            }
            let part = self.typed.part_at(read.address).filter(|_| !is_before);
            if let Some((declared, name)) = part.and_then(|it| Some((it.declared()?, it.name))) {
                let own = name.strip_prefix(self.unit).and_then(|name| name.strip_prefix('.'));
                let name = own.unwrap_or(&name);
                values.push(format!("{name} = {}", drawn(&declared, read.value)));
            }
        }
        let values =
            if values.is_empty() { String::new() } else { format!(", {}", values.join(", ")) };
        Some((truth != 0, values))
    }

    /// The statements of the program as they are written, those that were executed marked, with the values after the scan.
    fn body(&self, lines: &[ShownLine]) -> String {
        let is_word = |line: &ShownLine, word: &str| {
            let mut words =
                line.text.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
            words.any(|own| own.eq_ignore_ascii_case(word))
        };
        let begins = |line: &ShownLine| {
            let mut words = line.text.split_whitespace();
            let [first, second] = [(); 2].map(|()| words.next().unwrap_or_default());
            first.eq_ignore_ascii_case("PROGRAM") && second.eq_ignore_ascii_case(self.unit)
        };
        let own = lines.iter().skip_while(|line| !begins(line)).skip(1);
        let own: Vec<&ShownLine> = own.take_while(|line| !is_word(line, "END_PROGRAM")).collect();
        let declared = own.iter().rposition(|line| is_word(line, "END_VAR"));
        let own = &own[declared.map_or(0, |last| last + 1)..];
        let width = own.iter().map(|line| line.text.chars().count()).max().unwrap_or(0);
        let shown = own.iter().map(|line| {
            let values = line.values.iter().map(|value| {
                let text = self.after(&value.name);
                let text = text.unwrap_or_else(|| value_text(&value.value));
                format!("{} = {text}", value.name)
            });
            let mark = if line.executed { "▸" } else { " " };
            let values = values.collect::<Vec<_>>().join(", ");
            format!("{mark} {:width$}   {values}", line.text).trim_end().to_owned() + "\n"
        });
        shown.collect()
    }
}

/// A value as a drawing shows it: a real with at most seven digits, which fit next to a box.
fn drawn(declared: &Declared, stored: u64) -> String {
    let number = declared.of.number(stored);
    if declared.of.is_real() && number.is_finite() {
        let rounded: f64 = format!("{number:.6e}").parse().unwrap_or(number);
        return format!("{rounded:?}");
    }
    declared.text(stored)
}

/// The one assignment of an address, with its value.
fn assignment<'t>(done: &[&'t Done], address: u64) -> Option<(&'t Done, Elementary, u64)> {
    let mut found = done.iter().filter_map(|done| match done.effect {
        Effect::Assigned { address: at, value: Some((of, value)), .. } if at == address => {
            Some((*done, of, value))
        }
        _ => None,
    });
    let first = found.next()?;
    found.next().is_none().then_some(first)
}

/// Writes the values of the functions that lead to an output, and that of the output itself.
fn fill(
    network: &mut Network,
    (object, output): (usize, usize),
    negated: bool,
    assigned: Option<(&Done, Elementary, u64)>,
) {
    let Some((done, of, value)) = assigned else {
        return;
    };
    let is_made = matches!(
        network.objects[object].kind,
        Kind::Block { instance: None, .. } | Kind::Contacts(_)
    );
    if !is_made {
        return;
    }
    for (at, made) in matched(network, object, &done.results).unwrap_or_default() {
        let outputs = &mut network.objects[at].outputs;
        if let Some(output) = outputs.iter_mut().find(|output| output.name == "OUT") {
            output.value = Some(drawn(&made.of.into(), made.value));
        }
    }
    // The last one is what was assigned.
    if !negated {
        network.objects[object].outputs[output].value = Some(drawn(&of.into(), value));
    }
}

/// A variable without computed parts.
fn is_name(text: &str) -> bool {
    let mut letters = text.chars();
    let first = letters.next().is_some_and(|it| it.is_alphabetic() || it == '_' || it == '%');
    first && letters.all(|it| it.is_alphanumeric() || it == '_' || it == '.')
}

/// A value as power.
fn power(value: &str) -> Option<bool> {
    match value {
        "TRUE" => Some(true),
        "FALSE" => Some(false),
        _ => None,
    }
}

/// A value written out.
fn is_literal(text: &str) -> bool {
    let is_word = ["TRUE", "FALSE"].contains(&text);
    is_word || text.starts_with(|first: char| first.is_ascii_digit())
}

/// The functions that lead to an object with the operations that they were; nothing where these are not one another.
fn matched(network: &Network, root: usize, results: &[Made]) -> Option<Vec<(usize, Made)>> {
    let mut matching = Matching {
        network,
        results: results.iter().filter(|it| !is_between(it.operation)).collect(),
        next: 0,
        found: Vec::new(),
    };
    matching.object(root)?;
    let is_all = matching.next == matching.results.len();
    is_all.then_some(matching.found)
}

/// Goes through the functions of a statement in the order in which they are executed.
struct Matching<'n> {
    network: &'n Network,
    results: Vec<&'n Made>,
    next: usize,
    found: Vec<(usize, Made)>,
}

impl Matching<'_> {
    fn object(&mut self, at: usize) -> Option<()> {
        let network = self.network;
        let object = &network.objects[at];
        let of = match &object.kind {
            Kind::Value(text) => return (is_name(text) || is_literal(text)).then_some(()),
            Kind::Contacts(contacts) => return self.contacts(contacts, at),
            Kind::Target(_) | Kind::Coil(..) => return None,
            Kind::Block { instance: Some(_), .. } => return Some(()),
            Kind::Block { of, .. } => of.as_str(),
        };
        let inputs = object.inputs.iter().filter(|input| input.name != "EN");
        let (names, values): (Vec<&str>, Vec<usize>) =
            inputs.filter_map(|input| Some((input.name.as_str(), input.from?.0))).unzip();
        if of == "NOT" || of == "MOVE" || of.contains("_TO_") {
            return values.iter().try_for_each(|value| self.object(*value));
        }
        // What is made of literals alone is known before the scan.
        let is_known = |at: &usize| match &network.objects[*at].kind {
            Kind::Value(text) => is_literal(text),
            _ => false,
        };
        if values.iter().all(is_known) {
            return None;
        }
        let last = match (of, names.as_slice(), values.as_slice()) {
            ("LIMIT", ["MN", "IN", "MX"], [least, value, most]) => {
                // The last input is looked at first.
                [most, least, value].into_iter().try_for_each(|value| self.object(*value))?;
                self.take("MAX")?;
                self.take("MIN")?
            }
            ("SEL", ["G", "IN0", "IN1"], _) | ("MAX" | "MIN" | "ABS" | "SQRT", ..) => {
                values.iter().try_for_each(|value| self.object(*value))?;
                self.take(of)?
            }
            (_, _, [first, second, more @ ..]) => {
                self.object(*first)?;
                self.object(*second)?;
                let mut last = self.take(of)?;
                for value in more {
                    self.object(*value)?;
                    last = self.take(of)?;
                }
                last
            }
            _ => return None,
        };
        self.found.push((at, last));
        Some(())
    }

    /// Contacts in series and in parallel are AND and OR.
    fn contacts(&mut self, contacts: &Contacts, at: usize) -> Option<()> {
        let (all, word) = match contacts {
            Contacts::Contact { .. } => return Some(()),
            Contacts::Power(input) => {
                let (from, _) = self.network.objects[at].inputs.get(*input)?.from?;
                return self.object(from);
            }
            Contacts::Series(all) => (all, "AND"),
            Contacts::Parallel(all) => (all, "OR"),
        };
        for (number, one) in all.iter().enumerate() {
            self.contacts(one, at)?;
            if number > 0 {
                self.take(word)?;
            }
        }
        Some(())
    }

    /// The next operation, where it is that function.
    fn take(&mut self, of: &str) -> Option<Made> {
        let made = **self.results.get(self.next)?;
        self.next += 1;
        (word(made.operation) == Some(of)).then_some(made)
    }
}

/// Operations that stand between two functions and are no function of a drawing.
fn is_between(operation: Operation) -> bool {
    matches!(operation, Operation::Convert(..) | Operation::Reinterpret(..) | Operation::Not(_))
}

/// The function of a drawing that an operation is.
fn word(operation: Operation) -> Option<&'static str> {
    Some(match operation {
        Operation::Add(_) => "ADD",
        Operation::Subtract(_) => "SUB",
        Operation::Multiply(_) => "MUL",
        Operation::Divide(_) => "DIV",
        Operation::Modulo(_) => "MOD",
        Operation::And(_) => "AND",
        Operation::Or(_) => "OR",
        Operation::Xor(_) => "XOR",
        Operation::Select(_) => "SEL",
        Operation::Minimum(_) => "MIN",
        Operation::Maximum(_) => "MAX",
        Operation::Absolute(_) => "ABS",
        Operation::Real(RealFunction::SquareRoot, _) => "SQRT",
        Operation::Compare(comparison, _) => match comparison {
            Comparison::Equal => "EQ",
            Comparison::NotEqual => "NE",
            Comparison::Less => "LT",
            Comparison::LessOrEqual => "LE",
            Comparison::Greater => "GT",
            Comparison::GreaterOrEqual => "GE",
        },
        _ => return None,
    })
}
