//! The arm of section V: it takes a part at the pick place, left and down, and hands it over, right and down.
//!
//! ```text
//!   left, up  ──── horizontal axis ────  right, up
//!      │ vertical axis                      │
//!   pick place                          where it hands over
//! ```
//!
//! Driving an axis against its end stop is harmless, as is driving it in both directions at once. Plant faults: moving
//! sideways while not up, and opening the gripper with a part elsewhere than at the two places below. An end may be
//! missed by one step for both: an output that is held for a cycle moves an axis a little further, which is no plant
//! fault.

use serde::{Deserialize, Serialize};
use smallvec::{SmallVec, smallvec};

use crate::feeder::Feeder;
use crate::model::{Counts, Model, SHOWN};

/// Travel times of the arm.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, Hash)]
pub struct RobotParameters {
    /// Cycles from left to right; at least 1.
    pub horizontal_cycles: u32,
    /// Cycles from up to down; at least 1.
    pub vertical_cycles: u32,
    /// Cycles between taking a part and the next one at the pick place, where no other plant feeds the arm.
    pub feed_cycles: u32,
}

/// About 48 cycles for each part: six parts in 300 cycles.
impl Default for RobotParameters {
    fn default() -> Self {
        Self { horizontal_cycles: 10, vertical_cycles: 5, feed_cycles: 5 }
    }
}

/// Sensors in the order of u10 to u14.
pub(crate) const SENSORS: [&str; 5] =
    ["part_present", "arm_left", "arm_right", "arm_up", "arm_down"];
/// Actuators in the order of y11 to y15.
pub(crate) const ACTUATORS: [&str; 5] = ["move_right", "move_left", "move_down", "move_up", "grip"];
pub(crate) const POSITIONS: [&str; 3] = ["horizontal", "vertical", "gripper"];

#[derive(Debug, Clone, Hash)]
pub(crate) struct Robot {
    parameters: RobotParameters,
    feeder: Feeder,
    /// Position of the horizontal axis; 0 is left.
    horizontal: u32,
    /// Position of the vertical axis; 0 is up.
    vertical: u32,
    closed: bool,
    holds_part: bool,
    part_at_pick_place: bool,
    /// Parts from another plant that wait for the pick place to be free.
    queue: u64,
    sideways_while_low: bool,
    counts: Counts,
}

impl Robot {
    pub(crate) fn new(parameters: RobotParameters, fed: bool) -> Self {
        let feeder = Feeder::new(fed, parameters.feed_cycles);
        let mut robot = Self {
            parameters,
            feeder,
            horizontal: 0,
            vertical: 0,
            closed: false,
            holds_part: false,
            part_at_pick_place: false,
            queue: 0,
            sideways_while_low: false,
            counts: Counts::default(),
        };
        robot.take_parts(0);
        robot
    }

    fn is_down(&self) -> bool {
        self.vertical == self.parameters.vertical_cycles
    }

    /// Whether the arm is low enough to open the gripper.
    fn is_low(&self) -> bool {
        let end = self.parameters.vertical_cycles;
        self.vertical + tolerance(end) >= end
    }

    fn is_right(&self) -> bool {
        self.horizontal == self.parameters.horizontal_cycles
    }

    fn take_parts(&mut self, arrived: u64) {
        self.queue += self.feeder.parts(arrived, !self.part_at_pick_place);
        if self.queue > 0 && !self.part_at_pick_place {
            self.queue -= 1;
            self.part_at_pick_place = true;
        }
    }

    fn move_axes(&mut self, right: bool, left: bool, down: bool, up: bool) {
        let before = self.horizontal;
        self.horizontal = moved(before, right, left, self.parameters.horizontal_cycles);
        let sideways =
            self.horizontal != before && self.vertical > tolerance(self.parameters.vertical_cycles);
        if sideways && !self.sideways_while_low {
            self.counts.plant_faults += 1;
        }
        self.sideways_while_low = sideways;
        self.vertical = moved(self.vertical, down, up, self.parameters.vertical_cycles);
    }

    fn move_gripper(&mut self, closed: bool) {
        let at_pick_place = self.horizontal == 0;
        if closed && !self.closed && at_pick_place && self.is_down() && self.part_at_pick_place {
            self.part_at_pick_place = false;
            self.holds_part = true;
        }
        if !closed && self.holds_part {
            self.holds_part = false;
            if self.is_right() && self.is_low() {
                self.counts.handed_over += 1;
                self.counts.finished += 1;
            } else if at_pick_place && self.is_low() && !self.part_at_pick_place {
                self.part_at_pick_place = true;
            } else {
                self.counts.plant_faults += 1;
            }
        }
        self.closed = closed;
    }
}

impl Model for Robot {
    fn step(&mut self, actuators: &[bool], arrived: u64) {
        let [right, left, down, up, grip] = actuators else {
            return;
        };
        self.take_parts(arrived);
        self.move_axes(*right, *left, *down, *up);
        self.move_gripper(*grip);
    }

    fn sensors(&self, sensors: &mut [bool]) {
        sensors.copy_from_slice(&[
            self.part_at_pick_place,
            self.horizontal == 0,
            self.is_right(),
            self.vertical == 0,
            self.is_down(),
        ]);
    }

    fn counts(&self) -> Counts {
        self.counts
    }

    fn positions(&self) -> SmallVec<[u16; 4]> {
        smallvec![
            shown(self.horizontal, self.parameters.horizontal_cycles),
            shown(self.vertical, self.parameters.vertical_cycles),
            if self.closed { SHOWN } else { 0 },
        ]
    }
}

/// One step of an axis from 0 to `end`.
pub(crate) fn moved(position: u32, further: bool, back: bool, end: u32) -> u32 {
    match (further, back) {
        (true, false) => end.min(position + 1),
        (false, true) => position.saturating_sub(1),
        _ => position,
    }
}

/// Number of steps by which the end of an axis may be missed; a short axis is exact.
pub(crate) fn tolerance(end: u32) -> u32 {
    u32::from(end > 2)
}

/// Position in 0 to 1000 of the way to `end`.
pub(crate) fn shown(position: u32, end: u32) -> u16 {
    (u64::from(position) * u64::from(SHOWN) / u64::from(end.max(1))) as u16
}
