//! The plants behind the remote I/Os, and the wires between them.

use std::hash::{Hash, Hasher};

use understudy_plant::{Followed, Plant};
use understudy_wire::{Field, Image, ProgramId};

use crate::parts::Parts;

/// Every plant of a cluster; a wire neither loses nor delays.
#[derive(Debug, Clone)]
pub(crate) struct Plants {
    initial: Vec<Option<Plant>>,
    running: Vec<Option<Plant>>,
    shown: Vec<Option<Field>>,
    fed_by: Vec<Option<ProgramId>>,
    follows: Vec<Vec<Followed>>,
    /// Parts of its feeder that each plant has seen.
    taken: Vec<u64>,
}

/// By where the plants are now; how they start and are fed is given.
impl Hash for Plants {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        (&self.running, &self.shown, &self.taken).hash(hasher);
    }
}

impl Plants {
    pub(crate) fn new(parts: &Parts) -> Self {
        let shown = parts.plants.iter();
        Self {
            initial: parts.plants.clone(),
            running: parts.plants.clone(),
            shown: shown.map(|plant| plant.as_ref().map(Plant::field)).collect(),
            fed_by: parts.fed_by.clone(),
            follows: parts.follows.clone(),
            taken: vec![0; parts.plants.len()],
        }
    }

    /// What the sensors of a program's plant see; none where it has no plant.
    pub(crate) fn field(&self, program: ProgramId) -> Option<&Field> {
        self.shown[program.index()].as_ref()
    }

    /// Drives a plant for one cycle; one that is crashed shows what it showed.
    pub(crate) fn drive(&mut self, program: ProgramId, outputs: &Image) {
        let index = program.index();
        let Some(plant) = &mut self.running[index] else {
            return;
        };
        let feeder = self.fed_by[index].and_then(|feeder| self.shown[feeder.index()].as_ref());
        let handed_over = feeder.map_or(0, |field| field.handed_over);
        // A feeder that was restarted counts from 0 again.
        let arrived = handed_over.saturating_sub(self.taken[index].min(handed_over));
        self.taken[index] = handed_over;
        for (number, followed) in self.follows[index].iter().enumerate() {
            if let Some(field) = &self.shown[followed.from.index()] {
                plant.see(number, &followed.shown(field));
            }
        }
        self.shown[index] = Some(plant.step(outputs, arrived));
    }

    pub(crate) fn crash(&mut self, program: ProgramId) {
        self.running[program.index()] = None;
    }

    pub(crate) fn restart(&mut self, program: ProgramId) {
        let index = program.index();
        self.running[index].clone_from(&self.initial[index]);
        self.shown[index] = self.initial[index].as_ref().map(Plant::field);
        let feeder = self.fed_by[index].and_then(|feeder| self.shown[feeder.index()].as_ref());
        self.taken[index] = feeder.map_or(0, |field| field.handed_over);
    }
}
