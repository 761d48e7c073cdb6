//! The receiving side.

use std::collections::BTreeMap;
use std::sync::Arc;

use ring::aead::{Aad, LessSafeKey, Nonce};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Configurations, Frame, FrameError, MAXIMUM_FRAME_BYTES,
    Member, StationId, Via, decode,
};

use crate::envelope::{
    AUTHENTICATOR_BYTES, Envelope, HEADER_BYTES, OVERHEAD_BYTES, TAG_BYTES, UNSEALED_MAGIC,
};
use crate::key::{FrameKey, TransferKey};
use crate::revocations::Revocations;
use crate::window::{Verdict, Window};

/// Reason why a datagram is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Neither a sealed nor an unsealed frame.
    #[error("{bytes} bytes are no sealed frame")]
    Bytes {
        /// Number of its bytes.
        bytes: usize,
    },
    /// A frame that is not sealed: from a member without keys, or of another cluster.
    #[error("a frame without an authenticator")]
    Unsealed,
    /// From a member whose frames this one does not receive, or that is in no cluster of this size.
    #[error("{sender:?} has nothing to say to this member")]
    Foreign {
        /// Sender that it names.
        sender: Member,
    },
    /// The authenticator is not the one of the sender that it names: forged, or changed on its way.
    #[error("the authenticator is not by {sender:?}")]
    Forged {
        /// Sender that it names.
        sender: Member,
    },
    /// It was accepted before, or is older than any frame that may still arrive.
    #[error("a frame of {sender:?} came again, or too late")]
    Replayed {
        /// Its sender.
        sender: Member,
    },
    /// It was accepted before, and this path has not carried it yet: the copy over another one came first.
    #[error("a frame of {sender:?} came over another network before")]
    SecondCopy {
        /// Its sender.
        sender: Member,
    },
    /// New, but of a life before the newest one: two processes have the keys of its sender.
    #[error(
        "{sender:?} sends in two lives at once: two processes have its keys, or its frames were recorded"
    )]
    OfAnotherLife {
        /// Member whose keys they have.
        sender: Member,
    },
    /// From a member whose keys were revoked.
    #[error("the keys of {sender:?} are revoked")]
    Revoked {
        /// Its sender.
        sender: Member,
    },
    /// Authentic, but not a frame: an error in the sender's program, or another version of it.
    #[error("{sender:?} sealed what is no frame: {error}")]
    Broken {
        /// Its sender.
        sender: Member,
        /// Reason why it cannot be decoded.
        error: FrameError,
    },
}

/// A member that this one receives.
struct Sender {
    key: FrameKey,
    /// What was accepted, over any path.
    accepted: Window,
    /// What each path has carried.
    carried: [Window; Via::ALL.len()],
}

/// Opens the datagrams that arrive at one member.
pub struct Opener {
    own: Member,
    senders: BTreeMap<Member, Sender>,
    transfers: BTreeMap<StationId, LessSafeKey>,
    revoked: Arc<Revocations>,
    agreed: Option<(ClusterHash, Configurations)>,
}

impl Opener {
    /// `senders` are the members that this one receives; `transfers` the keys of the states transferred to it, by their
    /// sender.
    pub fn new(
        own: Member,
        senders: impl IntoIterator<Item = (Member, FrameKey)>,
        transfers: impl IntoIterator<Item = (StationId, TransferKey)>,
        revoked: Arc<Revocations>,
    ) -> Self {
        let senders = senders.into_iter();
        let ciphers = transfers.into_iter().map(|(from, key)| (from, key.cipher()));
        Self {
            own,
            senders: senders
                .map(|(member, key)| {
                    let (accepted, carried) =
                        (Window::default(), [Window::default(); Via::ALL.len()]);
                    (member, Sender { key, accepted, carried })
                })
                .collect(),
            transfers: ciphers.collect(),
            revoked,
            agreed: None,
        }
    }

    /// Accepts a new life of a sender only from a frame of this configuration: a station of an earlier configuration
    /// cannot shut out its successor.
    #[must_use]
    pub fn of_configuration(
        mut self,
        cluster: ClusterHash,
        configuration: ConfigurationHash,
    ) -> Self {
        self.agreed = Some((cluster, Configurations { own: configuration, prepared: None }));
        self
    }

    /// The member has these configurations from now on.
    pub fn agree(&mut self, configurations: Configurations) {
        if let Some((_, agreed)) = &mut self.agreed {
            *agreed = configurations;
        }
    }

    /// [`Self::open_over`] the network that every cluster has.
    ///
    /// # Errors
    /// As there.
    pub fn open(&mut self, datagram: &mut [u8]) -> Result<Option<Frame>, Refusal> {
        self.open_over(Via::First, datagram)
    }

    /// The frame in a datagram that came over a path, which is decrypted in place; `None` where it is authentic and for another station.
    ///
    /// # Errors
    /// [`Refusal`]; the datagram then has no effect.
    pub fn open_over(&mut self, via: Via, datagram: &mut [u8]) -> Result<Option<Frame>, Refusal> {
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
        let known = self.senders.get_mut(&sender).ok_or(Refusal::Foreign { sender })?;
        let (sealed, authenticator) = datagram.split_at_mut(length - AUTHENTICATOR_BYTES);
        let computed = blake3::keyed_hash(known.key.bytes(), sealed);
        if !same(&computed.as_bytes()[..AUTHENTICATOR_BYTES], authenticator) {
            return Err(Refusal::Forged { sender });
        }
        if self.revoked.holds(sender) {
            return Err(Refusal::Revoked { sender });
        }
        let begins = known.accepted.begins(envelope.life);
        if !begins {
            known.take(via, envelope)?;
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
        let header = &frame.header;
        let agrees = self.agreed.is_none_or(|(cluster, configurations)| {
            header.cluster == cluster && configurations.admit(header)
        });
        // A frame of another configuration is refused by its receiver, and does not begin a life.
        if begins && agrees {
            known.take(via, envelope)?;
        }
        Ok(Some(frame))
    }
}

impl Sender {
    fn take(&mut self, via: Via, envelope: Envelope) -> Result<(), Refusal> {
        let Envelope { sender, life, number, .. } = envelope;
        // What a path carries is judged before what counts: its copy is not one of the others'.
        let is_new_here = self.carried[via.index()].take(life, number) == Verdict::Taken;
        match self.accepted.take(life, number) {
            Verdict::Taken => Ok(()),
            Verdict::Again if is_new_here => Err(Refusal::SecondCopy { sender }),
            Verdict::Again => Err(Refusal::Replayed { sender }),
            Verdict::OfAnotherLife => Err(Refusal::OfAnotherLife { sender }),
        }
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

/// Compares in constant time, so that an authenticator cannot be guessed byte by byte.
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
