//! What frames wear on the network: an authenticator, or nothing where the cluster file says so.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

use understudy_seal::{Opener, Refusal, Seal, claimed_sender};
use understudy_wire::{Configurations, Frame, FrameError, Member, Via, decode};

use crate::refused_as::RefusedAs;
use crate::rights::run_in_background;

/// Closes what a member says and opens what it hears.
#[derive(Debug, Default)]
pub enum Guard {
    /// Everybody on the network is believed.
    #[default]
    Off,
    /// Only the holders of keys are.
    Keys(Box<Keys>),
}

/// Begins a life that the member never had; it may take its time.
pub type NewLife = Arc<dyn Fn() -> Result<Seal, String> + Send + Sync>;

/// Both sides of one member.
pub struct Keys {
    seal: Seal,
    opener: Opener,
    datagram: Vec<u8>,
    new_life: Option<NewLife>,
    awaited: Option<Receiver<Result<Seal, String>>>,
}

impl std::fmt::Debug for Keys {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Keys")
            .field("seal", &self.seal)
            .field("opener", &self.opener)
            .finish_non_exhaustive()
    }
}

/// What an authentic datagram is.
#[derive(Debug)]
pub(crate) enum Opened {
    /// A frame for this member.
    Frame(Arc<Frame>),
    /// A transfer for another station.
    ForAnother,
    /// A frame of this member that came over the other network before.
    SecondCopy(Member),
}

/// Why a datagram is not passed on to the member.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Refused {
    pub(crate) kind: RefusedAs,
    /// In whose name it came, where it bears one.
    pub(crate) sender: Option<Member>,
    pub(crate) reason: String,
}

impl Guard {
    /// With the keys of one member.
    pub fn with_keys(seal: Seal, opener: Opener) -> Self {
        Self::Keys(Box::new(Keys {
            seal,
            opener,
            datagram: Vec::new(),
            new_life: None,
            awaited: None,
        }))
    }

    /// The same, and the member may begin a further life while it runs.
    #[must_use]
    pub fn with_lives(mut self, new_life: NewLife) -> Self {
        if let Self::Keys(keys) = &mut self {
            keys.new_life = Some(new_life);
        }
        self
    }

    /// From now on the member has these configurations.
    pub(crate) fn agree(&mut self, configurations: Configurations) {
        if let Self::Keys(keys) = self {
            keys.opener.agree(configurations);
        }
    }

    /// Asks for a new life, which a thread of its own prepares: a life is noted on the disk before it is used.
    pub(crate) fn ask_for_life(&mut self) {
        let Self::Keys(keys) = self else {
            return;
        };
        let (Some(new_life), None) = (keys.new_life.clone(), &keys.awaited) else {
            return;
        };
        let (sender, awaited) = channel();
        let begun = std::thread::Builder::new().name("new-life".into()).spawn(move || {
            run_in_background();
            // The member may have ended meanwhile.
            let _ = sender.send(new_life());
        });
        if begun.is_ok() {
            keys.awaited = Some(awaited);
        }
    }

    /// Goes on in the life that was asked for, once it is there: its number, or why there is none.
    pub(crate) fn begin_life(&mut self) -> Option<Result<u32, String>> {
        let Self::Keys(keys) = self else {
            return None;
        };
        let begun = keys.awaited.as_ref()?.try_recv().ok()?;
        keys.awaited = None;
        Some(begun.map(|seal| {
            keys.seal = seal;
            keys.seal.life()
        }))
    }

    /// The datagram of `frame`, which `encoded` are the bytes of.
    pub(crate) fn close<'b>(
        &'b mut self,
        frame: &Frame,
        encoded: &'b [u8],
    ) -> Result<&'b [u8], String> {
        if let Self::Keys(keys) = self {
            let sealed = keys.seal.seal(frame, encoded, &mut keys.datagram);
            sealed.map_err(|error| error.to_string())?;
            if keys.seal.needs_life() {
                self.ask_for_life();
            }
        }
        Ok(match self {
            Self::Off => encoded,
            Self::Keys(keys) => &keys.datagram,
        })
    }

    /// The sender that a datagram names, be it true or not.
    pub(crate) fn claimed_sender(&self, datagram: &[u8]) -> Option<Member> {
        match self {
            Self::Off => decode(datagram).ok().map(|frame| frame.header.sender),
            Self::Keys(_) => claimed_sender(datagram),
        }
    }

    /// What a datagram is that came over a path. Without keys a second copy is a frame like its first.
    pub(crate) fn open(&mut self, via: Via, datagram: &mut [u8]) -> Result<Opened, Refused> {
        match self {
            Self::Off => {
                let frame = decode(datagram).map_err(Refused::from)?;
                Ok(Opened::Frame(Arc::new(frame)))
            }
            Self::Keys(keys) => match keys.opener.open_over(via, datagram) {
                Ok(Some(frame)) => Ok(Opened::Frame(Arc::new(frame))),
                Ok(None) => Ok(Opened::ForAnother),
                Err(Refusal::SecondCopy { sender }) => Ok(Opened::SecondCopy(sender)),
                Err(refusal) => Err(Refused::from(refusal)),
            },
        }
    }
}

impl From<FrameError> for Refused {
    fn from(error: FrameError) -> Self {
        Self { kind: RefusedAs::NoFrame, sender: None, reason: error.to_string() }
    }
}

impl From<Refusal> for Refused {
    fn from(refusal: Refusal) -> Self {
        let (kind, sender) = match refusal {
            Refusal::Bytes { .. } => (RefusedAs::NoFrame, None),
            Refusal::Unsealed => (RefusedAs::Unsealed, None),
            Refusal::Foreign { sender } => (RefusedAs::Foreign, Some(sender)),
            Refusal::Forged { sender } => (RefusedAs::Forged, Some(sender)),
            Refusal::Replayed { sender } | Refusal::SecondCopy { sender } => {
                (RefusedAs::Replayed, Some(sender))
            }
            Refusal::OfAnotherLife { sender } => (RefusedAs::OfAnotherLife, Some(sender)),
            Refusal::Revoked { sender } => (RefusedAs::Revoked, Some(sender)),
            Refusal::Broken { sender, .. } => (RefusedAs::NoFrame, Some(sender)),
        };
        Self { kind, sender, reason: refusal.to_string() }
    }
}
