//! What a receiver takes: what the sender that it names has sealed, once, and nothing else.

use std::sync::Arc;

use proptest::prelude::*;
use smallvec::smallvec;
use understudy_seal::{
    ClusterSecret, FrameKey, ON_THEIR_WAY, OVERHEAD_BYTES, Opener, Refusal, Revocations, Seal,
    SealError, Title, TransferKey, WINDOW_FRAMES,
};
use understudy_wire::{
    Actuation, Body, ClusterHash, ConfigurationHash, Cycle, Digest, Epoch, Field, Frame,
    FrameError, Header, Image, Lineage, MAXIMUM_IMAGE_BITS, Member, Moment, ProgramHash, ProgramId,
    Segment, StationId, Transfer, Via, encode,
};

const ROBOT: Member = Member::Station(StationId(0));
const PRESS: Member = Member::Station(StationId(1));
const UNDERSTUDY: Member = Member::Station(StationId(2));
const ROBOT_IO: Member = Member::RemoteIo(ProgramId(0));
const ARM: Member = Member::Plant(ProgramId(0));

fn secret() -> ClusterSecret {
    ClusterSecret::new([7; 32])
}

fn title(member: Member, name: &mut String) -> Title<'_> {
    *name = format!("{member:?}");
    Title { cluster: "cell", member: name, generation: 1 }
}

fn frame_key(member: Member) -> FrameKey {
    secret().frame_key(title(member, &mut String::new()))
}

fn transfer_key(from: Member, to: Member) -> TransferKey {
    let (mut first, mut second) = (String::new(), String::new());
    secret().transfer_key(title(from, &mut first), title(to, &mut second))
}

fn stations() -> [(StationId, Member); 3] {
    [0, 1, 2].map(|rank| (StationId(rank), Member::Station(StationId(rank))))
}

/// A member in one of its lives.
fn seal(own: Member, life: u32) -> Seal {
    let transfers = stations().map(|(rank, to)| (rank, transfer_key(own, to)));
    Seal::new(own, frame_key(own), life, transfers)
}

/// Somebody who hears all of them.
fn opener(own: Member, revoked: Arc<Revocations>) -> Opener {
    let senders =
        [ROBOT, PRESS, UNDERSTUDY, ROBOT_IO, ARM].map(|member| (member, frame_key(member)));
    let transfers = stations().map(|(rank, from)| (rank, transfer_key(from, own)));
    Opener::new(own, senders, transfers, revoked)
}

fn listener() -> Opener {
    opener(UNDERSTUDY, Arc::default())
}

fn frame(sender: Member, cycle: u64) -> Frame {
    let image = Image::from_words(4, &[0b1010]).expect("it fits");
    let body = match sender {
        Member::Station(_) => Body::Sync,
        Member::RemoteIo(_) | Member::Twin(_) => Body::Actuation(Actuation { outputs: image }),
        Member::Plant(_) => Body::Field(Field {
            sensors: image,
            handed_over: 1,
            finished: 2,
            plant_faults: 0,
            positions: smallvec![0, 500],
        }),
    };
    framed(sender, cycle, body)
}

fn framed(sender: Member, cycle: u64, body: Body) -> Frame {
    Frame {
        header: Header {
            cluster: ClusterHash(1),
            configuration: ConfigurationHash(2),
            prepared: None,
            moment: Moment { epoch: Epoch(3), cycle: Cycle(cycle) },
            sender,
            alone: false,
        },
        body,
    }
}

fn transfer(from: Member, to: StationId, state: Image) -> Frame {
    let body = Body::Transfer(Transfer {
        to,
        program: ProgramId(0),
        hash: ProgramHash(7),
        born: Moment::default(),
        lineage: Lineage(8),
        stepped: Moment::default(),
        digest: Digest(9),
        state: Segment::single(&state),
    });
    framed(from, 4, body)
}

fn sealed(seal: &mut Seal, frame: &Frame) -> Vec<u8> {
    let (mut encoded, mut datagram) = (Vec::new(), Vec::new());
    encode(frame, &mut encoded).expect("a sensible frame");
    seal.seal(frame, &encoded, &mut datagram).expect("its own frame");
    assert!(datagram.len() <= encoded.len() + OVERHEAD_BYTES);
    datagram
}

fn open(opener: &mut Opener, datagram: &[u8]) -> Result<Option<Frame>, Refusal> {
    opener.open(&mut datagram.to_vec())
}

/// One frame of each kind of sender, and a state.
fn one_of_each() -> Vec<Frame> {
    let state = transfer(ROBOT, StationId(2), Image::zero(9));
    let plain = [ROBOT, ROBOT_IO, ARM].map(|sender| frame(sender, 4));
    plain.into_iter().chain([state]).collect()
}

#[test]
fn what_was_sealed_is_opened() {
    let mut opener = listener();
    for (life, frame) in (1..).zip(one_of_each()) {
        let datagram = sealed(&mut seal(frame.header.sender, life), &frame);
        assert_eq!(open(&mut opener, &datagram), Ok(Some(frame)));
    }
}

/// Every bit of every kind of datagram, and every length.
#[test]
fn no_changed_bit_is_taken() {
    for frame in one_of_each() {
        let datagram = sealed(&mut seal(frame.header.sender, 2), &frame);
        let mut opener = listener();
        for bit in 0..datagram.len() * 8 {
            let mut changed = datagram.clone();
            changed[bit / 8] ^= 1 << (bit % 8);
            assert!(open(&mut opener, &changed).is_err(), "bit {bit}");
        }
        for length in 0..datagram.len() {
            assert!(open(&mut opener, &datagram[..length]).is_err(), "{length} bytes");
        }
        assert_eq!(
            open(&mut opener, &datagram),
            Ok(Some(frame)),
            "nothing that was refused leaves a trace"
        );
    }
}

#[test]
fn a_frame_counts_once() {
    let (mut seal, mut opener) = (seal(ROBOT, 1), listener());
    let said: Vec<Vec<u8>> = (0..3).map(|cycle| sealed(&mut seal, &frame(ROBOT, cycle))).collect();
    for datagram in [&said[1], &said[0], &said[2]] {
        assert!(matches!(open(&mut opener, datagram), Ok(Some(_))));
    }
    for datagram in &said {
        assert_eq!(open(&mut opener, datagram), Err(Refusal::Replayed { sender: ROBOT }));
    }
}

#[test]
fn a_frame_of_an_earlier_life_never_counts() {
    let mut opener = listener();
    let old = sealed(&mut seal(ROBOT, 1), &frame(ROBOT, 900));
    assert!(open(&mut opener, &old).is_ok());
    let mut restarted = seal(ROBOT, 2);
    assert!(open(&mut opener, &sealed(&mut restarted, &frame(ROBOT, 4))).is_ok());
    let unheard = sealed(&mut seal(ROBOT, 1), &frame(ROBOT, 901));
    for datagram in [old, unheard] {
        assert_eq!(open(&mut opener, &datagram), Err(Refusal::Replayed { sender: ROBOT }));
    }
}

/// A copy of a member with the same keys and another configuration, such as an old disk image.
#[test]
fn a_later_life_of_another_configuration_shuts_nobody_out() {
    let own = frame(ROBOT, 1).header;
    let mut opener = listener().of_configuration(own.cluster, own.configuration);
    let (mut rightful, mut copy) = (seal(ROBOT, 1), seal(ROBOT, 9));
    for cycle in 0..200 {
        let said = frame(ROBOT, cycle);
        assert_eq!(open(&mut opener, &sealed(&mut rightful, &said)), Ok(Some(said.clone())));
        let mut other = said;
        other.header.configuration = ConfigurationHash(3);
        assert_eq!(
            open(&mut opener, &sealed(&mut copy, &other)),
            Ok(Some(other)),
            "for others to report"
        );
    }
    let restarted = frame(ROBOT, 200);
    let datagram = sealed(&mut seal(ROBOT, 10), &restarted);
    assert_eq!(open(&mut opener, &datagram), Ok(Some(restarted)));
    let refused = open(&mut opener, &sealed(&mut rightful, &frame(ROBOT, 201)));
    assert_eq!(refused, Err(Refusal::Replayed { sender: ROBOT }));
}

/// What was on its way when a member started again is late; what its earlier life goes on to say is not.
/// The last frames of a life are opened like all others; then nothing is sealed until a further life, which is asked for in time.
#[test]
fn numbers_of_a_life_end() {
    let mut listener = listener();
    let mut last = seal(ROBOT, 7).after(u64::MAX - 3);
    for cycle in 0..3 {
        let datagram = sealed(&mut last, &frame(ROBOT, cycle));
        assert!(open(&mut listener, &datagram).is_ok_and(|found| found.is_some()));
        assert!(open(&mut listener, &datagram).is_err(), "a frame counts once");
    }
    let mut datagram = vec![1];
    let refused = last.seal(&frame(ROBOT, 3), &[], &mut datagram);
    assert_eq!((refused, datagram.len()), (Err(SealError::Exhausted { life: 7 }), 0));
    let mut next = seal(ROBOT, 8);
    let datagram = sealed(&mut next, &frame(ROBOT, 4));
    assert!(open(&mut listener, &datagram).is_ok_and(|found| found.is_some()));

    let asks = |number: u64| seal(ROBOT, 7).after(number).needs_life();
    assert!(!asks(0) && !asks(u64::MAX / 2));
    let near = (u64::MAX - 20_000..=u64::MAX).filter(|number| asks(*number)).count();
    assert_eq!(near, 5, "at intervals, and once more when no number is left");
}

#[test]
fn two_lives_at_once_are_told_from_late_frames() {
    let mut opener = listener();
    let (mut earlier, mut later) = (seal(ROBOT, 1), seal(ROBOT, 2));
    assert!(open(&mut opener, &sealed(&mut earlier, &frame(ROBOT, 1))).is_ok());
    assert!(open(&mut opener, &sealed(&mut later, &frame(ROBOT, 2))).is_ok());
    for number in 1..=2 * ON_THEIR_WAY {
        let refused = open(&mut opener, &sealed(&mut earlier, &frame(ROBOT, number)));
        let expected = if number <= ON_THEIR_WAY {
            Refusal::Replayed { sender: ROBOT }
        } else {
            Refusal::OfAnotherLife { sender: ROBOT }
        };
        assert_eq!(refused, Err(expected), "{number}");
    }
    assert!(open(&mut opener, &sealed(&mut later, &frame(ROBOT, 3))).is_ok());
}

#[test]
fn a_frame_that_is_too_late_does_not_count() {
    let (mut seal, mut opener) = (seal(ROBOT, 1), listener());
    let said: Vec<Vec<u8>> =
        (0..=WINDOW_FRAMES).map(|cycle| sealed(&mut seal, &frame(ROBOT, cycle))).collect();
    let newest = said.last().expect("there are some");
    assert!(open(&mut opener, newest).is_ok());
    assert!(open(&mut opener, &said[0]).is_err());
    assert!(open(&mut opener, &said[1]).is_ok());
}

#[test]
fn strangers_are_told_apart() {
    let mut opener = listener();
    let check = |opener: &mut Opener, datagram: &[u8], expected: Refusal| {
        assert_eq!(open(opener, datagram), Err(expected));
    };
    let mut plain = Vec::new();
    encode(&frame(ROBOT, 1), &mut plain).expect("a sensible frame");
    check(&mut opener, &plain, Refusal::Unsealed);
    check(&mut opener, b"nonsense", Refusal::Bytes { bytes: 8 });
    check(&mut opener, &[0; 40_000], Refusal::Bytes { bytes: 40_000 });

    let unheard = Member::Plant(ProgramId(1));
    let datagram = sealed(&mut seal(unheard, 1), &frame(unheard, 1));
    check(&mut opener, &datagram, Refusal::Foreign { sender: unheard });

    // Another station of the same cluster, in the robot's name.
    let mut impostor = Seal::new(ROBOT, frame_key(PRESS), 1, []);
    let datagram = sealed(&mut impostor, &frame(ROBOT, 1));
    check(&mut opener, &datagram, Refusal::Forged { sender: ROBOT });

    // A cluster of the same names and another secret.
    let other = ClusterSecret::new([8; 32]).frame_key(title(ROBOT, &mut String::new()));
    let datagram = sealed(&mut Seal::new(ROBOT, other, 1, []), &frame(ROBOT, 1));
    check(&mut opener, &datagram, Refusal::Forged { sender: ROBOT });
}

#[test]
fn a_revoked_member_is_heard_no_more_and_again_when_it_is_let() {
    let revoked = Arc::new(Revocations::default());
    let mut opener = opener(UNDERSTUDY, Arc::clone(&revoked));
    let mut seal = seal(ROBOT, 1);
    let mut say = |opener: &mut Opener, cycle| {
        let datagram = sealed(&mut seal, &frame(ROBOT, cycle));
        open(opener, &datagram)
    };
    assert!(say(&mut opener, 1).is_ok());
    revoked.set([ROBOT]);
    assert_eq!(say(&mut opener, 2), Err(Refusal::Revoked { sender: ROBOT }));
    revoked.set([PRESS]);
    assert!(say(&mut opener, 3).is_ok());
}

#[test]
fn a_state_is_for_the_station_that_asked() {
    let secret_state = Image::from_words(64, &[0x5afe_c0de_5afe_c0de]).expect("it fits");
    let state = transfer(ROBOT, StationId(2), secret_state);
    let datagram = sealed(&mut seal(ROBOT, 1), &state);
    let mut bystander = opener(PRESS, Arc::default());
    assert_eq!(open(&mut bystander, &datagram), Ok(None));
    let mut encoded = Vec::new();
    encode(&state, &mut encoded).expect("a sensible frame");
    for piece in encoded.windows(8) {
        let shown = datagram.windows(8).any(|window| window == piece);
        assert!(!shown, "8 bytes of a state are readable");
    }
    // Whoever hears the sender has its key, and still cannot make a state of it for another one.
    let transfers = [(StationId(2), transfer_key(PRESS, UNDERSTUDY))];
    let mut insider = Seal::new(ROBOT, frame_key(ROBOT), 1, transfers);
    assert_eq!(
        open(&mut listener(), &sealed(&mut insider, &state)),
        Err(Refusal::Forged { sender: ROBOT })
    );
    assert_eq!(open(&mut listener(), &datagram), Ok(Some(state)));
}

#[test]
fn a_sender_seals_its_own_frames_only() {
    let mut datagram = Vec::new();
    let refused = seal(ROBOT, 1).seal(&frame(PRESS, 1), &[], &mut datagram);
    assert_eq!(refused, Err(SealError::NotOwn { own: ROBOT, sender: PRESS }));
    let nobody = transfer(ROBOT, StationId(9), Image::zero(1));
    let refused = seal(ROBOT, 1).seal(&nobody, &[], &mut datagram);
    assert_eq!(refused, Err(SealError::NoKey { to: StationId(9) }));
    assert!(datagram.is_empty());
}

/// A frame under an envelope that says something else about it.
#[test]
fn the_envelope_and_the_frame_agree() {
    let actuation = framed(ROBOT_IO, 1, Body::Actuation(Actuation { outputs: Image::zero(1) }));
    let (mut encoded, mut datagram) = (Vec::new(), Vec::new());
    encode(&frame(PRESS, 1), &mut encoded).expect("a sensible frame");
    seal(ROBOT_IO, 1).seal(&actuation, &encoded, &mut datagram).expect("its own envelope");
    assert!(matches!(
        open(&mut listener(), &datagram),
        Err(Refusal::Broken { sender: ROBOT_IO, error: FrameError::Promise(_) })
    ));
}

#[test]
fn the_longest_frame_fits() {
    let bits = (0..MAXIMUM_IMAGE_BITS).map(|place| place % 3 == 0);
    let longest = transfer(ROBOT, StationId(2), Image::from_bits(bits));
    let datagram = sealed(&mut seal(ROBOT, 1), &longest);
    assert_eq!(open(&mut listener(), &datagram), Ok(Some(longest)));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_may_arrive(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        prop_assert!(open(&mut listener(), &bytes).is_err());
    }

    /// Any bytes behind a header that looks right, and any other key.
    #[test]
    fn nobody_without_the_key_is_heard(key in any::<[u8; 32]>(), life in 1..u32::MAX, cycle in any::<u64>()) {
        let mut stranger = Seal::new(ROBOT, FrameKey::new(key), life, []);
        let datagram = sealed(&mut stranger, &frame(ROBOT, cycle));
        prop_assert_eq!(open(&mut listener(), &datagram), Err(Refusal::Forged { sender: ROBOT }));
    }

    /// Whatever order a network delivers them in, and however often: no frame is taken twice.
    #[test]
    fn each_frame_is_taken_once_at_most(order in prop::collection::vec(0..100_usize, 0..400)) {
        let (mut seal, mut opener) = (seal(ROBOT, 1), listener());
        let said: Vec<Vec<u8>> = (0..100).map(|cycle| sealed(&mut seal, &frame(ROBOT, cycle))).collect();
        let mut taken = [0; 100];
        for place in order {
            if let Ok(Some(frame)) = open(&mut opener, &said[place]) {
                prop_assert_eq!(frame.header.moment.cycle.0 as usize, place);
                taken[place] += 1;
            }
        }
        prop_assert!(taken.iter().all(|&times| times <= 1));
    }
}

/// The copy over the other network is told from a replay over one of them.
#[test]
fn a_second_copy_is_no_replay() {
    let (mut seal, mut opener) = (seal(ROBOT, 1), listener());
    let said: Vec<Vec<u8>> =
        (0..WINDOW_FRAMES).map(|cycle| sealed(&mut seal, &frame(ROBOT, cycle))).collect();
    for datagram in &said {
        assert!(opener.open_over(Via::Second, &mut datagram.clone()).is_ok());
    }
    // The first network is far behind, and each of its copies comes once.
    for datagram in &said {
        let copy = opener.open_over(Via::First, &mut datagram.clone());
        assert_eq!(copy, Err(Refusal::SecondCopy { sender: ROBOT }));
    }
    for via in Via::NETWORKS {
        for datagram in &said {
            let again = opener.open_over(via, &mut datagram.clone());
            assert_eq!(again, Err(Refusal::Replayed { sender: ROBOT }));
        }
    }
}
