//! The filling line in a closed loop: the combined ladder, its plant, and between them what a remote I/O does with a diagnosing ladder.

use std::path::Path;

use understudy_logic::{Circuit, Running};
use understudy_reconfiguration::project::{self, Project};
use understudy_reconfiguration::{Outcome, analyse};

/// One circuit and its state, by names of signals.
#[derive(Clone)]
pub(crate) struct Machine {
    circuit: Circuit,
    running: Running,
    pub(crate) outputs: Vec<bool>,
}

impl Machine {
    pub(crate) fn new(circuit: Circuit) -> Self {
        Self {
            running: Running::new(&circuit),
            outputs: vec![false; circuit.outputs().len()],
            circuit,
        }
    }

    pub(crate) fn step(&mut self, input: &dyn Fn(&str) -> bool) {
        let inputs = self.circuit.inputs().iter().map(|name| input(name));
        self.outputs = self.running.step(&inputs.collect::<Vec<_>>());
    }

    pub(crate) fn get(&self, name: &str) -> bool {
        let outputs = self.circuit.outputs().iter();
        let place = outputs.clone().position(|output| output.name == name);
        place.is_some_and(|place| self.outputs[place])
    }
}

/// The example's project, for some of its channels, with a diagnosing ladder.
pub(crate) fn analysed(channels: &[&str]) -> (Project, Outcome) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/filling-line");
    let text = std::fs::read_to_string(folder.join("reconfiguration.toml")).expect("the example");
    let loaded = project::read("reconfiguration.toml", &text, &mut |name| {
        std::fs::read_to_string(folder.join(name)).map_err(|error| error.to_string())
    });
    let mut project = loaded.project.expect("the example has no errors");
    let channels: Vec<String> = channels.iter().map(|&name| name.to_owned()).collect();
    project.choose(&channels).expect("they are its inputs");
    let outcome = analyse(&project).expect("the example can be analysed");
    (project, outcome)
}

#[derive(Clone)]
pub(crate) struct Bench {
    ladder: Machine,
    plant: Machine,
    diagnosis: Machine,
    channels: Vec<String>,
    /// What the program saw of each channel last.
    seen: Vec<bool>,
    /// What went wrong so far.
    pub(crate) plant_faults: Vec<String>,
    pub(crate) finished: u32,
    pub(crate) scans: u32,
}

impl Bench {
    pub(crate) fn new(project: &Project, outcome: &Outcome) -> Self {
        let lower = |program: &understudy_ladder::Program| {
            Machine::new(program.lower(project.period).expect("it is a circuit"))
        };
        let inputs = &outcome.controller.signals.inputs;
        let channels = project.channels.iter().map(|&place| inputs[place].clone());
        Self {
            ladder: lower(&outcome.combined.program),
            plant: lower(project.plant.as_ref().expect("the example has a plant")),
            diagnosis: lower(outcome.diagnosis.as_ref().expect("it was asked for")),
            channels: channels.collect(),
            seen: vec![false; project.channels.len()],
            plant_faults: Vec::new(),
            finished: 0,
            scans: 0,
        }
    }

    /// What a sensor of the plant would show if it were whole.
    pub(crate) fn shows(&self, name: &str) -> bool {
        self.plant.get(name)
    }

    /// Whether what a channel shows is not believed yet.
    pub(crate) fn unsteady(&self, channel: &str) -> bool {
        self.diagnosis.get(&format!("{channel}.unsteady"))
    }

    /// Whether an output of the ladder is on.
    pub(crate) fn drives(&self, name: &str) -> bool {
        self.ladder.get(name)
    }

    pub(crate) fn diagnosed(&self, channel: &str) -> bool {
        self.diagnosis.get(&format!("{channel}.diagnosed"))
    }

    /// One cycle, in which `sensor` says what a sensor shows instead of what it should.
    pub(crate) fn cycle(&mut self, sensor: &dyn Fn(&str, bool) -> bool, release: bool) {
        let (plant, ladder) = (&self.plant, &self.ladder);
        let raw = |name: &str| sensor(name, plant.get(name));
        self.diagnosis.step(&|name| match name {
            "diagnosis.driven" => true,
            "diagnosis.release" => release,
            _ if name.ends_with(".failed") || name.ends_with(".recalled") => false,
            _ => raw(name) || ladder.get(name),
        });
        let mut status = Vec::new();
        for (place, channel) in self.channels.iter().enumerate() {
            let says = |what: &str| self.diagnosis.get(&format!("{channel}.{what}"));
            status.push((format!("{channel}.failed"), says("diagnosed")));
            if !says("diagnosed") && !says("unsteady") {
                self.seen[place] = raw(channel);
            }
        }
        let (channels, seen) = (&self.channels, &self.seen);
        self.ladder.step(&|name| {
            let known = channels.iter().position(|channel| channel == name);
            let failed = status.iter().find(|(status, _)| status == name);
            match (known, failed) {
                (Some(place), _) => seen[place],
                (None, Some((_, failed))) => *failed,
                _ if name == "module_2.release" => release,
                _ => raw(name),
            }
        });
        self.plant.step(&|name| self.ladder.get(name));
        self.scans += 1;
        self.watch();
    }

    /// What must not happen to a box.
    fn watch(&mut self) {
        if self.plant.get("plant_fault") {
            self.plant_faults.push(format!("scan {}: filled beside the box", self.scans));
        }
        self.finished += u32::from(self.plant.get("finished"));
    }
}
