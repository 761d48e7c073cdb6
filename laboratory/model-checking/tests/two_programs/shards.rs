//! Shards divide the runs by their first faults: together they try what the whole tries.

use stateright::Model as _;
use understudy_cycle::Turns;
use understudy_model_checking::{Budget, Model, Shard, Start, Step, Verdict, check};

use super::{NONE, ONE, parts};

fn model(understudies: usize, budget: Budget, shard: Shard) -> Model {
    let model = Model::new(parts(understudies, Turns::Token), Start::default(), budget);
    model.expect("it comes into step").of_shard(shard)
}

fn shards(of: u64) -> impl Iterator<Item = Shard> {
    (1..=of).map(move |number| format!("{number}/{of}").parse().expect("a shard"))
}

/// At every place of a run without faults each fault is the first one of exactly one shard. After a fault all shards try the same.
#[test]
fn each_first_fault_is_in_one_shard() {
    let budget = Budget { total: 2, losses: 2, cycles: 2, ..ONE };
    let whole = model(1, budget, Shard::WHOLE);
    let parts: Vec<Model> = shards(7).map(|shard| model(1, budget, shard)).collect();
    let steps = |model: &Model, world: &_| {
        let mut steps = Vec::new();
        model.actions(world, &mut steps);
        steps
    };
    let mut world = whole.init_states().remove(0);
    let mut most = 0;
    while let all = steps(&whole, &world)
        && !all.is_empty()
    {
        let faults: Vec<Step> = all.iter().copied().filter(|step| *step != Step::Wait).collect();
        most = most.max(faults.len());
        let own: Vec<Vec<Step>> = parts.iter().map(|part| steps(part, &world)).collect();
        assert!(own.iter().all(|own| own.contains(&Step::Wait)));
        for fault in &faults {
            let having = own.iter().filter(|own| own.contains(fault)).count();
            assert_eq!(having, 1, "{fault:?} in {world:?}");
        }
        let sum: usize = own.iter().map(|own| own.len() - 1).sum();
        assert_eq!(sum, faults.len(), "{world:?}");
        if let Some(&first) = faults.first() {
            let after = whole.next_state(&world, first).expect("it can be done");
            let after = whole.next_state(&after, Step::Wait).expect("time goes on");
            let expected = steps(&whole, &after);
            assert!(parts.iter().all(|part| steps(part, &after) == expected));
        }
        world = whole.next_state(&world, Step::Wait).expect("time goes on");
    }
    assert!(most > parts.len(), "a place has faults for each shard: {most}");
}

/// A property that is broken is broken in at least one shard, and only there where it is.
#[test]
fn what_the_whole_finds_one_shard_finds() {
    let budget = Budget { crashes: 1, losses: 1, total: 1, cycles: 1, ..NONE };
    let broken = |shard| -> Vec<&'static str> {
        let Verdict { counterexamples, .. } = check(model(0, budget, shard), 2);
        counterexamples.iter().map(|example| example.property).collect()
    };
    let whole = broken(Shard::WHOLE);
    assert!(!whole.is_empty());
    let found: Vec<Vec<&str>> = shards(30).map(broken).collect();
    for property in &whole {
        assert!(found.iter().any(|shard| shard.contains(property)), "{property}: {found:?}");
    }
    assert!(found.iter().flatten().all(|property| whole.contains(property)));
    assert!(found.iter().any(Vec::is_empty), "a loss of some frames breaks nothing: {found:?}");
}
