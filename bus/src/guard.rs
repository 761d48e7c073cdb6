//! What frames wear on the network: an authenticator, or nothing where the cluster file says so.

use understudy_seal::{Opener, Refusal, Seal};
use understudy_wire::{Frame, FrameError, Party, decode};

use crate::journal::RefusedAs;

/// Closes what a party says and opens what it hears.
#[derive(Debug, Default)]
pub enum Guard {
    /// Everybody on the network is believed.
    #[default]
    Off,
    /// Only the holders of keys are.
    Keys(Box<Keys>),
}

/// Both sides of one party.
pub struct Keys {
    seal: Seal,
    opener: Opener,
    datagram: Vec<u8>,
    next_life: Option<NextLife>,
}

/// Begins another life of the same party.
type NextLife = Box<dyn FnMut() -> Result<Seal, String> + Send>;

impl std::fmt::Debug for Keys {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { seal, opener, .. } = self;
        formatter
            .debug_struct("Keys")
            .field("seal", seal)
            .field("opener", opener)
            .finish_non_exhaustive()
    }
}

/// Why a datagram is not passed on to the party.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Refused {
    pub(crate) kind: RefusedAs,
    /// In whose name it came, where it bears one.
    pub(crate) sender: Option<Party>,
    pub(crate) reason: String,
}

impl Guard {
    /// With the keys of one party.
    pub fn with_keys(seal: Seal, opener: Opener) -> Self {
        Self::Keys(Box::new(Keys {
            seal,
            opener,
            datagram: Vec::new(),
            next_life: None,
        }))
    }

    /// The same, with what begins another life where nobody receives this one.
    #[must_use]
    pub fn with_next_life(
        mut self,
        next_life: impl FnMut() -> Result<Seal, String> + Send + 'static,
    ) -> Self {
        if let Self::Keys(keys) = &mut self {
            keys.next_life = Some(Box::new(next_life));
        }
        self
    }

    /// Whose frames it closes, where that party could begin another life.
    pub(crate) fn mortal(&self) -> Option<Party> {
        match self {
            Self::Keys(keys) if keys.next_life.is_some() => Some(keys.seal.own()),
            _ => None,
        }
    }

    /// Closes frames in another life from now on.
    pub(crate) fn begin_next_life(&mut self) -> Result<(), String> {
        if let Self::Keys(keys) = self
            && let Some(next_life) = &mut keys.next_life
        {
            keys.seal = next_life()?;
        }
        Ok(())
    }

    /// The datagram of `frame`, which `encoded` are the bytes of.
    pub(crate) fn close<'b>(
        &'b mut self,
        frame: &Frame,
        encoded: &'b [u8],
    ) -> Result<&'b [u8], String> {
        match self {
            Self::Off => Ok(encoded),
            Self::Keys(keys) => {
                let sealed = keys.seal.seal(frame, encoded, &mut keys.datagram);
                sealed.map_err(|error| error.to_string())?;
                Ok(&keys.datagram)
            }
        }
    }

    /// The frame in a datagram; nothing where it is in order, and for somebody else.
    pub(crate) fn open(&mut self, datagram: &mut [u8]) -> Result<Option<Frame>, Refused> {
        match self {
            Self::Off => decode(datagram).map(Some).map_err(Refused::from),
            Self::Keys(keys) => keys.opener.open(datagram).map_err(Refused::from),
        }
    }
}

impl From<FrameError> for Refused {
    fn from(error: FrameError) -> Self {
        Self {
            kind: RefusedAs::NoFrame,
            sender: None,
            reason: error.to_string(),
        }
    }
}

impl From<Refusal> for Refused {
    fn from(refusal: Refusal) -> Self {
        let (kind, sender) = match refusal {
            Refusal::Bytes { .. } => (RefusedAs::NoFrame, None),
            Refusal::Unsealed => (RefusedAs::Unsealed, None),
            Refusal::Foreign { sender } => (RefusedAs::Foreign, Some(sender)),
            Refusal::Forged { sender } => (RefusedAs::Forged, Some(sender)),
            Refusal::Replayed { sender } => (RefusedAs::Replayed, Some(sender)),
            Refusal::TwoLives { sender } => (RefusedAs::TwoLives, Some(sender)),
            Refusal::Revoked { sender } => (RefusedAs::Revoked, Some(sender)),
            Refusal::Broken { sender, .. } => (RefusedAs::NoFrame, Some(sender)),
        };
        Self {
            kind,
            sender,
            reason: refusal.to_string(),
        }
    }
}
