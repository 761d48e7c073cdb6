//! One module a rung, as appendix 2 of the paper on the deployment of controllers has it.

use std::collections::{HashMap, VecDeque};
use std::fmt::Write as _;

use understudy_ladder::{
    Block, Coil, CoilKind, Comparison, Contact, ContactKind, Element, Program, Rung,
};

use super::names::Namer;

/// `program` with a module for each rung: its contacts are parameters, its coils `output`s. A rung passes its parameters on to the rungs below
/// it (`r1.c1`). Pins of blocks and comparisons are free, as the paper's timer is: the coil of a rung that ends with a timer is what starts the
/// timer, and its contacts are free. The specification is the paper's: every output of every rung can be switched on and off.
pub fn of_rungs(program: &Program) -> String {
    let mut text = format!(
        "-- {}: one module a rung; a rung sees the outputs of the others one step late\n",
        program.name
    );
    let modules: Vec<Module> = program.rungs.iter().map(Module::of).collect();
    for (place, module) in modules.iter().enumerate() {
        module.write(place + 1, &mut text);
    }
    write_main(&modules, &mut text);
    text
}

/// What a rung reads and what its coils become.
struct Module {
    /// Operands of contacts, each once.
    reads: Vec<String>,
    parameters: Vec<String>,
    /// Names of last values, and of what.
    edges: Vec<(String, String)>,
    /// For each coil its name in the module and its next value.
    outputs: Vec<(String, String)>,
    /// The coils' targets, in the same order; none where a timer stands before the coils.
    targets: Vec<String>,
    namer: Namer,
}

impl Module {
    fn of(rung: &Rung) -> Self {
        let mut module = Self {
            reads: Vec::new(),
            parameters: Vec::new(),
            edges: Vec::new(),
            outputs: Vec::new(),
            targets: Vec::new(),
            namer: Namer::default(),
        };
        let own: Vec<String> = (0..rung.coils.len())
            .map(|place| match place {
                0 => module.namer.name("output"),
                _ => module.namer.name(&format!("output{}", place + 1)),
            })
            .collect();
        let (network, is_timed) = before_timer(rung);
        let mut operands = Vec::new();
        push_operands(network, &mut operands);
        for place in 1..=operands.len() {
            module.namer.name(&format!("c{place}"));
        }
        for operand in &operands {
            module.parameter(operand);
        }
        let power = module.series(network);
        for (name, coil) in own.into_iter().zip(&rung.coils) {
            let next = module.coil(coil, &name, &power);
            module.outputs.push((name, next));
            if !is_timed {
                module.targets.push(coil.target.to_string());
            }
        }
        module
    }

    /// Parameter of an operand.
    fn parameter(&mut self, operand: &str) -> String {
        if let Some(place) = self.reads.iter().position(|read| read == operand) {
            return self.parameters[place].clone();
        }
        let name = self.namer.name(operand);
        self.reads.push(operand.to_owned());
        self.parameters.push(name.clone());
        name
    }

    fn edge(&mut self, value: &str) -> String {
        let last = self.namer.name("last");
        self.edges.push((last.clone(), value.to_owned()));
        last
    }

    fn series(&mut self, series: &[Element]) -> String {
        let parts: Vec<String> = series.iter().map(|element| self.element(element)).collect();
        match parts.len() {
            0 => "TRUE".to_owned(),
            1 => parts.into_iter().collect(),
            _ => format!("({})", parts.join(" & ")),
        }
    }

    fn element(&mut self, element: &Element) -> String {
        match element {
            Element::Contact(contact) => self.contact(contact),
            Element::Comparison(comparison) => self.parameter(&compared(comparison)),
            Element::Branches(branches) => {
                let parts: Vec<String> =
                    branches.iter().map(|series| self.series(series)).collect();
                format!("({})", parts.join(" | "))
            }
            Element::Block(block) => self.parameter(&pin(block)),
        }
    }

    fn contact(&mut self, contact: &Contact) -> String {
        let name = self.parameter(&contact.operand);
        match contact.kind {
            ContactKind::NormallyOpen => name,
            ContactKind::NormallyClosed => format!("!{name}"),
            ContactKind::Rising => format!("({name} & !{})", self.edge(&name)),
            ContactKind::Falling => format!("(!{name} & {})", self.edge(&name)),
        }
    }

    fn coil(&mut self, coil: &Coil, own: &str, power: &str) -> String {
        match coil.kind {
            CoilKind::Plain => power.to_owned(),
            CoilKind::Negated => format!("!{power}"),
            CoilKind::Set => format!("({power} | {own})"),
            CoilKind::Reset => format!("(!{power} & {own})"),
            CoilKind::Rising => format!("({power} & !{})", self.edge(power)),
            CoilKind::Falling => format!("(!{power} & {})", self.edge(power)),
        }
    }

    fn write(&self, number: usize, text: &mut String) {
        let parameters = match self.parameters.len() {
            0 => String::new(),
            _ => format!("({})", self.parameters.join(",")),
        };
        let _ = writeln!(text, "MODULE rung{number}{parameters}");
        let bits = self.outputs.iter().chain(&self.edges);
        if bits.clone().next().is_some() {
            text.push_str("VAR\n");
            for (name, _) in bits.clone() {
                let _ = writeln!(text, "  {name} : boolean;");
            }
            text.push_str("ASSIGN\n");
            for (name, next) in bits {
                let _ = writeln!(text, "  init({name}) := FALSE;\n  next({name}) := {next};");
            }
        }
        if !self.parameters.is_empty() {
            text.push_str("DEFINE\n");
            for (place, parameter) in self.parameters.iter().enumerate() {
                let _ = writeln!(text, "  c{} := {parameter};", place + 1);
            }
        }
    }
}

/// The network of a rung before a timer that drives its plain coils, and whether there is one.
fn before_timer(rung: &Rung) -> (&[Element], bool) {
    let is_plain = rung.coils.iter().all(|coil| coil.kind == CoilKind::Plain);
    match rung.network.split_last() {
        Some((Element::Block(block), before)) if is_plain && block.kind.preset_time().is_some() => {
            (before, true)
        }
        _ => (&rung.network, false),
    }
}

fn compared(comparison: &Comparison) -> String {
    format!("{} {} {}", comparison.counter, comparison.relation.sign(), comparison.value)
}

fn pin(block: &Block) -> String {
    format!("{}.{}", block.name, block.kind.outputs()[0])
}

/// What a network reads, each once, in the order of the paper: the first line, then the branches below it.
fn push_operands(series: &[Element], operands: &mut Vec<String>) {
    let mut lines = VecDeque::from([series]);
    while let Some(line) = lines.pop_front() {
        push_line(line, operands, &mut lines);
    }
}

/// What one line reads; the branches below it are kept for later.
fn push_line<'a>(
    line: &'a [Element],
    operands: &mut Vec<String>,
    below: &mut VecDeque<&'a [Element]>,
) {
    for element in line {
        let operand = match element {
            Element::Contact(contact) => contact.operand.to_string(),
            Element::Comparison(comparison) => compared(comparison),
            Element::Block(block) => pin(block),
            Element::Branches(branches) => {
                let mut branches = branches.iter().map(Vec::as_slice);
                if let Some(first) = branches.next() {
                    push_line(first, operands, below);
                }
                below.extend(branches);
                continue;
            }
        };
        if !operands.contains(&operand) {
            operands.push(operand);
        }
    }
}

fn write_main(modules: &[Module], text: &mut String) {
    text.push_str("MODULE main\nVAR\n");
    // The last rung that writes a signal.
    let mut written: HashMap<&str, String> = HashMap::new();
    for (place, module) in modules.iter().enumerate() {
        for (target, (output, _)) in module.targets.iter().zip(&module.outputs) {
            written.insert(target, format!("r{}.{output}", place + 1));
        }
    }
    // Where a rung gets what it reads: from the first rung above that reads it too, from the rung that writes it, or from a free input.
    let mut passed: HashMap<&str, String> = HashMap::new();
    let mut free = 0;
    let mut rungs = String::new();
    for (place, module) in modules.iter().enumerate() {
        let number = place + 1;
        let actual = module.reads.iter().map(|read| {
            let source = passed.get(read.as_str()).or_else(|| written.get(read.as_str())).cloned();
            source.unwrap_or_else(|| {
                free += 1;
                let _ = writeln!(text, "  in{free} : boolean; -- {read}");
                format!("in{free}")
            })
        });
        let actual: Vec<String> = actual.collect();
        let _ = match actual.len() {
            0 => writeln!(rungs, "  r{number} : rung{number};"),
            _ => writeln!(rungs, "  r{number} : rung{number}({});", actual.join(",")),
        };
        for (read, parameter) in module.reads.iter().zip(1..) {
            passed.entry(read).or_insert_with(|| format!("r{number}.c{parameter}"));
        }
    }
    text.push_str(&rungs);
    let switches = modules.iter().enumerate().flat_map(|(place, module)| {
        let outputs = module.outputs.iter();
        outputs
            .map(move |(output, _)| format!("EF (r{0}.{output}) & EF (!r{0}.{output})", place + 1))
    });
    let switches: Vec<String> = switches.collect();
    if !switches.is_empty() {
        let _ = writeln!(text, "SPEC\n  AG (\n    {})", switches.join(" &\n    "));
    }
}
