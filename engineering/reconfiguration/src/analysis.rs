//! From a project to everything that `understudy reconfigure` writes.

use understudy_ladder::Program;

use crate::command::Posed;
use crate::controller::Controller;
use crate::diagnosis::{Ground, diagnose};
use crate::explore::{Bounds, Explored, MAXIMUM_FREE_INPUTS, Unexplored, explore};
use crate::mega::{MegaController, Question, Reached, Trimming, Unbuilt, failed_channels};
use crate::module_two::{Combined, MAXIMUM_RUNGS, combine};
use crate::project::{Project, RelationEntry};
use crate::proof::{Claim, NotProved, Proof, prove};
use crate::record::{self, Missed, RecordError};
use crate::relation::Relation;
use crate::settle::NoCommand;
use crate::signals::{Bits, Signals};
use crate::timing::Timing;

/// Maximum number of states of the mega-controller.
const MAXIMUM_MEGA_STATES: usize = 2_000_000;

/// Maximum number of states of the proof.
const MAXIMUM_PROOF_STATES: usize = 2_000_000;

/// What came of it.
pub struct Outcome {
    /// S.
    pub controller: Controller,
    /// States of ladder and plant together, where there is a plant.
    pub joint_states: Option<usize>,
    /// Inputs that the plant does not show.
    pub unseen_inputs: Vec<String>,
    /// Of each state and each move of S that the records have missed, its name.
    pub missed: Option<Missed>,
    /// Λ.
    pub relation: Relation,
    /// Relations of the file that concern no state, by their places.
    pub idle: Vec<std::ops::Range<usize>>,
    /// What was asked.
    pub question: Question,
    /// Θ.
    pub mega: MegaController,
    /// What leads to the states that only the operator's release leaves.
    pub trimming: Trimming,
    /// How many states can be reached before trimming.
    pub reached: Reached,
    /// The same after it, where it is applied.
    pub trimmed: Option<Reached>,
    /// What is commanded outside of the model.
    pub lost_outputs: Bits,
    /// Module 1 with module 2.
    pub combined: Combined,
    /// That it is right.
    pub proof: Proof,
    /// The ladder that finds failed channels, where the project asks for one.
    pub diagnosis: Option<Program>,
}

/// Why nothing came of it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// The records.
    #[error("{0}")]
    Record(#[from] RecordError),
    /// The ladder or the plant is no circuit at this period.
    #[error("U1220: {0}")]
    NoCircuit(String),
    /// Ladder and plant reach a permanent standstill.
    #[error("U1221: after {way}, ladder and plant remain indefinitely in state {state}")]
    Deadlock {
        /// Its vector.
        state: String,
        /// Events.
        way: String,
    },
    /// The plant has too many free inputs.
    #[error(
        "U1222: the plant has {count} inputs that the ladder does not drive, and {MAXIMUM_FREE_INPUTS} are possible: {names}"
    )]
    TooFree {
        /// How many.
        count: usize,
        /// Which.
        names: String,
    },
    /// Too many states.
    #[error(
        "U1223: {what} has more than {limit} states; ask about fewer channels, fewer at once, or lengthen the period"
    )]
    TooLarge {
        /// Ladder and plant, or the mega-controller.
        what: &'static str,
        /// The limit.
        limit: usize,
    },
    /// No outputs are safe.
    #[error("U1231: {}", .0.join("\n"))]
    NoCommand(Vec<String>),
    /// Module 2 would be too long.
    #[error(
        "U1232: module 2 would have {0} rungs, and {MAXIMUM_RUNGS} are possible; ask about fewer channels or fewer at once"
    )]
    TooLong(usize),
    /// The diagnosing ladder would be too long.
    #[error(
        "U1233: the diagnosing ladder would have {0} rungs, and {MAXIMUM_RUNGS} are possible; lengthen the period"
    )]
    DiagnosisTooLong(usize),
    /// The proof.
    #[error("{0}")]
    NotProved(#[from] NotProved),
}

impl Failure {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Record(error) => error.code(),
            Self::NoCircuit(_) => "U1220",
            Self::Deadlock { .. } => "U1221",
            Self::TooFree { .. } => "U1222",
            Self::TooLarge { .. } => "U1223",
            Self::NoCommand(_) => "U1231",
            Self::TooLong(_) => "U1232",
            Self::DiagnosisTooLong(_) => "U1233",
            Self::NotProved(error) => error.code(),
        }
    }
}

/// Does all of it.
///
/// # Errors
/// What made it impossible, with the states, events and rows that show it.
pub fn analyse(project: &Project) -> Result<Outcome, Failure> {
    let Known { controller, joint_states, unseen_inputs, missed, timing } = automaton(project)?;
    let (relation, idle) = RelationEntry::compile(&project.relation, &controller);
    let question = Question {
        channels: project.channels.clone(),
        simultaneous: project.simultaneous,
        analysis: project.analysis,
        objective: project.objective.clone(),
        maximum_states: MAXIMUM_MEGA_STATES,
    };
    let mut mega = MegaController::build(&controller, &relation, &question)
        .map_err(|unbuilt| not_built(unbuilt, &controller, &question))?;
    let trimming = mega.trim(&controller, &relation, &question);
    let reached = mega.reached(&controller, &relation, &question);
    let trimmed = project.trim.then(|| {
        mega.apply(&trimming);
        mega.reached(&controller, &relation, &question)
    });
    let lost_outputs = MegaController::outputs_for_any(&controller, &relation, &question)
        .map_err(|none| not_built(Unbuilt::NoCommand(vec![none]), &controller, &question))?;
    let combined = combine(&project.ladder, &controller, &mega, &question, &lost_outputs)
        .map_err(Failure::TooLong)?;
    let sets = |place: usize| (mega.states[place].members.clone(), mega.states[place].failed);
    let proof = prove(&Claim {
        controller: &controller,
        relation: &relation,
        alone: &project.ladder,
        combined: &combined.program,
        correspondence: &combined.correspondence,
        sets: &sets,
        channels: &question.channels,
        simultaneous: question.simultaneous,
        late: question.analysis == crate::mega::Analysis::Late,
        period: project.period,
        maximum_states: MAXIMUM_PROOF_STATES,
    })?;
    let diagnosis = match (project.patience, &timing) {
        (Some(patience), Some(timing)) if !question.channels.is_empty() => {
            let ground = Ground {
                controller: &controller,
                relation: &relation,
                timing,
                channels: &question.channels,
                period: project.period,
                patience,
            };
            let name = project.ladder.name.to_string();
            Some(diagnose(&name, ground).map_err(Failure::DiagnosisTooLong)?)
        }
        _ => None,
    };
    Ok(Outcome {
        diagnosis,
        joint_states,
        unseen_inputs,
        controller,
        missed,
        relation,
        idle,
        question,
        mega,
        trimming,
        reached,
        trimmed,
        lost_outputs,
        combined,
        proof,
    })
}

/// S, what was explored where there is a plant, and what the records have missed of it.
struct Known {
    controller: Controller,
    joint_states: Option<usize>,
    unseen_inputs: Vec<String>,
    missed: Option<Missed>,
    timing: Option<Timing>,
}

/// S by exploration where there is a plant, else from the records.
fn automaton(project: &Project) -> Result<Known, Failure> {
    let ladder = &project.ladder;
    let names = |signals: &[understudy_ladder::Signal]| -> Vec<String> {
        signals.iter().map(|signal| signal.name.to_string()).collect()
    };
    let signals = Signals { inputs: names(&ladder.inputs), outputs: names(&ladder.outputs) };
    let mut runs = Vec::new();
    for (name, text) in &project.records {
        runs.extend(record::read(name, text, &signals)?);
    }
    let recorded = match project.records.is_empty() {
        true => None,
        false => Some(record::learn(&runs, ladder, project.period, &signals)?),
    };
    let Some(plant) = &project.plant else {
        let controller = recorded.ok_or(RecordError::Empty)?;
        return Ok(Known {
            controller,
            joint_states: None,
            unseen_inputs: Vec::new(),
            missed: None,
            timing: None,
        });
    };
    let lower = |program: &Program| {
        let lowered = program.lower(project.period);
        lowered.map_err(|error| Failure::NoCircuit(error.to_string()))
    };
    let explored =
        explore(&lower(ladder)?, &lower(plant)?, &names(&ladder.memory), Bounds::default());
    let Explored { controller, joint_states, unseen_inputs, timing } =
        explored.map_err(not_explored)?;
    let missed = recorded.map(|recorded| record::missed(&recorded, &controller));
    Ok(Known {
        controller,
        joint_states: Some(joint_states),
        unseen_inputs,
        missed,
        timing: Some(timing),
    })
}

fn not_explored(why: Unexplored) -> Failure {
    match why {
        Unexplored::TooFree(names) => {
            Failure::TooFree { count: names.len(), names: names.join(", ") }
        }
        Unexplored::TooLarge(limit) => {
            Failure::TooLarge { what: "ladder and plant together", limit }
        }
        Unexplored::Deadlock { state, way } => Failure::Deadlock {
            state,
            way: if way.is_empty() { "the first scan".into() } else { way.join(" ") },
        },
    }
}

fn not_built(why: Unbuilt, controller: &Controller, question: &Question) -> Failure {
    match why {
        Unbuilt::TooLarge(limit) => Failure::TooLarge { what: "the mega-controller", limit },
        Unbuilt::NoCommand(without) => Failure::NoCommand(
            without.iter().map(|none| describe_conflict(none, controller, question)).collect(),
        ),
    }
}

/// States, events and rows that contradict each other.
fn describe_conflict(none: &NoCommand, controller: &Controller, question: &Question) -> String {
    let members: Vec<String> = none
        .members
        .iter()
        .take(20)
        .map(|&member| controller.state_name(member as usize))
        .collect();
    let failed: Vec<&str> = failed_channels(&question.channels, none.failed)
        .map(|input| controller.signals.inputs[input].as_str())
        .collect();
    if let Some(message) = &none.solver {
        return format!("the solver failed in {}: {message}", members.join(" "));
    }
    let row = |posed: &Posed| {
        let rows: Vec<String> =
            posed.demand.rows.iter().map(|row| format!("[{}]", row.text())).collect();
        format!(
            "\n  in {} {} must {}happen: {}",
            controller.state_name(posed.state),
            controller.signals.event_name(posed.event),
            if posed.demand.enable { "be able to " } else { "not " },
            rows.join(" or ")
        )
    };
    let rows: String = none.conflict.iter().map(row).collect();
    format!(
        "no outputs are safe in all of {} (failed: {}); these rows of ({}) contradict each other:{rows}",
        members.join(" "),
        if failed.is_empty() { "none".to_owned() } else { failed.join(" ") },
        controller.signals.outputs.join(" ")
    )
}
