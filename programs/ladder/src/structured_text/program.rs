//! A ladder as Structured Text: for each rung the calls of its blocks, then what its coils write, in the order of the scan.
//!
//! Invariant: every statement reads what the scan of the rung reads at that place. An expression is written at most once, unless it is a single
//! operand: what is needed twice, or before a call that changes it, is held in a bit of its own.

use std::collections::{HashMap, HashSet};
use std::time::Duration;

use super::power::Power;
use super::sections::Sections;
use super::{broken, comment, configuration, section, standard_time, statement};
use crate::names::StandardNames;
use crate::program::{
    Block, Coil, CoilKind, Contact, ContactKind, Element, Name, Program, Relation, Rung, Series,
    Signal, visit, visit_any,
};

/// A PROGRAM whose execution is one scan of `program`, and the task that executes it every `period`.
///
/// Timers, counters, latches and triggers are instances of the standard function blocks; edge contacts and edge coils are instances of R_TRIG and
/// F_TRIG. Names become identifiers of the standard; the ladder's name is in the comment behind one that was changed.
pub fn structured_text(program: &Program, period: Duration) -> String {
    Written::new(program, period, false).text
}

/// What sees the edges of contacts and coils, in the order of the scan: its name as [`Program::typed`] has it, such as `a.rising`, and in the Structured
/// Text of the program.
pub fn edge_names(program: &Program) -> Vec<(String, String)> {
    let written = Written::new(program, Duration::from_millis(1), false);
    written.edges.into_iter().map(|(name, own)| (own, name)).collect()
}

/// A text, and its names.
pub(crate) struct Written {
    pub(crate) text: String,
    /// The names of signals and blocks in the text, each with the name in the ladder.
    pub(crate) names: Vec<(String, String)>,
    /// The names in the text of what sees edges, in the order of the scan, each with what it is called in the ladder: `a.rising`.
    pub(crate) edges: Vec<(String, String)>,
    /// Outputs behind those of the program that keep what is read where it is read, in the order of the scan: for a contact its operand, behind it
    /// what sees its edge; for a comparison the count; for a block its output, and behind it its time or count. Then, behind the elements of a rung, for each
    /// coil its target before the first coil, and for each coil that sees an edge what sees it. Behind all rungs the memory bits.
    pub(crate) taps: Vec<String>,
}

impl Written {
    pub(crate) fn new(program: &Program, period: Duration, is_tapped: bool) -> Self {
        let mut writer = Writer::new(program);
        writer.taps = is_tapped.then(Vec::new);
        for rung in &program.rungs {
            writer.rung(rung);
        }
        for signal in &program.memory {
            let operand = writer.names.operand(&signal.name);
            writer.tap("BOOL", &operand);
        }
        let text = writer.text(period);
        let names = writer.names.all().map(|(own, written)| (written.to_owned(), own.to_owned()));
        let names: Vec<(String, String)> = names.collect();
        let mut taken: HashSet<String> = names.iter().map(|(_, own)| own.clone()).collect();
        let edges = writer.edges.into_iter().map(|edge| {
            let mut unique = edge.of.clone();
            let mut count = 2;
            while !taken.insert(unique.clone()) {
                unique = format!("{}_{count}", edge.of);
                count += 1;
            }
            (edge.name, unique)
        });
        let edges = edges.collect();
        let taps = writer.taps.unwrap_or_default().into_iter().map(|(name, _)| name).collect();
        Self { text, names, edges, taps }
    }
}

impl Writer<'_> {
    fn text(&mut self, period: Duration) -> String {
        let program = self.program;
        let writer = self;
        let mut text = String::new();
        for line in program.comments.iter().chain(&program.description) {
            text.push_str(&format!("{}\n", comment(line)));
        }
        text.push_str(&format!("PROGRAM {}\n", writer.names.program()));
        writer.declarations(&mut text);
        text.push_str(&writer.body);
        if !program.footer.is_empty() {
            text.push('\n');
        }
        for line in &program.footer {
            text.push_str(&format!("  {}\n", comment(line)));
        }
        text.push_str("END_PROGRAM\n");
        writer.names.configuration(&mut text, period);
        text
    }
}

impl StandardNames {
    fn configuration(&mut self, text: &mut String, period: Duration) {
        let program = self.program().to_owned();
        configuration(text, &program, period, self.namer());
    }
}

/// Brackets of one statement that stand in each other.
const MAXIMUM_DEPTH: usize = 16;

/// An instance of R_TRIG or F_TRIG.
struct Edge {
    name: String,
    block: &'static str,
    /// What it is called in a ladder.
    of: String,
}

struct Writer<'a> {
    program: &'a Program,
    names: StandardNames,
    presets: HashMap<&'a str, u16>,
    /// Bits that hold an expression, in the order of their use.
    held: Vec<String>,
    /// Instances for edge contacts and edge coils.
    edges: Vec<Edge>,
    /// Variables that keep what is read where it is read, with their types; where they are asked for.
    taps: Option<Vec<(String, &'static str)>>,
    /// Blocks of the present rung that are called further on.
    pending: HashSet<&'a str>,
    /// Blocks whose call takes the power of the present series: what is read of them goes into their call.
    taking: HashSet<&'a str>,
    /// Branches around the present element.
    depth: usize,
    body: String,
}

impl<'a> Writer<'a> {
    fn new(program: &'a Program) -> Self {
        let counters = program.blocks().into_iter();
        let presets = counters
            .filter_map(|block| Some((block.name.as_str(), block.kind.preset_value()?)))
            .collect();
        Self {
            program,
            names: StandardNames::of(program),
            presets,
            held: Vec::new(),
            edges: Vec::new(),
            taps: None,
            pending: HashSet::new(),
            taking: HashSet::new(),
            depth: 0,
            body: String::new(),
        }
    }

    fn rung(&mut self, rung: &'a Rung) {
        self.body.push('\n');
        for line in rung.title.iter().chain(&rung.comments) {
            self.body.push_str(&format!("  {}\n", comment(line)));
        }
        visit(&rung.network, &mut |element| {
            if let Element::Block(block) = element {
                self.pending.insert(&block.name);
            }
        });
        let mut power = self.series(&rung.network, Power::On);
        for coil in &rung.coils {
            let target = self.names.operand(&coil.target);
            self.tap("BOOL", &target);
        }
        if rung.coils.is_empty() && !matches!(rung.network.last(), Some(Element::Block(_))) {
            power = self.hold("power", power);
        }
        let is_choice = rung.coils.iter().all(|coil| coil.kind.is_latch());
        let is_single = rung.coils.len() == 1 || is_choice;
        if !is_single && (!power.is_word() || self.changes(rung, &power)) {
            power = self.hold("power", power);
        }
        for coils in
            rung.coils.chunk_by(|left, right| left.kind.is_latch() && right.kind.is_latch())
        {
            match coils {
                [coil] => self.coil(coil, &power),
                latches => self.latches(latches, &power),
            }
        }
    }

    /// Whether a coil changes the one word that the coils behind it read.
    fn changes(&self, rung: &Rung, power: &Power) -> bool {
        let Some((_, changing)) = rung.coils.split_last() else {
            return false;
        };
        matches!(power, Power::Word(word) if changing.iter().any(|coil| self.names.operand(&coil.target) == *word))
    }

    fn state(&mut self, words: &[String]) {
        statement(&mut self.body, words);
    }

    fn assign(&mut self, target: &str, power: &Power) {
        let mut words = vec![target.to_owned(), ":=".into()];
        power.words(0, &mut words);
        self.state(&words);
    }

    /// Keeps a value in a bit of its own.
    fn hold(&mut self, wanted: &str, power: Power) -> Power {
        let name = self.names.add(wanted);
        self.assign(&name, &power);
        self.held.push(name.clone());
        Power::Word(name)
    }

    /// Calls an instance of its own that sees the edges of `power`, and gives its output; `drawn` is what the contact or coil is drawn with, and `of` what
    /// has the edges.
    fn edge(&mut self, kind: &'static str, (drawn, of): (&str, &str), power: &Power) -> Power {
        let direction = if kind == "R_TRIG" { "rising" } else { "falling" };
        let name = self.names.add(&format!("{}_{direction}", self.names.operand(drawn)));
        let mut words = vec![format!("{name}("), "CLK".into(), ":=".into()];
        power.words(0, &mut words);
        words.push(")".into());
        self.state(&words);
        let pulse = format!("{name}.Q");
        let of = format!("{of}.{direction}");
        self.edges.push(Edge { name, block: kind, of });
        Power::Word(pulse)
    }

    /// The edges of the power of a coil, not those of its target.
    fn coil_edge(&mut self, kind: &'static str, coil: &Coil, power: &Power) -> Power {
        let power_of = format!("{}.power", coil.target);
        self.edge(kind, (&coil.target, &power_of), power)
    }

    /// Keeps what is read here.
    fn tap(&mut self, of: &'static str, operand: &str) {
        if self.taps.is_none() {
            return;
        }
        let name = self.names.add("tap");
        self.state(&[name.clone(), ":=".into(), operand.to_owned()]);
        self.taps.get_or_insert_default().push((name, of));
    }

    /// Set and reset coils with the same power, which is read once.
    fn latches(&mut self, coils: &[Coil], power: &Power) {
        let latched = |coil: &Coil| {
            let value = if coil.kind == CoilKind::Set { "TRUE" } else { "FALSE" };
            format!("{} := {value}", self.names.operand(&coil.target))
        };
        let latched: Vec<String> = coils.iter().map(latched).collect();
        if matches!(power, Power::On) {
            for latched in latched {
                self.state(&[latched]);
            }
            return;
        }
        let mut words = vec!["IF".into()];
        power.words(0, &mut words);
        words.push("THEN".into());
        if let [latched] = latched.as_slice() {
            words.push(format!("{latched}; END_IF"));
            self.state(&words);
            return;
        }
        broken(&mut self.body, &words);
        for latched in latched {
            self.body.push_str(&format!("\n    {latched};"));
        }
        self.body.push_str("\n  END_IF;\n");
    }

    fn coil(&mut self, coil: &Coil, power: &Power) {
        let target = self.names.operand(&coil.target);
        match coil.kind {
            CoilKind::Set | CoilKind::Reset => self.latches(std::slice::from_ref(coil), power),
            CoilKind::Plain => self.assign(&target, power),
            CoilKind::Negated => {
                let mut words = vec![target, ":=".into()];
                match power {
                    Power::On => words.push("FALSE".into()),
                    // Not every compiler reads NOT NOT.
                    Power::Not(word) => words.push(word.clone()),
                    power => {
                        words.push("NOT".into());
                        power.words(3, &mut words);
                    }
                }
                self.state(&words);
            }
            CoilKind::Rising => {
                let pulse = self.coil_edge("R_TRIG", coil, power);
                self.assign(&target, &pulse);
                self.tap("BOOL", &target);
            }
            CoilKind::Falling => {
                let pulse = self.coil_edge("F_TRIG", coil, power);
                self.assign(&target, &pulse);
                self.tap("BOOL", &target);
            }
        }
    }

    fn series(&mut self, series: &'a Series, rail: Power) -> Power {
        self.taking.extend(direct_blocks(series));
        let mut power = rail;
        for element in series {
            power = match element {
                Element::Contact(contact) => {
                    let passes = self.contact(contact);
                    power.and(passes)
                }
                Element::Comparison(comparison) => {
                    let counter = comparison.counter.as_str();
                    let preset = self.presets.get(counter).copied();
                    let sign = portable(comparison.relation, comparison.value, preset).sign();
                    let counter_name = self.names.operand(counter);
                    let text = format!("{counter_name}.CV {sign} {}", comparison.value);
                    self.tap("INT", &format!("{counter_name}.CV"));
                    let passes = self.before(counter, Power::Compared(text));
                    power.and(passes)
                }
                Element::Branches(branches) => self.branches(branches, power),
                Element::Block(block) => self.block(block, &power),
            };
        }
        for block in direct_blocks(series) {
            self.taking.remove(block);
        }
        power
    }

    fn branches(&mut self, branches: &'a [Series], power: Power) -> Power {
        let calls = |branch: &Series| visit_any(branch, |inner| matches!(inner, Element::Block(_)));
        let has_block = branches.iter().any(calls);
        // The power before the branches is common to them, and a block in one of them needs it there.
        let power = if has_block && !power.is_word() { self.hold("power", power) } else { power };
        let start = if has_block { power.clone() } else { Power::On };
        self.depth += 1;
        let depth = self.depth;
        let parts: Vec<Power> =
            branches.iter().map(|branch| self.series(branch, start.clone())).collect();
        self.depth -= 1;
        let mut any = Power::Any(parts);
        if depth.is_multiple_of(MAXIMUM_DEPTH) {
            any = self.hold("power", any);
        }
        if has_block { any } else { power.and(any) }
    }

    fn contact(&mut self, contact: &Contact) -> Power {
        let operand = self.names.operand(&contact.operand);
        self.tap("BOOL", &operand);
        let block = match contact.kind {
            ContactKind::NormallyOpen => return self.read(contact, Power::Word(operand)),
            ContactKind::NormallyClosed => return self.read(contact, Power::Not(operand)),
            ContactKind::Rising => "R_TRIG",
            ContactKind::Falling => "F_TRIG",
        };
        let drawn = (contact.operand.as_str(), contact.operand.as_str());
        let pulse = self.edge(block, drawn, &Power::Word(operand));
        if let Power::Word(word) = &pulse {
            self.tap("BOOL", &word.clone());
        }
        pulse
    }

    fn read(&mut self, contact: &Contact, power: Power) -> Power {
        match contact.operand.rsplit_once('.') {
            Some((block, _)) => self.before(block, power),
            None => power,
        }
    }

    /// What is read of a block: above its call in the same rung it is the last scan's, and is kept before the call changes it.
    fn before(&mut self, block: &str, power: Power) -> Power {
        if self.pending.contains(block) && !self.taking.contains(block) {
            self.hold("before", power)
        } else {
            power
        }
    }

    fn block(&mut self, block: &'a Block, power: &Power) -> Power {
        let kind = block.kind;
        let mut fed = vec![(kind.wire_input(), power.clone())];
        let around = std::mem::replace(&mut self.taking, HashSet::from([block.name.as_str()]));
        for feed in &block.pins {
            let network = self.series(&feed.network, Power::On);
            fed.push((feed.pin.as_str(), network));
        }
        self.taking = around;
        let preset = kind
            .preset_time()
            .map(|time| ("PT", standard_time(time)))
            .or_else(|| kind.preset_value().map(|value| ("PV", value.to_string())));
        fed.extend(preset.map(|(pin, text)| (pin, Power::Word(text))));
        let name = self.names.operand(&block.name);
        let mut words = vec![format!("{name}(")];
        for (place, (pin, power)) in fed.iter().enumerate() {
            if let (Some(last), true) = (words.last_mut(), place > 0) {
                last.push(',');
            }
            words.extend([(*pin).to_owned(), ":=".into()]);
            power.words(0, &mut words);
        }
        words.push(")".into());
        self.state(&words);
        self.pending.remove(block.name.as_str());
        let output = format!("{name}.{}", kind.outputs()[0]);
        self.tap("BOOL", &output);
        let value = kind.value_output().map(|pin| format!("{name}.{pin}"));
        if let Some(value) = value {
            let of = if kind.preset_time().is_some() { "TIME" } else { "INT" };
            self.tap(of, &value);
        }
        Power::Word(output)
    }

    fn declarations(&self, text: &mut String) {
        let program = self.program;
        let inputs = program.inputs.iter().map(|signal| ("VAR_INPUT", signal));
        let outputs = program.outputs.iter().map(|signal| ("VAR_OUTPUT", signal));
        let memory = program.memory.iter().map(|signal| ("VAR", signal));
        let retained: HashSet<&str> = program.retained.iter().map(Name::as_str).collect();
        let mut sections = Sections::default();
        for (word, signal) in inputs.chain(outputs).chain(memory) {
            // Located variables have sections of their own.
            let is_located = signal.address.is_some();
            let key = (if is_located { "VAR" } else { word }, is_located);
            let is_kept = retained.contains(signal.name.as_str());
            sections.add((key.0, key.1, is_kept), self.declaration(signal));
        }
        sections.end();
        for block in program.blocks() {
            let name = self.names.signal(&block.name);
            let about = remark(&block.name, name, &Signal::default());
            let line = format!("{name} : {};{about}", block.kind.word());
            sections.add(("VAR", false, retained.contains(block.name.as_str())), line);
        }
        let edges = self.edges.iter().map(|edge| format!("{} : {};", edge.name, edge.block));
        let held = self.held.iter().map(|name| format!("{name} : BOOL;"));
        for line in edges.chain(held) {
            sections.add(("VAR", false, false), line);
        }
        sections.end();
        text.push_str(&sections.text);
        // They come last, so that all others stand where they stand without them.
        let taps = self.taps.iter().flatten();
        let taps: Vec<String> = taps.map(|(name, of)| format!("{name} : {of};")).collect();
        section(text, "VAR_OUTPUT", &taps);
    }

    fn declaration(&self, signal: &Signal) -> String {
        let name = self.names.signal(&signal.name);
        let address = signal.address.as_ref();
        let address = address.map_or(String::new(), |address| format!(" AT {address}"));
        let initial = match signal.initial {
            None => "",
            Some(true) => " := TRUE",
            Some(false) => " := FALSE",
        };
        let about = remark(&signal.name, name, signal);
        format!("{name}{address} : BOOL{initial};{about}")
    }
}

fn direct_blocks(series: &Series) -> impl Iterator<Item = &str> {
    series.iter().filter_map(|element| match element {
        Element::Block(block) => Some(block.name.as_str()),
        _ => None,
    })
}

/// The comment behind a declaration: the ladder's name, where it was changed, and what is said about the signal.
fn remark(wanted: &str, name: &str, signal: &Signal) -> String {
    let changed = (wanted != name).then_some(wanted);
    let about = signal.comments.iter().chain(&signal.description);
    let parts: Vec<&str> = changed.into_iter().chain(about.map(String::as_str)).collect();
    if parts.is_empty() { String::new() } else { format!("  {}", comment(&parts.join("  "))) }
}

/// The relation as it is also right where a counter counts on past its preset, as the third edition of the standard has it.
fn portable(relation: Relation, value: u16, preset: Option<u16>) -> Relation {
    match relation {
        Relation::Equal if preset == Some(value) => Relation::GreaterOrEqual,
        Relation::NotEqual if preset == Some(value) => Relation::Less,
        relation => relation,
    }
}
