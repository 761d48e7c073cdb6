//! Every figure that TCT, libFAUDES, the literature and two independent programs found for the reference models.

use crate::models::{MODELS, Model, OF_PAPERS, automaton, counts, counts_in, json};
use understudy_supervisor::operations::{
    condat, isomorph, lift, meet, minstate, nonconflict, supcon, supreduce, supreduce_while, sync,
};
use understudy_supervisor::{Alphabet, Automaton, Bounds, synthesise};

/// The plant does and marks the same under both supervisors.
pub(crate) fn assert_same_effect(plant: &Automaton, left: &Automaton, right: &Automaton) {
    let [left, right] = [left, right].map(|supervisor| {
        let loops = meet(&[plant, supervisor], Bounds::default()).expect("it fits");
        minstate(&loops)
    });
    isomorph(&left, &right).expect("the same behaviour");
}

struct Made {
    plant: Automaton,
    specification: Automaton,
    supervisor: Automaton,
}

fn make(model: &Model) -> Made {
    let bounds = Bounds::default();
    let plant = sync(&model.plants(), bounds).expect("it fits");
    let specification = match model.specifications().as_slice() {
        [] => understudy_supervisor::operations::allevents(plant.alphabet()),
        several => {
            let joined = sync(several, bounds).expect("it fits");
            lift(&joined, plant.alphabet())
        }
    };
    let result = supcon(&plant, &specification, bounds).expect("it fits");
    assert_eq!(result.not_lifted, []);
    assert_eq!(result.explanation, None);
    Made { plant, specification, supervisor: result.supervisor }
}

fn check(name: &str) {
    let bounds = Bounds::default();
    let model = Model::read(name);
    let made = make(&model);
    let expect = |key: &str, automaton: &Automaton| {
        let expected = model.counts(key).unwrap_or_else(|| panic!("{name} has no {key}"));
        assert_eq!(counts(automaton), expected, "{name}: {key}");
    };
    expect("plant", &made.plant);
    expect("spec_lifted", &made.specification);
    let both = meet(&[&made.plant, &made.specification], bounds).expect("it fits");
    expect("product_plant_x_specs", &both);
    expect("super", &made.supervisor);
    expect("minstate_of_super", &minstate(&made.supervisor));

    let of_tct = model.file("_SUPER");
    assert_eq!(isomorph(&made.supervisor, &of_tct).err(), None, "{name}: TCT's supervisor");
    let at_once = synthesise(&model.plants(), &model.specifications(), bounds).expect("it fits");
    assert_eq!(isomorph(&at_once.supervisor, &of_tct).err(), None, "{name}: at once");
    assert_eq!(nonconflict(&[&made.plant, &made.supervisor], bounds), Ok(None), "{name}");

    let data = condat(&made.plant, &of_tct, bounds).expect("it fits");
    let expected = &model.expected["condat"];
    assert_eq!(expected["states_with_disablement"], data.states_with_disablement(), "{name}");
    assert_eq!(expected["pairs"], data.pairs(), "{name}");
    assert_eq!(data.uncontrollable, []);
    if let Some(table) = model.expected["condat_table"].as_object() {
        let rows = data.table.iter().map(|(state, events)| {
            let events: Vec<u32> = events.iter().map(|event| event.number()).collect();
            (state.to_string(), events.into())
        });
        assert_eq!(&rows.collect::<serde_json::Map<_, _>>(), table, "{name}: condat");
    }

    let of_tct = model.file("_SIMSUP");
    for supervisor in [&made.supervisor, &model.file("_SUPER")] {
        let reduced = supreduce(&made.plant, supervisor, bounds).expect("it fits");
        assert!(reduced.state_count() <= of_tct.state_count(), "{name}: {:?}", counts(&reduced));
        assert_same_effect(&made.plant, &reduced, supervisor);
        assert_same_effect(&made.plant, &reduced, &of_tct);
    }
}

#[test]
fn small_models() {
    for name in MODELS.into_iter().filter(|&name| name != "agv") {
        check(name);
    }
}

#[test]
fn guided_vehicles() {
    check("agv");
}

/// Wherever a reduction is stopped, what there is has the same effect; the later, the smaller.
#[test]
fn a_reduction_that_is_stopped_is_right() {
    let bounds = Bounds::default();
    let model = Model::read("agv");
    let plant = sync(&model.plants(), bounds).expect("it fits");
    let supervisor = model.file("_SUPER");
    let mut sizes = vec![supervisor.state_count()];
    for questions in [1, 2, 8] {
        let mut asked = 0;
        let made = supreduce_while(&plant, &supervisor, bounds, &mut |at| {
            assert!(at.tried < at.states && at.left <= at.states && at.order <= at.orders);
            asked += 1;
            asked < questions
        });
        let made = made.expect("it fits");
        assert_eq!((made.is_complete, asked), (false, questions));
        sizes.push(made.supervisor.state_count());
        assert_same_effect(&plant, &made.supervisor, &supervisor);
    }
    let whole = supreduce_while(&plant, &supervisor, bounds, &mut |_| true).expect("it fits");
    assert!(whole.is_complete);
    let reduced = supreduce(&plant, &supervisor, bounds).expect("it fits");
    assert_eq!(whole.supervisor, reduced);
    sizes.push(reduced.state_count());
    assert!(sizes.is_sorted_by(|a, b| a >= b), "{sizes:?}");
    assert!(sizes[1] > sizes[4], "{sizes:?}");
}

#[test]
fn sizes_of_the_papers_examples() {
    for name in OF_PAPERS {
        let plant = automaton("avalanche", name);
        let expected = json("avalanche", &format!("{name}.expected.json"));
        assert_eq!(Some(counts(&plant)), counts_in(&expected, "size"), "{name}");
        assert_ne!(plant.alphabet(), &Alphabet::new([]));
    }
}
