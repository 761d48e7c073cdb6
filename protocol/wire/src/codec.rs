//! The bytes of a frame.
//!
//! ```text
//! offset  size  what
//!      0     4  magic "UNDR"
//!      4     1  version of this layout, 14
//!      5     n  header and body, bincode 2 "standard": little-endian, integers as varints, enums by their index
//!    5+n     4  CRC-32 (IEEE) of everything before it, little-endian
//! ```
//!
//! Two stages: any bytes may arrive; [`decode`] returns a frame only where every bound and every rule of
//! [`crate::frame`] holds, so that the members never process another one. [`encode`] asserts the same of what is sent.

use bincode::config::{Configuration, Limit};

use crate::frame::{
    Body, Frame, MAXIMUM_CHANGE_MARKS, MAXIMUM_HISTORY, Recalled, Relayed, Sample, Word,
};
use crate::identifier::{MAXIMUM_PROGRAMS, MAXIMUM_STATIONS, Member, ProgramId};
use crate::set::ProgramSet;
use crate::write::{MAXIMUM_PULSES, MAXIMUM_SESSIONS, Pulse, WriteId};

/// Maximum length of a frame; one UDP datagram can carry it.
pub const MAXIMUM_FRAME_BYTES: usize = 32 * 1024;

const MAGIC: [u8; 4] = *b"UNDR";
const VERSION: u8 = 14;
const PREFIX_BYTES: usize = 5;
const CHECKSUM_BYTES: usize = 4;
/// Maximum number of positions that a plant shows.
const MAXIMUM_POSITIONS: usize = 16;

type Layout = Configuration<
    bincode::config::LittleEndian,
    bincode::config::Varint,
    Limit<MAXIMUM_FRAME_BYTES>,
>;

fn layout() -> Layout {
    bincode::config::standard().with_limit::<MAXIMUM_FRAME_BYTES>()
}

/// Reason why bytes are not a frame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// Too short for any frame, or longer than [`MAXIMUM_FRAME_BYTES`].
    #[error("{bytes} bytes are no frame (at most {MAXIMUM_FRAME_BYTES})")]
    Length {
        /// Number of bytes that arrived.
        bytes: usize,
    },
    /// Not a frame of this project.
    #[error("the bytes do not start with the magic of a frame")]
    Magic,
    /// A frame of another version of this layout.
    #[error("a frame of version {found}; this program speaks version {VERSION}")]
    Version {
        /// Version that arrived.
        found: u8,
    },
    /// Changed on its way.
    #[error("checksum {found:08x} where {computed:08x} was computed")]
    Checksum {
        /// Checksum in the frame.
        found: u32,
        /// Checksum of the bytes that arrived.
        computed: u32,
    },
    /// The checksum is right, but the bytes cannot be decoded as header and body.
    #[error("the bytes are no header and body: {0}")]
    Layout(String),
    /// The frame can be decoded, but breaks a rule of the layout.
    #[error("a frame that breaks a promise: {0}")]
    Promise(&'static str),
}

/// Appends the bytes of `frame` to `bytes`.
///
/// # Errors
/// [`FrameError::Promise`] or [`FrameError::Length`] where the frame breaks a bound; nothing is appended then.
pub fn encode(frame: &Frame, bytes: &mut Vec<u8>) -> Result<(), FrameError> {
    keeps_promises(frame)?;
    let start = bytes.len();
    bytes.extend_from_slice(&MAGIC);
    bytes.push(VERSION);
    let written = bincode::serde::encode_into_std_write(frame, bytes, layout());
    if let Err(error) = written {
        bytes.truncate(start);
        return Err(FrameError::Layout(error.to_string()));
    }
    let length = bytes.len() - start + CHECKSUM_BYTES;
    if length > MAXIMUM_FRAME_BYTES {
        bytes.truncate(start);
        return Err(FrameError::Length { bytes: length });
    }
    let checksum = crc32fast::hash(&bytes[start..]);
    bytes.extend_from_slice(&checksum.to_le_bytes());
    Ok(())
}

/// Reads one frame from exactly `bytes`.
///
/// # Errors
/// Every other [`FrameError`]; never panics, and never allocates more than [`MAXIMUM_FRAME_BYTES`] allow.
pub fn decode(bytes: &[u8]) -> Result<Frame, FrameError> {
    let length = bytes.len();
    if !(PREFIX_BYTES + CHECKSUM_BYTES..=MAXIMUM_FRAME_BYTES).contains(&length) {
        return Err(FrameError::Length { bytes: length });
    }
    if bytes[..MAGIC.len()] != MAGIC {
        return Err(FrameError::Magic);
    }
    if bytes[MAGIC.len()] != VERSION {
        return Err(FrameError::Version { found: bytes[MAGIC.len()] });
    }
    let (before, checksum) = bytes.split_at(length - CHECKSUM_BYTES);
    let found = u32::from_le_bytes(checksum.try_into().expect("four bytes"));
    let computed = crc32fast::hash(before);
    if found != computed {
        return Err(FrameError::Checksum { found, computed });
    }
    let payload = &before[PREFIX_BYTES..];
    let (frame, read) = bincode::serde::decode_from_slice::<Frame, _>(payload, layout())
        .map_err(|error| FrameError::Layout(error.to_string()))?;
    if read != payload.len() {
        return Err(FrameError::Promise("bytes are left after the body"));
    }
    keeps_promises(&frame)?;
    Ok(frame)
}

/// Rules that types alone cannot express.
fn keeps_promises(frame: &Frame) -> Result<(), FrameError> {
    let kept = |holds: bool, promise: &'static str| {
        if holds { Ok(()) } else { Err(FrameError::Promise(promise)) }
    };
    let sender = frame.header.sender;
    kept(
        match sender {
            Member::Station(station) => station.index() < MAXIMUM_STATIONS,
            Member::RemoteIo(program) | Member::Plant(program) | Member::Twin(program) => {
                program.index() < MAXIMUM_PROGRAMS
            }
        },
        "the sender's index is below 64",
    )?;
    let station = matches!(sender, Member::Station(_));
    let remote_io = sender.sampled_program().is_some();
    match &frame.body {
        Body::Sync => kept(station, "only a station paces"),
        Body::Sample(sample) => {
            kept(remote_io, "only a remote I/O samples")?;
            kept_sample(sample)
        }
        Body::Turn(turn) => {
            kept(station, "only a station takes turns")?;
            let held = kept_programs(turn.holdings.iter().map(|holding| holding.program))?;
            kept_recalled(&turn.recalled)?;
            kept_relayed(&turn.relayed)?;
            kept(turn.words.len() <= MAXIMUM_PROGRAMS + 1, "a turn has at most 65 words")?;
            let covered = |word: &Word| !word.mask.is_empty() && word.mask.without(held).is_empty();
            kept(turn.words.iter().all(covered), "a word is over states that are held")
        }
        Body::Join(join) => {
            kept(station, "only a station joins")?;
            kept_recalled(&join.recalled)?;
            let partial = join.partial.iter().map(|partial| partial.program);
            let programs: ProgramSet = partial.collect();
            kept(
                programs.len() == join.partial.len() && programs.without(join.wants).is_empty(),
                "a station has segments of a state that it wants, once for each program",
            )?;
            kept_programs(join.retained.iter().map(|kept| kept.holding.program))?;
            kept_programs(join.holdings.iter().map(|holding| holding.program)).map(|_| ())
        }
        Body::Transfer(transfer) => {
            kept(station, "only a station gives a state")?;
            kept(
                transfer.to.index() < MAXIMUM_STATIONS
                    && transfer.program.index() < MAXIMUM_PROGRAMS,
                "the indices of a transfer are below 64",
            )?;
            kept(
                transfer.state.fits(),
                "a segment is a part of its state, which has at most 256 KiB",
            )
        }
        Body::Field(field) => {
            kept(matches!(sender, Member::Plant(_)), "only a plant has a field")?;
            kept(field.positions.len() <= MAXIMUM_POSITIONS, "a plant shows at most 16 positions")
        }
        Body::Actuation(_) => kept(remote_io, "only a remote I/O drives"),
        Body::Pair(_) => kept(remote_io, "only a remote I/O has a second one"),
    }
}

fn kept_sample(sample: &Sample) -> Result<(), FrameError> {
    if !(1..=MAXIMUM_HISTORY).contains(&sample.history.len()) {
        return Err(FrameError::Promise("a sample carries 1 to 32 cycles"));
    }
    let marks = sample.history.iter().filter(|step| step.change.is_some()).count();
    if marks > MAXIMUM_CHANGE_MARKS {
        return Err(FrameError::Promise("a sample carries at most 4 change marks"));
    }
    kept_writes(&sample.writes)?;
    kept_pulses(&sample.pulses)?;
    // A change mark may bring other points.
    let steps = sample.history.iter().zip(&sample.history[1..]);
    let mut steps = steps.filter(|(_, next)| next.change.is_none());
    let is_even = steps.all(|(step, next)| step.inputs.width() == next.inputs.width());
    let newest = sample.history[sample.history.len() - 1].inputs.width();
    if is_even && sample.unforced.iter().all(|image| image.width() == newest) {
        Ok(())
    } else {
        Err(FrameError::Promise("all samples from one change mark to the next are of one width"))
    }
}

fn kept_relayed(relayed: &[Relayed]) -> Result<(), FrameError> {
    let programs: ProgramSet = relayed.iter().map(|one| one.program).collect();
    if programs.len() != relayed.len() {
        return Err(FrameError::Promise(
            "a sample is relayed once, of a program with an index below 64",
        ));
    }
    relayed.iter().try_for_each(|one| kept_sample(&one.sample))
}

fn kept_writes(writes: &[WriteId]) -> Result<(), FrameError> {
    let ascending = writes.is_sorted_by(|one, next| one.session < next.session);
    if writes.len() <= MAXIMUM_SESSIONS && ascending {
        Ok(())
    } else {
        Err(FrameError::Promise(
            "at most 16 writes are remembered, one for each session, in the order of sessions",
        ))
    }
}

fn kept_pulses(pulses: &[Pulse]) -> Result<(), FrameError> {
    let ascending = pulses.is_sorted_by(|one, next| one.input < next.input);
    if pulses.len() <= MAXIMUM_PULSES && ascending {
        Ok(())
    } else {
        Err(FrameError::Promise("at most 16 pulses are carried, in the order of inputs"))
    }
}

fn kept_recalled(recalled: &[Recalled]) -> Result<(), FrameError> {
    recalled.iter().try_for_each(|one| {
        kept_writes(&one.writes)?;
        kept_pulses(&one.pulses)
    })?;
    let programs: ProgramSet = recalled.iter().map(|one| one.program).collect();
    if programs.len() == recalled.len() {
        Ok(())
    } else {
        Err(FrameError::Promise("a program is recalled once, with an index below 64"))
    }
}

fn kept_programs(
    programs: impl ExactSizeIterator<Item = ProgramId> + Clone,
) -> Result<ProgramSet, FrameError> {
    let held: ProgramSet = programs.clone().collect();
    let ascending = programs.clone().is_sorted_by(|one, next| one < next);
    if held.len() == programs.len() && ascending {
        Ok(held)
    } else {
        Err(FrameError::Promise(
            "a program is held once, in the order of programs, with an index below 64",
        ))
    }
}
