//! Which terminal of a model is which signal of its controller.
//!
//! A terminal without an entry in [`Signals`] is bound to the signal of its own name. Every sensor has to be an input of the
//! controller and every actuator an output; an input that no sensor drives stays 0.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use understudy_logic::Circuit;

use crate::model::{Direction, Terminals};

/// From the name of a model's terminal to the name of the controller's signal, where the two differ.
pub type Signals = BTreeMap<String, String>;

/// Why a model and its controller do not fit; the last two are no obstacle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BindingProblem {
    /// The model has no such terminal.
    UnknownTerminal {
        /// As in [`Signals`].
        terminal: String,
        /// All that there are.
        known: Arc<[String]>,
    },
    /// The controller has no input or no output of this name.
    UnknownSignal {
        /// The model's terminal.
        terminal: String,
        /// Whether the model drives it or is driven by it.
        direction: Direction,
        /// What it is bound to.
        signal: String,
        /// The inputs, or the outputs, that the controller has.
        known: Arc<[String]>,
    },
    /// Two sensors are bound to one input of the controller.
    DrivenTwice {
        /// The second of the two.
        terminal: String,
        /// What both are bound to.
        signal: String,
    },
    /// No sensor drives this input of the controller: it stays 0.
    InputStaysZero {
        /// The input.
        input: String,
    },
    /// No actuator reads this output of the controller.
    OutputHasNoEffect {
        /// The output.
        output: String,
    },
}

/// Of each terminal, its place in u(i) or y(i).
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Binding {
    pub(crate) sensors: Vec<usize>,
    pub(crate) actuators: Vec<usize>,
    /// Bits of u(i).
    pub(crate) inputs: usize,
}

impl Binding {
    /// Finds every problem; the binding is there when none of them is an obstacle.
    pub(crate) fn new(
        terminals: &Terminals,
        controller: &Circuit,
        signals: &Signals,
    ) -> (Option<Self>, Vec<BindingProblem>) {
        let mut problems = Vec::new();
        let known: Arc<[String]> = terminals.names().map(str::to_owned).collect();
        for terminal in signals.keys() {
            if !known.contains(terminal) {
                problems.push(BindingProblem::UnknownTerminal {
                    terminal: terminal.clone(),
                    known: Arc::clone(&known),
                });
            }
        }
        let inputs: Arc<[String]> = controller.inputs().into();
        let outputs = controller.outputs().iter();
        let outputs: Arc<[String]> = outputs.map(|output| output.name.clone()).collect();
        let mut places = |direction: Direction, terminals: &[String], known: &Arc<[String]>| {
            let mut places = Vec::with_capacity(terminals.len());
            let mut taken = HashSet::new();
            let place_of: HashMap<&String, usize> = known
                .iter()
                .enumerate()
                .map(|(place, name)| (name, place))
                .collect();
            for terminal in terminals {
                let signal = signals.get(terminal).unwrap_or(terminal);
                let Some(&place) = place_of.get(signal) else {
                    problems.push(BindingProblem::UnknownSignal {
                        terminal: terminal.clone(),
                        direction,
                        signal: signal.clone(),
                        known: Arc::clone(known),
                    });
                    continue;
                };
                if !taken.insert(place) && direction == Direction::Sensor {
                    problems.push(BindingProblem::DrivenTwice {
                        terminal: terminal.clone(),
                        signal: signal.clone(),
                    });
                }
                places.push(place);
            }
            places
        };
        let sensors = places(Direction::Sensor, &terminals.sensors, &inputs);
        let actuators = places(Direction::Actuator, &terminals.actuators, &outputs);
        let fits = problems.is_empty();
        let unbound = |names: &[String], places: &[usize]| {
            let places: HashSet<usize> = places.iter().copied().collect();
            let unbound = names.iter().enumerate();
            let unbound = unbound.filter(|(place, _)| !places.contains(place));
            unbound.map(|(_, name)| name.clone()).collect::<Vec<_>>()
        };
        // Where something does not fit, what is left over is only its other side.
        if fits {
            for input in unbound(&inputs, &sensors) {
                if !terminals.always_zero.contains(&input) {
                    problems.push(BindingProblem::InputStaysZero { input });
                }
            }
            for output in unbound(&outputs, &actuators) {
                problems.push(BindingProblem::OutputHasNoEffect { output });
            }
        }
        let binding = Self {
            sensors,
            actuators,
            inputs: inputs.len(),
        };
        (fits.then_some(binding), problems)
    }
}
