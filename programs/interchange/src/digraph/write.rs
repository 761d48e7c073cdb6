//! Digraphs as XML.

use std::collections::HashMap;
use std::fmt::Write;
use understudy_text::markup::escaped;

use understudy_ladder::{Address, Program, Signal};
use understudy_text::duration;

use super::graph::{Digraph, Edge, Label, digraphs, type_of};

/// The XML of a program, which [`super::read`] reads back as the same program.
pub fn write(program: &Program) -> String {
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = write!(text, "<LadderDiagram name=\"{}\"", escaped(&program.name));
    attribute(&mut text, "description", program.description.as_deref());
    text.push_str(">\n");
    lines(&mut text, 1, "Comment", &program.comments);
    text.push_str("  <Signals>\n");
    let mut addresses = HashMap::new();
    for (role, signals) in
        [("input", &program.inputs), ("output", &program.outputs), ("memory", &program.memory)]
    {
        for signal in signals {
            declaration(&mut text, role, signal);
            if let Some(address) = &signal.address {
                addresses.insert(signal.name.as_str(), address_text(address));
            }
        }
    }
    text.push_str("  </Signals>\n");
    for graph in digraphs(program) {
        write_graph(&mut text, &graph, &addresses);
    }
    lines(&mut text, 1, "Footer", &program.footer);
    text.push_str("</LadderDiagram>\n");
    text
}

fn attribute(text: &mut String, name: &str, value: Option<&str>) {
    if let Some(value) = value {
        let _ = write!(text, " {name}=\"{}\"", escaped(value));
    }
}

fn lines(text: &mut String, depth: usize, element: &str, lines: &[String]) {
    for line in lines {
        let _ = writeln!(text, "{:1$}<{element}>{2}</{element}>", "", 2 * depth, escaped(line));
    }
}

fn declaration(text: &mut String, role: &str, signal: &Signal) {
    let _ = write!(text, "    <Signal role=\"{role}\" name=\"{}\"", escaped(&signal.name));
    let address = signal.address.as_ref().map(Address::to_string);
    attribute(text, "address", address.as_deref());
    let initial = signal.initial.map(|initial| if initial { "1" } else { "0" });
    attribute(text, "initial", initial);
    attribute(text, "description", signal.description.as_deref());
    if signal.comments.is_empty() {
        text.push_str("/>\n");
    } else {
        text.push_str(">\n");
        lines(text, 3, "Comment", &signal.comments);
        text.push_str("    </Signal>\n");
    }
}

/// As the paper writes it, `000.02`, where it has two numbers; else as the standard does.
fn address_text(address: &Address) -> String {
    match address.path.as_slice() {
        [word, bit] => format!("{word:03}.{bit:02}"),
        _ => address.to_string(),
    }
}

fn write_graph(text: &mut String, graph: &Digraph, addresses: &HashMap<&str, String>) {
    let _ = write!(text, "  <Graph graphNumber=\"{}\"", graph.number);
    if let Some((block, pin)) = &graph.feeds {
        let _ = write!(text, " block=\"{}\" pin=\"{}\"", escaped(block), escaped(pin));
    }
    attribute(text, "title", graph.title.as_deref());
    text.push_str(">\n");
    lines(text, 2, "Comment", &graph.comments);
    text.push_str("    <Vertices>\n");
    for vertex in &graph.vertices {
        let _ = writeln!(
            text,
            "      <Vertex number=\"{}\">\n        <startX>{:.1}</startX>\n        <startY>{:.1}</startY>\n      </Vertex>",
            vertex.number, vertex.x, vertex.y
        );
    }
    text.push_str("    </Vertices>\n    <Edges>\n");
    for edge in &graph.edges {
        write_edge(text, edge, addresses);
    }
    text.push_str("    </Edges>\n  </Graph>\n");
}

fn write_edge(text: &mut String, edge: &Edge, addresses: &HashMap<&str, String>) {
    let (symbol, more) = match &edge.label {
        Label::Contact(_, name) | Label::Coil(_, name) => (name.to_string(), Vec::new()),
        Label::Comparison(comparison) => {
            let sign = comparison.relation.sign().to_owned();
            let more = vec![("relation", sign), ("value", comparison.value.to_string())];
            (comparison.counter.to_string(), more)
        }
        Label::Block(name, kind) => {
            let mut more = vec![("block", kind.word().to_owned())];
            more.extend(kind.preset_time().map(|time| ("preset", duration::text(time))));
            more.extend(kind.preset_value().map(|value| ("preset", value.to_string())));
            (name.to_string(), more)
        }
    };
    let _ = writeln!(text, "      <Edge type=\"{}\">", type_of(&edge.label));
    let mut element = |name: &str, content: &str| {
        let _ = writeln!(text, "        <{name}>{}</{name}>", escaped(content));
    };
    element("from", &edge.from.to_string());
    element("to", &edge.to.to_string());
    element("address", addresses.get(symbol.as_str()).map_or("", String::as_str));
    element("symbol", &symbol);
    for (name, content) in more {
        element(name, &content);
    }
    text.push_str("      </Edge>\n");
}
