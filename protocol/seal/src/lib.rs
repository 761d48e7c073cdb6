//! Authenticity and freshness of frames: each one was sent by the named member, and is accepted once.
//!
//! A sealed frame is one datagram:
//!
//! ```text
//! offset  size  what
//!      0     4  magic "UNDS"
//!      4     1  version of this layout, 1
//!      5     1  the kind of its sender: 0 a station, 1 a remote I/O, 2 a plant
//!      6     1  the index of its sender
//!      7     1  255: for all members; else the only station that it is for, and the frame is encrypted
//!      8     4  the sender's life, little-endian: one more after each start
//!     12     8  the number of the frame in that life, little-endian, from 1
//!     20     n  the frame as `understudy_wire::encode` writes it; where it is encrypted, ChaCha20-Poly1305 of it, with its tag
//!   20+n    16  authenticator: the first 16 bytes of the keyed BLAKE3 hash of everything before it
//! ```
//!
//! * **Key.** Every sender has its own ([`FrameKey`]), derived from the secret of the cluster. A receiver has the keys
//!   of its senders too, and could send in their names: that is the price of one datagram for all. No other member can.
//! * **Monotone acceptance.** Life and number are the nonce. A receiver takes each number once, none that is more than
//!   [`WINDOW_FRAMES`] behind the newest, and none of a life before the newest. A new life begins with a frame of the
//!   receiver's configuration. Where frames of the earlier life still arrive, two processes have the keys of one
//!   sender, and the receiver reports it. Epoch and cycle are in the frame and so under the authenticator, but they are
//!   not its nonce: a station that founds an epoch alone gives it up when it receives an older cluster, and its cycles
//!   then run backwards, which a nonce must never.
//! * **States are confidential.** A Transfer is encrypted for the station that asked, under a key of these two and this
//!   direction ([`TransferKey`]); other receivers see which station transfers a state to which one, and its length.
//!
//! Invariant: no two datagrams of a sender have one life and one number. The caller gives [`Seal::new`] a life that was
//! never used before.

mod envelope;
mod key;
mod opener;
mod revocations;
mod seal;
mod window;

pub use envelope::{OVERHEAD_BYTES, claimed_sender};
pub use key::{ClusterSecret, FrameKey, KEY_BYTES, Title, TransferKey};
pub use opener::{Opener, Refusal};
pub use revocations::Revocations;
pub use seal::{Seal, SealError};
pub use window::{ON_THEIR_WAY, WINDOW_FRAMES};
