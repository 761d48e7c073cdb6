//! A model bound to its controller's signals.

use std::hash::{Hash, Hasher};

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use understudy_executable::{Executable, Interface};
use understudy_typed::{Declared, Elementary};
use understudy_wire::{Field, Image};

use crate::binding::{Binding, BindingProblem, Driver, Signals};
use crate::press::{self, Press, PressParameters};
use crate::program_model::{self, ProgramModel};
use crate::robot::{self, Robot, RobotParameters};

/// Position of a moving part at its far end.
pub(crate) const SHOWN: u16 = 1000;

/// The inside of a plant. Shapes: `actuators` and `sensors` have the bits of its [`Terminals`], one behind the other.
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
    /// A program, for the period of the cluster.
    Program(Box<PlantProgram>),
}

/// A program that is a plant.
#[derive(Debug, Clone)]
pub struct PlantProgram {
    /// Compiled.
    pub executable: Executable,
    /// Its inputs, which are actuators, and its outputs, which are sensors.
    pub interface: Interface,
}

impl<'a, P> From<&'a P> for PlantProgram
where
    Executable: From<&'a P>,
    Interface: From<&'a P>,
{
    fn from(program: &'a P) -> Self {
        Self { executable: program.into(), interface: program.into() }
    }
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

/// A sensor or an actuator of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Terminal {
    /// Its name.
    pub name: String,
    /// What it shows, or what moves it.
    pub declared: Declared,
}

impl Terminal {
    /// One that is on or off.
    fn bit(name: &str) -> Self {
        Self { name: name.to_owned(), declared: Elementary::Bool.into() }
    }

    pub(crate) fn bits(&self) -> usize {
        self.declared.of.bits() as usize
    }
}

/// The names by which a model is bound to a controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Terminals {
    /// What it shows.
    pub sensors: Vec<Terminal>,
    /// What moves it.
    pub actuators: Vec<Terminal>,
    /// Inputs that its controller may have and that are 0 as long as nobody is there to press them.
    pub always_zero: Vec<String>,
    /// Its moving parts, in the order of [`Field::positions`].
    pub positions: Vec<String>,
}

impl Terminals {
    /// Sensors, then actuators.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let names = self.sensors.iter().chain(&self.actuators);
        names.map(|terminal| terminal.name.as_str())
    }
}

impl ModelKind {
    /// The names by which it is bound.
    pub fn terminals(&self) -> Terminals {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        let bits = |names: &[&str]| names.iter().map(|name| Terminal::bit(name)).collect();
        match self {
            Self::Robot(_) => Terminals {
                sensors: bits(&robot::SENSORS),
                actuators: bits(&robot::ACTUATORS),
                always_zero: names(&["stop"]),
                positions: names(&robot::POSITIONS),
            },
            Self::Press(_) => Terminals {
                sensors: bits(&press::SENSORS),
                actuators: bits(&press::ACTUATORS),
                always_zero: names(&["stop"]),
                positions: names(&press::POSITIONS),
            },
            Self::Program(program) => Terminals {
                sensors: program_model::sensors(&program.interface.outputs),
                actuators: program_model::actuators(&program.interface.inputs),
                always_zero: Vec::new(),
                positions: Vec::new(),
            },
        }
    }

    /// The points that count parts or plant faults and are no BOOL.
    pub fn counted_numbers(&self) -> Vec<Terminal> {
        match self {
            Self::Robot(_) | Self::Press(_) => Vec::new(),
            Self::Program(program) => program_model::counted_numbers(&program.interface),
        }
    }

    /// Whether parts from another plant have an effect.
    pub fn takes_parts(&self) -> bool {
        match self {
            Self::Robot(_) | Self::Press(_) => true,
            Self::Program(program) => {
                let mut inputs = program.interface.inputs.names();
                inputs.any(|input| input == program_model::PART_ARRIVES)
            }
        }
    }

    /// Whether it hands parts over to a plant that it feeds.
    pub fn hands_over(&self) -> bool {
        match self {
            Self::Robot(_) | Self::Press(_) => true,
            Self::Program(program) => {
                let mut outputs = program.interface.outputs.names();
                outputs.any(|output| output == program_model::HANDED_OVER)
            }
        }
    }
}

/// A plant.
#[derive(Debug, Clone)]
pub struct Plant {
    inside: Inside,
    binding: Binding,
    /// What it follows, as it last saw that, bit by bit.
    seen: Vec<SmallVec<[bool; 1]>>,
    actuators: Vec<bool>,
    sensors: Vec<bool>,
    position_names: Vec<String>,
}

#[derive(Debug, Clone, Hash)]
enum Inside {
    Robot(Robot),
    Press(Press),
    Program(Box<ProgramModel>),
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
            Self::Program(program) => program.as_ref(),
        }
    }

    fn model_mut(&mut self) -> &mut dyn Model {
        match self {
            Self::Robot(robot) => robot,
            Self::Press(press) => press,
            Self::Program(program) => program.as_mut(),
        }
    }
}

impl Plant {
    /// Binds a model to the signals of `controller`; `fed` where its parts come from another plant.
    ///
    /// Returns every problem; the plant is there unless one of them is an error.
    pub fn new(
        kind: &ModelKind,
        controller: &Interface,
        signals: &Signals,
        fed: bool,
    ) -> (Option<Self>, Vec<BindingProblem>) {
        Self::following(kind, controller, signals, &[], fed)
    }

    /// As [`Self::new`], where the actuators `follows` follow other plants and not the controller. They are 0 until
    /// [`Self::see`] sets them.
    pub fn following(
        kind: &ModelKind,
        controller: &Interface,
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
                ModelKind::Program(program) => {
                    Inside::Program(Box::new(ProgramModel::new(program)))
                }
            },
            seen: vec![SmallVec::new(); follows.len()],
            actuators: vec![false; binding.actuators.iter().map(|(_, bits)| bits).sum()],
            sensors: vec![false; binding.sensors.iter().map(|(_, bits)| bits).sum()],
            position_names: terminals.positions,
            binding,
        });
        (plant, problems)
    }

    /// From now on what is followed under this number shows these bits; a number that there is not is ignored.
    pub fn see(&mut self, number: usize, shown: &[bool]) {
        if let Some(seen) = self.seen.get_mut(number) {
            *seen = SmallVec::from_slice(shown);
        }
    }

    /// Steps one cycle with y(i), in which `arrived` parts came from the plant that feeds this one. Returns the new
    /// field.
    ///
    /// Outputs past the width of `outputs` count as 0.
    pub fn step(&mut self, outputs: &Image, arrived: u64) -> Field {
        let mut actuators = self.actuators.iter_mut();
        for &(driver, bits) in &self.binding.actuators {
            for (bit, actuator) in actuators.by_ref().take(bits).enumerate() {
                *actuator = match driver {
                    Driver::Output(place) => outputs.get(place + bit),
                    Driver::Neighbour(number) => {
                        self.seen[number].get(bit).copied().unwrap_or_default()
                    }
                };
            }
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
        let mut sensors = self.binding.undriven.clone();
        let mut shown = self.sensors.iter();
        for &(place, bits) in &self.binding.sensors {
            for (bit, &sensor) in shown.by_ref().take(bits).enumerate() {
                sensors.set(place + bit, sensor);
            }
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
