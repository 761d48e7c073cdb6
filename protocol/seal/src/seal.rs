//! The sending side.

use std::collections::BTreeMap;

use ring::aead::{Aad, LessSafeKey, Nonce};
use understudy_wire::{Body, Frame, Member, StationId};

use crate::envelope::{AUTHENTICATOR_BYTES, Envelope, HEADER_BYTES};
use crate::key::{FrameKey, TransferKey};

/// Reason why a frame cannot be sealed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SealError {
    /// A state for a station with which this one shares no key.
    #[error("there is no key for states to station {}", to.0)]
    NoKey {
        /// Station that asked.
        to: StationId,
    },
    /// All numbers of this life are used: only a further life can seal.
    #[error("all frames of life {life} are numbered")]
    Exhausted {
        /// The life.
        life: u32,
    },
    /// A frame of another member: an error in this program.
    #[error("a frame of {sender:?} cannot be sealed by {own:?}")]
    NotOwn {
        /// Member that seals.
        own: Member,
        /// Sender of the frame.
        sender: Member,
    },
}

/// Frames before the end of the numbers of a life at which a further life is asked for.
const RESERVE: u64 = 1 << 20;

/// Frames between two requests for a further life.
const ASKED_EVERY: u64 = 1 << 12;

/// Seals the frames of one member in one life.
pub struct Seal {
    own: Member,
    key: FrameKey,
    transfers: BTreeMap<StationId, LessSafeKey>,
    life: u32,
    number: u64,
}

impl Seal {
    /// `life` must be one that this member never had; `transfers` are the keys of the states that it transfers, by
    /// receiver.
    pub fn new(
        own: Member,
        key: FrameKey,
        life: u32,
        transfers: impl IntoIterator<Item = (StationId, TransferKey)>,
    ) -> Self {
        let ciphers = transfers.into_iter().map(|(to, key)| (to, key.cipher()));
        Self { own, key, transfers: ciphers.collect(), life, number: 0 }
    }

    /// The same after the frame with this number: the next one has the next number.
    #[must_use]
    pub fn after(self, number: u64) -> Self {
        Self { number, ..self }
    }

    /// Whether it is time to ask for a further life: from about a million frames before the end on, at intervals, so that a life that cannot begin is not
    /// asked for with every frame.
    pub fn needs_life(&self) -> bool {
        let left = u64::MAX - self.number;
        left <= RESERVE && left.is_multiple_of(ASKED_EVERY)
    }

    /// Life in which it seals.
    pub fn life(&self) -> u32 {
        self.life
    }

    /// Replaces the content of `datagram` by the sealed `frame`, whose bytes are `encoded`. A copy of a frame is sealed
    /// again: it has a number of its own.
    ///
    /// # Errors
    /// [`SealError`]; `datagram` is then empty.
    pub fn seal(
        &mut self,
        frame: &Frame,
        encoded: &[u8],
        datagram: &mut Vec<u8>,
    ) -> Result<(), SealError> {
        datagram.clear();
        let sender = frame.header.sender;
        if sender != self.own {
            return Err(SealError::NotOwn { own: self.own, sender });
        }
        let to = match &frame.body {
            Body::Transfer(transfer) => Some(transfer.to),
            _ => None,
        };
        let cipher = match to {
            Some(to) => {
                let found = self.transfers.get(&to);
                Some(found.ok_or(SealError::NoKey { to })?)
            }
            None => None,
        };
        self.number = self.number.checked_add(1).ok_or(SealError::Exhausted { life: self.life })?;
        let envelope = Envelope { sender, to, life: self.life, number: self.number };
        let header = envelope.to_bytes();
        datagram.extend_from_slice(&header);
        datagram.extend_from_slice(encoded);
        if let Some(cipher) = cipher {
            let nonce = Nonce::assume_unique_for_key(envelope.nonce());
            let text = &mut datagram[HEADER_BYTES..];
            let tag = cipher
                .seal_in_place_separate_tag(nonce, Aad::from(header), text)
                .expect("a frame is shorter than what the cipher takes");
            datagram.extend_from_slice(tag.as_ref());
        }
        let authenticator = blake3::keyed_hash(self.key.bytes(), datagram);
        datagram.extend_from_slice(&authenticator.as_bytes()[..AUTHENTICATOR_BYTES]);
        Ok(())
    }
}

impl std::fmt::Debug for Seal {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Seal")
            .field("own", &self.own)
            .field("life", &self.life)
            .field("number", &self.number)
            .finish_non_exhaustive()
    }
}
