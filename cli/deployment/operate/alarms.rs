//! Acknowledging and shelving alarms of a run. These actions are recorded in its journal and reach no member.

use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::json;
use understudy_bus::RefusedOrder;
use understudy_journal::{AlarmRefusal, OperatorAction, Refusal, Shelving, Unshelving, find_alarm};
use understudy_view::{Alarm, Bounds, Run};

use super::{Arguments, What, refused, written};
use crate::answer::Answer;

/// Does what the command says with the alarm `--name`.
pub(super) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let run = written(arguments)?;
    let actions = match arguments.what {
        What::ShelveAlarm => vec![OperatorAction::Shelve(Shelving {
            name: arguments.name.clone(),
            seconds: u64::from(arguments.seconds),
            owner: crate::inspect::top::owner(),
            reason: arguments.reason.clone(),
            at_unix_s: unix_seconds(),
        })],
        What::UnshelveAlarm => vec![OperatorAction::Unshelve(Unshelving {
            name: arguments.name.clone(),
            owner: crate::inspect::top::owner(),
            reason: arguments.reason.clone(),
            at_unix_s: unix_seconds(),
        })],
        _ => acknowledgements(arguments, &run)?,
    };
    for action in &actions {
        let checked = action.alarm_event(run.cluster().alarms());
        checked.map_err(|refusal| {
            let order = action.refused(&refusal);
            order.into_iter().for_each(|order| run.commander().refused_and_wait(order));
            refused(&refusal)
        })?;
        let done = run.commander().act_and_wait(action);
        done.map_err(|refusal| refused(&refusal))?;
    }
    let word = arguments.word();
    let text = format!("{word} {}: done", arguments.name);
    let result = json!({ "run": run.path(), "name": arguments.name, "done": word });
    Ok(Answer::done(text, result).and_next(&[&"top", &run.path()]))
}

/// One for each alarm of that name that is not acknowledged: of a signal, or of a member.
fn acknowledgements(arguments: &Arguments, run: &Run) -> Result<Vec<OperatorAction>, Answer> {
    let name = &arguments.name;
    let model = run.read(Bounds::default())?;
    let is_open = |alarm: &&Alarm| {
        alarm.name == *name && alarm.acknowledged_by.is_none() && alarm.repeated_in.is_none()
    };
    let owner = crate::inspect::top::owner();
    let open = model.alarms().filter(is_open);
    let actions: Vec<OperatorAction> = open
        .map(|alarm| {
            OperatorAction::Acknowledge(alarm.acknowledgement(owner.clone(), unix_seconds()))
        })
        .collect();
    if actions.is_empty() {
        let is_member = run.cluster().member(name).is_some();
        let refusal = match find_alarm(run.cluster().alarms(), name) {
            Err(unknown) if !is_member => unknown,
            _ => AlarmRefusal::NotOpen(name.clone()),
        };
        let order = RefusedOrder::new(&arguments.word(), name, &owner, &refusal);
        run.commander().refused_and_wait(order);
        return Err(refused(&Refusal::Alarm(refusal)));
    }
    Ok(actions)
}

/// For the journal.
fn unix_seconds() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_secs())
}
