//! A model bound to its controller's signals.

use std::hash::{Hash, Hasher};

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use understudy_logic::Circuit;
use understudy_wire::{Field, Image};

use crate::binding::{Binding, BindingProblem, Driver, Signals};
use crate::ladder_model::{self, LadderModel};
use crate::press::{self, Press, PressParameters};
use crate::robot::{self, Robot, RobotParameters};

/// Position of a moving part at its far end.
pub(crate) const SHOWN: u16 = 1000;

/// Behaviour of a plant. Shapes: `actuators` and `sensors` as long as its [`Terminals`].
pub(crate) trait Model {
    /// Steps one cycle, in which `arrived` parts came from the plant that feeds this one.
    fn step(&mut self, actuators: &[bool], arrived: u64);
    /// Current values of its sensors.
    fn sensors(&self, sensors: &mut [bool]);
    fn counts(&self) -> Counts;
    /// Positions of its moving parts, 0 to [`SHOWN`] each.
    fn positions(&self) -> SmallVec<[u16; 4]>;
}

/// Counts since the start of the plant; none ever falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub(crate) struct Counts {
    pub(crate) handed_over: u64,
    pub(crate) finished: u64,
    pub(crate) plant_faults: u64,
}

/// Kind of a model, with its parameters.
#[derive(Debug, Clone)]
pub enum ModelKind {
    /// The arm of section V.
    Robot(RobotParameters),
    /// The press of section V.
    Press(PressParameters),
    /// A ladder program, lowered with the period of the cluster.
    Ladder(Box<Circuit>),
}

/// Direction of a terminal, as seen from the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// An input of the controller.
    Sensor,
    /// An output of the controller.
    Actuator,
}

/// Names by which a model is bound to a controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Terminals {
    /// Its sensors.
    pub sensors: Vec<String>,
    /// Its actuators.
    pub actuators: Vec<String>,
    /// Inputs that its controller may have for push buttons: 0 in the model.
    pub always_zero: Vec<String>,
    /// Its moving parts, in the order of [`Field::positions`].
    pub positions: Vec<String>,
}

impl Terminals {
    /// Sensors, then actuators.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let names = self.sensors.iter().chain(&self.actuators);
        names.map(String::as_str)
    }
}

impl ModelKind {
    /// The names by which it is bound.
    pub fn terminals(&self) -> Terminals {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        match self {
            Self::Robot(_) => Terminals {
                sensors: names(&robot::SENSORS),
                actuators: names(&robot::ACTUATORS),
                always_zero: names(&["stop"]),
                positions: names(&robot::POSITIONS),
            },
            Self::Press(_) => Terminals {
                sensors: names(&press::SENSORS),
                actuators: names(&press::ACTUATORS),
                always_zero: names(&["stop"]),
                positions: names(&press::POSITIONS),
            },
            Self::Ladder(circuit) => Terminals {
                sensors: ladder_model::sensors(circuit),
                actuators: ladder_model::actuators(circuit),
                always_zero: Vec::new(),
                positions: Vec::new(),
            },
        }
    }

    /// Whether parts from another plant have an effect.
    pub fn takes_parts(&self) -> bool {
        match self {
            Self::Robot(_) | Self::Press(_) => true,
            Self::Ladder(circuit) => {
                let mut inputs = circuit.inputs().iter();
                inputs.any(|input| input == ladder_model::PART_ARRIVES)
            }
        }
    }

    /// Whether it hands parts over to a plant that it feeds.
    pub fn hands_over(&self) -> bool {
        match self {
            Self::Robot(_) | Self::Press(_) => true,
            Self::Ladder(circuit) => {
                let mut outputs = circuit.outputs().iter();
                outputs.any(|output| output.name == ladder_model::HANDED_OVER)
            }
        }
    }
}

/// A plant.
#[derive(Debug, Clone)]
pub struct Plant {
    inside: Inside,
    binding: Binding,
    /// Last known values of the sensors that it follows.
    seen: Vec<bool>,
    actuators: Vec<bool>,
    sensors: Vec<bool>,
    position_names: Vec<String>,
}

#[derive(Debug, Clone, Hash)]
enum Inside {
    Robot(Robot),
    Press(Press),
    Ladder(Box<LadderModel>),
}

/// Two of one binding that hash alike behave alike.
impl Hash for Plant {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        (&self.inside, &self.seen, &self.actuators, &self.sensors).hash(hasher);
    }
}

impl Inside {
    fn model(&self) -> &dyn Model {
        match self {
            Self::Robot(robot) => robot,
            Self::Press(press) => press,
            Self::Ladder(ladder) => ladder.as_ref(),
        }
    }

    fn model_mut(&mut self) -> &mut dyn Model {
        match self {
            Self::Robot(robot) => robot,
            Self::Press(press) => press,
            Self::Ladder(ladder) => ladder.as_mut(),
        }
    }
}

impl Plant {
    /// Binds a model to the signals of `controller`; `fed` where its parts come from another plant.
    ///
    /// Returns every problem; the plant is there unless one of them is an error.
    pub fn new(
        kind: &ModelKind,
        controller: &Circuit,
        signals: &Signals,
        fed: bool,
    ) -> (Option<Self>, Vec<BindingProblem>) {
        Self::following(kind, controller, signals, &[], fed)
    }

    /// As [`Self::new`], where the actuators `follows` follow other plants and not the controller. They are 0 until
    /// [`Self::see`] sets them.
    pub fn following(
        kind: &ModelKind,
        controller: &Circuit,
        signals: &Signals,
        follows: &[String],
        fed: bool,
    ) -> (Option<Self>, Vec<BindingProblem>) {
        let terminals = kind.terminals();
        let (binding, problems) = Binding::new(&terminals, controller, signals, follows);
        let plant = binding.map(|binding| Self {
            inside: match kind {
                ModelKind::Robot(parameters) => Inside::Robot(Robot::new(parameters.clone(), fed)),
                ModelKind::Press(parameters) => Inside::Press(Press::new(parameters.clone(), fed)),
                ModelKind::Ladder(circuit) => Inside::Ladder(Box::new(LadderModel::new(circuit))),
            },
            seen: vec![false; follows.len()],
            actuators: vec![false; binding.actuators.len()],
            sensors: vec![false; binding.sensors.len()],
            position_names: terminals.positions,
            binding,
        });
        (plant, problems)
    }

    /// Sets the followed sensor with this number; an unknown number is ignored.
    pub fn see(&mut self, number: usize, on: bool) {
        if let Some(seen) = self.seen.get_mut(number) {
            *seen = on;
        }
    }

    /// Steps one cycle with y(i), in which `arrived` parts came from the plant that feeds this one. Returns the new
    /// field.
    ///
    /// Outputs past the width of `outputs` count as 0.
    pub fn step(&mut self, outputs: &Image, arrived: u64) -> Field {
        for (actuator, &driver) in self.actuators.iter_mut().zip(&self.binding.actuators) {
            *actuator = match driver {
                Driver::Output(place) => outputs.get(place),
                Driver::Neighbour(number) => self.seen[number],
            };
        }
        self.inside.model_mut().step(&self.actuators, arrived);
        self.show()
    }

    /// Its current sensors and counts.
    pub fn field(&self) -> Field {
        self.clone().show()
    }

    /// Names of [`Field::positions`], in order.
    pub fn position_names(&self) -> &[String] {
        &self.position_names
    }

    fn show(&mut self) -> Field {
        let model = self.inside.model();
        model.sensors(&mut self.sensors);
        let mut sensors = Image::zero(self.binding.inputs);
        for (&sensor, &place) in self.sensors.iter().zip(&self.binding.sensors) {
            sensors.set(place, sensor);
        }
        let counts = model.counts();
        Field {
            sensors,
            handed_over: counts.handed_over,
            finished: counts.finished,
            plant_faults: counts.plant_faults,
            positions: model.positions(),
        }
    }
}
