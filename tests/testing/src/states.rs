//! The table of a state machine: each reachable named state, with each input, and the state that follows.

use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The states that are reachable from a start, and the state that follows each of them with each input.
#[derive(Debug)]
pub struct Table {
    inputs: Vec<&'static str>,
    rows: Vec<(String, Vec<String>)>,
}

impl Table {
    /// Finds the states breadth first. Two machines with one name of a state count as one: the first that was found.
    pub fn explore<Machine: Clone, Input: Copy>(
        start: Machine,
        inputs: &[(Input, &'static str)],
        give: impl Fn(&mut Machine, Input),
        name: impl Fn(&Machine) -> String,
    ) -> Self {
        let mut found = vec![name(&start)];
        let mut machines = vec![start];
        let mut rows = Vec::new();
        while let Some(machine) = machines.get(rows.len()).cloned() {
            let follows = |&(input, _): &(Input, &'static str)| {
                let mut machine = machine.clone();
                give(&mut machine, input);
                let state = name(&machine);
                if !found.contains(&state) {
                    found.push(state.clone());
                    machines.push(machine);
                }
                state
            };
            let next = inputs.iter().map(follows).collect();
            rows.push((name(&machine), next));
        }
        Self { inputs: inputs.iter().map(|&(_, input)| input).collect(), rows }
    }

    /// The table as text: a dot where the state stays.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for (state, next) in &self.rows {
            let _ = writeln!(text, "{state}");
            for (next, input) in next.iter().zip(&self.inputs) {
                let next = if next == state { "." } else { next };
                let _ = writeln!(text, "  {input:<34} {next}");
            }
        }
        text
    }

    /// The table as a drawing in DOT: an edge for each state that follows another one.
    pub fn drawing(&self, machine: &str, source: &str) -> String {
        let mut text = format!(
            "// The states of a {machine}. The test {source} makes this file.\n\
             digraph \"{machine}\" {{\n  node [shape=box, style=rounded];\n"
        );
        for (state, next) in &self.rows {
            let mut edges: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
            for (next, input) in next.iter().zip(&self.inputs) {
                if next != state {
                    edges.entry(next).or_default().push(input);
                }
            }
            for (next, inputs) in edges {
                let label = inputs.join("\\n");
                let _ = writeln!(text, "  \"{state}\" -> \"{next}\" [label=\"{label}\"];");
            }
        }
        text.push_str("}\n");
        text
    }
}
