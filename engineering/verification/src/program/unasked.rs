//! What is asked of every ladder: each output can be switched on and off, again and again. The specification of the paper on the deployment
//! of controllers (its section 4.3 and appendix 2) is `AG (EF y & EF !y)` for every output y.

use super::{Answer, Bounds, Subject};
use crate::property::Formula;
use crate::symbolic::{Resolved, Signal, Trace};

/// Which of the two an output cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lamp {
    /// 1
    On,
    /// 0
    Off,
}

/// What was found about one output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OutputFinding {
    /// It can be switched on and off, from wherever the program is.
    Free,
    /// It is never on, or never off, in any run.
    Never(Lamp),
    /// After these scans it cannot be switched on, or off, any more.
    Stuck(Lamp, Trace),
    /// Neither was proved within the bounds.
    Undecided(String),
}

impl Subject {
    /// Whether each output can always be switched on and off again.
    pub fn switches(&self, bounds: Bounds<'_>) -> Vec<(Signal, OutputFinding)> {
        let outputs: Vec<Signal> = self.outputs().collect();
        let questions: Vec<Resolved> =
            outputs.iter().flat_map(|&output| questions(output)).collect();
        let answers = self.check(&questions, Vec::new(), bounds, &mut |_, _| {});
        let found = answers.chunks(4).map(finding);
        outputs.into_iter().zip(found).collect()
    }
}

fn questions(output: Signal) -> [Resolved; 4] {
    let on = Formula::Signal(output);
    let off = on.clone().negated();
    [off.clone().always(), on.clone().always(), on.reachable().always(), off.reachable().always()]
}

fn finding(answers: &[Answer]) -> OutputFinding {
    let lamps = [Lamp::On, Lamp::Off];
    for (answer, lamp) in answers.iter().zip(lamps) {
        if matches!(answer, Answer::Holds(_)) {
            return OutputFinding::Never(lamp);
        }
    }
    for (answer, lamp) in answers.iter().skip(2).zip(lamps) {
        if let Answer::Fails(Some(trace)) = answer {
            return OutputFinding::Stuck(lamp, trace.clone());
        }
    }
    let mut open = answers.iter().filter_map(|answer| match answer {
        Answer::Undecided(undecided) => Some(undecided.to_string()),
        _ => None,
    });
    let Some(why) = open.next() else {
        return OutputFinding::Free;
    };
    // Never on was refuted, and never off.
    let changes = answers[..2].iter().all(|answer| matches!(answer, Answer::Fails(_)));
    OutputFinding::Undecided(if changes {
        format!("it can be on and off; whether again and again is not decided: {why}")
    } else {
        why
    })
}
