//! A stranger on the network, who speaks in the name of a member and lacks its key.

use std::sync::Arc;

use understudy_seal::{ClusterSecret, FrameKey, Opener, Seal, Title};
use understudy_wire::{Body, Frame, Image, Member, StationId, encode};

/// What comes through the authenticator of whoever hears `frame` when a stranger sends it, changed to its liking.
pub(crate) fn forged(frame: &Frame) -> Option<Arc<Frame>> {
    let mut forged = frame.clone();
    make_false(&mut forged);
    let sender = forged.header.sender;
    let mut encoded = Vec::new();
    encode(&forged, &mut encoded).ok()?;
    let mut datagram = Vec::new();
    // It has a secret, and not the one of this cluster.
    let mut seal = Seal::new(sender, key(2, sender), 1, []);
    seal.seal(&forged, &encoded, &mut datagram).ok()?;
    let hearer = match sender {
        Member::Station(StationId(0)) => Member::Station(StationId(1)),
        _ => Member::Station(StationId(0)),
    };
    let senders = [(sender, key(1, sender))];
    let mut opener = Opener::new(hearer, senders, [], Arc::default());
    opener.open(&mut datagram).ok().flatten().map(Arc::new)
}

fn key(secret: u8, sender: Member) -> FrameKey {
    ClusterSecret::new([secret; 32]).frame_key(Title {
        cluster: "simulated",
        member: &format!("{sender:?}"),
        generation: 1,
    })
}

/// The true history, and outputs or inputs that are none: all of it would be believed.
fn make_false(frame: &mut Frame) {
    let flip = |image: &mut Image| {
        if image.width() > 0 {
            image.set(0, !image.get(0));
        }
    };
    match &mut frame.body {
        Body::Turn(turn) => turn.words.iter_mut().for_each(|word| flip(&mut word.sum)),
        Body::Sample(sample) => {
            if let Some(newest) = sample.history.last_mut() {
                flip(&mut newest.inputs);
                sample.after = sample.before.after_step(newest);
            }
        }
        // A state is encrypted for one who has a key; anybody can ask for one.
        Body::Transfer(_) => frame.body = Body::Sync,
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::{ClusterHash, ConfigurationHash, Header, Moment, ProgramId};

    use super::*;

    #[test]
    fn no_stranger_is_heard() {
        for sender in [
            Member::Station(StationId(0)),
            Member::Station(StationId(2)),
            Member::RemoteIo(ProgramId(0)),
        ] {
            let frame = Frame {
                header: Header {
                    cluster: ClusterHash(1),
                    configuration: ConfigurationHash(1),
                    prepared: None,
                    moment: Moment::default(),
                    sender,
                    alone: false,
                },
                body: Body::Sync,
            };
            assert_eq!(forged(&frame), None);
        }
    }
}
