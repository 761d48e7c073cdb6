//! What a member keeps on disk for the time after a power failure, and its bytes.
//!
//! A station keeps the state of each program that has retentive variables, and the steps since, so that it can come to the
//! state after any of them. A remote I/O keeps a note of the newest sample whose outputs it applied. Each of them keeps the text of the program next to
//! that, so that a changed program can take over its values.
//!
//! ```text
//!   length │ CRC-32 │ record      a file is one record after another; what follows a torn one is not read
//! ```

use bincode::config::{Configuration, Limit, LittleEndian, Varint};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::frame::Recalled;
use crate::identifier::{
    AuthorityHash, ClusterHash, ConfigurationHash, Moment, ProgramHash, ProgramId,
};
use crate::image::{Image, MAXIMUM_STATE_BITS};
use crate::lineage::{Digest, Lineage};

/// Bytes before the content of a record: its length and its checksum.
const PREFIX_BYTES: usize = 8;

/// Bytes of the text of a program that is kept, at most.
pub const MAXIMUM_KEPT_TEXT_BYTES: usize = 16 << 20;

/// Bytes of a record, at most: the longest text with what names it, which is more than the widest state.
const MAXIMUM_RECORD_BYTES: usize = MAXIMUM_KEPT_TEXT_BYTES + 4096;

const _: () = assert!(MAXIMUM_STATE_BITS / 64 * 9 + 4096 <= MAXIMUM_RECORD_BYTES);

/// Version of the records.
const VERSION: u8 = 4;

type Layout = Configuration<LittleEndian, Varint, Limit<MAXIMUM_RECORD_BYTES>>;

fn layout() -> Layout {
    bincode::config::standard().with_limit::<MAXIMUM_RECORD_BYTES>()
}

/// One record of what a member keeps.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Retained {
    /// A station: a state of a program, from which later steps go on.
    State(RetainedState),
    /// A station: a step of a program.
    Step(RetainedStep),
    /// A remote I/O: the newest sample whose outputs were applied.
    Note(Note),
    /// At the start of a file: the authority of the keys of its member; absent without keys.
    Authority(AuthorityHash),
}

/// State of a program.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct RetainedState {
    /// Its cluster.
    pub cluster: ClusterHash,
    /// Its program.
    pub program: ProgramId,
    /// Hash of that program.
    pub hash: ProgramHash,
    /// Number of the state among those that this station has kept: a wall clock that is set back makes moments earlier, and this number no smaller.
    pub number: u64,
    /// Moment of the start of that program.
    pub born: Moment,
    /// Lineage of the state.
    pub lineage: Lineage,
    /// Cycle of the last sample in it.
    pub stepped: Moment,
    /// Digest of the state before that sample.
    pub digest: Digest,
    /// x(i).
    pub state: Image,
}

/// Step of a program.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct RetainedStep {
    /// Its program.
    pub program: ProgramId,
    /// Cycle of the sample.
    pub stepped: Moment,
    /// u(i).
    pub inputs: Image,
    /// Lineage after it: a step that does not lead there is not of this state.
    pub after: Lineage,
}

/// What a remote I/O notes of the newest sample whose outputs it applied, and of a history of which it has applied none yet.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Note {
    /// Its cluster.
    pub cluster: ClusterHash,
    /// The configuration that it ran.
    pub configuration: ConfigurationHash,
    /// Hash of its program.
    pub hash: ProgramHash,
    /// Whether that program has retentive variables.
    pub is_retentive: bool,
    /// Number of the note among those that this remote I/O has made.
    pub number: u64,
    /// Lineage after the newest applied sample.
    pub lineage: Lineage,
    /// Start of the history that it samples, while no output of that is applied: after a warm or a cold start.
    pub begun: Option<Moment>,
    /// The newest sample, as stations recall it.
    pub recalled: Recalled,
}

impl Note {
    /// The cycle of the newest applied sample; nothing where none was applied ever.
    pub fn applied(&self) -> Option<Moment> {
        self.recalled.applied
    }
}

/// The text of a program, from which the same program is read again.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct RetainedProgram {
    /// Hash of the program.
    pub hash: ProgramHash,
    /// The name of its file, whose ending tells the language.
    pub file: String,
    /// Nanoseconds from one scan to the next.
    pub period: u64,
    /// The text of that file.
    pub text: String,
    /// Of a remote I/O: the inputs that operators write and that keep their values.
    pub inputs: Vec<String>,
    /// Paths of the program before it and the ones that they have in this program. A record of its own, where there are any.
    #[serde(skip)]
    pub renamed: Vec<(String, String)>,
}

/// A state of a program with the steps since, as a station has kept them.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct RetainedRun {
    /// The state.
    pub state: RetainedState,
    /// Steps from it, in their order.
    pub steps: Vec<RetainedStep>,
    /// The program whose values the state has, where they were taken over from another one.
    pub carried: Option<Carried>,
}

/// Where the values of a state are from that another program has left behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Carried {
    /// Hash of that program; the lineage and the cycle of the state are of it.
    pub from: ProgramHash,
    /// Whether each of its retentive values is in the state.
    pub is_whole: bool,
}

impl From<RetainedState> for RetainedRun {
    fn from(state: RetainedState) -> Self {
        Self { state, steps: Vec::new(), carried: None }
    }
}

impl RetainedRun {
    /// The cycle of the last step.
    pub fn stepped(&self) -> Moment {
        self.steps.last().map_or(self.state.stepped, |step| step.stepped)
    }

    /// The runs of a file, in its order; steps that lead on from no state are left out.
    pub fn of_records(records: impl IntoIterator<Item = Retained>) -> Vec<Self> {
        let mut runs: Vec<Self> = Vec::new();
        for record in records {
            match record {
                Retained::State(state) => runs.push(Self::from(state)),
                Retained::Step(step) => {
                    if let Some(run) = runs.last_mut()
                        && run.leads_to(&step)
                    {
                        run.steps.push(step);
                    }
                }
                Retained::Note(_) | Retained::Authority(_) => {}
            }
        }
        runs
    }

    /// The lineage after the last step.
    pub fn lineage(&self) -> Lineage {
        self.steps.last().map_or(self.state.lineage, |step| step.after)
    }

    fn leads_to(&self, step: &RetainedStep) -> bool {
        step.program == self.state.program && self.lineage().after(&step.inputs) == step.after
    }
}

/// Why the rest of a file of records is not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum RetainedError {
    /// It ends within a record: the power failed while that was written.
    #[error("it ends within a record, after byte {0}")]
    Torn(usize),
    /// A record differs from its checksum, or is none.
    #[error("the record at byte {0} is damaged")]
    Damaged(usize),
    /// A record of another version.
    #[error("the record at byte {at} has version {found}; this program reads version {VERSION}")]
    Version {
        /// Where it begins.
        at: usize,
        /// Its version.
        found: u8,
    },
}

impl Retained {
    /// Appends its bytes to `bytes`; nothing where it is wider than a state may be.
    pub fn write(&self, bytes: &mut Vec<u8>) {
        write_record(self, bytes);
    }

    /// The records of a file up to the first that cannot be read, and why the rest is not read.
    pub fn read(bytes: &[u8]) -> (Vec<Self>, Option<RetainedError>) {
        let mut records = Vec::new();
        let mut at = 0;
        while at < bytes.len() {
            match read_record(&bytes[at..], at) {
                Ok((record, length)) => {
                    records.push(record);
                    at += length;
                }
                Err(error) => return (records, Some(error)),
            }
        }
        (records, None)
    }
}

impl RetainedProgram {
    /// Its bytes; none where its text is longer than [`MAXIMUM_KEPT_TEXT_BYTES`].
    pub fn to_bytes(&self) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        if self.text.len() <= MAXIMUM_KEPT_TEXT_BYTES {
            write_record(self, &mut bytes);
        }
        let length = bytes.len();
        if length > 0 && !self.renamed.is_empty() {
            write_record(&self.renamed, &mut bytes);
            // Without its pairs it is another program.
            if bytes.len() == length {
                return None;
            }
        }
        (length > 0).then_some(bytes)
    }

    /// The program of a file.
    ///
    /// # Errors
    /// [`RetainedError`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, RetainedError> {
        let (program, length): (Self, usize) = read_record(bytes, 0)?;
        if length == bytes.len() {
            return Ok(program);
        }
        match read_record(&bytes[length..], length)? {
            (renamed, rest) if length + rest == bytes.len() => Ok(Self { renamed, ..program }),
            (_, rest) => Err(RetainedError::Damaged(length + rest)),
        }
    }
}

fn write_record(record: &impl Serialize, bytes: &mut Vec<u8>) {
    let start = bytes.len();
    bytes.extend_from_slice(&[0; PREFIX_BYTES]);
    bytes.push(VERSION);
    let written = bincode::serde::encode_into_std_write(record, bytes, layout());
    let length = bytes.len() - start - PREFIX_BYTES;
    if written.is_err() || length > MAXIMUM_RECORD_BYTES {
        bytes.truncate(start);
        return;
    }
    let checksum = crc32fast::hash(&bytes[start + PREFIX_BYTES..]);
    let length = u32::try_from(length).unwrap_or(u32::MAX);
    bytes[start..start + 4].copy_from_slice(&length.to_le_bytes());
    bytes[start + 4..start + PREFIX_BYTES].copy_from_slice(&checksum.to_le_bytes());
}

/// The record at the start of `bytes`, which is at byte `at` of its file, and its length.
fn read_record<T: DeserializeOwned>(bytes: &[u8], at: usize) -> Result<(T, usize), RetainedError> {
    let word = |place: usize| {
        let word = bytes.get(place..place + 4).ok_or(RetainedError::Torn(at))?;
        Ok(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
    };
    let (length, checksum) = (word(0)? as usize, word(4)?);
    if !(1..=MAXIMUM_RECORD_BYTES).contains(&length) {
        return Err(RetainedError::Damaged(at));
    }
    let content = bytes.get(PREFIX_BYTES..PREFIX_BYTES + length);
    let content = content.ok_or(RetainedError::Torn(at))?;
    if crc32fast::hash(content) != checksum {
        return Err(RetainedError::Damaged(at));
    }
    if content[0] != VERSION {
        return Err(RetainedError::Version { at, found: content[0] });
    }
    let decoded = bincode::serde::decode_from_slice::<T, _>(&content[1..], layout());
    match decoded {
        Ok((record, read)) if read + 1 == length => Ok((record, PREFIX_BYTES + length)),
        _ => Err(RetainedError::Damaged(at)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identifier::{Cycle, Epoch};

    fn state(width: usize) -> Retained {
        Retained::State(RetainedState {
            cluster: ClusterHash(1),
            program: ProgramId(2),
            hash: ProgramHash(3),
            number: 1,
            born: Moment { epoch: Epoch(4), cycle: Cycle(5) },
            lineage: Lineage(6),
            stepped: Moment { epoch: Epoch(4), cycle: Cycle(7) },
            digest: Digest(8),
            state: Image::from_bits((0..width).map(|_| true)),
        })
    }

    fn program(text: String) -> RetainedProgram {
        let inputs = vec!["level".to_owned()];
        let renamed = Vec::new();
        let (hash, file) = (ProgramHash(3), "a.st".to_owned());
        RetainedProgram { hash, file, period: 10, text, inputs, renamed }
    }

    fn step(before: Lineage, cycle: u64) -> RetainedStep {
        let inputs = Image::from_bits([cycle.is_multiple_of(2), true]);
        RetainedStep {
            program: ProgramId(2),
            stepped: Moment { epoch: Epoch(4), cycle: Cycle(cycle) },
            after: before.after(&inputs),
            inputs,
        }
    }

    /// The widest state too: a bound that wraps at a power of two saves nothing.
    #[test]
    fn records_come_back_up_to_the_widest_state() {
        for width in [0, 1, 64, 65, 524_288, MAXIMUM_STATE_BITS - 1, MAXIMUM_STATE_BITS] {
            let mut bytes = Vec::new();
            state(width).write(&mut bytes);
            state(3).write(&mut bytes);
            assert_eq!(Retained::read(&bytes), (vec![state(width), state(3)], None), "{width}");
        }
    }

    #[test]
    fn every_cut_and_every_flipped_byte_is_found() {
        let mut bytes = Vec::new();
        let first = step(Lineage(6), 8);
        let records = [state(9), Retained::Step(first.clone())];
        let mut ends = vec![0];
        for record in &records {
            record.write(&mut bytes);
            ends.push(bytes.len());
        }
        for length in 0..bytes.len() {
            let (read, error) = Retained::read(&bytes[..length]);
            let whole = ends.iter().filter(|end| **end <= length).count() - 1;
            assert_eq!(read, records[..whole], "{length}");
            let torn = RetainedError::Torn(ends[whole]);
            assert_eq!(error, (!ends.contains(&length)).then_some(torn), "{length}");
        }
        for place in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[place] ^= 0x10;
            let (read, error) = Retained::read(&damaged);
            assert!(error.is_some() && read.len() < 2, "{place}");
        }
    }

    /// The longest text too; a longer one is not kept in part.
    #[test]
    fn programs_come_back_up_to_the_longest_text() {
        for length in [0, 1, 300, MAXIMUM_KEPT_TEXT_BYTES] {
            let text = "x".repeat(length);
            let program = program(text);
            let mut bytes = program.to_bytes().expect("it is short enough");
            assert_eq!(RetainedProgram::from_bytes(&bytes), Ok(program), "{length}");
            bytes.push(0);
            assert!(RetainedProgram::from_bytes(&bytes).is_err());
            bytes.truncate(bytes.len() - 2);
            assert_eq!(RetainedProgram::from_bytes(&bytes), Err(RetainedError::Torn(0)));
        }
        let text = "x".repeat(MAXIMUM_KEPT_TEXT_BYTES + 1);
        let program = program(text);
        assert_eq!(program.to_bytes(), None);
    }

    /// Pairs come back with the program, and a file that ends before them is not one with fewer.
    #[test]
    fn programs_come_back_with_their_pairs() {
        let plain = program("text".to_owned());
        let renamed = vec![("old.path".to_owned(), "path".to_owned())];
        let program = RetainedProgram { renamed, ..plain.clone() };
        let bytes = program.to_bytes().expect("it is short enough");
        assert_eq!(RetainedProgram::from_bytes(&bytes), Ok(program));
        let first = plain.to_bytes().expect("it is short enough").len();
        for length in (0..bytes.len()).filter(|length| *length != first) {
            assert!(RetainedProgram::from_bytes(&bytes[..length]).is_err(), "{length}");
        }
        // Its hash, which is of the pairs too, tells that this is another program.
        assert_eq!(RetainedProgram::from_bytes(&bytes[..first]), Ok(plain));
    }

    /// A file of a later release is not read as one of this.
    #[test]
    fn a_record_of_another_version_is_named() {
        let mut bytes = Vec::new();
        state(9).write(&mut bytes);
        let first = bytes.len();
        state(9).write(&mut bytes);
        bytes[first + PREFIX_BYTES] = VERSION + 1;
        let checksum = crc32fast::hash(&bytes[first + PREFIX_BYTES..]);
        bytes[first + 4..first + PREFIX_BYTES].copy_from_slice(&checksum.to_le_bytes());
        let error = RetainedError::Version { at: first, found: VERSION + 1 };
        assert_eq!(Retained::read(&bytes), (vec![state(9)], Some(error)));
    }

    #[test]
    fn steps_that_do_not_lead_on_are_left_out() {
        let first = step(Lineage(6), 8);
        let second = step(first.after, 9);
        let foreign = step(Lineage(77), 9);
        let records = [
            Retained::Step(first.clone()),
            state(9),
            Retained::Step(first.clone()),
            Retained::Step(foreign),
            Retained::Step(second.clone()),
        ];
        let runs = RetainedRun::of_records(records);
        assert_eq!(runs.len(), 1);
        assert_eq!(runs[0].steps, [first, second.clone()]);
        assert_eq!(runs[0].stepped(), second.stepped);
    }
}
