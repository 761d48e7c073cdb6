//! The reference models as ladders: what their findings are, and that their ladders are proved.

mod reference_models;

use reference_models::{Model, OF_PAPERS, automaton, json};
use understudy_ladder::check;
use understudy_supervisor::Label;
use understudy_supervisor::ladder::{InputOutputMap, Mode, Modules, avalanche_events, convert};
use understudy_supervisor::proof::{FindingKind, Proof, ProofSettings, Verdict, findings, prove};

const MODELS: [&str; 4] = ["small_factory", "transfer_line", "guideway", "dining5"];

fn numbers(labels: &[Label]) -> Vec<u64> {
    labels.iter().map(|label| u64::from(label.number())).collect()
}

fn expected_numbers(value: &serde_json::Value) -> Vec<u64> {
    let list = value.as_array().expect("a list");
    list.iter().map(|number| number.as_u64().expect("a number")).collect()
}

#[test]
fn avalanche_events_are_those_of_the_reference() {
    for name in OF_PAPERS {
        let expected = json("avalanche", &format!("{name}.expected.json"));
        let found = avalanche_events(&automaton("avalanche", name));
        assert_eq!(numbers(&found), expected_numbers(&expected["avalanche_events"]), "{name}");
    }
    for model in MODELS.into_iter().chain(["agv", "line4_3"]) {
        let expected = json(model, "expected.json");
        for (name, key) in [("_SUPER", "avalanche_super"), ("_SIMSUP", "avalanche_reduced")] {
            let found = avalanche_events(&automaton(model, name));
            assert_eq!(numbers(&found), expected_numbers(&expected[key]), "{model} {name}");
        }
    }
}

#[test]
fn findings_are_those_of_the_reference() {
    for model in MODELS.into_iter().chain(["agv", "line4_3"]) {
        let expected = json(model, "expected.json");
        let supervisors = [automaton(model, "_SUPER")];
        let plants = Model::read(model).plants;
        let modules = Modules { supervisors: &supervisors, plants: &plants };
        let found = findings(&modules, None).expect("small enough");
        let has = |kind| found.iter().any(|finding| finding.kind == kind);
        assert!(!has(FindingKind::Controllability), "{model}");
        assert_eq!(!has(FindingKind::Blocking), expected["nonblocking"], "{model}");
        assert_eq!(!has(FindingKind::Choice), expected["confluent"], "{model}");
        assert_eq!(
            !has(FindingKind::BlockingUnderControl),
            expected["nonblocking_under_control"],
            "{model}"
        );
        let longest_run_of_commands = &expected["bounded_response_unc_ctrl"][1];
        assert_eq!(has(FindingKind::Response), longest_run_of_commands.is_null(), "{model}");
    }
}

fn proved(modules: &Modules, mode: Mode) -> Proof {
    let map = InputOutputMap::direct("reference", &modules.alphabet());
    let conversion = convert(modules, &map, mode).expect("a direct map fits");
    let errors = check(&conversion.program);
    assert!(!understudy_text::has_errors(&errors), "{errors:?}");
    let settings = ProofSettings { mode, ..ProofSettings::default() };
    match prove(&conversion.program, modules, &map, &conversion.correspondence, settings) {
        Ok(Verdict::Proved(proof)) => proof,
        Ok(Verdict::Refuted(counterexample)) => {
            panic!("{}\n{counterexample}", understudy_ladder::print(&conversion.program))
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn ladders_of_the_papers_examples_are_proved() {
    for name in OF_PAPERS {
        let supervisor = automaton("avalanche", name);
        proved(&Modules::supervisor(&supervisor), Mode::Requested);
        proved(&Modules::supervisor(&supervisor), Mode::Automatic);
    }
}

#[test]
fn ladders_of_supervisors_are_proved() {
    for model in MODELS {
        let supervisor = automaton(model, "_SUPER");
        let modules = Modules::supervisor(&supervisor);
        let proof = proved(&modules, Mode::Requested);
        assert_eq!(proof.joint_states, supervisor.state_count(), "{model}");
        assert_eq!(proof.events.len(), supervisor.alphabet().len(), "{model}");
        proved(&modules, Mode::Automatic);
    }
}

/// The reduced supervisor does not know the state of its plant; with the plants beside it, it has the same closed loop.
#[test]
fn ladders_of_reduced_supervisors_with_their_plants_are_proved() {
    for model in MODELS {
        let supervisors = [automaton(model, "_SIMSUP")];
        let plants = Model::read(model).plants;
        let modules = Modules { supervisors: &supervisors, plants: &plants };
        let proof = proved(&modules, Mode::Requested);
        assert_eq!(proof.joint_states, automaton(model, "_SUPER").state_count(), "{model}");
    }
}
