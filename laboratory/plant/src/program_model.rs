//! A plant that is itself a program, because its author knows how to write one.
//!
//! Its inputs have the names of the controller's outputs, its outputs those of the controller's inputs; a scan of it is
//! one cycle of the plant. In addition, where they are declared: the input `part_arrives` is 1 for one scan for each
//! part that the feeding plant hands over (parts that come together follow each other every other scan, so that each is
//! an edge); the outputs `finished`, `handed_over` and `plant_fault` are counted at their rising edges. Without
//! `finished`, parts that are handed over count as finished.

use std::hash::{Hash, Hasher};

use smallvec::SmallVec;
use understudy_executable::{Executable, Interface, Scratch};
use understudy_typed::{Elementary, Point, Points, Program};
use understudy_wire::Image;

use crate::model::{Counts, Model, PlantProgram, Terminal};

pub(crate) const PART_ARRIVES: &str = "part_arrives";
pub(crate) const FINISHED: &str = "finished";
pub(crate) const HANDED_OVER: &str = "handed_over";
pub(crate) const PLANT_FAULT: &str = "plant_fault";

const COUNTED: [&str; 4] = [FINISHED, HANDED_OVER, PLANT_FAULT, Program::FAULT];

fn is_actuator(point: &&Point) -> bool {
    ![PART_ARRIVES, Program::RESET].contains(&point.name.as_str())
}

fn is_sensor(point: &&Point) -> bool {
    !COUNTED.contains(&point.name.as_str())
}

fn terminal(point: &Point) -> Terminal {
    Terminal { name: point.name.clone(), declared: point.declared() }
}

/// The inputs that the controller drives: all but `part_arrives`.
pub(crate) fn actuators(inputs: &Points) -> Vec<Terminal> {
    inputs.iter().filter(is_actuator).map(terminal).collect()
}

/// The outputs that the controller senses: all but those that are counted.
pub(crate) fn sensors(outputs: &Points) -> Vec<Terminal> {
    outputs.iter().filter(is_sensor).map(terminal).collect()
}

/// The points of a plant's own meaning that are no BOOL: they have no edge to be counted.
pub(crate) fn counted_numbers(interface: &Interface) -> Vec<Terminal> {
    let inputs = interface.inputs.iter().filter(|point| !is_actuator(point));
    let outputs = interface.outputs.iter().filter(|point| !is_sensor(point));
    let numbers = inputs.chain(outputs).filter(|point| point.of != Elementary::Bool);
    numbers.map(terminal).collect()
}

/// The bits of points, one behind the other.
fn bits<'a>(points: impl Iterator<Item = &'a Point>) -> Vec<usize> {
    let bits = points.flat_map(|point| point.bit..point.bit + point.of.bits());
    bits.map(|bit| bit as usize).collect()
}

#[derive(Debug, Clone)]
pub(crate) struct ProgramModel {
    executable: Executable,
    scratch: Scratch,
    state: Image,
    inputs: Image,
    outputs: Image,
    /// Of each bit of an actuator, its place among the inputs.
    actuator_places: Vec<usize>,
    /// Of each bit of a sensor, its place among the outputs.
    sensor_places: Vec<usize>,
    part_arrives: Option<usize>,
    queue: u64,
    finished: Counter,
    handed_over: Counter,
    plant_fault: Counter,
    /// A plant whose own program has stopped is broken.
    program_fault: Counter,
}

/// Two of one program that hash alike go on alike.
impl Hash for ProgramModel {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        (&self.state, &self.inputs, &self.outputs, self.queue).hash(hasher);
        (&self.finished, &self.handed_over).hash(hasher);
        (&self.plant_fault, &self.program_fault).hash(hasher);
    }
}

/// Rising edges of an output, if the program has it.
#[derive(Debug, Clone, Hash)]
struct Counter {
    place: Option<usize>,
    last: bool,
    count: u64,
}

impl Counter {
    /// What is 1 from the start is no edge: `outputs` are those that the plant shows before its first scan.
    fn of(points: &Points, name: &str, outputs: &Image) -> Self {
        let place = points.find(name).map(|point| point.bit as usize);
        Self { place, last: place.is_some_and(|place| outputs.get(place)), count: 0 }
    }

    fn see(&mut self, outputs: &Image) {
        let Some(place) = self.place else {
            return;
        };
        let now = outputs.get(place);
        self.count += u64::from(now && !self.last);
        self.last = now;
    }
}

impl ProgramModel {
    /// Before its first scan a plant shows the outputs of a scan with all inputs 0, without having stepped.
    pub(crate) fn new(program: &PlantProgram) -> Self {
        let executable = program.executable.clone();
        let (reads, shows) = (&program.interface.inputs, &program.interface.outputs);
        let mut state = Image::zero(executable.state_count());
        state.words_mut().copy_from_slice(executable.initial());
        let inputs = Image::zero(executable.input_count());
        let mut outputs = Image::zero(executable.output_count());
        let mut scratch = Scratch::default();
        executable.step(
            &mut scratch,
            state.clone().words_mut(),
            inputs.words(),
            outputs.words_mut(),
        );
        Self {
            actuator_places: bits(reads.iter().filter(is_actuator)),
            sensor_places: bits(shows.iter().filter(is_sensor)),
            part_arrives: reads.find(PART_ARRIVES).map(|point| point.bit as usize),
            queue: 0,
            finished: Counter::of(shows, FINISHED, &outputs),
            handed_over: Counter::of(shows, HANDED_OVER, &outputs),
            plant_fault: Counter::of(shows, PLANT_FAULT, &outputs),
            program_fault: Counter::of(shows, Program::FAULT, &outputs),
            executable,
            scratch,
            state,
            inputs,
            outputs,
        }
    }
}

impl Model for ProgramModel {
    fn step(&mut self, actuators: &[bool], arrived: u64) {
        for (&place, &actuator) in self.actuator_places.iter().zip(actuators) {
            self.inputs.set(place, actuator);
        }
        if let Some(place) = self.part_arrives {
            self.queue += arrived;
            let pulse = self.queue > 0 && !self.inputs.get(place);
            self.inputs.set(place, pulse);
            self.queue -= u64::from(pulse);
        }
        self.executable.step(
            &mut self.scratch,
            self.state.words_mut(),
            self.inputs.words(),
            self.outputs.words_mut(),
        );
        for counter in [
            &mut self.finished,
            &mut self.handed_over,
            &mut self.plant_fault,
            &mut self.program_fault,
        ] {
            counter.see(&self.outputs);
        }
    }

    fn sensors(&self, sensors: &mut [bool]) {
        for (sensor, &place) in sensors.iter_mut().zip(&self.sensor_places) {
            *sensor = self.outputs.get(place);
        }
    }

    fn counts(&self) -> Counts {
        let handed_over = self.handed_over.count;
        Counts {
            handed_over,
            finished: match self.finished.place {
                Some(_) => self.finished.count,
                None => handed_over,
            },
            plant_faults: self.plant_fault.count + self.program_fault.count,
        }
    }

    fn positions(&self) -> SmallVec<[u16; 4]> {
        SmallVec::new()
    }
}
