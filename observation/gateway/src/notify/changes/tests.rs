use std::collections::BTreeMap;
use std::sync::Arc;

use understudy_cycle::Mode;
use understudy_journal::{Members, Record, RunEvent};
use understudy_scenarios::{read, simulate};
use understudy_view::{Bounds, Model};

use super::*;
use crate::followed;

/// An event with the number and the text of its alarm.
type Told = (Change, u64, String);

/// The changes of a run of the press cell whose alarms are all acknowledged in some cycles, looked at once in `every` records.
fn told(steps: &str, acknowledged_in: &[i64], every: usize, first: i64) -> Vec<Told> {
    let cell = understudy_testing::press_cell(Mode::Full);
    let text = format!("title = \"changes\"\ncycles = 600\n{steps}");
    let scenario = read("scenario.toml", &text, Some(&Members::of(&cell)));
    let scenario = scenario.scenario.expect("a scenario");
    let mut records = Vec::new();
    simulate(&cell, &scenario, 1, &mut |record| records.push(record.clone())).expect("it runs");

    let mut model = Model::new(Arc::new(cell), Bounds::default());
    let mut changes = Changes::new("press-cell");
    let mut waits = acknowledged_in.iter().peekable();
    let mut told = Vec::new();
    let look = |model: &Model, changes: &mut Changes, told: &mut Vec<Told>| {
        let found = changes.since(&followed::alarms(model, i64::MAX), &[]);
        let found = found.into_iter();
        told.extend(found.map(|found| (found.event, found.alarm.number, found.alarm.text)));
    };
    let mut countdown = 0;
    for record in &records {
        model.note(record);
        if waits.next_if(|cycle| model.newest() >= Some(**cycle)).is_some() {
            let open: Vec<Alarm> =
                model.alarms().filter(|alarm| alarm.is_open()).cloned().collect();
            for alarm in open {
                let seen = alarm.acknowledgement("anna".to_owned(), 0);
                model.note(&Record::of_run(record.at_ns, RunEvent::Acknowledged(seen)));
            }
        }
        if model.newest() < Some(first) {
            continue;
        }
        if countdown == 0 {
            look(&model, &mut changes, &mut told);
            countdown = every;
        }
        countdown -= 1;
    }
    look(&model, &mut changes, &mut told);
    told
}

fn step(at: u32, action: &str, station: &str) -> String {
    format!("[[step]]\nat = {at}\naction = \"{action}\"\nstation = \"{station}\"\n")
}

fn events(told: &[Told]) -> Vec<(Change, u64)> {
    told.iter().map(|(event, number, _)| (*event, *number)).collect()
}

#[test]
fn an_alarm_is_told_when_it_comes_is_acknowledged_and_goes() {
    use Change::{Acknowledged, Raised, Returned};
    let failed = step(100, "crash", "understudy") + &step(300, "restart", "understudy");
    let told = |acknowledged_in: &[i64]| events(&told(&failed, acknowledged_in, 1, 0));
    assert_eq!(told(&[]), [(Raised, 1), (Returned, 1)]);
    assert_eq!(told(&[200]), [(Raised, 1), (Acknowledged, 1), (Returned, 1)]);
    assert_eq!(told(&[500]), [(Raised, 1), (Returned, 1), (Acknowledged, 1)]);
}

/// A program more asks again: the cause lasts, so it has not returned.
#[test]
fn a_longer_list_is_raised_again_and_has_not_returned() {
    use Change::{Acknowledged, Raised};
    let cut = "[[step]]\nat = 50\naction = \"cut\"\nstation = \"understudy\"\nto = \"robot-io\"\n";
    let told = told(&(cut.to_owned() + &step(200, "crash", "understudy")), &[100], 1, 0);
    assert_eq!(events(&told), [(Raised, 1), (Acknowledged, 1), (Raised, 2)]);
    assert!(told[2].2.contains("press: not protected, because understudy is killed"), "{told:?}");
}

/// However seldom the alarms are looked at, each has the same events in the same order.
#[test]
fn no_event_is_lost_between_two_looks() {
    let steps = step(50, "crash", "understudy")
        + &step(150, "crash", "robot")
        + &step(250, "restart", "robot")
        + &step(300, "restart", "understudy")
        + &step(450, "crash", "press");
    let by_alarm = |every| {
        let mut by_alarm: BTreeMap<u64, Vec<Change>> = BTreeMap::new();
        for (event, number, _) in told(&steps, &[100, 400], every, 0) {
            by_alarm.entry(number).or_default().push(event);
        }
        // Whether it was acknowledged or over first is not known of two in one look.
        by_alarm.values_mut().for_each(|events| events.sort_by_key(|event| event.word()));
        by_alarm
    };
    let fine = by_alarm(1);
    assert!(fine.len() > 3, "{fine:?}");
    for every in [7, 100, 5000] {
        assert_eq!(by_alarm(every), fine, "{every}");
    }
}

/// A gateway that begins later tells of what is open, and of nothing that is over and acknowledged.
#[test]
fn what_is_open_when_the_gateway_begins_is_raised() {
    use Change::{Acknowledged, Raised};
    let failed = step(50, "crash", "understudy") + &step(150, "restart", "understudy");
    let later = failed + &step(300, "crash", "robot");
    let told = told(&later, &[100, 350], 1, 400);
    assert_eq!(events(&told), [(Raised, 2), (Acknowledged, 2)]);
    assert_eq!(told[0].2, "robot: not protected, because robot is killed");
}
