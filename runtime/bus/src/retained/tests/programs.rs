//! The texts of programs next to what is kept of them.

use super::*;

fn program(hash: u64) -> RetainedProgram {
    RetainedProgram {
        hash: understudy_wire::ProgramHash(hash),
        file: "robot.st".to_owned(),
        period: 10_000_000,
        text: format!("PROGRAM p{hash} END_PROGRAM"),
        inputs: Vec::new(),
        renamed: Vec::new(),
    }
}

/// The values of the program before cannot come back once the next one has kept its own: not by what still waited for the disk, and not by its text.
#[test]
fn what_the_program_before_has_left_does_not_come_back() {
    let folder = Folder::new("retained-changed");
    let of = |hash: u64| {
        RetainedFiles::new(&folder, "robot.robot".to_owned()).with_program(program(hash))
    };
    let state_of = |hash: u64, cycle: u64| match state(cycle) {
        Retained::State(state) => {
            Retained::State(RetainedState { hash: understudy_wire::ProgramHash(hash), ..state })
        }
        _ => unreachable!("a state"),
    };
    let run = |hash: u64, cycles: std::ops::Range<u64>| {
        let retainer = Retainer::start(vec![(Some(PROGRAM), of(hash))]).expect("threads");
        for cycle in cycles {
            retainer.keep(state_of(hash, cycle));
            retainer.keep(step(cycle + 1));
        }
        retainer.finish();
    };
    let hashes = || {
        let (runs, _) = of(0).runs(Some(OWNER));
        let newest = runs.iter().max_by_key(|run| run.state.number).map(|run| run.state.hash.0);
        (newest, [8, 9].map(|hash| of(0).program(understudy_wire::ProgramHash(hash)).is_ok()))
    };
    run(8, 1..20);
    assert_eq!(hashes(), (Some(8), [true, false]));
    assert_eq!(of(0).program(program(8).hash), Ok(program(8)));
    run(9, 20..21);
    // The other file is still of the program before, and older.
    assert_eq!(hashes(), (Some(9), [true, true]));
    run(9, 21..40);
    run(9, 40..41);
    assert_eq!(hashes(), (Some(9), [false, true]));
    let (runs, _) = of(0).runs(Some(OWNER));
    assert!(runs.iter().all(|run| run.state.hash.0 == 9));
}

/// After an online change the text of the new program is there with the first record of it, also where that continues a file, and that of the old one as long
/// as a record is of it.
#[test]
fn the_text_of_a_program_that_an_online_change_brought_is_kept() {
    let folder = Folder::new("retained-online");
    let loaded = LoadedPrograms::default();
    let inputs = vec!["speed".to_owned()];
    let own = RetainedProgram { inputs: inputs.clone(), ..program(8) };
    let files = RetainedFiles::new(&folder, "robot.robot".to_owned()).with_program(own);
    let files = files.with_loaded(loaded.clone());
    let state_of = |hash: u64, cycle: u64| match state(cycle) {
        Retained::State(state) => {
            Retained::State(RetainedState { hash: understudy_wire::ProgramHash(hash), ..state })
        }
        _ => unreachable!("a state"),
    };
    let retainer = Retainer::start(vec![(Some(PROGRAM), files.clone())]).expect("threads");
    loaded.are(vec![program(8), program(9)]);
    let text = |hash: u64| files.program(understudy_wire::ProgramHash(hash));
    retainer.keep(state_of(8, 1));
    // It may be written behind the first one, which may not be on the disk yet.
    retainer.keep(state_of(9, 2));
    retainer.finish();
    assert_eq!(text(9), Ok(RetainedProgram { inputs, ..program(9) }));
    assert!(text(8).is_ok());
    let (runs, _) = files.runs(Some(OWNER));
    assert!(runs.iter().any(|run| run.state.hash.0 == 9));
}

/// A text that is longer than one that is kept is reported; the member runs.
#[test]
fn a_program_that_is_too_long_is_reported() {
    let folder = Folder::new("retained-long");
    let text = "x".repeat(understudy_wire::MAXIMUM_KEPT_TEXT_BYTES + 1);
    let long = RetainedProgram { text, ..program(8) };
    let files = RetainedFiles::new(&folder, "robot.robot".to_owned()).with_program(long);
    let mut retainer = Retainer::start(vec![(Some(PROGRAM), files)]).expect("threads");
    let reason = changed(&mut retainer, 1).expect("a reason");
    assert!(reason.contains("the text of the program has"), "{reason}");
    retainer.finish();
}
