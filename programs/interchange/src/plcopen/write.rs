//! A program as PLCopen XML 2.01 that editors open and that compiles there to the same scan.
//!
//! Each rung is below the one before it, between rails of its own, and its coils below each other, so that the order by y is
//! the order of the scan in every tool. Tools that write Structured Text ask a rung's contacts again for each coil, and call a block
//! that nothing asks for after everything else; so a rung whose coils change what it reads gets a bit that keeps its power,
//! and a block at the end of a rung gets a coil.

mod blocks;
mod chart;
mod order;
mod sheet;
mod tree;
mod typed;

use std::collections::HashSet;
use std::time::Duration;

use understudy_ladder::{
    Coil, CoilKind, Contact, ContactKind, Element, Name, Program, Rung, Series, Signal,
    StandardNames, standard_time, visit,
};

pub(crate) use self::order::confirm as confirm_order;
use self::sheet::Sheet;
use self::tree::Tree;
pub use self::typed::{TypedDocument, write_typed};

/// The file of a program that runs every `period`.
///
/// Names become names of IEC 61131-3; memory bits that rungs need (see above) follow those of the program. The dates in the
/// header are fixed, so that the same program is the same file.
pub fn write(program: &Program, period: Duration) -> String {
    let mut names = StandardNames::of(program);
    let (rungs, added) = prepared(program, &mut names);
    let sheet = Sheet::of(&rungs, &program.footer, &names);
    let mut tree = document(names.program());
    tree.open("types", &[]);
    tree.empty("dataTypes", &[]);
    tree.open("pous", &[]);
    tree.open("pou", &[("name", names.program()), ("pouType", "program")]);
    interface(&mut tree, program, &names, &added);
    tree.open("body", &[]);
    tree.open("LD", &[]);
    sheet.write(&mut tree);
    tree.close("LD");
    tree.close("body");
    let about: Vec<&str> =
        program.comments.iter().chain(&program.description).map(String::as_str).collect();
    if !about.is_empty() {
        tree.formatted("documentation", &about.join("\n"));
    }
    tree.close("pou");
    tree.close("pous");
    tree.close("types");
    instances(&mut tree, &mut names, period);
    tree.close("project");
    tree.finish()
}

/// A document up to its types.
fn document(name: &str) -> Tree {
    let mut tree = Tree::new();
    tree.open(
        "project",
        &[
            ("xmlns", "http://www.plcopen.org/xml/tc6_0201"),
            ("xmlns:xhtml", "http://www.w3.org/1999/xhtml"),
        ],
    );
    header(&mut tree, name);
    tree
}

fn header(tree: &mut Tree, name: &str) {
    tree.empty(
        "fileHeader",
        &[
            ("companyName", "Understudy"),
            ("productName", "Understudy"),
            ("productVersion", env!("CARGO_PKG_VERSION")),
            ("creationDateTime", "2000-01-01T00:00:00"),
        ],
    );
    tree.open("contentHeader", &[("name", name)]);
    tree.open("coordinateInfo", &[]);
    for language in ["fbd", "ld", "sfc"] {
        tree.open(language, &[]);
        tree.empty("scaling", &[("x", "10"), ("y", "10")]);
        tree.close(language);
    }
    tree.close("coordinateInfo");
    tree.close("contentHeader");
}

/// Inputs and outputs with an address are local variables, as compilers want them.
fn interface(tree: &mut Tree, program: &Program, names: &StandardNames, added: &[String]) {
    tree.open("interface", &[]);
    let retained: HashSet<&str> = program.retained.iter().map(Name::as_str).collect();
    let mut list = None;
    let inputs = program.inputs.iter().map(|signal| ("inputVars", signal));
    let outputs = program.outputs.iter().map(|signal| ("outputVars", signal));
    let memory = program.memory.iter().map(|signal| ("localVars", signal));
    for (section, signal) in inputs.chain(outputs).chain(memory) {
        let section = if signal.address.is_some() { "localVars" } else { section };
        enter(tree, &mut list, (section, retained.contains(signal.name.as_str())));
        variable(tree, signal, names.signal(&signal.name));
    }
    for name in added {
        enter(tree, &mut list, ("localVars", false));
        variable(tree, &Signal::default(), name);
    }
    for block in program.blocks() {
        enter(tree, &mut list, ("localVars", retained.contains(block.name.as_str())));
        tree.open("variable", &[("name", names.signal(&block.name))]);
        tree.open("type", &[]);
        tree.empty("derived", &[("name", block.kind.word())]);
        tree.close("type");
        tree.close("variable");
    }
    if let Some((open, _)) = list {
        tree.close(open);
    }
    tree.close("interface");
}

/// Begins a list of variables, of a name and retentive or not, unless it is open.
fn enter<'a>(tree: &mut Tree, list: &mut Option<(&'a str, bool)>, wanted: (&'a str, bool)) {
    if *list != Some(wanted) {
        if let Some((open, _)) = *list {
            tree.close(open);
        }
        let (section, is_kept) = wanted;
        let attributes: &[_] = if is_kept { &[("retain", "true")] } else { &[] };
        tree.open(section, attributes);
        *list = Some(wanted);
    }
}

fn variable(tree: &mut Tree, signal: &Signal, name: &str) {
    let address = signal.address.as_ref().map(ToString::to_string);
    let mut attributes = vec![("name", name)];
    if let Some(address) = &address {
        attributes.push(("address", address));
    }
    tree.open("variable", &attributes);
    tree.open("type", &[]);
    tree.empty("BOOL", &[]);
    tree.close("type");
    if let Some(initial) = signal.initial {
        tree.open("initialValue", &[]);
        tree.empty("simpleValue", &[("value", if initial { "TRUE" } else { "FALSE" })]);
        tree.close("initialValue");
    }
    let about: Vec<&str> =
        signal.comments.iter().chain(&signal.description).map(String::as_str).collect();
    if !about.is_empty() {
        tree.formatted("documentation", &about.join("\n"));
    }
    tree.close("variable");
}

fn instances(tree: &mut Tree, names: &mut StandardNames, period: Duration) {
    let interval = standard_time(period);
    let configuration = names.add("configuration0");
    let (resource, task) = (names.add("resource0"), names.add("task0"));
    let instance = names.add("instance0");
    tree.open("instances", &[]);
    tree.open("configurations", &[]);
    tree.open("configuration", &[("name", &configuration)]);
    tree.open("resource", &[("name", &resource)]);
    tree.open("task", &[("name", &task), ("interval", &interval), ("priority", "0")]);
    tree.empty("pouInstance", &[("name", &instance), ("typeName", names.program())]);
    tree.close("task");
    tree.close("resource");
    tree.close("configuration");
    tree.close("configurations");
    tree.close("instances");
}

/// The rungs as other tools scan them like the scan here, and the bits that this adds.
fn prepared(program: &Program, names: &mut StandardNames) -> (Vec<Rung>, Vec<String>) {
    let mut rungs = Vec::with_capacity(program.rungs.len());
    let mut added = Vec::new();
    for rung in &program.rungs {
        if rung.coils.is_empty() {
            let wanted = program_block(&rung.network).unwrap_or("rung");
            let target = names.add(&format!("{wanted}_out"));
            added.push(target.clone());
            rungs.push(Rung {
                coils: vec![Coil { kind: CoilKind::Plain, target: target.into() }],
                ..rung.clone()
            });
        } else if changes_itself(rung) {
            let power = names.add("power");
            added.push(power.clone());
            let keep = Coil { kind: CoilKind::Plain, target: power.as_str().into() };
            rungs.push(Rung { coils: vec![keep], ..rung.clone() });
            for coil in &rung.coils {
                let operand = power.as_str().into();
                let contact = Contact { kind: ContactKind::NormallyOpen, operand };
                rungs.push(Rung {
                    network: vec![Element::Contact(contact)],
                    coils: vec![coil.clone()],
                    ..Rung::default()
                });
            }
        } else {
            rungs.push(rung.clone());
        }
    }
    (rungs, added)
}

/// The last block of a network.
fn program_block(network: &Series) -> Option<&str> {
    let mut last = None;
    visit(network, &mut |element| {
        if let Element::Block(block) = element {
            last = Some(block.name.as_str());
        }
    });
    last
}

/// Whether a coil changes what the rung reads for the next coil.
fn changes_itself(rung: &Rung) -> bool {
    let Some((_, changing)) = rung.coils.split_last() else {
        return false;
    };
    let mut reads = false;
    visit(&rung.network, &mut |element| {
        if let Element::Contact(contact) = element {
            reads |= changing.iter().any(|coil| coil.target == contact.operand);
        }
    });
    reads
}
