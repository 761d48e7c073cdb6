//! Binding of a model's terminals to the signals of its controller.
//!
//! A terminal without an entry in [`Signals`] is bound to the signal of its own name. Every sensor must be an input of
//! the controller and every actuator an output, except those that follow another plant; an input that no sensor drives
//! keeps its initial value.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use understudy_executable::Interface;
use understudy_typed::{Declared, Point, Points, Program};
use understudy_wire::Image;

use crate::model::{Direction, Terminal, Terminals};

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
    /// A terminal and the signal that it is bound to are of different types, or the receiver of the two lacks values of the sender.
    OtherType {
        /// The terminal and its type.
        terminal: Terminal,
        /// Whether the model drives the signal or is driven by it.
        direction: Direction,
        /// What it is bound to.
        signal: String,
        /// Type and range of the signal.
        declared: Declared,
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
    /// No sensor drives this input of the controller: it keeps its initial value.
    InputNotDriven {
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
    /// Bits of y(i), from this one on.
    Output(usize),
    /// A sensor of another plant, by its number in `follows`.
    Neighbour(usize),
}

/// Of each sensor, its first bit in u(i); of each actuator, what moves it; of both, how many bits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Binding {
    pub(crate) sensors: Vec<(usize, usize)>,
    pub(crate) actuators: Vec<(Driver, usize)>,
    /// u(i) without sensors: the initial values.
    pub(crate) undriven: Image,
}

impl Binding {
    /// Finds every problem; returns the binding unless one of them is an error.
    pub(crate) fn new(
        terminals: &Terminals,
        controller: &Interface,
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
        let actuators = names(&terminals.actuators);
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
        let (inputs, outputs) = (&controller.inputs, &controller.outputs);
        let mut places = |direction: Direction, terminals: &[&Terminal], points: &Points| {
            let mut places = Vec::with_capacity(terminals.len());
            let mut taken = HashSet::new();
            let point_of: HashMap<&str, &Point> =
                points.iter().map(|point| (point.name.as_str(), point)).collect();
            for &terminal in terminals {
                let signal = signals.get(&terminal.name).unwrap_or(&terminal.name);
                let Some(&point) = point_of.get(signal.as_str()) else {
                    problems.push(BindingProblem::UnknownSignal {
                        terminal: terminal.name.clone(),
                        direction,
                        signal: signal.clone(),
                        known: points.names().map(str::to_owned).collect(),
                    });
                    continue;
                };
                let (sender, receiver) = match direction {
                    Direction::Sensor => (&terminal.declared, &point.declared()),
                    Direction::Actuator => (&point.declared(), &terminal.declared),
                };
                if !receiver.takes(sender) {
                    problems.push(BindingProblem::OtherType {
                        terminal: terminal.clone(),
                        direction,
                        signal: signal.clone(),
                        declared: point.declared(),
                    });
                }
                let place = point.bit as usize;
                if !taken.insert(place) && direction == Direction::Sensor {
                    problems.push(BindingProblem::DrivenTwice {
                        terminal: terminal.name.clone(),
                        signal: signal.clone(),
                    });
                }
                places.push(place);
            }
            places
        };
        let sensors: Vec<&Terminal> = terminals.sensors.iter().collect();
        let sensors = places(Direction::Sensor, &sensors, inputs);
        let followed = |terminal: &Terminal| follows.iter().position(|name| *name == terminal.name);
        let driven = terminals.actuators.iter();
        let driven: Vec<&Terminal> = driven.filter(|it| followed(it).is_none()).collect();
        let driven = places(Direction::Actuator, &driven, outputs);
        let fits = problems.is_empty();
        let unbound = |points: &Points, places: &[usize]| {
            let places: HashSet<usize> = places.iter().copied().collect();
            let unbound = points.iter();
            let implied = [Program::RESET, Program::FAULT];
            let unbound = unbound.filter(|point| !implied.contains(&point.name.as_str()));
            let unbound = unbound.filter(|point| !places.contains(&(point.bit as usize)));
            unbound.map(|point| point.name.clone()).collect::<Vec<_>>()
        };
        // Where a name does not fit, the unbound signal is only the other side of the same problem.
        if fits {
            for input in unbound(inputs, &sensors) {
                if !terminals.always_zero.contains(&input) {
                    problems.push(BindingProblem::InputNotDriven { input });
                }
            }
            for output in unbound(outputs, &driven) {
                problems.push(BindingProblem::OutputHasNoEffect { output });
            }
        }
        let mut driven = driven.into_iter();
        let actuators = terminals.actuators.iter().filter_map(|terminal| {
            let neighbour = followed(terminal).map(Driver::Neighbour);
            let driver = neighbour.or_else(|| driven.next().map(Driver::Output))?;
            Some((driver, terminal.bits()))
        });
        let binding = Self {
            actuators: actuators.collect(),
            sensors: sensors
                .into_iter()
                .zip(terminals.sensors.iter().map(Terminal::bits))
                .collect(),
            undriven: Image::from_words(inputs.width(), &inputs.initial_image())
                .unwrap_or_default(),
        };
        (fits.then_some(binding), problems)
    }
}

fn names(terminals: &[Terminal]) -> Arc<[String]> {
    let names = terminals.iter().map(|terminal| terminal.name.clone());
    names.collect()
}
