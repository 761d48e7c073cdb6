//! One module a rung, as appendix 2 of the paper on the deployment of controllers has it.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fmt::Write as _;

use understudy_ladder::{Coil, CoilKind, Contact, ContactKind, Element, Program, Rung, Series};

use super::names::Namer;

/// `program` with a module for each rung: its contacts are parameters, its coils `output`s; pins of blocks and comparisons are free, as the
/// paper's timer is. The specification is the paper's: every output of every rung can be switched on and off.
pub fn of_rungs(program: &Program) -> String {
    let mut text = format!(
        "-- {}: one module a rung; a rung sees the outputs of the others one step late\n",
        program.name
    );
    let modules: Vec<Module> = program.rungs.iter().map(Module::of).collect();
    for (place, module) in modules.iter().enumerate() {
        module.write(place + 1, &mut text);
    }
    write_main(program, &modules, &mut text);
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
    /// The coils' targets, in the same order.
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
        let power = module.series(&rung.network);
        for (name, coil) in own.into_iter().zip(&rung.coils) {
            let next = module.coil(coil, &name, &power);
            module.outputs.push((name, next));
            module.targets.push(coil.target.to_string());
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

    fn series(&mut self, series: &Series) -> String {
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
            Element::Comparison(comparison) => {
                let operand = format!(
                    "{} {} {}",
                    comparison.counter,
                    comparison.relation.sign(),
                    comparison.value
                );
                self.parameter(&operand)
            }
            Element::Branches(branches) => {
                let parts: Vec<String> =
                    branches.iter().map(|series| self.series(series)).collect();
                format!("({})", parts.join(" | "))
            }
            Element::Block(block) => {
                self.parameter(&format!("{}.{}", block.name, block.kind.outputs()[0]))
            }
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
        if bits.clone().next().is_none() {
            return;
        }
        text.push_str("VAR\n");
        for (name, _) in bits.clone() {
            let _ = writeln!(text, "  {name} : boolean;");
        }
        text.push_str("ASSIGN\n");
        for (name, next) in bits {
            let _ = writeln!(text, "  init({name}) := FALSE;\n  next({name}) := {next};");
        }
    }
}

fn write_main(program: &Program, modules: &[Module], text: &mut String) {
    text.push_str("MODULE main\nVAR\n");
    // Where a signal comes from: the last rung that writes it, or an input of its own.
    let mut sources: HashMap<String, String> = HashMap::new();
    for (place, module) in modules.iter().enumerate() {
        for (target, (output, _)) in module.targets.iter().zip(&module.outputs) {
            sources.insert(target.clone(), format!("r{}.{output}", place + 1));
        }
    }
    let mut namer = Namer::default();
    for place in 1..=modules.len() {
        namer.name(&format!("r{place}"));
    }
    let inputs = program.inputs.iter().map(|signal| signal.name.to_string());
    let read = modules.iter().flat_map(|module| module.reads.iter().cloned());
    for signal in inputs.chain(read) {
        if let Entry::Vacant(entry) = sources.entry(signal) {
            let name = namer.name(entry.key());
            let _ = writeln!(text, "  {name} : boolean;");
            entry.insert(name);
        }
    }
    for (place, module) in modules.iter().enumerate() {
        let actual: Vec<&str> = module.reads.iter().map(|read| sources[read].as_str()).collect();
        let actual = match actual.len() {
            0 => String::new(),
            _ => format!("({})", actual.join(",")),
        };
        let number = place + 1;
        let _ = writeln!(text, "  r{number} : rung{number}{actual};");
    }
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
