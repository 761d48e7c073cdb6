//! One of two remote I/Os of a program: what it does when the author is not received any more.

use understudy_cycle::{Input, Output, RemoteIoInput};
use understudy_remote_io::{Event, Missing, PairSettings, Release, Settings};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Frame, Header, Image, Join, Lineage, Member, Part,
    ProgramSet, Sample, Source, StationSet, Step, Turn,
};

use crate::bench::{
    Bench, PROGRAM, Said, held_after, join, recalled_of, releasing, sample_of, settings, turn,
};

/// The twin of a program with a controller and an understudy.
fn twin(release: Release) -> Settings {
    let pair = PairSettings { is_twin: true, ..PairSettings::exclusive(1) };
    Settings { pair: Some(pair), ..releasing(settings(1), release) }
}

/// The sample of the author in the cycle of `bench`, after `before`.
fn sample(bench: &Bench, before: Lineage, drives: bool) -> Sample {
    let inputs = Image::zero(2);
    Sample {
        born: bench.moment(),
        base: before,
        before,
        after: before.after(&inputs),
        history: [Step::of(inputs)].into_iter().collect(),
        applied: None,
        excluded: StationSet::EMPTY,
        gone: StationSet::EMPTY,
        drives,
        writes: Default::default(),
        pulses: Default::default(),
        unforced: None,
        version: None,
    }
}

fn from_author(bench: &mut Bench, sample: &Sample) -> Said {
    let header = Header {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        prepared: None,
        moment: bench.moment(),
        sender: Member::RemoteIo(PROGRAM),
        alone: false,
    };
    let frame = std::sync::Arc::new(Frame { header, body: Body::Sample(sample.clone()) });
    bench.give(bench.start(), Input::Frame(&frame))
}

/// A follower that has received the author for ten cycles, and then does not any more; all stations have its last sample. Answers with what it puts
/// out in the cycles after that.
fn taken_over(release: Release, drives: bool) -> Vec<Said> {
    let mut bench = Bench::new(twin(release), 100);
    let mut last = sample(&bench, Lineage(7), drives);
    for _ in 0..10 {
        bench.cycle += 1;
        bench.receive(bench.start(), 0, false, Body::Sync);
        last = sample(&bench, last.after, drives);
        let said = from_author(&mut bench, &last);
        assert!(!said.iter().any(|it| matches!(it, Output::Drive { .. } | Output::Connect(_))));
        for rank in [0, 1] {
            bench.receive(bench.start(), rank, false, turn(held_after(&last, bench.moment())));
        }
        bench.decide();
    }
    let sampled = bench.moment();
    let mut all = Vec::new();
    for _ in 0..5 {
        bench.cycle += 1;
        let mut said = bench.receive(bench.start(), 0, false, Body::Sync);
        let own = sample_of(&said).cloned();
        let body = match &own {
            Some(own) => turn(held_after(own, bench.moment())),
            None => Body::Turn(Turn {
                heard: StationSet::EMPTY,
                holdings: [held_after(&last, sampled)].into_iter().collect(),
                words: Default::default(),
                recalled: vec![recalled_of(&last, sampled)],
                lacks: ProgramSet::only(PROGRAM),
                relayed: Vec::new(),
            }),
        };
        for rank in [0, 1] {
            said.extend(bench.receive(bench.start(), rank, false, body.clone()));
        }
        said.extend(bench.decide());
        if said.iter().any(|it| matches!(it, Output::Connect(true))) {
            said.extend(bench.tell(RemoteIoInput::Field(&Image::zero(2))));
        }
        all.push(said);
    }
    all
}

fn applied(all: &[Said]) -> Vec<(Source, Option<Missing>)> {
    let events = all.iter().flatten().filter_map(|output| match output {
        Output::Report(Event::Applied { source, missing, .. }) => Some((*source, *missing)),
        _ => None,
    });
    events.collect()
}

#[test]
fn a_follower_takes_over_after_one_cycle() {
    let all = taken_over(Release::Automatic, true);
    let parts = all.iter().map(|said| {
        said.iter().find_map(|output| match output {
            Output::Report(Event::PartChanged { part, .. }) => Some(*part),
            _ => None,
        })
    });
    let parts: Vec<Option<Part>> = parts.collect();
    assert_eq!(parts[..2], [Some(Part::TakingOver), Some(Part::Author)]);
    assert_eq!(applied(&all), [(Source::Direct, None); 4]);
}

/// The author waited for the operator's release, and so does the one that takes over; a release that is not asked for is not waited for.
#[test]
fn outputs_that_were_not_released_stay_so() {
    let all = taken_over(Release::Operator, false);
    assert_eq!(applied(&all), [(Source::FailSafe, Some(Missing::NotReleased)); 4]);
    assert_eq!(applied(&taken_over(Release::Operator, true)), [(Source::Direct, None); 4]);
    assert_eq!(applied(&taken_over(Release::Automatic, false)), [(Source::Direct, None); 4]);
}

/// A follower that receives neither the author nor a station that follows it asks the operator. The author comes: nothing is asked any more, and the journal
/// says so, since the author itself has nothing to report.
#[test]
fn a_question_that_the_author_ends_is_reported_as_over() {
    let mut bench = Bench::new(twin(Release::Automatic), 100);
    let states = |said: &Said| -> Vec<Event> {
        let events = said.iter().filter_map(|output| match output {
            Output::Report(event) => Some(event.clone()),
            _ => None,
        });
        let is_of_state =
            |event: &Event| matches!(event, Event::StateLost { .. } | Event::StateRecovered { .. });
        events.filter(is_of_state).collect()
    };
    // A station that receives no author, and one that is not received and might.
    let Body::Join(unfollowing) = join(None, None) else { unreachable!("a join") };
    let unfollowing = Join { lacks: ProgramSet::only(PROGRAM), ..unfollowing };
    let mut asked = Vec::new();
    for _ in 0..700 {
        bench.cycle += 1;
        let mut said = bench.receive(bench.start(), 0, false, Body::Sync);
        let body = Body::Join(unfollowing.clone());
        said.extend(bench.receive(bench.start(), 0, false, body));
        said.extend(bench.decide());
        asked.extend(states(&said));
    }
    assert!(matches!(asked[..], [Event::StateLost { asks: true, .. }]), "{asked:?}");
    assert!(bench.remote_io.asks_operator());
    bench.cycle += 1;
    bench.receive(bench.start(), 0, false, Body::Sync);
    let author = sample(&bench, Lineage(7), true);
    let moment = bench.moment();
    let said = from_author(&mut bench, &author);
    assert_eq!(states(&said), [Event::StateRecovered { moment, from: None }]);
    assert!(!bench.remote_io.asks_operator());
    let said = from_author(&mut bench, &author);
    assert_eq!(states(&said), []);
}
