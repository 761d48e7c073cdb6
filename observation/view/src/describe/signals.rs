//! Signals and their values in words, and the writes that records refer to.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Deref;

use understudy_journal::{Cycles, Happening, Members, NamedSignal, Record};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_typed::Elementary;
use understudy_wire::{Force, Image, Member, PointValue, ProgramId, SignalPlace, WriteId};

use crate::value::{is_declared, stored_text};

/// Writes that are remembered: their outcomes come within some cycles.
const MOST: usize = 256;

/// The newest writes in words, `speed = 120.0 mm/s of anna`, by the points of their time: the record of an outcome has the identifier of its write only.
#[derive(Debug, Clone, Default)]
pub(crate) struct Writes(VecDeque<(WriteId, String)>);

impl Writes {
    /// Takes the next record of the run, with the names that count.
    pub(crate) fn note(&mut self, record: &Record, members: &Members) {
        if let Happening::RemoteIo(RemoteIoEvent::Written { write, .. }) = &record.event {
            if self.0.len() == MOST {
                self.0.pop_front();
            }
            let place = SignalPlace::Input(write.input);
            let assignment = assignment(record.member, place, write.value, members);
            self.0.push_back((write.id, format!("{assignment} of {}", write.owner)));
        }
    }

    fn find(&self, id: WriteId) -> Option<&str> {
        let found = self.0.iter().rev().find(|(write, _)| *write == id);
        found.map(|(_, text)| text.as_str())
    }
}

/// The names that the events of a remote I/O or a plant need.
pub(super) struct Names<'a> {
    pub(super) members: &'a Members,
    pub(super) writes: &'a Writes,
    /// Counts cycles from the origin of the run.
    pub(super) cycles: &'a Cycles,
    /// The member that reports the event.
    pub(super) by: Option<Member>,
}

impl Deref for Names<'_> {
    type Target = Members;

    fn deref(&self) -> &Members {
        self.members
    }
}

impl Names<'_> {
    /// `input start`; the number of the first bit where the program is not known.
    pub(super) fn place(&self, place: SignalPlace) -> String {
        place_text(self.by, place, self.members)
    }

    /// A force with its end, its operator and its reason.
    pub(super) fn force(&self, force: &Force) -> String {
        force_text(self.by, force, self.members)
    }

    /// The value of a signal with its unit.
    pub(super) fn value(&self, place: SignalPlace, value: PointValue) -> String {
        signal_value(self.by, place, value, self.members)
    }

    /// `speed = 120.0 mm/s of anna`, where the write is remembered.
    pub(super) fn write(&self, id: WriteId) -> String {
        self.writes.find(id).unwrap_or("a written value").to_owned()
    }

    /// The program whose inputs and outputs the reporting member has.
    fn program(&self) -> Option<ProgramId> {
        match self.by? {
            Member::Plant(program) => Some(program),
            by => by.sampled_program(),
        }
    }

    /// The image of all inputs of its program.
    pub(super) fn inputs(&self, image: &Image) -> String {
        match self.program() {
            Some(program) => image_text(image, self.members.inputs(program)),
            None => image.to_string(),
        }
    }

    /// The image of all outputs of its program.
    pub(super) fn outputs(&self, image: &Image) -> String {
        match self.program() {
            Some(program) => image_text(image, self.members.outputs(program)),
            None => image.to_string(),
        }
    }

    /// The output of another program at an input: `press.done`.
    pub(super) fn source(&self, input: u16) -> &str {
        let signal = signal(self.by, SignalPlace::Input(input), self.members);
        let from = signal.and_then(|signal| signal.from.as_deref());
        from.unwrap_or("of another program")
    }
}

/// The values by name where one of them is a number, else the bits.
pub(super) fn image_text<'a>(
    image: &Image,
    signals: impl Iterator<Item = &'a NamedSignal>,
) -> String {
    let signals: Vec<&NamedSignal> = signals.collect();
    let end = |signal: &&NamedSignal| {
        u32::from(signal.place.first_bit()) + signal.declared.of.bits() <= image.width() as u32
    };
    let has_numbers = signals.iter().any(|signal| signal.declared.of != Elementary::Bool);
    if !has_numbers || !signals.iter().all(end) {
        return image.to_string();
    }
    let declared = signals.iter().filter(|signal| is_declared(&signal.name));
    let texts = declared.map(|signal| {
        let bit = usize::from(signal.place.first_bit());
        // No point crosses a word.
        let stored = image.words()[bit / 64] >> (bit % 64) & signal.declared.of.mask();
        format!("{} = {}", signal.name, number_text(signal, stored))
    });
    texts.collect::<Vec<String>>().join(", ")
}

fn signal(by: Option<Member>, place: SignalPlace, members: &Members) -> Option<&NamedSignal> {
    // Either remote I/O of a program has its signals.
    members.signal(by?.sampled_program()?, place)
}

fn place_text(by: Option<Member>, place: SignalPlace, members: &Members) -> String {
    let (kind, bit) = match place {
        SignalPlace::Input(bit) => ("input", bit),
        SignalPlace::Output(bit) => ("output", bit),
    };
    match signal(by, place, members) {
        Some(signal) => format!("{kind} {}", signal.name),
        None => format!("{kind} {}", bit + 1),
    }
}

/// The value of a signal with its unit; its bits where its type is not known.
fn signal_value(
    by: Option<Member>,
    place: SignalPlace,
    value: PointValue,
    members: &Members,
) -> String {
    let stored = value.stored();
    let known = signal(by, place, members);
    let known = known.filter(|signal| signal.declared.of.bits() == u32::from(value.width()));
    match (known, value) {
        (_, PointValue::Bit(bit)) => u8::from(bit).to_string(),
        (Some(signal), _) => number_text(signal, stored),
        (None, PointValue::Number { width, .. }) => {
            let digits = usize::from(width) / 4;
            format!("16#{stored:0digits$X}")
        }
    }
}

/// A force with its end, its operator and its reason.
pub(crate) fn force_text(by: Option<Member>, force: &Force, members: &Members) -> String {
    let signal = place_text(by, force.signal, members);
    let value = signal_value(by, force.signal, force.value, members);
    let Force { seconds, owner, reason, .. } = force;
    format!("{signal} is forced to {value} for {seconds} s by {owner}: {reason}")
}

/// Inputs whose modules are in doubt, with the remote I/O whose module is excluded.
pub(crate) fn modules_text(
    by: Option<Member>,
    inputs: &BTreeMap<u16, Option<Member>>,
    members: &Members,
) -> String {
    let texts = inputs.iter().map(|(input, excluded)| {
        let input = place_text(by, SignalPlace::Input(*input), members);
        match excluded {
            None => format!("the modules differ at {input}, whose last agreed value is sampled"),
            Some(at) => format!("the module of {input} at {} is excluded", members.name(*at)),
        }
    });
    texts.collect::<Vec<_>>().join("; ")
}

/// With all digits: what was written, and what a scan has read, is not rounded.
fn number_text(signal: &NamedSignal, stored: u64) -> String {
    signal.card.with_unit(stored_text(&signal.declared, stored))
}

/// `speed = 120.0 mm/s`
pub(super) fn assignment(
    by: Option<Member>,
    place: SignalPlace,
    value: PointValue,
    members: &Members,
) -> String {
    let name = match signal(by, place, members) {
        Some(signal) => signal.name.clone(),
        None => place_text(by, place, members),
    };
    format!("{name} = {}", signal_value(by, place, value, members))
}
