//! Whether what a cluster says fits into its frames.
//!
//! The bounds are those of the layout at its longest: an integer takes at most 9 bytes, a set of members 17, and a frame has a header besides.

use understudy_text::Diagnostic;
use understudy_wire::{
    MAXIMUM_FRAME_BYTES, MAXIMUM_IMAGE_BITS, MAXIMUM_PULSES, MAXIMUM_SESSIONS, MAXIMUM_STATE_BITS,
};

use super::Member;
use crate::cluster::RemoteIo;
use crate::code::Code;

/// Of an integer as it travels.
const INTEGER_BYTES: usize = 9;
/// Of a set of members.
const SET_BYTES: usize = 17;
/// Magic, header, checksum, and the fields beside the images of any body.
const FRAME_BYTES: usize = 256;
/// One state that a turn speaks of.
const HOLDING_BYTES: usize = 8 * INTEGER_BYTES;

/// The newest write of each session and the pulses, in the samples of a program with operator inputs.
const WRITES_BYTES: usize = MAXIMUM_SESSIONS * (INTEGER_BYTES + 5) + MAXIMUM_PULSES * (3 + 5);

/// At most so many bytes of an image, with the members of a word besides.
const fn image_bytes(bits: usize) -> usize {
    (bits.div_ceil(64) + 2) * INTEGER_BYTES + SET_BYTES
}

/// A sample: the inputs of each cycle of its history, and those of the last one without forces.
fn sample_bytes(inputs: usize, history: usize, has_operator_inputs: bool) -> usize {
    FRAME_BYTES
        + (history + 1) * image_bytes(inputs)
        + usize::from(has_operator_inputs) * WRITES_BYTES
}

/// What an author with modules of its own sends to the other remote I/O: its outputs, and the excluded modules of both. It fits for every program.
const fn modules_bytes(inputs: usize, outputs: usize) -> usize {
    FRAME_BYTES + 2 * image_bytes(inputs) + image_bytes(outputs)
}

const _: () = assert!(modules_bytes(MAXIMUM_IMAGE_BITS, MAXIMUM_IMAGE_BITS) <= MAXIMUM_FRAME_BYTES);

/// The turn of an understudy: a word for each program that is silent, one for the rest, all that it holds, and the last inputs of
/// each program where every remote I/O is silent; `written` programs have operator inputs.
fn turn_bytes(
    programs: usize,
    written: usize,
    widest_inputs: usize,
    widest_outputs: usize,
) -> usize {
    let recalled = image_bytes(widest_inputs) + 6 * INTEGER_BYTES + 2 * SET_BYTES;
    FRAME_BYTES
        + (programs + 1) * image_bytes(widest_outputs)
        + programs * (HOLDING_BYTES + recalled)
        + written * WRITES_BYTES
}

/// Reports every program whose samples, state or turn could be longer than a frame.
pub(crate) fn check(
    members: &[Member],
    remote_ios: &[RemoteIo],
    history: u32,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let has_operator_inputs = |index: usize| {
        remote_ios.get(index).is_some_and(|it| it.operator_inputs().next().is_some())
    };
    let written = (0..members.len()).filter(|&index| has_operator_inputs(index)).count();
    let (mut widest, mut widest_inputs) = (0, 0);
    for (index, member) in members.iter().enumerate() {
        let Some((code, interface)) = &member.code else {
            continue;
        };
        let inputs = interface.inputs.width();
        let outputs = interface.outputs.width();
        widest = widest.max(outputs);
        widest_inputs = widest_inputs.max(inputs);
        if let Some(message) = too_wide(&member.name, code) {
            let span = member.section.span.clone();
            diagnostics.push(Diagnostic::error("U0213", message, span));
        }
        let mut report = |what: String, bytes: usize, help: &str| {
            if bytes <= MAXIMUM_FRAME_BYTES {
                return;
            }
            let message = format!(
                "`{}` has {what}: up to {bytes} bytes in a frame, which takes {MAXIMUM_FRAME_BYTES}",
                member.name
            );
            let span = member.section.span.clone();
            diagnostics.push(Diagnostic::error("U0213", message, span).with_help(help));
        };
        report(
            format!("{inputs} inputs, sent {history} times"),
            sample_bytes(inputs, history as usize, has_operator_inputs(index)),
            "a smaller `history` makes samples shorter",
        );
    }
    let bytes = turn_bytes(members.len(), written, widest_inputs, widest);
    if bytes > MAXIMUM_FRAME_BYTES {
        let message = format!(
            "{} programs of up to {widest_inputs} inputs and {widest} outputs: a turn of the understudy takes up to {bytes} bytes, and a frame {MAXIMUM_FRAME_BYTES}",
            members.len()
        );
        diagnostics.push(Diagnostic::error("U0213", message, 0..0));
    }
}

/// What is to be said of a program with more inputs, state bits or outputs than an image may have.
pub(crate) fn too_wide(name: &str, code: &Code) -> Option<String> {
    let interface = code.interface();
    let widths = [
        ("inputs", interface.inputs.width(), MAXIMUM_IMAGE_BITS),
        ("state bits", code.executable().state_count(), MAXIMUM_STATE_BITS),
        ("outputs", interface.outputs.width(), MAXIMUM_IMAGE_BITS),
    ];
    let mut widths = widths.into_iter();
    let (what, bits, most) = widths.find(|(_, bits, most)| bits > most)?;
    Some(format!("`{name}` has {bits} {what}; there may be {most}"))
}

#[cfg(test)]
mod tests {
    use smallvec::SmallVec;
    use understudy_wire::{
        Body, ClusterHash, ConfigurationHash, Cycle, Digest, Epoch, Frame, Header, Holding, Image,
        Lineage, MAXIMUM_CHANGE_MARKS, MAXIMUM_HISTORY, Member, Modules, Moment, Pair, Part,
        ProgramHash, ProgramId, ProgramSet, Pulse, Recalled, Sample, Share, StationId, StationSet,
        Step, Time, Turn, Word, WriteId, encode,
    };

    use super::*;

    const LATE: Moment = Moment { epoch: Epoch(u64::MAX), cycle: Cycle(u64::MAX) };

    fn ones(bits: usize) -> Image {
        Image::from_bits(std::iter::repeat_n(true, bits))
    }

    /// The frame with the longest integers is not longer than was thought.
    fn check_body(sender: Member, body: Body, bound: usize) {
        let header = Header {
            cluster: ClusterHash(u64::MAX),
            configuration: ConfigurationHash(u64::MAX),
            prepared: Some(ConfigurationHash(u64::MAX)),
            moment: LATE,
            sender,
            alone: true,
        };
        let mut bytes = Vec::new();
        encode(&Frame { header, body }, &mut bytes).expect("it is within the bound of a frame");
        assert!(bytes.len() <= bound, "{} of {bound} bytes", bytes.len());
    }

    fn all_writes() -> SmallVec<[WriteId; 1]> {
        let sessions = (0..MAXIMUM_SESSIONS as u64).rev();
        let write = |below| WriteId { session: u64::MAX - below, number: u32::MAX };
        sessions.map(write).collect()
    }

    fn all_pulses() -> SmallVec<[Pulse; 1]> {
        let inputs = (0..MAXIMUM_PULSES as u16).rev();
        inputs.map(|below| Pulse { input: u16::MAX - below, left: u32::MAX }).collect()
    }

    #[test]
    fn no_frame_is_longer_than_its_bound() {
        for bits in [0, 1, 64, 65, 1000] {
            for history in [1, 8, MAXIMUM_HISTORY] {
                let sample = Sample {
                    born: LATE,
                    base: Lineage(u64::MAX),
                    before: Lineage(u64::MAX),
                    after: Lineage(u64::MAX),
                    history: (0..history)
                        .map(|place| Step {
                            change: (place < MAXIMUM_CHANGE_MARKS).then_some(ProgramHash(u64::MAX)),
                            inputs: ones(bits),
                        })
                        .collect(),
                    applied: Some(LATE),
                    excluded: StationSet::from_bits(u128::MAX),
                    gone: StationSet::from_bits(u128::MAX),
                    drives: true,
                    writes: all_writes(),
                    pulses: all_pulses(),
                    unforced: Some(ones(bits)),
                    version: None,
                };
                let bound = sample_bytes(bits, history, true);
                check_body(Member::RemoteIo(ProgramId(63)), Body::Sample(sample), bound);
            }
            let latest = Some(Time(u64::MAX));
            let pair = Pair {
                part: Part::Author,
                able: true,
                receives_stations: true,
                sent: Time(u64::MAX),
                bound_by: latest,
                modules: Some(Modules::Author {
                    outputs: Some(ones(bits)),
                    share: Share::Whole,
                    answers: latest,
                    distrusted: [ones(bits), ones(bits)],
                }),
            };
            check_body(Member::Twin(ProgramId(63)), Body::Pair(pair), modules_bytes(bits, bits));
            let station = Member::Station(StationId(63));
            for programs in [1, 2, 64] {
                let holding = |program| Holding {
                    program: ProgramId(program),
                    born: LATE,
                    lineage: Lineage(u64::MAX),
                    stepped: LATE,
                    digest: Digest(u64::MAX),
                    version: None,
                };
                // More of them do not fit beside programs of this width.
                let written = programs.min(2);
                let recalled = |program: u8| Recalled {
                    program: ProgramId(program),
                    sampled: LATE,
                    received: understudy_wire::SamplesReceived::Later,
                    applied: Some(LATE),
                    excluded: StationSet::from_bits(u128::MAX),
                    accounted_for: StationSet::from_bits(u128::MAX),
                    writes: if usize::from(program) < written {
                        all_writes()
                    } else {
                        SmallVec::new()
                    },
                    pulses: if usize::from(program) < written {
                        all_pulses()
                    } else {
                        SmallVec::new()
                    },
                    inputs: ones(bits),
                    version: None,
                };
                let word = Word { mask: ProgramSet::first(programs), sum: ones(bits) };
                let turn = Turn {
                    heard: StationSet::first(128),
                    holdings: (0..programs as u8).map(holding).collect(),
                    words: std::iter::repeat_n(word, programs + 1).collect(),
                    recalled: (0..programs as u8).map(recalled).collect(),
                    lacks: ProgramSet::first(128),
                    relayed: Vec::new(),
                };
                check_body(station, Body::Turn(turn), turn_bytes(programs, written, bits, bits));
            }
        }
    }
}
