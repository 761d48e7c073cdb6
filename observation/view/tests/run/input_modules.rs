//! The alarm of inputs that two modules read: it names each input, tells when a module is excluded, and ends with it or with the author that raised it.

use std::sync::Arc;

use understudy_journal::{Happening, Record, moment};
use understudy_remote_io::Event;
use understudy_view::{Bounds, Model};
use understudy_wire::{Member, Part, ProgramId};

use crate::support::{example, records, scenario};

const FIRST: Member = Member::RemoteIo(ProgramId(0));
const TWIN: Member = Member::Twin(ProgramId(0));

#[test]
fn the_alarm_names_each_input_whose_modules_are_in_doubt() {
    let cluster = example("twin-remote-io");
    let quiet = scenario(&cluster, "title = \"quiet\"\ncycles = 50\n");
    let records = records(&cluster, &quiet, 1);
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    records.iter().for_each(|record| model.note(record));
    let of = |member| {
        let mut of_member = records.iter().rev();
        of_member.find(|record| record.member == Some(member)).expect("it reports").clone()
    };
    let (first, twin) = (of(FIRST), of(TWIN));
    let moment = moment(&first.event).expect("a cycle");
    let mut report = |by: &Record, event| {
        model.note(&Record { event: Happening::RemoteIo(event), ..by.clone() });
        let open = model.alarms().filter(|it| it.alarm == "input-modules" && it.over.is_none());
        open.map(|alarm| (alarm.name.clone(), alarm.text.clone())).collect::<Vec<_>>()
    };
    let differ = |input| Event::InputsDiffer { moment, input };
    let excluded = |input, at| Event::InputExcluded { moment, input, at };
    let agree = |input| Event::InputsAgree { moment, input };
    let check = |alarms: Vec<(String, String)>, name: &str, expected: &[&str]| {
        let [(of, text)] = &alarms[..] else { panic!("{alarms:?}") };
        assert_eq!((of.as_str(), text.split("; ").count()), (name, expected.len()), "{text}");
        assert!(expected.iter().all(|part| text.contains(part)), "{text}");
    };
    check(report(&first, differ(1)), "robot-io", &["differ at input arm_left"]);
    let both = ["differ at input part_present", "differ at input arm_left"];
    check(report(&first, differ(0)), "robot-io", &both);
    let expected = ["differ at input part_present", "arm_left at robot-io-2 is excluded"];
    check(report(&first, excluded(1, TWIN)), "robot-io", &expected);
    check(report(&first, agree(0)), "robot-io", &expected[1..]);
    // The other one becomes the author: it tells of what stays excluded.
    let author = Event::PartChanged { moment, part: Part::Author };
    assert_eq!(report(&twin, author), []);
    check(report(&twin, excluded(1, TWIN)), "robot-io-2", &expected[1..]);
    assert_eq!(report(&twin, agree(1)), []);
}
