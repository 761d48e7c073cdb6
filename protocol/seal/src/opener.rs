//! The receiver's side.

use std::collections::BTreeMap;
use std::sync::Arc;

use ring::aead::{Aad, LessSafeKey, Nonce};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Frame, FrameError, Header, MAXIMUM_FRAME_BYTES, Member,
    StationId, decode,
};

use crate::envelope::{
    AUTHENTICATOR_BYTES, Envelope, HEADER_BYTES, OVERHEAD_BYTES, TAG_BYTES, UNSEALED_MAGIC,
};
use crate::key::{FrameKey, TransferKey};
use crate::revocations::Revocations;
use crate::window::{Verdict, Window};

/// Why a datagram does not count.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Anything at all.
    #[error("{bytes} bytes are no sealed frame")]
    Bytes {
        /// How many.
        bytes: usize,
    },
    /// A frame, and nobody has sealed it: a member without keys, or of another cluster.
    #[error("a frame without an authenticator")]
    Unsealed,
    /// In the name of a member whose frames do not concern this one, or that is in no cluster of this size.
    #[error("{sender:?} has nothing to say to this member")]
    Foreign {
        /// The name that it bears.
        sender: Member,
    },
    /// The authenticator is not the one of the sender that it names: made by somebody else, or changed on its way.
    #[error("the authenticator is not by {sender:?}")]
    Forged {
        /// The name that it bears.
        sender: Member,
    },
    /// It counted before, or is older than anything that may still come.
    #[error("a frame of {sender:?} came again, or too late")]
    Replayed {
        /// Who said it when it was new.
        sender: Member,
    },
    /// New, and of a life before the newest one: two processes have the keys of its sender.
    #[error(
        "{sender:?} sends in two lives at once: two processes have its keys, or its frames were recorded"
    )]
    OfAnotherLife {
        /// Whose keys they have.
        sender: Member,
    },
    /// By a member whose keys were revoked.
    #[error("the keys of {sender:?} are revoked")]
    Revoked {
        /// Who.
        sender: Member,
    },
    /// Authentic, and no frame: a mistake in the sender's program, or another version of it.
    #[error("{sender:?} sealed what is no frame: {error}")]
    Broken {
        /// Who.
        sender: Member,
        /// What is wrong with it.
        error: FrameError,
    },
}

/// Opens what arrives at one member.
pub struct Opener {
    own: Member,
    senders: BTreeMap<Member, (FrameKey, Window)>,
    transfers: BTreeMap<StationId, LessSafeKey>,
    revoked: Arc<Revocations>,
    agreed: Option<(ClusterHash, ConfigurationHash)>,
}

impl Opener {
    /// `senders` are those whom this member hears; `transfers` the keys of the states that it is given, by who gives.
    pub fn new(
        own: Member,
        senders: impl IntoIterator<Item = (Member, FrameKey)>,
        transfers: impl IntoIterator<Item = (StationId, TransferKey)>,
        revoked: Arc<Revocations>,
    ) -> Self {
        let senders = senders.into_iter();
        let ciphers = transfers
            .into_iter()
            .map(|(from, key)| (from, key.cipher()));
        Self {
            own,
            senders: senders
                .map(|(member, key)| (member, (key, Window::default())))
                .collect(),
            transfers: ciphers.collect(),
            revoked,
            agreed: None,
        }
    }

    /// Takes a new life of a sender from a frame of this configuration only: an old copy of a station does not shut out the station.
    #[must_use]
    pub fn of_configuration(
        mut self,
        cluster: ClusterHash,
        configuration: ConfigurationHash,
    ) -> Self {
        self.agreed = Some((cluster, configuration));
        self
    }

    /// The frame in a datagram, which is decrypted in place; nothing where it is authentic and for another station.
    ///
    /// # Errors
    /// [`Refusal`]; the datagram is as if it had never come then.
    pub fn open(&mut self, datagram: &mut [u8]) -> Result<Option<Frame>, Refusal> {
        let length = datagram.len();
        let nothing = || Refusal::Bytes { bytes: length };
        if datagram.starts_with(&UNSEALED_MAGIC) {
            return Err(Refusal::Unsealed);
        }
        let bounds = HEADER_BYTES + AUTHENTICATOR_BYTES..=MAXIMUM_FRAME_BYTES + OVERHEAD_BYTES;
        if !bounds.contains(&length) {
            return Err(nothing());
        }
        let header: [u8; HEADER_BYTES] = *datagram.first_chunk().ok_or_else(nothing)?;
        let envelope = Envelope::read(&header).ok_or_else(nothing)?;
        let sender = envelope.sender;
        let (key, window) = self
            .senders
            .get_mut(&sender)
            .ok_or(Refusal::Foreign { sender })?;
        let (sealed, authenticator) = datagram.split_at_mut(length - AUTHENTICATOR_BYTES);
        let computed = blake3::keyed_hash(key.bytes(), sealed);
        if !same(&computed.as_bytes()[..AUTHENTICATOR_BYTES], authenticator) {
            return Err(Refusal::Forged { sender });
        }
        if self.revoked.holds(sender) {
            return Err(Refusal::Revoked { sender });
        }
        let begins = window.begins(envelope.life);
        if !begins {
            take(window, envelope)?;
        }
        let text = &mut sealed[HEADER_BYTES..];
        let encoded = match envelope.to {
            None => &*text,
            Some(to) if Member::Station(to) != self.own => return Ok(None),
            Some(_) => decrypt(&self.transfers, envelope, header, text)
                .ok_or(Refusal::Forged { sender })?,
        };
        let broken = |error| Refusal::Broken { sender, error };
        let frame = decode(encoded).map_err(broken)?;
        let to = match &frame.body {
            Body::Transfer(transfer) => Some(transfer.to),
            _ => None,
        };
        if frame.header.sender != sender || to != envelope.to {
            return Err(broken(FrameError::Promise(
                "sender and receiver are those of its envelope",
            )));
        }
        let Header {
            cluster,
            configuration,
            ..
        } = frame.header;
        let agrees = self
            .agreed
            .is_none_or(|agreed| agreed == (cluster, configuration));
        // What does not agree is refused by who gets it, and its life is as if it had never begun.
        if begins && agrees {
            take(window, envelope)?;
        }
        Ok(Some(frame))
    }
}

fn take(window: &mut Window, envelope: Envelope) -> Result<(), Refusal> {
    let sender = envelope.sender;
    match window.take(envelope.life, envelope.number) {
        Verdict::Taken => Ok(()),
        Verdict::Again => Err(Refusal::Replayed { sender }),
        Verdict::OfAnotherLife => Err(Refusal::OfAnotherLife { sender }),
    }
}

fn decrypt<'t>(
    ciphers: &BTreeMap<StationId, LessSafeKey>,
    envelope: Envelope,
    header: [u8; HEADER_BYTES],
    text: &'t mut [u8],
) -> Option<&'t [u8]> {
    let Member::Station(from) = envelope.sender else {
        return None;
    };
    let cipher = ciphers.get(&from)?;
    if text.len() < TAG_BYTES {
        return None;
    }
    let nonce = Nonce::assume_unique_for_key(envelope.nonce());
    let decrypted = cipher.open_in_place(nonce, Aad::from(header), text).ok()?;
    Some(decrypted)
}

/// Takes as long for every difference, so that nobody learns an authenticator byte by byte.
fn same(one: &[u8], other: &[u8]) -> bool {
    let differs = one.iter().zip(other).fold(0, |all, (a, b)| all | (a ^ b));
    one.len() == other.len() && std::hint::black_box(differs) == 0
}

impl std::fmt::Debug for Opener {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Opener")
            .field("own", &self.own)
            .field("senders", &self.senders.keys())
            .finish_non_exhaustive()
    }
}
