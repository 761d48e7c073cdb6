//! An online change that gives points other names: values of operators, and alarms of the cluster file, go with the declared pairs.

use std::sync::Arc;

use understudy_cluster::{ChangeTexts, Cluster, read};
use understudy_journal::Happening;
use understudy_remote_io::Event;
use understudy_simulator::{Action, ChangeStep, Fault};
use understudy_view::{Bounds, Model};
use understudy_wire::{Image, Member, PointValue, ProgramId, StationId};

use crate::changed::records_of;

const OLD: &str = "PROGRAM counter
  VAR_INPUT step : INT; END_VAR
  VAR_OUTPUT shown : DINT; END_VAR
  VAR count : DINT; END_VAR
  count := count + step;
  shown := count;
END_PROGRAM";

/// `step` is `stride`, `shown` is `level`, and both have other places.
const NEW: &str = "PROGRAM counter
  VAR_INPUT more : INT; stride : INT; END_VAR
  VAR_OUTPUT extra : LREAL; level : DINT; END_VAR
  VAR count : DINT; END_VAR
  count := count + stride;
  level := count;
END_PROGRAM";

const ALARM: &str = "[[alarm]]
name = \"many\"
signal = \"counter.shown\"
above = 100
text = \"many\"
";

const REMOTE_IO: Member = Member::RemoteIo(ProgramId(0));

fn cluster(program: &str, renamed: &str, input: &str, rest: &str) -> Cluster {
    let text = format!(
        "[cluster]\nname = \"renamed\"\nsecurity = \"off\"\n[[controller]]\nname = \"counter\"\nladder = \"counter.st\"\n{renamed}\n\
         [[remote_io]]\ncontroller = \"counter\"\ninputs.{input} = {{ operator = \"setpoint\", low = 0, high = 9, initial = 1 }}\n{rest}"
    );
    let loaded = read("cluster.toml", &text, &mut |_| Ok(program.to_owned()));
    loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
}

fn number(image: &Image, first: usize, count: usize) -> i64 {
    (0..count).map(|bit| i64::from(image.get(first + bit)) << bit).sum()
}

/// The alarm is raised before the switch or after it, and follows its point there, also where the remote I/O starts again, and where a second change adds to
/// the first one; the value that the operator has written goes on.
#[test]
fn alarms_and_written_values_go_with_the_declared_pairs() {
    let old = cluster(OLD, "", "step", ALARM);
    let pairs = "renamed = { step = \"stride\", shown = \"level\" }";
    let new = cluster(NEW, pairs, "stride", "");
    let texts = ChangeTexts::between(&old, &new).expect("an online change");
    let version = new.controllers()[0].hash;
    for (written, restarts) in [(15, false), (45, false), (15, true), (45, true)] {
        let at = |at_cycle, member, action| Fault { at_cycle, phase: 0.3, member, action };
        let members = [Member::Station(StationId(0)), Member::Station(StationId(1)), REMOTE_IO];
        let prepare = Action::Change { step: ChangeStep::Prepare };
        let mut faults = members.map(|member| at(10, member, prepare)).to_vec();
        let value = PointValue::new(16, 2);
        faults.push(at(written, REMOTE_IO, Action::Write { input: 0, value }));
        faults.push(at(60, REMOTE_IO, Action::Change { step: ChangeStep::Switch }));
        if restarts {
            faults.push(at(90, REMOTE_IO, Action::Crash));
            faults.push(at(95, REMOTE_IO, Action::Restart));
        }
        let records = records_of(&old, texts.clone(), &faults, 160);
        let mut model = Model::new(Arc::new(old.clone()), Bounds::default());
        let mut checked = [0, 0];
        for record in &records {
            model.note(record);
            let Happening::RemoteIo(Event::Applied { sampled, outputs, missing, .. }) =
                &record.event
            else {
                continue;
            };
            let is_new = model.present().versions()[0] == version;
            let alarms = &model.snapshot().process_alarms;
            let active = alarms.iter().find(|alarm| alarm.name == "many").expect("many").active;
            let (Some(sampled), None) = (sampled, missing) else {
                continue;
            };
            let shown = number(outputs, if is_new { 64 } else { 0 }, 32);
            assert_eq!(active, Some(shown > 100), "{written} {restarts} {shown}");
            checked[usize::from(is_new)] += 1;
            let step = number(sampled, if is_new { 16 } else { 0 }, 16);
            assert!(!is_new || step == 2, "{written} {restarts}: {step}");
        }
        assert!(checked.iter().all(|count| *count > 20), "{written} {restarts} {checked:?}");
        let raised = model.alarms().filter(|alarm| alarm.name == "many" && alarm.over.is_none());
        assert_eq!(raised.count(), 1, "{written} {restarts}");
    }
}
