//! Records as they come: from the files of a journal, also while they are written and closed, or handed over in this process.
//!
//! A reader of files that never blocks: [`Source::poll`] takes the records that are there and returns their number.

mod channel;
mod follow;
mod progress;

use std::io;
use std::path::{Path, PathBuf};

use understudy_journal::{JournalError, Place, Record, WrongVersion};
use understudy_text::shortened;

use channel::Channel;
pub use channel::Feed;
use follow::Follower;
pub use progress::{BEHIND, Progress, Reading};

/// Loss of records on the way to a reader.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// A file or its folder cannot be read.
    #[error("{} cannot be read: {reason}", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The journal is of another version.
    #[error(transparent)]
    Version(#[from] WrongVersion),
    /// A line is no record; it is left out.
    #[error("a line of the journal is no record: {reason}")]
    Line {
        /// Why.
        reason: String,
    },
    /// Records went before they were read: the journal has reached its limit, or the reader was too slow.
    #[error("some records were rotated out before they were read{}", count.map_or(String::new(), |count| format!(": {count}")))]
    Gone {
        /// How many, where that is known.
        count: Option<u64>,
    },
}

/// Maximum number of characters of the reason why a line is not a record.
const LONGEST_REASON: usize = 200;

impl Trouble {
    /// A line that is not a record. The reason may quote the line.
    fn of_line(reason: serde_json::Error) -> Self {
        Self::Line { reason: shortened(&reason.to_string(), LONGEST_REASON).into_owned() }
    }
}

impl From<JournalError> for Trouble {
    fn from(error: JournalError) -> Self {
        match error {
            JournalError::Version(wrong) => Self::Version(wrong),
            JournalError::Line { reason, .. } => Self::of_line(reason),
            JournalError::Read(error) => Self::Line { reason: error.to_string() },
        }
    }
}

/// Where records come from.
#[derive(Debug)]
pub struct Source(Kind);

#[derive(Debug)]
enum Kind {
    Files(Box<Follower>),
    Channel(Channel),
}

impl Source {
    /// The journal at `path` with all its segments: what is there, and then what is written. It need not be there yet.
    pub fn following(path: &Path) -> Self {
        Self(Kind::Files(Box::new(Follower::new(path))))
    }

    /// The same from a place of it on; nothing is said of what is before.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn following_from(path: &Path, place: Place) -> io::Result<Self> {
        let follower = Follower::from_place(path, place)?;
        Ok(Self(Kind::Files(Box::new(follower))))
    }

    /// Records of this process, `most` of them waiting at most; what does not fit is counted and said.
    pub fn channel(most: usize) -> (Feed, Self) {
        let (feed, channel) = channel::bounded(most);
        (feed, Self(Kind::Channel(channel)))
    }

    /// Takes what is there, some thousand records at most; answers with how many that were, troubles included. 0 means that
    /// there is nothing now.
    pub fn poll(&mut self, take: &mut dyn FnMut(Result<Record, Trouble>)) -> usize {
        match &mut self.0 {
            Kind::Files(follower) => follower.poll(take),
            Kind::Channel(channel) => channel.poll(take),
        }
    }

    /// Progress of the last poll. Callers check it before they show a state.
    pub fn progress(&self) -> Progress {
        match &self.0 {
            Kind::Files(follower) => follower.progress(),
            Kind::Channel(channel) => channel.progress(),
        }
    }

    /// Why it cannot be read at present, where that is so.
    pub fn failure(&self) -> Option<Trouble> {
        match &self.0 {
            Kind::Files(follower) => follower.failure(),
            Kind::Channel(_) => None,
        }
    }
}
