//! Alarms on signals of the programs.

use crate::common::{findings, load};
use understudy_cluster::{AlarmCondition, Cluster, Priority};
use understudy_wire::ProgramId;

const TANK: &str = "PROGRAM tank
VAR_INPUT level : REAL; count : UINT; pause : TIME; full : BOOL; END_VAR
VAR_OUTPUT inlet : REAL; open : BOOL; END_VAR
inlet := level;
open := full;
END_PROGRAM";

const FILES: [(&str, &str); 1] = [("tank.st", TANK)];

const HEAD: &str = r#"
[cluster]
name = "cell"
period = "20ms"
[[controller]]
name = "tank"
ladder = "tank.st"
"#;

fn loaded(alarms: &str) -> Cluster {
    let loaded = load(&format!("{HEAD}{alarms}"), &FILES);
    let findings = findings(&loaded.reports);
    loaded.cluster.unwrap_or_else(|| panic!("{findings}"))
}

fn check(alarms: &str) -> String {
    findings(&load(&format!("{HEAD}{alarms}"), &FILES).reports)
}

#[test]
fn an_alarm_is_bound_to_its_signal() {
    let cluster = loaded(
        r#"
[[alarm]]
signal = "tank.level"
name = "level-high"
above = 90
hysteresis = 2.5
on_delay = "50ms"
priority = "critical"
text = "Level of the tank is too high"
action = "Close the inlet"
[[alarm]]
signal = "tank.open"
when = false
off_delay = "1s"
text = "Outlet is closed"
[[alarm]]
signal = "tank.count"
below = 3
text = "Few parts"
[[alarm]]
signal = "tank.pause"
above = "1.5 s"
hysteresis = "500 ms"
text = "Long pause"
"#,
    );
    let [level, open, count, pause] = cluster.alarms().as_ref() else {
        panic!("four alarms");
    };
    let bits = |value: f32| u64::from(value.to_bits());
    assert_eq!((level.name.as_str(), level.program), ("level-high", ProgramId(0)));
    assert_eq!((level.point.name.as_str(), level.is_output), ("level", false));
    let condition = AlarmCondition::Above { limit: bits(90.0), over: bits(87.5) };
    assert_eq!(level.condition, condition);
    // Rounded up to whole cycles.
    assert_eq!((level.on_delay, level.off_delay), (3, 0));
    assert_eq!(level.priority, Priority::Critical);
    assert_eq!(level.action.as_deref(), Some("Close the inlet"));
    assert_eq!((open.name.as_str(), open.is_output), ("tank.open", true));
    assert_eq!(open.condition, AlarmCondition::Is(0));
    assert_eq!((open.off_delay, open.priority), (50, Priority::Low));
    assert_eq!(count.condition, AlarmCondition::Below { limit: 3, over: 3 });
    let condition = AlarmCondition::Above { limit: 1_500_000_000, over: 1_000_000_000 };
    assert_eq!(pause.condition, condition);
}

#[test]
fn wrong_alarms_are_reported() {
    insta::assert_snapshot!(check(
        r#"
[[alarm]]
signal = "tank.levle"
above = 90.0
text = "x"
[[alarm]]
signal = "tnk.level"
above = 90.0
text = "x"
[[alarm]]
signal = "level"
above = 90.0
text = "x"
[[alarm]]
signal = "tank.full"
above = 1
priority = "urgent"
text = "x"
[[alarm]]
signal = "tank.inlet"
when = true
[[alarm]]
signal = "tank.open"
text = "x"
"#
    ));
    insta::assert_snapshot!(check(
        r#"
[[alarm]]
signal = "tank.level"
above = 90.0
below = 10.0
text = "x"
[[alarm]]
signal = "tank.level"
above = 90.0
hysteresis = -1.0
text = "x"
[[alarm]]
signal = "tank.count"
below = 65535
hysteresis = 1
text = "x"
[[alarm]]
signal = "tank.open"
when = true
hysteresis = 1
on_delay = "25h"
text = "x"
[[alarm]]
signal = "tank.count"
name = "few parts"
below = 2.5
text = "x"
limit = 5
"#
    ));
}

#[test]
fn the_number_of_alarms_is_bounded() {
    let alarm = |number: usize| {
        format!(
            "[[alarm]]\nname = \"a{number}\"\nsignal = \"tank.open\"\nwhen = true\ntext = \"x\"\n"
        )
    };
    let many: String = (0..=understudy_cluster::MAXIMUM_ALARMS).map(alarm).collect();
    let findings = check(&many);
    assert!(findings.contains("U0213 there are more than 1000 alarms"), "{findings}");
}

#[test]
fn alarms_are_not_part_of_the_configuration_of_the_members() {
    let alarm = "[[alarm]]\nsignal = \"tank.open\"\nwhen = true\ntext = \"x\"\n";
    let configuration = |text: &str| loaded(text).agreement().configuration;
    assert_eq!(configuration(""), configuration(alarm));
}
