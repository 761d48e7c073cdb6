//! The journal of a run: its records, its files, the directory that holds them, and what an operator adds to it.
//!
//! Every record of a laboratory, of the simulator and of a cluster elsewhere has this form, so that one account judges all of them and every
//! viewer shows all of them.

mod alarm_fold;
mod clock;
mod continuation;
mod cycles;
mod in_effect;
mod journal;
mod kept;
mod leftovers;
mod members;
mod named_files;
mod numbering;
mod operator;
mod packed_file;
mod packing;
mod place;
mod present;
mod record;
mod repeated;
mod rules;
mod run_directory;
mod segments;
mod source;
mod tally;
mod time_of_day;
mod version;
mod writer;

pub use alarm_fold::{AlarmChange, AlarmFold, AlarmTransition};
pub use clock::monotonic_ns;
pub use continuation::{Continuation, ProgramSoFar};
pub use cycles::Cycles;
pub use in_effect::records_not_over;
pub use journal::{JOURNAL_LIMIT_BYTES, Journal, JournalError, JournalState, records, records_of};
pub use kept::{KeptError, keep_cluster, kept_cluster, kept_overrides};
pub use members::{Members, NamedInput, NamedSignal};
pub use named_files::{ALLOWED_FOLDERS, named_file};
pub use numbering::Numbering;
pub use operator::{
    Acknowledgement, AlarmRefusal, Command, Commanded, Commander, Commands, DECIDED_WITHIN,
    DecidedOrder, Done, MAXIMUM_SHELVING_SECONDS, OperatorAction, PendingOrders, Refusal,
    RequestedValue, RunSocket, Shelving, Unshelving, WriteProblem, WriteRequest, WriteSessions,
    attempt_until_decided, commands, find_alarm, force_value, new_write, write_answer,
};
pub use packed_file::{SegmentFile, open_file};
pub use place::{CheckpointPlace, Place, continuation_before, place_before};
pub use present::{PointsInEffect, Present, Turn};
pub use record::{Happening, LABORATORY, Record, RunEvent, moment};
pub use repeated::{RecordsInEffect, heard_at_deadline, repeated};
pub use rules::{Process, SourceCounts, is_blocked, is_provable};
pub use run_directory::{KEYS, RETAINED, RunDirectory, RunDirectoryError, time_name, time_text};
pub use segments::{Segments, closed_segments, segments_of};
pub use source::{SOURCES, source_word};
pub use tally::{Deadlines, Tally};
pub use time_of_day::{ClocksApart, TimeOfDay, TimesOfDay};
pub use understudy_bus::JOURNAL_VERSION;
pub use understudy_simulator::Action;
pub use version::{WrongVersion, check_header, check_journal, check_version, journal_header};
pub use writer::{Writing, writing};
