//! The bytes before and behind a frame in its datagram; the documentation of the crate draws them.

use understudy_wire::{Member, ProgramId, StationId};

pub(crate) const MAGIC: [u8; 4] = *b"UNDS";
/// Magic of a frame that is not sealed.
pub(crate) const UNSEALED_MAGIC: [u8; 4] = *b"UNDR";
pub(crate) const VERSION: u8 = 1;
pub(crate) const HEADER_BYTES: usize = 20;
pub(crate) const AUTHENTICATOR_BYTES: usize = 16;
pub(crate) const TAG_BYTES: usize = 16;
const EVERYBODY: u8 = 255;

/// Maximum number of bytes by which a sealed frame is longer than the frame.
pub const OVERHEAD_BYTES: usize = HEADER_BYTES + TAG_BYTES + AUTHENTICATOR_BYTES;

/// The readable header of a sealed frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Envelope {
    pub(crate) sender: Member,
    /// `None`, or the station for which alone the frame is.
    pub(crate) to: Option<StationId>,
    pub(crate) life: u32,
    pub(crate) number: u64,
}

impl Envelope {
    pub(crate) fn to_bytes(self) -> [u8; HEADER_BYTES] {
        let (kind, index) = match self.sender {
            Member::Station(station) => (0, station.0),
            Member::RemoteIo(program) => (1, program.0),
            Member::Plant(program) => (2, program.0),
            Member::Twin(program) => (3, program.0),
        };
        let mut bytes = [0; HEADER_BYTES];
        bytes[..4].copy_from_slice(&MAGIC);
        bytes[4] = VERSION;
        bytes[5] = kind;
        bytes[6] = index;
        bytes[7] = self.to.map_or(EVERYBODY, |station| station.0);
        bytes[8..12].copy_from_slice(&self.life.to_le_bytes());
        bytes[12..].copy_from_slice(&self.number.to_le_bytes());
        bytes
    }

    /// `None` for an unknown kind of sender, magic or version.
    pub(crate) fn read(bytes: &[u8; HEADER_BYTES]) -> Option<Self> {
        if bytes[..4] != MAGIC || bytes[4] != VERSION {
            return None;
        }
        let sender = match bytes[5] {
            0 => Member::Station(StationId(bytes[6])),
            1 => Member::RemoteIo(ProgramId(bytes[6])),
            2 => Member::Plant(ProgramId(bytes[6])),
            3 => Member::Twin(ProgramId(bytes[6])),
            _ => return None,
        };
        let field = |from: usize, to: usize| &bytes[from..to];
        Some(Self {
            sender,
            to: (bytes[7] != EVERYBODY).then_some(StationId(bytes[7])),
            life: u32::from_le_bytes(field(8, 12).try_into().ok()?),
            number: u64::from_le_bytes(field(12, 20).try_into().ok()?),
        })
    }

    /// Nonce of the cipher: unique for a key as long as no pair of life and number is used twice.
    pub(crate) fn nonce(self) -> [u8; 12] {
        let mut nonce = [0; 12];
        nonce[..4].copy_from_slice(&self.life.to_le_bytes());
        nonce[4..].copy_from_slice(&self.number.to_le_bytes());
        nonce
    }
}

/// The sender that a sealed datagram names; whether it is authentic, only [`crate::Opener`] tells.
pub fn claimed_sender(datagram: &[u8]) -> Option<Member> {
    Envelope::read(datagram.first_chunk()?).map(|envelope| envelope.sender)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_envelope_is_read_back() {
        let senders = [
            Member::Station(StationId(63)),
            Member::RemoteIo(ProgramId(0)),
            Member::Plant(ProgramId(7)),
            Member::Twin(ProgramId(5)),
        ];
        for sender in senders {
            for to in [None, Some(StationId(0)), Some(StationId(63))] {
                let envelope =
                    Envelope { sender, to, life: 0x0102_0304, number: 0x0506_0708_090a_0b0c };
                assert_eq!(Envelope::read(&envelope.to_bytes()), Some(envelope));
            }
        }
        let mut strange = [0; HEADER_BYTES];
        assert_eq!(Envelope::read(&strange), None);
        strange[..4].copy_from_slice(&MAGIC);
        strange[4] = VERSION;
        strange[5] = 4;
        assert_eq!(Envelope::read(&strange), None);
    }
}
