//! What is asked of every ladder: each output can be switched on and off, again and again. The specification of the paper on the deployment
//! of controllers (its section 4.3 and appendix 2) is `AG (EF y & EF !y)` for every output y.

use understudy_logic::{CircuitBuilder, Variable};

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
        let settling = (!self.restarting.is_empty()).then(|| self.settling());
        let (subject, settled) = match &settling {
            Some((subject, settled)) => (subject, Formula::Signal(*settled)),
            None => (self, Formula::Constant(true)),
        };
        let questions: Vec<Resolved> =
            outputs.iter().flat_map(|&output| questions(output, &settled)).collect();
        let answers = subject.check(&questions, Vec::new(), bounds, &mut |_, _| {});
        let found = answers.chunks(4).map(|answers| self.told(finding(answers)));
        outputs.into_iter().zip(found).collect()
    }

    /// The same program, which is restarted no more from some scan on: in every scan in which the signal is TRUE. A restart is no way to switch an
    /// output.
    fn settling(&self) -> (Self, Signal) {
        const SETTLED: &str = "no more restarts";
        let circuit = &self.circuit;
        let mut builder = CircuitBuilder::like(circuit);
        let settles = builder.input(SETTLED);
        let (settled, was_settled) = builder.register(SETTLED, false);
        let graph = builder.graph();
        let is_settled = graph.or(was_settled, settles);
        let restarts = graph.not(is_settled);
        let values = builder.copy_functions(circuit, |graph, variable| {
            let value = graph.variable(variable);
            match variable {
                Variable::Input(input) if self.restarting.contains(&(input as usize)) => {
                    graph.and(value, restarts)
                }
                _ => value,
            }
        });
        builder.set_next(settled, is_settled);
        for (output, value) in circuit.outputs().iter().zip(values) {
            builder.output(&output.name, value);
        }
        builder.output(SETTLED, is_settled);
        let circuit = builder.finish().expect("names are those of a circuit, and one with blanks");
        let settled = Signal::Output(circuit.outputs().len() - 1);
        (Self::of(circuit, self.outputs).with_assumed(self.assumed), settled)
    }

    /// A finding over the signals of the program alone.
    fn told(&self, finding: OutputFinding) -> OutputFinding {
        let is_own = |signal: &Signal| match *signal {
            Signal::Input(input) => input < self.circuit.inputs().len(),
            Signal::Output(output) => output < self.circuit.outputs().len(),
        };
        match finding {
            OutputFinding::Stuck(lamp, mut trace) => {
                trace.signals.retain(is_own);
                OutputFinding::Stuck(lamp, trace)
            }
            finding => finding,
        }
    }
}

/// `settled`: the program is restarted no more.
fn questions(output: Signal, settled: &Resolved) -> [Resolved; 4] {
    let on = Formula::Signal(output);
    let off = on.clone().negated();
    let reached = |end: Resolved| match settled {
        Formula::Constant(_) => end.reachable().always(),
        _ => settled.clone().implies(end.reachable()).always(),
    };
    [off.clone().always(), on.clone().always(), reached(on), reached(off)]
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
