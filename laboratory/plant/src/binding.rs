//! Binding of a model's terminals to the signals of its controller.
//!
//! A terminal without an entry in [`Signals`] is bound to the signal of its own name. Every sensor must be an input of
//! the controller and every actuator an output, except those that follow another plant; an input that no sensor drives
//! stays 0.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use understudy_logic::Circuit;

use crate::model::{Direction, Terminals};

/// Names of the controller's signals by the name of the model's terminal, where the two differ.
pub type Signals = BTreeMap<String, String>;

/// Reason why a model and its controller do not fit; the last two are warnings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BindingProblem {
    /// The model has no such terminal.
    UnknownTerminal {
        /// Name in [`Signals`].
        terminal: String,
        /// All terminals of the model.
        known: Arc<[String]>,
    },
    /// The controller has no input or no output of this name.
    UnknownSignal {
        /// The model's terminal.
        terminal: String,
        /// Whether the model drives it or is driven by it.
        direction: Direction,
        /// Signal that it is bound to.
        signal: String,
        /// The inputs, or the outputs, of the controller.
        known: Arc<[String]>,
    },
    /// Two sensors are bound to one input of the controller.
    DrivenTwice {
        /// The second of the two.
        terminal: String,
        /// Input that both are bound to.
        signal: String,
    },
    /// A terminal that follows another plant is bound to a signal of the controller too.
    FollowsTwo {
        /// The terminal.
        terminal: String,
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

/// Source of an actuator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Driver {
    /// A bit of y(i).
    Output(usize),
    /// A sensor of another plant, by its number in `follows`.
    Neighbour(usize),
}

/// Place in u(i) of each sensor; source of each actuator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Binding {
    pub(crate) sensors: Vec<usize>,
    pub(crate) actuators: Vec<Driver>,
    /// Width of u(i) in bits.
    pub(crate) inputs: usize,
}

impl Binding {
    /// Finds every problem; returns the binding unless one of them is an error.
    pub(crate) fn new(
        terminals: &Terminals,
        controller: &Circuit,
        signals: &Signals,
        follows: &[String],
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
        let actuators: Arc<[String]> = terminals.actuators.as_slice().into();
        for terminal in follows {
            if !actuators.contains(terminal) {
                problems.push(BindingProblem::UnknownTerminal {
                    terminal: terminal.clone(),
                    known: Arc::clone(&actuators),
                });
            } else if signals.contains_key(terminal) {
                let terminal = terminal.clone();
                problems.push(BindingProblem::FollowsTwo { terminal });
            }
        }
        let inputs: Arc<[String]> = controller.inputs().into();
        let outputs = controller.outputs().iter();
        let outputs: Arc<[String]> = outputs.map(|output| output.name.clone()).collect();
        let mut places = |direction: Direction, terminals: &[&String], known: &Arc<[String]>| {
            let mut places = Vec::with_capacity(terminals.len());
            let mut taken = HashSet::new();
            let place_of: HashMap<&String, usize> = known
                .iter()
                .enumerate()
                .map(|(place, name)| (name, place))
                .collect();
            for &terminal in terminals {
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
        let sensors: Vec<&String> = terminals.sensors.iter().collect();
        let sensors = places(Direction::Sensor, &sensors, &inputs);
        let followed = |terminal: &String| follows.iter().position(|name| name == terminal);
        let driven = terminals.actuators.iter();
        let driven: Vec<&String> = driven.filter(|name| followed(name).is_none()).collect();
        let driven = places(Direction::Actuator, &driven, &outputs);
        let fits = problems.is_empty();
        let unbound = |names: &[String], places: &[usize]| {
            let places: HashSet<usize> = places.iter().copied().collect();
            let unbound = names.iter().enumerate();
            let unbound = unbound.filter(|(place, _)| !places.contains(place));
            unbound.map(|(_, name)| name.clone()).collect::<Vec<_>>()
        };
        // Where a name does not fit, the unbound signal is only the other side of the same problem.
        if fits {
            for input in unbound(&inputs, &sensors) {
                if !terminals.always_zero.contains(&input) {
                    problems.push(BindingProblem::InputStaysZero { input });
                }
            }
            for output in unbound(&outputs, &driven) {
                problems.push(BindingProblem::OutputHasNoEffect { output });
            }
        }
        let mut driven = driven.into_iter();
        let actuators = terminals.actuators.iter().filter_map(|terminal| {
            let neighbour = followed(terminal).map(Driver::Neighbour);
            neighbour.or_else(|| driven.next().map(Driver::Output))
        });
        let actuators = actuators.collect();
        let binding = Self {
            sensors,
            actuators,
            inputs: inputs.len(),
        };
        (fits.then_some(binding), problems)
    }
}
