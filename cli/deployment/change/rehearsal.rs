//! `understudy change … rehearse`: what the new programs would have done in a run.

use understudy_cluster::{ChangeTexts, Cluster, Way, changed_points};
use understudy_view::{Bounds, Following, Model, Rehearsal, Run};

use super::{Arguments, pause};
use crate::answer::{Answer, Status};

/// Cycles of which states are kept in addition to those that are asked for: some are not complete.
const MORE: usize = 64;

/// Rehearses over the newest recorded cycles of a run, or over those that come.
pub(super) fn rehearse(
    arguments: &Arguments,
    run: Option<&Run>,
    (before, after): (&Cluster, &Cluster),
    texts: &ChangeTexts,
) -> Result<Answer, Answer> {
    let Some(run) = run else {
        let message = "a rehearsal needs the directory of a run in place of the first cluster file, such as `runs/latest`";
        return Err(Answer::failed(Status::BadInput, "U0614", message.to_owned()));
    };
    let change = texts
        .load(before)
        .map_err(|error| Answer::failed(Status::BadInput, "U0631", error.to_string()))?;
    let rehearsals = change.programs.into_iter().map(|changed| {
        let controller = &before.controllers()[changed.program.index()];
        let points = (controller.interface.inputs.clone(), controller.interface.outputs.clone());
        let program = changed.program;
        let points_of = changed_points(before, after, program, Way::There);
        let lone = points_of.iter().filter(|point| point.is_lone_output());
        let lone = lone.map(|point| point.name.clone()).collect();
        (program, Rehearsal::new(&controller.name, changed, (points, lone), arguments.renew))
    });
    let mut rehearsals: Vec<_> = rehearsals.collect();
    let cycles = usize::try_from(arguments.cycles).unwrap_or(usize::MAX);
    let bounds = Bounds { cycles: cycles.saturating_add(MORE), ..Bounds::default() };
    let mut take = |model: &Model, newest: usize| {
        for (program, rehearsal) in &mut rehearsals {
            if let Some(history) = model.history(*program) {
                let steps = history.steps();
                rehearsal.take(steps.iter().skip(steps.len().saturating_sub(newest)));
            }
        }
        rehearsals.iter().all(|(_, it)| it.found().cycles >= arguments.cycles)
    };
    if arguments.live {
        let (mut model, mut following) = Following::of(run, bounds);
        following.poll(&mut |found| model.take_found(found));
        // What is there already is not rehearsed but for the newest cycle, whose state the new program takes over.
        take(&model, 1);
        while !run.is_finished() {
            following.poll(&mut |found| model.take_found(found));
            if take(&model, usize::MAX) {
                break;
            }
            pause();
        }
    } else {
        take(&run.read(bounds)?, cycles);
    }
    let found: Vec<_> = rehearsals.iter().map(|(_, rehearsal)| rehearsal.found()).collect();
    let is_equal = found.iter().all(|found| found.differing == 0);
    let text: String = found.iter().map(|found| found.to_text()).collect();
    if found.iter().any(|found| found.cycles == 0) {
        let message = "the run has no cycle in which the state of a program that changes is known";
        return Err(Answer::failed(Status::BadInput, "U0614", message.to_owned()));
    }
    if let Some(of) = found.iter().find(|found| found.compared.is_empty()) {
        let message = format!(
            "no output of `{}` is compared: the old program and the new one have none in common",
            of.program
        );
        return Err(Answer::failed(Status::BadInput, "U0614", message));
    }
    let answer = Answer::done(text.trim_end(), serde_json::json!({ "rehearsed": found }));
    Ok(answer.with_status(if is_equal { Status::Done } else { Status::Failed }))
}
