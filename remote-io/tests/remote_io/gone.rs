//! Which stations a sample names as gone: those learn by it that they are not received.

use understudy_wire::{Body, Sample, StationId, StationSet};

use crate::bench::{
    Bench, FLAG_AFTER, HISTORY, PERIOD, held_after, join, sample_of, settings, turn,
};

/// Cycles after which a station that is not received is gone.
const GONE_AFTER: u32 = FLAG_AFTER + HISTORY as u32;

/// A controller and two understudies.
const STATIONS: [u8; 3] = [0, 1, 2];

/// What publishes in a cycle of `bench`, of which the sample is known.
fn publish(bench: &mut Bench, stations: &[u8], sample: Option<&Sample>) {
    let holding = sample.map(|sample| held_after(sample, bench.moment()));
    for &rank in stations {
        let body = holding.map_or_else(|| join(None, None), turn);
        bench.receive(bench.start(), rank, false, body);
    }
}

/// A cluster of which all stations publish, in the first epoch.
fn running() -> Bench {
    let mut bench = Bench::new(settings(2), 100);
    let mut gone = None;
    for _ in 0..30 {
        bench.cycle += 1;
        let said = bench.receive(bench.start(), 0, false, Body::Sync);
        publish(&mut bench, &STATIONS, sample_of(&said));
        bench.decide();
        gone = sample_of(&said).map(|sample| sample.gone);
    }
    assert_eq!(gone, Some(StationSet::EMPTY), "the program runs");
    bench
}

/// A second process with the keys of a station begins a later life: every receiver refuses the first one. No frame goes to the second, which so
/// founds a later epoch and asks for a state in it. A remote I/O that hears nothing else for some cycles follows that epoch, and the others
/// follow the remote I/O.
#[test]
fn a_station_is_gone_while_a_second_process_without_a_state_has_its_place() {
    for station in STATIONS {
        let others: Vec<u8> = STATIONS.into_iter().filter(|&rank| rank != station).collect();
        let mut followed = 0;
        for silent in 0..10 {
            let mut bench = running();
            let mut gone = StationSet::EMPTY;
            for cycle in 0..silent + GONE_AFTER + 2 {
                bench.cycle += 1;
                bench.epoch = 2;
                let mut said = bench.receive(bench.start(), station, true, Body::Sync);
                let is_followed = sample_of(&said).is_some();
                if cycle >= silent {
                    if !is_followed {
                        bench.epoch = 1;
                        said = bench.receive(bench.start(), others[0], false, Body::Sync);
                    }
                    publish(&mut bench, &others, sample_of(&said));
                    followed += u32::from(is_followed);
                }
                bench.decide();
                bench.epoch = 2;
                let asks_at = bench.start() + PERIOD * 8 / 10;
                bench.receive(asks_at, station, true, join(None, None));
                if let Some(sample) = sample_of(&said) {
                    gone = sample.gone;
                }
            }
            let expected = StationSet::only(StationId(station));
            assert_eq!(gone, expected, "{station}: the others were silent for {silent} cycles");
        }
        assert!((1..10 * (GONE_AFTER + 2)).contains(&followed), "{station}: {followed}");
    }
}

/// A station that waits for its state is not gone while it receives other members, and so begins no new life meanwhile.
#[test]
fn a_station_that_waits_for_a_state_is_not_gone() {
    for station in STATIONS {
        let others: Vec<u8> = STATIONS.into_iter().filter(|&rank| rank != station).collect();
        let mut bench = running();
        let mut was_alone = false;
        for cycle in 0..4 * GONE_AFTER {
            bench.cycle += 1;
            let said = bench.receive(bench.start(), others[0], false, Body::Sync);
            publish(&mut bench, &others, sample_of(&said));
            bench.decide();
            // For a while it receives none.
            let alone = (GONE_AFTER..2 * GONE_AFTER + 3).contains(&cycle);
            let asks_at = bench.start() + PERIOD * 8 / 10;
            bench.receive(asks_at, station, alone, join(None, None));
            let gone = sample_of(&said).map(|sample| sample.gone);
            // A join counts from the next cycle on.
            if !was_alone {
                assert_eq!(gone, Some(StationSet::EMPTY), "{station}, {cycle}");
            }
            was_alone = alone;
        }
    }
}
