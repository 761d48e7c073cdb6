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
#[derive(Debug)]
pub struct Keys {
    seal: Seal,
    opener: Opener,
    datagram: Vec<u8>,
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
        }))
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
