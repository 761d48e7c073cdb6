//! Channels that do not report their failure: a ladder finds it from what the plant can do.
//!
//! The ladder is scanned before each sample. It reads the sensors and the driven outputs; its findings become part
//! of u(i), and so of the history: all replicas of the program receive what the remote I/O found, also after restarts.
//!
//! ```text
//!   reads   every input of the program by its name   the value of the device, not the value that the program reads
//!           every output of the program by its name  the output driven since the last sample
//!           NAME.recalled                            NAME.failed of the last sample, in the first scan after a restart
//!           diagnosis.driven                         the driven output was proven, neither held nor fail-safe
//!           diagnosis.release                        the operator has released since the last scan
//!   writes  NAME.diagnosed                           NAME.failed is 1, and NAME keeps its last good value
//!           NAME.unsteady                            NAME keeps its last value, and is not reported as failed
//! ```

use understudy_logic::{Circuit, Scan, Scratch};
use understudy_wire::Image;

/// A diagnosing ladder for the signals of a program.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    scan: Scan,
    inputs: Vec<InputSource>,
    /// For each output.
    outputs: Vec<OutputMeaning>,
}

#[derive(Debug, Clone, Copy)]
enum InputSource {
    Input(usize),
    Output(usize),
    /// By the place of the status in u(i).
    Recalled(usize),
    Driven,
    Release,
}

#[derive(Debug, Clone, Copy)]
enum OutputMeaning {
    /// By the place of the status in u(i).
    Diagnosed(usize),
    Unsteady(usize),
    /// For people only.
    Nothing,
}

/// Inputs of one scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Observation<'a> {
    pub(crate) sensors: &'a Image,
    pub(crate) driven: &'a Image,
    pub(crate) is_true: bool,
}

/// What it has found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Found {
    /// Statuses that are 1, as bits of u(i).
    pub(crate) failed: Image,
    /// Inputs that keep their value, as bits of u(i).
    pub(crate) unsteady: Image,
}

/// A diagnosing ladder at work.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Diagnosing {
    registers: Image,
    /// The last sample before a restart, until the first scan after it.
    recalled: Option<Image>,
    released: bool,
}

impl Diagnosis {
    /// `circuit` for a program with these inputs and outputs.
    ///
    /// # Errors
    /// Each input of the circuit without a source, and each output that names a channel that does not exist.
    pub fn new(
        circuit: &Circuit,
        inputs: &[String],
        outputs: &[String],
    ) -> Result<Self, Vec<String>> {
        let mut unknown = Vec::new();
        let input = |name: &str| inputs.iter().position(|known| known == name);
        let status =
            |name: &str| input(&format!("{name}.failed")).filter(|_| input(name).is_some());
        let mut sources = Vec::new();
        for name in circuit.inputs() {
            let output = || outputs.iter().position(|known| known == name);
            let recalled = || name.strip_suffix(".recalled").and_then(status);
            let found = match name.as_str() {
                "diagnosis.driven" => Some(InputSource::Driven),
                "diagnosis.release" => Some(InputSource::Release),
                _ => input(name)
                    .map(InputSource::Input)
                    .or_else(|| output().map(InputSource::Output))
                    .or_else(|| recalled().map(InputSource::Recalled)),
            };
            match found {
                Some(found) => sources.push(found),
                None => unknown.push(format!("the program has no signal `{name}`")),
            }
        }
        let mut meanings = Vec::new();
        for output in circuit.outputs() {
            let (found, channel) = if let Some(channel) = output.name.strip_suffix(".diagnosed") {
                (status(channel).map(OutputMeaning::Diagnosed), channel)
            } else if let Some(channel) = output.name.strip_suffix(".unsteady") {
                (input(channel).map(OutputMeaning::Unsteady), channel)
            } else {
                (Some(OutputMeaning::Nothing), "")
            };
            match found {
                Some(found) => meanings.push(found),
                None => unknown.push(format!(
                    "`{}` names an unknown channel: the program needs the inputs `{channel}` and `{channel}.failed`",
                    output.name
                )),
            }
        }
        if !unknown.is_empty() {
            return Err(unknown);
        }
        Ok(Self { scan: Scan::new(circuit), inputs: sources, outputs: meanings })
    }
}

impl Diagnosing {
    pub(crate) fn new(diagnosis: Option<&Diagnosis>) -> Self {
        let registers = diagnosis.map(|diagnosis| {
            let scan = &diagnosis.scan;
            Image::from_words(scan.register_count(), scan.initial())
                .expect("a circuit packs its initial state")
        });
        Self { registers: registers.unwrap_or_default(), recalled: None, released: false }
    }

    /// u(i) of the last sample before a restart.
    pub(crate) fn recall(&mut self, inputs: &Image) {
        self.recalled = Some(inputs.clone());
    }

    /// The operator has released.
    pub(crate) fn release(&mut self) {
        self.released = true;
    }

    /// One scan.
    pub(crate) fn scan(&mut self, diagnosis: &Diagnosis, observation: Observation<'_>) -> Found {
        let recalled = self.recalled.take();
        let bit = |source: &InputSource| match *source {
            InputSource::Input(place) => observation.sensors.get(place),
            InputSource::Output(place) => observation.driven.get(place),
            InputSource::Recalled(place) => {
                recalled.as_ref().is_some_and(|inputs| inputs.get(place))
            }
            InputSource::Driven => observation.is_true,
            InputSource::Release => self.released,
        };
        let inputs = Image::from_bits(diagnosis.inputs.iter().map(bit));
        self.released = false;
        let mut outputs = Image::zero(diagnosis.outputs.len());
        diagnosis.scan.step(
            &mut Scratch::default(),
            self.registers.words_mut(),
            inputs.words(),
            outputs.words_mut(),
        );
        let mut found = Found {
            failed: Image::zero(observation.sensors.width()),
            unsteady: Image::zero(observation.sensors.width()),
        };
        for (place, meaning) in diagnosis.outputs.iter().enumerate() {
            match *meaning {
                OutputMeaning::Diagnosed(status) => found.failed.set(status, outputs.get(place)),
                OutputMeaning::Unsteady(input) => found.unsteady.set(input, outputs.get(place)),
                OutputMeaning::Nothing => {}
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use understudy_logic::CircuitBuilder;

    use super::*;

    fn names(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    /// `a.diagnosed` is set while `a` shows 1 without `motor`, and kept until the operator releases; `a.unsteady` is
    /// motor.
    fn circuit() -> Circuit {
        let mut builder = CircuitBuilder::new("diagnosis");
        let [a, motor, recalled, release] =
            ["a", "motor", "a.recalled", "diagnosis.release"].map(|name| builder.input(name));
        let (register, before) = builder.register("latch", false);
        let graph = builder.graph();
        let still = graph.not(motor);
        let wrong = graph.and(a, still);
        let kept = graph.any([before, wrong, recalled]);
        let other = graph.not(release);
        let failed = graph.and(kept, other);
        builder.set_next(register, failed);
        builder.output("a.diagnosed", failed);
        builder.output("a.unsteady", motor);
        builder.finish().expect("a circuit")
    }

    #[test]
    fn a_ladder_may_name_the_signals_of_its_program_only() {
        let of = |inputs: &str, outputs: &str| {
            Diagnosis::new(&circuit(), &names(inputs), &names(outputs)).map(|_| ())
        };
        assert_eq!(of("a a.failed", "motor"), Ok(()));
        let all = of("a b", "c").expect_err("no status, no motor");
        assert_eq!(all.len(), 3, "{all:?}");
    }

    #[test]
    fn what_it_finds_lasts_as_its_rungs_say() {
        let inputs = names("a a.failed");
        let diagnosis = Diagnosis::new(&circuit(), &inputs, &names("motor")).expect("it fits");
        let mut diagnosing = Diagnosing::new(Some(&diagnosis));
        let scan = |diagnosing: &mut Diagnosing, a: bool, motor: bool| {
            let found = diagnosing.scan(
                &diagnosis,
                Observation {
                    sensors: &Image::from_bits([a, false]),
                    driven: &Image::from_bits([motor]),
                    is_true: true,
                },
            );
            (found.failed.get(1), found.unsteady.get(0))
        };
        assert_eq!(scan(&mut diagnosing, true, true), (false, true));
        assert_eq!(scan(&mut diagnosing, true, false), (true, false));
        assert_eq!(scan(&mut diagnosing, false, false), (true, false));
        diagnosing.release();
        assert_eq!(scan(&mut diagnosing, false, false), (false, false));
        diagnosing.recall(&Image::from_bits([false, true]));
        assert_eq!(scan(&mut diagnosing, false, false), (true, false));
        assert_eq!(scan(&mut diagnosing, false, false), (true, false));
    }
}
