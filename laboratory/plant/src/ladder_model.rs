//! A plant model that is itself a ladder program.
//!
//! Its inputs have the names of the controller's outputs, its outputs those of the controller's inputs; a scan of it is
//! one cycle of the plant. In addition, where they are declared: the input `part_arrives` is 1 for one scan for each
//! part that the feeding plant hands over (parts that come together follow each other every other scan, so that each is
//! an edge); the outputs `finished`, `handed_over` and `plant_fault` are counted at their rising edges. Without
//! `finished`, parts that are handed over count as finished.

use std::hash::{Hash, Hasher};

use smallvec::SmallVec;
use understudy_logic::{Circuit, Scan, Scratch};
use understudy_wire::Image;

use crate::model::{Counts, Model};

pub(crate) const PART_ARRIVES: &str = "part_arrives";
pub(crate) const FINISHED: &str = "finished";
pub(crate) const HANDED_OVER: &str = "handed_over";
pub(crate) const PLANT_FAULT: &str = "plant_fault";

/// The inputs that the controller drives: all but `part_arrives`.
pub(crate) fn actuators(circuit: &Circuit) -> Vec<String> {
    let names = circuit.inputs().iter();
    names
        .filter(|name| *name != PART_ARRIVES)
        .cloned()
        .collect()
}

/// The outputs that the controller senses: all but those that are counted.
pub(crate) fn sensors(circuit: &Circuit) -> Vec<String> {
    let names = circuit.outputs().iter().map(|output| &output.name);
    names
        .filter(|name| ![FINISHED, HANDED_OVER, PLANT_FAULT].contains(&name.as_str()))
        .cloned()
        .collect()
}

#[derive(Debug, Clone)]
pub(crate) struct LadderModel {
    scan: Scan,
    scratch: Scratch,
    state: Image,
    inputs: Image,
    outputs: Image,
    /// Place among the inputs of each actuator.
    actuator_places: Vec<usize>,
    /// Place among the outputs of each sensor.
    sensor_places: Vec<usize>,
    part_arrives: Option<usize>,
    queue: u64,
    finished: Counter,
    handed_over: Counter,
    plant_fault: Counter,
}

/// Two of one program that hash alike behave alike.
impl Hash for LadderModel {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        (&self.state, &self.inputs, &self.outputs, self.queue).hash(hasher);
        (&self.finished, &self.handed_over, &self.plant_fault).hash(hasher);
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
    /// An output that is 1 from the start is not an edge: `outputs` are those that the plant shows before its first
    /// scan.
    fn of(circuit: &Circuit, name: &str, outputs: &Image) -> Self {
        let mut names = circuit.outputs().iter();
        let place = names.position(|output| output.name == name);
        Self {
            place,
            last: place.is_some_and(|place| outputs.get(place)),
            count: 0,
        }
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

impl LadderModel {
    /// Before its first scan a plant shows the outputs of a scan with all inputs 0, without having stepped.
    pub(crate) fn new(circuit: &Circuit) -> Self {
        let scan = Scan::new(circuit);
        let mut state = Image::zero(scan.register_count());
        state.words_mut().copy_from_slice(scan.initial());
        let inputs = Image::zero(scan.input_count());
        let mut outputs = Image::zero(scan.output_count());
        let mut scratch = Scratch::default();
        scan.step(
            &mut scratch,
            state.clone().words_mut(),
            inputs.words(),
            outputs.words_mut(),
        );
        let places = |kept: &dyn Fn(&str) -> bool, names: &mut dyn Iterator<Item = &String>| {
            let places = names.enumerate().filter(|(_, name)| kept(name));
            places.map(|(place, _)| place).collect::<Vec<_>>()
        };
        let counted = [FINISHED, HANDED_OVER, PLANT_FAULT];
        Self {
            actuator_places: places(&|name| name != PART_ARRIVES, &mut circuit.inputs().iter()),
            sensor_places: places(
                &|name| !counted.contains(&name),
                &mut circuit.outputs().iter().map(|output| &output.name),
            ),
            part_arrives: circuit
                .inputs()
                .iter()
                .position(|name| name == PART_ARRIVES),
            queue: 0,
            finished: Counter::of(circuit, FINISHED, &outputs),
            handed_over: Counter::of(circuit, HANDED_OVER, &outputs),
            plant_fault: Counter::of(circuit, PLANT_FAULT, &outputs),
            scan,
            scratch,
            state,
            inputs,
            outputs,
        }
    }
}

impl Model for LadderModel {
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
        self.scan.step(
            &mut self.scratch,
            self.state.words_mut(),
            self.inputs.words(),
            self.outputs.words_mut(),
        );
        for counter in [
            &mut self.finished,
            &mut self.handed_over,
            &mut self.plant_fault,
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
            plant_faults: self.plant_fault.count,
        }
    }

    fn positions(&self) -> SmallVec<[u16; 4]> {
        SmallVec::new()
    }
}
