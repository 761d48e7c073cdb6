//! Raising, growing, ending and acknowledging of alarms.

use super::*;

#[test]
fn an_alarm_lasts_until_it_is_over_and_seen() {
    let mut alarms = Alarms::default();
    let subject = || ("press-io".to_owned(), "fail-safe");
    alarms.raise(subject(), 7, "no provable output".to_owned());
    alarms.raise(subject(), 8, "still".to_owned());
    assert_eq!(alarms.iter().count(), 1);
    alarms.over(&subject(), 9);
    assert!(alarms.iter().all(Alarm::is_open));
    let seen = |alarms: &Alarms, by: &str| {
        let alarm = alarms.iter().next().expect("one");
        alarm.acknowledgement(by.to_owned(), 0)
    };
    let other = Acknowledgement { raised_ns: 1, ..seen(&alarms, "anna") };
    alarms.acknowledged(&other, 10);
    assert!(alarms.iter().all(Alarm::is_open), "another one");
    alarms.acknowledged(&seen(&alarms, "anna"), 10);
    alarms.acknowledged(&seen(&alarms, "bert"), 11);
    alarms.shift(100);
    let first = alarms.iter().next().expect("one");
    assert_eq!(first.acknowledged_by.as_deref(), Some("anna"));
    assert_eq!(first.acknowledged_in, Some(110));
    assert!(!alarms.iter().any(Alarm::is_open));
    alarms.raise(subject(), 12, "again".to_owned());
    assert_eq!(alarms.iter().filter(|alarm| alarm.is_open()).count(), 1);
}

#[test]
fn an_alarm_that_is_replaced_asks_again_where_something_is_added() {
    for (is_acknowledged, asks_again) in
        [(false, false), (false, true), (true, false), (true, true)]
    {
        let mut alarms = Alarms::default();
        let subject = || ("press-io".to_owned(), "forced");
        alarms.replace(subject(), 3, "one".to_owned(), true);
        if is_acknowledged {
            let seen = alarms.iter().next().expect("one").acknowledgement("anna".to_owned(), 0);
            alarms.acknowledged(&seen, 4);
        }
        alarms.replace(subject(), 5, "other".to_owned(), asks_again);
        let open: Vec<&Alarm> = alarms.iter().filter(|alarm| alarm.is_open()).collect();
        let [open] = open[..] else { panic!("{open:?}") };
        assert_eq!((open.text.as_str(), open.over), ("other", None));
        let acknowledged = is_acknowledged && !asks_again;
        assert_eq!(open.acknowledged_by.is_some(), acknowledged);
    }
}

#[test]
fn the_number_of_alarms_is_bounded() {
    let mut alarms = Alarms::default();
    for number in 0..5000 {
        alarms.raise((format!("{number}"), "fail-safe"), number, String::new());
    }
    assert_eq!(alarms.iter().count(), MOST);
    assert_eq!(alarms.lasting.len(), MOST);
}

fn plant_of(programs: u8) -> Alarms {
    let names = (0..programs).map(|program| format!("unit{program}"));
    Alarms { programs: names.collect(), ..Alarms::default() }
}

#[test]
fn a_cause_that_concerns_all_programs_is_one_alarm_in_any_order() {
    let subject = ("understudy".to_owned(), UNPROTECTED);
    let cause = || "understudy is killed".to_owned();
    let orders: [Vec<u8>; 2] = [(0..24).collect(), (0..24).rev().collect()];
    for order in orders {
        let mut alarms = plant_of(24);
        for (count, program) in order.iter().enumerate() {
            alarms.concerns(&subject, Some(ProgramId(*program)), 7, cause());
            let alarm = alarms.iter().next().expect("one");
            assert_eq!((alarms.iter().count(), alarm.programs.len()), (1, count + 1));
        }
        let alarm = alarms.iter().next().expect("one");
        assert_eq!(alarm.text, "all 24 programs: not protected, because understudy is killed");
        for program in 0..24 {
            alarms.concerns_no_more(&subject, Some(ProgramId(program)), 9);
            let alarm = alarms.iter().next().expect("one");
            assert_eq!(alarm.over, (program == 23).then_some(9));
        }
        let alarm = alarms.iter().next().expect("one");
        assert_eq!(alarm.programs.len(), 24, "of one that is over all are named");
    }
}

#[test]
fn a_long_list_is_shortened_in_the_text_alone() {
    let mut alarms = plant_of(24);
    let subject = ("understudy".to_owned(), UNPROTECTED);
    for program in 0..10 {
        alarms.concerns(&subject, Some(ProgramId(program)), 7, "it is killed".to_owned());
    }
    let alarm = alarms.iter().next().expect("one");
    assert!(alarm.text.starts_with("unit0, unit1, "), "{}", alarm.text);
    assert!(alarm.text.contains("unit7 and 2 more: not protected"), "{}", alarm.text);
    assert_eq!(alarm.programs.len(), 10);
}

/// What was acknowledged before a further program was concerned is not acknowledged after it, also by a late record of it.
#[test]
fn an_acknowledgement_is_of_the_effects_that_were_seen() {
    let subject = ("understudy".to_owned(), UNPROTECTED);
    let concern = |alarms: &mut Alarms, program: u8, at_ns: u64| {
        alarms.now_ns = at_ns;
        alarms.concerns(&subject, Some(ProgramId(program)), 7, "it is killed".to_owned());
    };
    let mut alarms = plant_of(3);
    concern(&mut alarms, 0, 10);
    let seen = alarms.iter().next().expect("one").acknowledgement("anna".to_owned(), 0);
    concern(&mut alarms, 1, 20);
    alarms.acknowledged(&seen, 8);
    assert!(alarms.iter().all(|alarm| alarm.acknowledged_by.is_none()), "one of two was seen");
    let seen = alarms.iter().next().expect("one").acknowledgement("anna".to_owned(), 0);
    alarms.acknowledged(&seen, 8);
    assert_eq!(alarms.iter().next().map(Alarm::state), Some(AlarmState::Acknowledged));
    concern(&mut alarms, 1, 30);
    assert_eq!(alarms.iter().count(), 1, "nothing new");
    concern(&mut alarms, 2, 40);
    let open: Vec<&Alarm> = alarms.iter().filter(|alarm| alarm.is_open()).collect();
    let [open] = open[..] else { panic!("{open:?}") };
    assert_eq!((open.programs.len(), open.state()), (3, AlarmState::Unacknowledged));
    // The same alarm again, after its end: it is another one.
    alarms.over(&subject, 50);
    concern(&mut alarms, 0, 60);
    let seen = alarms.iter().next_back().expect("one").acknowledgement("anna".to_owned(), 0);
    alarms.acknowledged(&seen, 61);
    let unseen = alarms.iter().filter(|alarm| alarm.acknowledged_by.is_none());
    assert_eq!(unseen.count(), 1, "the one before was not seen");
}

/// A replay shows the text of its time, and what is over is told as the past.
#[test]
fn the_past_of_an_alarm_has_the_text_of_its_time() {
    let mut alarms = Alarms::default();
    let subject = ("network 2".to_owned(), "network-fault");
    alarms.raise_or_retell(subject.clone(), 10, "lost at press".to_owned());
    alarms.raise_or_retell(subject.clone(), 20, "lost at press and robot".to_owned());
    alarms.raise_or_retell(subject.clone(), 25, "lost at press and robot".to_owned());
    alarms.over_with(&subject, 30, "was not in order; now it is".to_owned());
    alarms.over_with(&subject, 40, "it does not last".to_owned());
    alarms.shift(100);
    let alarm = alarms.iter().next().expect("one");
    let text = |cycle| alarm.at(cycle).map(|then| then.text);
    assert_eq!(text(109), None);
    assert_eq!(text(110).as_deref(), Some("lost at press"));
    assert_eq!(text(120).as_deref(), Some("lost at press and robot"));
    assert_eq!(text(130).as_deref(), Some("was not in order; now it is"));
    assert_eq!(alarm.text, "was not in order; now it is");
    assert_eq!(alarms.iter().count(), 1);
}
