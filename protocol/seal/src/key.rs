//! Keys and their derivation.

use std::fmt;

use ring::aead::{CHACHA20_POLY1305, LessSafeKey, UnboundKey};

/// Length of every key, in bytes.
pub const KEY_BYTES: usize = 32;

/// Version of the derivation, raised when equal secrets and titles would give other keys than before.
const FRAME_CONTEXT: &str = "understudy 2026-11 the authenticator of a sender's frames, version 1";
const TRANSFER_CONTEXT: &str = "understudy 2026-11 a state from one station to another, version 1";

/// Name under which a member holds its keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Title<'a> {
    /// The name of the cluster.
    pub cluster: &'a str,
    /// The name of the member in it.
    pub member: &'a str,
    /// Generation of its keys: one more each time that it is issued new ones.
    pub generation: u32,
}

/// Secret from which all keys of a cluster are derived; only the authority that issues keys has it.
#[derive(Clone, PartialEq, Eq)]
pub struct ClusterSecret([u8; KEY_BYTES]);

/// Key with which the frames of one sender are sealed and opened.
#[derive(Clone, PartialEq, Eq)]
pub struct FrameKey([u8; KEY_BYTES]);

/// Key with which one station encrypts states for another one.
#[derive(Clone, PartialEq, Eq)]
pub struct TransferKey([u8; KEY_BYTES]);

impl ClusterSecret {
    /// A secret from random bytes.
    pub fn new(bytes: [u8; KEY_BYTES]) -> Self {
        Self(bytes)
    }

    /// Bytes for the file that keeps it.
    pub fn bytes(&self) -> &[u8; KEY_BYTES] {
        &self.0
    }

    /// The key of one sender.
    pub fn frame_key(&self, sender: Title<'_>) -> FrameKey {
        FrameKey(self.derive(FRAME_CONTEXT, &[sender]))
    }

    /// The key of the states that `from` transfers to `to`; the other direction has another key.
    pub fn transfer_key(&self, from: Title<'_>, to: Title<'_>) -> TransferKey {
        TransferKey(self.derive(TRANSFER_CONTEXT, &[from, to]))
    }

    fn derive(&self, context: &str, titles: &[Title<'_>]) -> [u8; KEY_BYTES] {
        let mut hasher = blake3::Hasher::new_derive_key(context);
        hasher.update(&self.0);
        for title in titles {
            // Lengths go first, so that no two lists of titles are the same bytes.
            for text in [title.cluster, title.member] {
                hasher.update(&(text.len() as u64).to_le_bytes());
                hasher.update(text.as_bytes());
            }
            hasher.update(&title.generation.to_le_bytes());
        }
        *hasher.finalize().as_bytes()
    }
}

impl FrameKey {
    /// A key from the file that keeps it.
    pub fn new(bytes: [u8; KEY_BYTES]) -> Self {
        Self(bytes)
    }

    /// Bytes for the file that keeps it.
    pub fn bytes(&self) -> &[u8; KEY_BYTES] {
        &self.0
    }
}

impl TransferKey {
    /// A key from the file that keeps it.
    pub fn new(bytes: [u8; KEY_BYTES]) -> Self {
        Self(bytes)
    }

    /// Bytes for the file that keeps it.
    pub fn bytes(&self) -> &[u8; KEY_BYTES] {
        &self.0
    }

    pub(crate) fn cipher(&self) -> LessSafeKey {
        let key = UnboundKey::new(&CHACHA20_POLY1305, &self.0);
        LessSafeKey::new(key.expect("the cipher takes keys of 32 bytes"))
    }
}

macro_rules! secret_in_debug {
    ($($name:ident)*) => {$(
        impl fmt::Debug for $name {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str(concat!(stringify!($name), "(…)"))
            }
        }
    )*};
}

secret_in_debug! { ClusterSecret FrameKey TransferKey }

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    fn title<'a>(cluster: &'a str, member: &'a str, generation: u32) -> Title<'a> {
        Title { cluster, member, generation }
    }

    #[test]
    fn everything_that_differs_makes_another_key() {
        let secrets = [ClusterSecret::new([1; 32]), ClusterSecret::new([2; 32])];
        let titles = [
            title("cell", "robot", 1),
            title("cell", "robot", 2),
            title("cell", "press", 1),
            title("cel", "lrobot", 1),
            title("mill", "robot", 1),
        ];
        let mut keys = HashSet::new();
        for secret in &secrets {
            for first in titles {
                assert!(keys.insert(*secret.frame_key(first).bytes()));
                for second in titles {
                    assert!(keys.insert(*secret.transfer_key(first, second).bytes()));
                }
            }
        }
        let again = secrets[0].frame_key(titles[0]);
        assert!(keys.contains(again.bytes()));
    }

    #[test]
    fn a_key_is_not_shown() {
        let shown = format!("{:?}", ClusterSecret::new([42; 32]));
        assert_eq!(shown, "ClusterSecret(…)");
    }
}
