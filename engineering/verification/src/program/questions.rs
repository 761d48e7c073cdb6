//! What is asked about the coils of a program, as outputs of a circuit of its own, so that one scan answers all of it.

use std::collections::BTreeMap;

use understudy_logic::{Circuit, CircuitBuilder, Expression, Graph};

use understudy_ladder::{Program, Write};

/// An output of [`Questions::circuit`]: whether something is so in a scan.
pub(super) type Question = usize;

/// The coils of one target, which are at least two, and what is asked about them.
pub(super) struct Target {
    /// In the order of the scan.
    pub(super) writes: Vec<Write>,
    /// For each coil: it sets the target, and a later one resets it for good; it sets the target, and that stays.
    pub(super) sets: Vec<(Question, Question)>,
    /// The target is 0 before the first coil, set by some, and 0 behind the last.
    pub(super) through: Question,
    /// Two coils that write want different values.
    pub(super) race: Question,
}

/// All that is asked.
pub(super) struct Questions {
    /// With the registers and inputs of the program; its outputs are the questions.
    pub(super) circuit: Circuit,
    /// For each rung with coils: one of them changes its target.
    pub(super) changes: Vec<Option<Question>>,
    pub(super) targets: Vec<Target>,
}

struct Asking {
    builder: CircuitBuilder,
    count: usize,
}

impl Asking {
    fn ask(&mut self, is_so: Expression) -> Question {
        self.builder.output(self.count.to_string(), is_so);
        self.count += 1;
        self.count - 1
    }
}

/// One coil in a scan.
#[derive(Clone, Copy)]
struct Moment {
    /// It writes.
    acts: Expression,
    after: Expression,
    rises: Expression,
    falls: Expression,
}

impl Questions {
    /// `circuit` and `writes` are those of [`Program::lower_writes`].
    pub(super) fn of(program: &Program, circuit: &Circuit, writes: &[Write]) -> Self {
        let mut builder = CircuitBuilder::like(circuit);
        let values = builder.copy_functions(circuit, Graph::variable);
        let coil = |write: &Write| &program.rungs[write.rung].coils[write.coil];
        let graph = builder.graph();
        let moments: Vec<Moment> = writes
            .iter()
            .map(|write| {
                let (before, after) = (values[write.before], values[write.after]);
                let (not_before, not_after) = (graph.not(before), graph.not(after));
                Moment {
                    acts: if coil(write).kind.is_latch() {
                        values[write.power]
                    } else {
                        graph.constant(true)
                    },
                    after,
                    rises: graph.and(not_before, after),
                    falls: graph.and(before, not_after),
                }
            })
            .collect();
        let mut asking = Asking { builder, count: 0 };
        let mut of_rung: Vec<Vec<Expression>> = vec![Vec::new(); program.rungs.len()];
        for (write, moment) in writes.iter().zip(&moments) {
            of_rung[write.rung].extend([moment.rises, moment.falls]);
        }
        let changes = of_rung.into_iter().map(|changes| {
            let any = (!changes.is_empty()).then(|| asking.builder.graph().any(changes));
            any.map(|any| asking.ask(any))
        });
        let changes = changes.collect();
        let mut of_name: BTreeMap<&str, (Vec<Write>, Vec<Moment>)> = BTreeMap::new();
        for (&write, &moment) in writes.iter().zip(&moments) {
            let (writes, moments) = of_name.entry(coil(&write).target.as_str()).or_default();
            writes.push(write);
            moments.push(moment);
        }
        let mut targets = Vec::new();
        for signal in program.writable() {
            match of_name.remove(signal.name.as_str()) {
                Some((writes, moments)) if writes.len() > 1 => {
                    targets.push(asking.target(values[writes[0].before], writes, &moments));
                }
                _ => {}
            }
        }
        Self {
            circuit: asking.builder.finish().expect("names are those of a circuit, and numbers"),
            changes,
            targets,
        }
    }
}

impl Asking {
    fn target(&mut self, before: Expression, writes: Vec<Write>, moments: &[Moment]) -> Target {
        let graph = self.builder.graph();
        let kept = moments[moments.len() - 1].after;
        let lost = graph.not(kept);
        let mut falls_later = graph.constant(false);
        let mut sets = Vec::new();
        for moment in moments.iter().rev() {
            let undone = graph.and(falls_later, lost);
            sets.push((graph.and(moment.rises, undone), graph.and(moment.rises, kept)));
            falls_later = graph.or(moment.falls, falls_later);
        }
        sets.reverse();
        let rises = graph.any(moments.iter().map(|moment| moment.rises));
        let was_off = graph.not(before);
        let off_on = graph.and(was_off, rises);
        let through = graph.and(off_on, lost);
        let mut wants = [graph.constant(false); 2];
        let mut race = graph.constant(false);
        for moment in moments {
            let not_after = graph.not(moment.after);
            let zero = graph.and(moment.acts, not_after);
            let one = graph.and(moment.acts, moment.after);
            for (now, other) in [(zero, wants[1]), (one, wants[0])] {
                let both = graph.and(now, other);
                race = graph.or(race, both);
            }
            wants = [graph.or(wants[0], zero), graph.or(wants[1], one)];
        }
        let sets = sets.into_iter();
        Target {
            writes,
            sets: sets.map(|(undone, stays)| (self.ask(undone), self.ask(stays))).collect(),
            through: self.ask(through),
            race: self.ask(race),
        }
    }
}
