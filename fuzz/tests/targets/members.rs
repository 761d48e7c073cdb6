//! What a member hears of others: frames, sealed and not, what is known of its peers, and what an operator forces.

use std::sync::Arc;

use understudy_bus::{Endpoints, Peer};
use understudy_cycle::{Input, Machine, Mode, RemoteIoInput};
use understudy_remote_io::RemoteIo;
use understudy_seal::{ClusterSecret, Opener, Revocations, Seal, Title};
use understudy_testing::press_cell;
use understudy_wire::{
    ClusterHash, Force, MAXIMUM_FRAME_BYTES, Member, ProgramId, Roster, StationId, Time, Unforce,
    decode, encode,
};

use crate::attack::attack;

/// Behind the prefix and before the checksum, where a reader has to understand something.
fn framed(payload: &[u8]) -> Vec<u8> {
    let mut bytes = b"UNDR\x02".to_vec();
    bytes.extend_from_slice(payload);
    let checksum = crc32fast::hash(&bytes);
    bytes.extend_from_slice(&checksum.to_le_bytes());
    bytes
}

#[test]
fn frame() {
    attack("frame", &[], |payload| {
        let bytes = framed(payload);
        let _ = decode(payload);
        // What is taken for a frame is one: it can be said again, and means the same.
        let Ok(frame) = decode(&bytes) else { return };
        let mut again = Vec::new();
        encode(&frame, &mut again).expect("what was heard can be said");
        assert!(again.len() <= MAXIMUM_FRAME_BYTES);
        assert_eq!(decode(&again), Ok(frame));
    });
}

/// Datagrams at one who knows the key of station 0: nothing without its seal is opened, and what it sealed is, once.
#[test]
fn sealed() {
    let secret = ClusterSecret::new([7; 32]);
    let title = |member| Title { cluster: "cell", member, generation: 1 };
    let (zero, one) = (Member::Station(StationId(0)), Member::Station(StationId(1)));
    attack("frame", &[], move |payload| {
        let key = || secret.frame_key(title("zero"));
        let transfer = || secret.transfer_key(title("zero"), title("one"));
        let revoked = Arc::new(Revocations::default());
        let mut opener = Opener::new(one, [(zero, key())], [(StationId(0), transfer())], revoked);
        let mut datagram = payload.to_vec();
        assert!(opener.open(&mut datagram).is_err());
        let encoded = framed(payload);
        let Ok(mut frame) = decode(&encoded) else {
            return;
        };
        frame.header.sender = zero;
        let mut encoded = Vec::new();
        if encode(&frame, &mut encoded).is_err() {
            return;
        }
        let mut seal = Seal::new(zero, key(), 1, [(StationId(1), transfer())]);
        let mut sealed = Vec::new();
        if seal.seal(&frame, &encoded, &mut sealed).is_err() {
            return;
        }
        // One bit of it, where the first byte of the payload says.
        let mut changed = sealed.clone();
        let bit = usize::from(payload[0]) % (8 * changed.len());
        changed[bit / 8] ^= 1 << (bit % 8);
        assert!(opener.open(&mut changed).is_err());
        let replay = sealed.clone();
        // It may be for another station, or not what its envelope says.
        if let Ok(Some(opened)) = opener.open(&mut sealed) {
            assert_eq!(opened, frame);
        }
        assert!(opener.open(&mut replay.clone()).is_err());
    });
}

#[test]
fn endpoints() {
    attack("endpoints", &[], |bytes| {
        let Ok(peers) = serde_json::from_slice::<Vec<Peer>>(bytes) else {
            return;
        };
        if let Some(own) = peers.first().map(|peer| peer.member) {
            let _ = Endpoints::new(ClusterHash(1), own, peers, Roster::new(2, 3, Vec::new()));
        }
    });
}

#[test]
fn register_of_keys() {
    attack("keys", &[], |bytes| {
        let text = String::from_utf8_lossy(bytes);
        let _ = toml::from_str::<understudy_keys::Register>(&text);
    });
}

/// What a line of standard input or a page may ask of a remote I/O.
#[test]
fn force() {
    let settings = press_cell(Mode::Full).remote_io_settings(ProgramId(0)).expect("the robot's");
    attack("force", &[], |bytes| {
        let mut remote_io = RemoteIo::new(Time(0), settings.clone());
        for line in bytes.split(|&byte| byte == b'\n').take(16) {
            if let Ok(force) = serde_json::from_slice::<Force>(line) {
                if force.check().is_ok() {
                    remote_io.handle_input(Time(1), Input::RemoteIo(RemoteIoInput::Force(&force)));
                }
            } else if let Ok(unforce) = serde_json::from_slice::<Unforce>(line) {
                remote_io.handle_input(Time(1), Input::RemoteIo(RemoteIoInput::Unforce(&unforce)));
            }
        }
        for _ in 0..16 {
            let now = remote_io.wakeup();
            remote_io.handle_input(now, Input::Wakeup);
            while remote_io.poll_output().is_some() {}
        }
    });
}
