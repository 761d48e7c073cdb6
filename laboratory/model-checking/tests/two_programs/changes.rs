//! An online change of one program while something else happens: no output is wrong, and one lost station costs no cycle of the change.

use understudy_cycle::Turns;
use understudy_model_checking::{Budget, Changed, Model, Start};
use understudy_remote_io::Event;
use understudy_simulator::{ChangeStep, Record};
use understudy_wire::Member;

use crate::cell::{parts, repointing};

use crate::starts::{REMOTE_IOS, STATIONS, remote_io, station};
use crate::{NONE, ONE, check_from, check_parts};

fn everybody() -> Vec<Member> {
    [&STATIONS[..], &REMOTE_IOS[..]].concat()
}

fn changing(prepared: &[Member], steps: &[(Member, ChangeStep)]) -> Start {
    let change = Changed { prepared: prepared.to_vec(), steps: steps.to_vec() };
    Start { change, ..Start::default() }
}

const SWITCH: (Member, ChangeStep) = (remote_io(0), ChangeStep::Switch);

/// How often a program changes in a run to which nothing else happens.
fn changes_from(start: Start) -> u32 {
    let model = Model::new(parts(1, Turns::Token), start, ONE).expect("it comes into step");
    let mut changes = 0;
    model.replay(&model.faults(&[])).go_to(8, 0.0, &mut |_, _, _, record| {
        changes += u32::from(matches!(record, Record::RemoteIo(Event::ProgramChanged { .. })));
    });
    changes
}

#[test]
fn the_program_changes_where_everybody_has_loaded_the_change() {
    assert_eq!(changes_from(changing(&everybody(), &[SWITCH])), 1);
    let others: Vec<Member> =
        everybody().into_iter().filter(|member| *member != station(2)).collect();
    assert_eq!(changes_from(changing(&others, &[SWITCH])), 0);
}

#[test]
fn one_of_each_while_a_program_changes() {
    check_from(changing(&everybody(), &[SWITCH]), 1, Budget { cycles: 3, ..ONE }, 15_885);
}

/// The points of the program change: what is held then, and what is fail-safe, is at the new places.
#[test]
fn one_of_each_while_points_change() {
    let accept = (remote_io(0), ChangeStep::Accept);
    for (steps, states) in [(&[SWITCH][..], 15_885), (&[SWITCH, accept], 16_439)] {
        let start = changing(&everybody(), steps);
        check_parts(repointing(), start, Budget { cycles: 3, ..ONE }, states);
    }
}

#[test]
fn two_crashes_while_points_change() {
    let budget = Budget { crashes: 2, total: 2, cycles: 1, ..NONE };
    let start = changing(&everybody(), &[SWITCH]);
    check_parts(repointing(), start, budget, 24_979);
}

#[test]
fn a_crash_and_a_loss_while_a_program_changes() {
    let budget = Budget { losses: 1, crashes: 1, total: 2, cycles: 2, ..NONE };
    check_from(changing(&everybody(), &[SWITCH]), 1, budget, 91_810);
}

/// The switch is refused, since the understudy would be silent.
#[test]
fn one_of_each_where_the_understudy_has_not_loaded_the_change() {
    let others: Vec<Member> =
        everybody().into_iter().filter(|member| *member != station(2)).collect();
    check_from(changing(&others, &[SWITCH]), 1, Budget { cycles: 2, ..ONE }, 6_897);
}

/// Some have accepted, others have not, and none knows of the others.
#[test]
fn one_of_each_while_some_have_accepted() {
    let accepted = [station(0), remote_io(1)].map(|member| (member, ChangeStep::Accept));
    let steps = [&[SWITCH], &accepted[..]].concat();
    check_from(changing(&everybody(), &steps), 1, Budget { cycles: 3, ..ONE }, 16_637);
}

/// Nobody proves the program any more, in a remote I/O that has accepted and in one that has not: it falls back by the settings of its own configuration.
#[test]
fn two_crashes_while_settings_change() {
    let budget = Budget { crashes: 2, total: 2, cycles: 1, ..NONE };
    for steps in [vec![SWITCH], vec![SWITCH, (remote_io(0), ChangeStep::Accept)]] {
        check_from(changing(&everybody(), &steps), 1, budget, 24_979);
    }
}
