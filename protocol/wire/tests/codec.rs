//! The bytes on the wire: fixed by golden vectors, read back, and never a panic for any others.

use proptest::prelude::*;
use smallvec::smallvec;
use understudy_wire::{
    Actuation, Body, ClusterHash, ConfigurationHash, Cycle, Digest, Epoch, Field, Frame,
    FrameError, Header, Holding, Image, Join, Kept, Lineage, MAXIMUM_FRAME_BYTES, MAXIMUM_STATIONS,
    Member, Moment, Partial, ProgramHash, ProgramId, ProgramSet, Pulse, Recalled, Relayed, Sample,
    SamplesReceived, Segment, StationId, StationSet, Step, Transfer, Turn, Word, WriteId, decode,
    encode,
};

fn moment(epoch: u64, cycle: u64) -> Moment {
    Moment { epoch: Epoch(epoch), cycle: Cycle(cycle) }
}

fn image(width: usize, word: u64) -> Image {
    Image::from_words(width, &[word]).expect("it fits")
}

fn frame(sender: Member, body: Body) -> Frame {
    Frame {
        header: Header {
            cluster: ClusterHash(1),
            configuration: ConfigurationHash(2),
            prepared: None,
            moment: moment(3, 4),
            sender,
            alone: false,
        },
        body,
    }
}

fn holding(program: u8) -> Holding {
    Holding {
        program: ProgramId(program),
        born: moment(1, 2),
        lineage: Lineage(0x0102_0304_0506_0708),
        stepped: moment(3, 4),
        digest: Digest(9),
        version: None,
    }
}

fn write(session: u64, number: u32) -> WriteId {
    WriteId { session, number }
}

fn pulse(input: u16, left: u32) -> Pulse {
    Pulse { input, left }
}

fn recalled(program: u8) -> Recalled {
    Recalled {
        program: ProgramId(program),
        sampled: moment(3, 3),
        received: SamplesReceived::Later,
        applied: Some(moment(3, 3)),
        excluded: StationSet::from_bits(0b100),
        accounted_for: StationSet::from_bits(0b1),
        writes: smallvec![write(7, 1)],
        pulses: smallvec![pulse(2, 40)],
        inputs: image(4, 0b1010),
        version: None,
    }
}

/// One frame of every kind.
fn every_kind() -> Vec<(&'static str, Frame)> {
    let station = Member::Station(StationId(2));
    let remote_io = Member::RemoteIo(ProgramId(1));
    let plant = Member::Plant(ProgramId(0));
    let sample = Sample {
        born: moment(1, 2),
        base: Lineage(5),
        before: Lineage(6),
        after: Lineage(7),
        history: smallvec![
            Step { change: Some(ProgramHash(9)), inputs: image(4, 0b0011) },
            Step::of(image(4, 0b1010))
        ],
        applied: Some(moment(3, 3)),
        excluded: StationSet::from_bits(0b10),
        gone: StationSet::from_bits(0b100),
        drives: true,
        writes: smallvec![write(7, 1), write(9, 4)],
        pulses: smallvec![pulse(2, 41)],
        unforced: Some(image(4, 0b1000)),
        version: Some(ProgramHash(11)),
    };
    let relayed = Relayed { program: ProgramId(1), sample: sample.clone() };
    let turn = Turn {
        heard: StationSet::from_bits(0b11),
        holdings: smallvec![holding(0), holding(1)],
        words: smallvec![Word { mask: ProgramSet::from_bits(0b11), sum: image(5, 0b10101) }],
        recalled: vec![recalled(0)],
        lacks: ProgramSet::from_bits(0b1),
        relayed: vec![relayed],
    };
    let join = Join {
        wants: ProgramSet::from_bits(0b01),
        holdings: smallvec![holding(1)],
        retained: vec![Kept { holding: holding(0), of: ProgramHash(5), is_whole: true }],
        recalled: vec![recalled(0), recalled(1)],
        lacks: ProgramSet::from_bits(0b10),
        partial: vec![Partial {
            program: ProgramId(0),
            lineage: Lineage(6),
            missing: 0b101,
            waits: true,
        }],
    };
    let transfer = Transfer {
        to: StationId(0),
        program: ProgramId(0),
        hash: ProgramHash(7),
        born: moment(1, 2),
        lineage: Lineage(8),
        stepped: moment(3, 4),
        digest: Digest(9),
        state: Segment::single(&image(7, 0b1001001)),
    };
    let field = Field {
        sensors: image(6, 0b1010),
        handed_over: 1,
        finished: 2,
        plant_faults: 0,
        positions: smallvec![0, 500, 1000],
    };
    let actuation = Actuation { outputs: image(5, 0b1) };
    vec![
        ("sync", frame(station, Body::Sync)),
        ("sample", frame(remote_io, Body::Sample(sample))),
        ("turn", frame(station, Body::Turn(turn))),
        ("join", frame(station, Body::Join(join))),
        ("transfer", frame(station, Body::Transfer(transfer))),
        ("field", frame(plant, Body::Field(field))),
        ("actuation", frame(remote_io, Body::Actuation(actuation))),
    ]
}

fn bytes_of(frame: &Frame) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode(frame, &mut bytes).expect("a sensible frame");
    bytes
}

/// Two programs of different builds understand each other only while these bytes stay as they are.
#[test]
fn golden_vectors() {
    let text: String = every_kind()
        .iter()
        .map(|(kind, frame)| {
            let hexadecimal: String =
                bytes_of(frame).iter().map(|byte| format!("{byte:02x}")).collect();
            format!("{kind} {hexadecimal}\n")
        })
        .collect();
    insta::assert_snapshot!(text);
}

#[test]
fn every_kind_is_read_back() {
    for (kind, frame) in every_kind() {
        assert_eq!(decode(&bytes_of(&frame)), Ok(frame), "{kind}");
    }
}

/// CRC-32 finds every change of one bit, wherever it is.
#[test]
fn no_flipped_bit_goes_unseen() {
    for (kind, frame) in every_kind() {
        let bytes = bytes_of(&frame);
        for bit in 0..bytes.len() * 8 {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&flipped).is_err(), "{kind}, bit {bit}");
        }
        for length in 0..bytes.len() {
            assert!(decode(&bytes[..length]).is_err(), "{kind}, {length} bytes");
        }
    }
}

fn check_refused(sender: Member, body: Body) {
    let frame = frame(sender, body);
    let mut bytes = Vec::new();
    let refused = encode(&frame, &mut bytes);
    assert!(matches!(refused, Err(FrameError::Promise(_))), "{refused:?}");
    assert!(bytes.is_empty());
}

#[test]
fn a_frame_that_breaks_a_promise_never_leaves() {
    let station = Member::Station(StationId(2));
    let remote_io = Member::RemoteIo(ProgramId(0));
    check_refused(remote_io, Body::Sync);
    check_refused(Member::Station(StationId(MAXIMUM_STATIONS as u8)), Body::Sync);
    let empty = Sample {
        born: Moment::default(),
        base: Lineage(0),
        before: Lineage(0),
        after: Lineage(0),
        history: smallvec![],
        applied: None,
        excluded: StationSet::EMPTY,
        gone: StationSet::EMPTY,
        drives: true,
        writes: smallvec![],
        pulses: smallvec![],
        unforced: None,
        version: None,
    };
    check_refused(remote_io, Body::Sample(empty.clone()));
    for writes in
        [vec![write(1, 1), write(1, 2)], (0..17).map(|session| write(session, 1)).collect()]
    {
        let sample = Sample {
            history: smallvec![Step::of(image(1, 0))],
            writes: writes.into(),
            ..empty.clone()
        };
        check_refused(remote_io, Body::Sample(sample));
    }
    for pulses in [vec![pulse(1, 2), pulse(1, 3)], (0..17).map(|input| pulse(input, 2)).collect()] {
        let sample = Sample {
            history: smallvec![Step::of(image(1, 0))],
            pulses: pulses.into(),
            ..empty.clone()
        };
        check_refused(remote_io, Body::Sample(sample));
    }
    let marks = (0..5).map(|hash| Step { change: Some(ProgramHash(hash)), inputs: image(1, 0) });
    let marked = Sample { history: marks.collect(), ..empty.clone() };
    check_refused(remote_io, Body::Sample(marked));
    let uneven = Sample {
        history: smallvec![Step::of(image(1, 0)), Step::of(image(2, 0))],
        ..empty.clone()
    };
    check_refused(remote_io, Body::Sample(uneven));
    // A change mark may bring other points; what is not forced is of the newest ones.
    let change = Some(ProgramHash(7));
    let history = smallvec![Step::of(image(1, 0)), Step { change, inputs: image(2, 0) }];
    let changed = Sample { history, unforced: Some(image(2, 1)), ..empty.clone() };
    let sent = frame(remote_io, Body::Sample(changed.clone()));
    let mut bytes = Vec::new();
    encode(&sent, &mut bytes).expect("it keeps its promises");
    assert_eq!(decode(&bytes), Ok(sent));
    check_refused(remote_io, Body::Sample(Sample { unforced: Some(image(1, 1)), ..changed }));
    let history = smallvec![Step::of(image(1, 0))];
    let uneven = Sample { history, unforced: Some(image(2, 0)), ..empty.clone() };
    check_refused(remote_io, Body::Sample(uneven));
    let word = |members| Word { mask: ProgramSet::from_bits(members), sum: Image::default() };
    let turn = |members, programs: &[u8]| Turn {
        heard: StationSet::EMPTY,
        holdings: programs.iter().map(|&program| holding(program)).collect(),
        words: smallvec![word(members)],
        recalled: Vec::new(),
        lacks: ProgramSet::EMPTY,
        relayed: Vec::new(),
    };
    check_refused(station, Body::Turn(turn(0, &[0])));
    check_refused(station, Body::Turn(turn(0b10, &[0])));
    check_refused(station, Body::Turn(turn(0b1, &[0, 0])));
    check_refused(station, Body::Turn(turn(0b1, &[1, 0])));
    let sample = Sample { history: smallvec![Step::of(image(1, 0))], ..empty.clone() };
    let relaying = |programs: [u8; 2], sample: &Sample| {
        let relayed =
            programs.map(|program| Relayed { program: ProgramId(program), sample: sample.clone() });
        Body::Turn(Turn { relayed: relayed.to_vec(), ..turn(0b1, &[0]) })
    };
    check_refused(station, relaying([1, 1], &sample));
    check_refused(station, relaying([1, 64], &sample));
    check_refused(station, relaying([1, 2], &empty));
    let twice = Join {
        wants: ProgramSet::EMPTY,
        holdings: smallvec![],
        retained: vec![],
        recalled: vec![recalled(1), recalled(1)],
        lacks: ProgramSet::EMPTY,
        partial: Vec::new(),
    };
    check_refused(station, Body::Join(twice));
}

#[test]
fn a_frame_past_the_bound_never_leaves() {
    let transfer = Transfer {
        to: StationId(0),
        program: ProgramId(0),
        hash: ProgramHash(0),
        born: Moment::default(),
        lineage: Lineage(0),
        stepped: Moment::default(),
        digest: Digest(0),
        state: Segment::single(&Image::from_bits(
            (0..understudy_wire::MAXIMUM_IMAGE_BITS).map(|_| true),
        )),
    };
    let widest = frame(Member::Station(StationId(0)), Body::Transfer(transfer));
    let bytes = bytes_of(&widest);
    assert!(bytes.len() <= MAXIMUM_FRAME_BYTES);
    assert_eq!(decode(&bytes), Ok(widest));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_may_arrive(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        prop_assert!(decode(&bytes).is_err());
    }

    /// Bytes with a right magic, version and checksum, and anything in between: read or refused, and what is read can be written.
    #[test]
    fn any_payload_may_arrive(kind in 0..7_usize, cut in 0..400_usize, noise in prop::collection::vec(any::<u8>(), 0..40)) {
        let (_, frame) = every_kind().swap_remove(kind);
        let mut bytes = bytes_of(&frame);
        bytes.truncate(bytes.len() - 4);
        bytes.truncate(cut.max(5));
        bytes.extend(noise);
        let checksum = crc32fast::hash(&bytes);
        bytes.extend(checksum.to_le_bytes());
        if let Ok(read) = decode(&bytes) {
            let mut again = Vec::new();
            prop_assert_eq!(encode(&read, &mut again), Ok(()));
            prop_assert_eq!(decode(&again), Ok(read));
        }
    }
}
