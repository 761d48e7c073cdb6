//! Local-modular supervisors together against the monolithic one.

use understudy_supervisor::operations::{sync, trim};
use understudy_supervisor::{
    Automaton, Bounds, SymbolicBounds, Together, nonconflicting_symbolically, synthesise,
    synthesise_modularly,
};

use crate::figures::assert_same_effect;
use crate::models::{MODELS, Model};

#[test]
fn local_supervisors_are_the_monolithic_one_together() {
    let bounds = Bounds::default();
    for name in MODELS {
        let model = Model::read(name);
        let modular = synthesise_modularly(&model.plants(), &model.specifications(), bounds)
            .expect("it fits");
        let local: Vec<&Automaton> =
            modular.local.iter().map(|one| &one.result.supervisor).collect();
        let symbolic = nonconflicting_symbolically(&local, SymbolicBounds::default());
        let nonconflicting = modular.together == Together::Nonconflicting;
        assert_eq!(symbolic, Ok(nonconflicting), "{name}");
        let joint = if nonconflicting {
            sync(&local, bounds).expect("it fits")
        } else {
            let coordinator = synthesise(&local, &[], bounds);
            coordinator.expect("it fits").supervisor
        };
        let whole = synthesise(&model.plants(), &model.specifications(), bounds).expect("it fits");
        let plant = sync(&model.plants(), bounds).expect("it fits");
        assert_same_effect(&plant, &trim(&joint), &whole.supervisor);
    }
}
