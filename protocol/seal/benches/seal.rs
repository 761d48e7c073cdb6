//! `cargo bench -p understudy-seal`: what an authenticator costs a frame, on each side.

use std::sync::Arc;

use divan::Bencher;
use divan::counter::BytesCount;
use smallvec::smallvec;
use understudy_seal::{ClusterSecret, FrameKey, Opener, Revocations, Seal, Title};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Digest, Epoch, Frame, Header, Holding, Image,
    Lineage, Member, Moment, ProgramId, ProgramSet, StationId, StationSet, Turn, Word, decode,
    encode,
};

const OWN: Member = Member::Station(StationId(0));

fn main() {
    divan::main();
}

/// A controller's turn with a word of 64 bits.
fn turn() -> (Frame, Vec<u8>) {
    let moment = Moment { epoch: Epoch(1_700_000_000_000_000), cycle: Cycle(1_000_000) };
    let holding = Holding {
        program: ProgramId(0),
        born: moment,
        lineage: Lineage(u64::MAX),
        stepped: moment,
        digest: Digest(u64::MAX),
        version: None,
    };
    let word = Word {
        mask: ProgramSet::only(ProgramId(0)),
        sum: Image::from_words(64, &[u64::MAX]).expect("it fits"),
    };
    let frame = Frame {
        header: Header {
            cluster: ClusterHash(1),
            configuration: ConfigurationHash(2),
            prepared: None,
            moment,
            sender: OWN,
            alone: false,
        },
        body: Body::Turn(Turn {
            heard: StationSet::first(3),
            holdings: smallvec![holding],
            words: smallvec![word],
            recalled: Vec::new(),
            lacks: ProgramSet::EMPTY,
            relayed: Vec::new(),
        }),
    };
    let mut bytes = Vec::new();
    encode(&frame, &mut bytes).expect("within its bounds");
    (frame, bytes)
}

fn key() -> FrameKey {
    ClusterSecret::new([7; 32]).frame_key(Title { cluster: "cell", member: "robot", generation: 1 })
}

#[divan::bench]
fn encode_alone(bencher: Bencher<'_, '_>) {
    let (frame, bytes) = turn();
    bencher
        .counter(BytesCount::new(bytes.len()))
        .with_inputs(|| Vec::with_capacity(256))
        .bench_local_values(|mut bytes| {
            encode(&frame, &mut bytes).expect("within its bounds");
            bytes
        });
}

#[divan::bench]
fn seal(bencher: Bencher<'_, '_>) {
    let (frame, bytes) = turn();
    let mut seal = Seal::new(OWN, key(), 1, []);
    let mut datagram = Vec::with_capacity(256);
    bencher
        .counter(BytesCount::new(bytes.len()))
        .bench_local(move || seal.seal(&frame, &bytes, &mut datagram));
}

#[divan::bench]
fn decode_alone(bencher: Bencher<'_, '_>) {
    let (_, bytes) = turn();
    bencher.counter(BytesCount::new(bytes.len())).bench_local(move || decode(&bytes));
}

/// With the decoding.
#[divan::bench]
fn open(bencher: Bencher<'_, '_>) {
    let (frame, bytes) = turn();
    let mut seal = Seal::new(OWN, key(), 1, []);
    let listener = Member::Station(StationId(1));
    let mut opener = Opener::new(listener, [(OWN, key())], [], Arc::new(Revocations::default()));
    bencher
        .counter(BytesCount::new(bytes.len()))
        .with_inputs(|| {
            let mut datagram = Vec::new();
            seal.seal(&frame, &bytes, &mut datagram).expect("its own");
            datagram
        })
        .bench_local_values(|mut datagram| opener.open(&mut datagram));
}
