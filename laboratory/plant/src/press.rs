//! The press of section V: a ram that presses the part below it.
//!
//! A part is finished, counted and taken away when the ram has gone down on it and has come back up. Plant fault: a
//! part that arrives while another one is in the press, or while the ram is more than a step from up; such a part is
//! lost.

use serde::{Deserialize, Serialize};
use smallvec::{SmallVec, smallvec};

use crate::feeder::Feeder;
use crate::model::{Counts, Model};
use crate::robot::{moved, shown, tolerance};

/// Travel times of the press.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, Hash)]
pub struct PressParameters {
    /// Cycles from up to down; at least 1.
    pub ram_cycles: u32,
    /// Cycles between a finished part and the next one, where no other plant feeds the press.
    pub feed_cycles: u32,
}

impl Default for PressParameters {
    fn default() -> Self {
        Self { ram_cycles: 8, feed_cycles: 5 }
    }
}

/// Sensors in the order of u20 to u22.
pub(crate) const SENSORS: [&str; 3] = ["part_present", "ram_up", "ram_down"];
/// Actuators in the order of y21 and y22.
pub(crate) const ACTUATORS: [&str; 2] = ["move_down", "move_up"];
pub(crate) const POSITIONS: [&str; 1] = ["ram"];

#[derive(Debug, Clone, Hash)]
pub(crate) struct Press {
    parameters: PressParameters,
    feeder: Feeder,
    /// Position of the ram; 0 is up.
    ram: u32,
    part: Option<Part>,
    counts: Counts,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Part {
    Raw,
    Pressed,
}

impl Press {
    pub(crate) fn new(parameters: PressParameters, fed: bool) -> Self {
        let feeder = Feeder::new(fed, parameters.feed_cycles);
        let mut press = Self { parameters, feeder, ram: 0, part: None, counts: Counts::default() };
        press.take_parts(0);
        press
    }

    fn take_parts(&mut self, arrived: u64) {
        let is_up = self.ram <= tolerance(self.parameters.ram_cycles);
        let free = self.part.is_none() && is_up;
        let parts = self.feeder.parts(arrived, free);
        let fits = u64::from(free).min(parts);
        if fits == 1 {
            self.part = Some(Part::Raw);
        }
        self.counts.plant_faults += parts - fits;
    }
}

impl Model for Press {
    fn step(&mut self, actuators: &[bool], arrived: u64) {
        let [down, up] = actuators else {
            return;
        };
        self.take_parts(arrived);
        self.ram = moved(self.ram, *down, *up, self.parameters.ram_cycles);
        if self.ram == self.parameters.ram_cycles && self.part.is_some() {
            self.part = Some(Part::Pressed);
        }
        if self.ram == 0 && self.part == Some(Part::Pressed) {
            self.part = None;
            self.counts.finished += 1;
            self.counts.handed_over += 1;
        }
    }

    fn sensors(&self, sensors: &mut [bool]) {
        sensors.copy_from_slice(&[
            self.part.is_some(),
            self.ram == 0,
            self.ram == self.parameters.ram_cycles,
        ]);
    }

    fn counts(&self) -> Counts {
        self.counts
    }

    fn positions(&self) -> SmallVec<[u16; 4]> {
        smallvec![shown(self.ram, self.parameters.ram_cycles)]
    }
}
