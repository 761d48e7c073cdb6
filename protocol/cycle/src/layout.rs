//! The points of a program, as its remote I/O samples and drives them.

use understudy_wire::{Image, PointsHash};

use crate::channel::{self, Channel};
use crate::place::PointPlace;
use crate::source::{OperatorInput, SignalInput, SignalSource};

/// Layout of u(i) and y(i): what each bit is, and where the inputs that are not wires come from. It belongs to a version of the program, so the change
/// marks of a history tell which layout each of its samples has.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Layout {
    /// Identifies the points, also by their names: who gives an order for one of them says which he means.
    pub hash: PointsHash,
    /// u(i) where nothing drives it: the initial values of its variables.
    pub undriven: Image,
    /// Signals of u(i), in the order of their bits.
    pub input_points: Vec<PointPlace>,
    /// Signals of y(i), in the order of their bits.
    pub output_points: Vec<PointPlace>,
    /// Inputs that operators write; no two share a bit with each other or with a signal.
    pub operator_inputs: Vec<OperatorInput>,
    /// Inputs that are outputs of other programs.
    pub signals: Vec<SignalInput>,
    /// The programs that compute them, each once.
    pub signal_sources: Vec<SignalSource>,
    /// Inputs whose channels report their own failure.
    pub channels: Vec<Channel>,
    /// Where the program reports a program fault; `None` for a program that has none.
    pub stop: Option<StopPoints>,
}

/// The points by which a program reports a program fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct StopPoints {
    /// Bit of y(i): a fault has stopped the program.
    pub stopped: usize,
    /// Bit of u(i): the program starts again from its initial state.
    pub reset: usize,
}

impl Layout {
    /// BOOLs alone, all of the field, with the initial value FALSE.
    pub fn booleans(inputs: u16, outputs: u16) -> Self {
        Self {
            hash: PointsHash(u64::from(inputs) << 16 | u64::from(outputs)),
            undriven: Image::zero(usize::from(inputs)),
            input_points: PointPlace::booleans(inputs),
            output_points: PointPlace::booleans(outputs),
            operator_inputs: Vec::new(),
            signals: Vec::new(),
            signal_sources: Vec::new(),
            channels: Vec::new(),
            stop: None,
        }
    }

    /// Width of u(i) in bits.
    pub fn input_width(&self) -> usize {
        self.undriven.width()
    }

    /// u(i) before the first sample: the initial values of all inputs.
    pub fn initial(&self) -> Image {
        let mut inputs = self.undriven.clone();
        self.operator_inputs.iter().for_each(|input| input.place.set(&mut inputs, input.initial));
        self.signals.iter().for_each(|signal| signal.place.set(&mut inputs, signal.default));
        inputs
    }

    /// Bits of u(i) that do not come from the field.
    pub fn sourced_bits(&self) -> impl Iterator<Item = usize> + '_ {
        let operators = self.operator_inputs.iter().map(|input| input.place);
        let signals = self.signals.iter().map(|signal| signal.place);
        let places = operators.chain(signals).flat_map(|place| {
            let first = usize::from(place.bit);
            first..first + place.of.bits() as usize
        });
        let of_groups = self.operator_inputs.iter().filter_map(|input| input.valid());
        let valid = self.signals.iter().filter_map(|signal| signal.valid);
        places.chain(valid.chain(of_groups).map(usize::from))
    }

    /// What the program sees of `sensors`, where it has seen `last` before and `unsteady` inputs are not believed yet: an input whose channel has failed
    /// keeps its last good value.
    pub fn seen(&self, last: &Image, sensors: &Image, unsteady: Option<&Image>) -> Image {
        channel::seen(&self.channels, last, sensors, unsteady)
    }
}
