//! Verdict on a whole program: verified, or the reasons against it.

use understudy_logic::Circuit;

use super::{Answer, Lamp, OutputFinding};
use crate::symbolic::Signal;

/// Maximum number of names per reason.
const NAMED: usize = 3;

/// Collects the results of all proofs about a program.
#[derive(Debug)]
pub struct Conclusion {
    outputs: usize,
    properties: usize,
    refuted: Vec<String>,
    /// Undecided outputs and properties by reason.
    undecided: Vec<(String, Vec<String>)>,
}

impl Conclusion {
    /// Starts with the results of the standard property of every output.
    pub fn new(circuit: &Circuit, outputs: &[(Signal, OutputFinding)]) -> Self {
        let mut conclusion = Self {
            outputs: outputs.len(),
            properties: 0,
            refuted: Vec::new(),
            undecided: Vec::new(),
        };
        for (signal, finding) in outputs {
            conclusion.add_output(signal.name(circuit), finding);
        }
        conclusion
    }

    fn add_output(&mut self, name: &str, finding: &OutputFinding) {
        let word = |lamp: &Lamp| if *lamp == Lamp::On { "on" } else { "off" };
        match finding {
            OutputFinding::Free => {}
            OutputFinding::Never(lamp) => {
                self.refuted.push(format!("{name} is never {}", word(lamp)));
            }
            OutputFinding::Stuck(lamp, _) => self.refuted.push(format!(
                "{name} can reach a state after which it is never {} again",
                word(lamp)
            )),
            OutputFinding::Undecided(reason) => self.add_undecided(name.to_owned(), reason),
        }
    }

    /// Adds the result of a property.
    pub fn add(&mut self, property: &str, answer: &Answer) {
        self.properties += 1;
        match answer {
            Answer::Holds(_) => {}
            Answer::Fails(_) => self.refuted.push(format!("`{property}` does not hold")),
            Answer::Undecided(reason) => {
                self.add_undecided(format!("`{property}`"), &reason.to_string());
            }
        }
    }

    fn add_undecided(&mut self, name: String, reason: &str) {
        let known = self.undecided.iter_mut().find(|(known, _)| known == reason);
        match known {
            Some((_, names)) => names.push(name),
            None => self.undecided.push((reason.to_owned(), vec![name])),
        }
    }

    /// What was proved about the program.
    ///
    /// # Errors
    /// Every reason why the program is not verified.
    pub fn verdict(self) -> Result<String, Vec<String>> {
        let mut reasons = self.refuted;
        reasons.extend(self.undecided.iter().map(undecided));
        if !reasons.is_empty() {
            return Err(reasons);
        }
        let outputs = format!(
            "every one of its {} outputs can always be switched on and off again",
            self.outputs
        );
        Ok(match self.properties {
            0 => outputs,
            properties => format!("{outputs}; {properties} properties hold"),
        })
    }
}

fn undecided((reason, names): &(String, Vec<String>)) -> String {
    let more = match names.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let named = names.iter().take(NAMED).map(String::as_str);
    let named = named.collect::<Vec<_>>().join(", ");
    format!("undecided: {named}{more}: {reason}")
}
