//! A chain for the model checkers PRISM and Storm, with the properties that ask what [`answer_chain`](crate::answer_chain) answers.
//!
//! States keep their numbers; their names are comments. The label `failure` is on the failure states, and the reward `hours` is 1 in every
//! state, so the expected reward until `failure` is the mean time to failure in hours. A state that is never left has a transition to
//! itself, which changes no probability, since the checkers take a state without one for an error.

use std::fmt::Write as _;

use crate::chain::Chain;
use crate::quantity::Hours;

/// How a chain is written for a model checker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportForm {
    /// The language of PRISM (.prism), which Storm reads too.
    Language,
    /// Storm's list of states (.drn), for large chains.
    States,
}

impl ExportForm {
    /// The form of a file by its ending, without the dot.
    pub fn of(ending: &str) -> Option<Self> {
        match ending {
            "prism" | "sm" => Some(Self::Language),
            "drn" => Some(Self::States),
            _ => None,
        }
    }
}

/// The text of a chain.
pub fn export_chain(chain: &Chain, form: ExportForm) -> String {
    match form {
        ExportForm::Language => language(chain),
        ExportForm::States => states(chain),
    }
}

/// The properties of an exported chain, one in a line: the mean time to failure, the unavailability, and with a mission 1 - R and the
/// point unavailability at its end.
pub fn export_properties(mission: Option<Hours>) -> String {
    let mut text = "\"mttf_hours\": R{\"hours\"}=? [ F \"failure\" ];\n\"unavailability\": S=? [ \"failure\" ];\n".to_owned();
    if let Some(hours) = mission {
        let hours = hours.get();
        let _ = writeln!(text, "\"unreliability\": P=? [ F<={hours} \"failure\" ];");
        let _ = writeln!(text, "\"point_unavailability\": P=? [ F[{hours},{hours}] \"failure\" ];");
    }
    text
}

/// The transitions of a state, the one to itself where there is no other.
fn leaving(chain: &Chain, state: usize) -> Vec<(usize, f64)> {
    let leaving: Vec<(usize, f64)> = chain.successors(state).collect();
    if leaving.is_empty() { vec![(state, 1.0)] } else { leaving }
}

/// A name in a comment of one line.
fn remark(name: &str) -> String {
    name.chars().map(|letter| if letter.is_control() { ' ' } else { letter }).collect()
}

fn language(chain: &Chain) -> String {
    let last = chain.states() - 1;
    // PRISM has no range of a single value.
    let mut text = format!(
        "// rates per hour\nctmc\n\nmodule chain\n  s : [0..{}] init {};\n",
        last.max(1),
        chain.start()
    );
    for state in 0..=last {
        let ways = leaving(chain, state);
        let ways: Vec<String> =
            ways.iter().map(|(target, rate)| format!("{rate:e}:(s'={target})")).collect();
        let _ = writeln!(text, "  // {}", remark(&chain.name(state)));
        let _ = writeln!(text, "  [] s={state} -> {};", ways.join(" + "));
    }
    if last == 0 {
        text.push_str("  [] s=1 -> 1:(s'=1);\n");
    }
    text.push_str("endmodule\n\n");
    let runs = failures(chain);
    let runs = runs.iter().map(|(first, last)| match first == last {
        true => format!("s={first}"),
        false => format!("(s>={first} & s<={last})"),
    });
    let runs: Vec<String> = runs.collect();
    let failed = if runs.is_empty() { "false".to_owned() } else { runs.join(" | ") };
    let _ = writeln!(text, "label \"failure\" = {failed};");
    text.push_str("\nrewards \"hours\"\n  true : 1;\nendrewards\n");
    text
}

/// The first and the last state of each run of failure states.
fn failures(chain: &Chain) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for state in (0..chain.states()).filter(|state| chain.is_failure(*state)) {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == state => *last = state,
            _ => runs.push((state, state)),
        }
    }
    runs
}

fn states(chain: &Chain) -> String {
    let count = chain.states();
    let mut text = format!(
        "// rates per hour\n@type: CTMC\n@parameters\n\n@reward_models\nhours\n@nr_states\n{count}\n@nr_choices\n{count}\n@model\n"
    );
    for state in 0..count {
        let ways = leaving(chain, state);
        let rate: f64 = ways.iter().map(|(_, rate)| rate).sum();
        let initial = if chain.start() == state { " init" } else { "" };
        let failure = if chain.is_failure(state) { " failure" } else { "" };
        let _ = writeln!(text, "// {}", remark(&chain.name(state)));
        let _ = writeln!(text, "state {state} !{rate:e} [1]{initial}{failure}\n\taction 0 [0]");
        for (target, rate) in ways {
            let _ = writeln!(text, "\t\t{target} : {rate:e}");
        }
    }
    text
}
