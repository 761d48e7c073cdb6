//! The cards of signals, and the variables of a program that is no ladder.

use std::sync::Arc;
use std::time::Instant;

use opcua::types::Variant;
use understudy_gateway::{BOUNDS, Observation};
use understudy_journal::Members;
use understudy_opcua_gateway::{Variable, variables};
use understudy_scenarios::{read as read_scenario, simulate};
use understudy_view::Model;

const TANK: &str = "PROGRAM tank
  VAR_INPUT level : REAL; (* from the comment *) END_VAR
  VAR_OUTPUT full : BOOL; END_VAR
  VAR scans : UINT; pause : TON; END_VAR
  scans := scans + 1;
  pause(IN := TRUE, PT := T#1s);
  full := level > 2.0;
END_PROGRAM";

const TANK_CLUSTER: &str = r#"
[cluster]
name = "cell"
period = "10ms"
[[controller]]
name = "tank"
ladder = "tank.st"
[signals]
"tank.level" = { unit = "m", low = 0, high = 2.5 }
"tank.full" = { description = "The tank is full" }
"#;

/// A client finds the card of a signal, and the variables of a program that is no ladder with the values of its state.
#[test]
fn signals_have_their_cards_and_programs_with_numbers_their_variables() {
    let mut open = |_: &str| Ok(TANK.to_owned());
    let loaded = understudy_cluster::read("cluster.toml", TANK_CLUSTER, &mut open);
    let cluster = loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports));
    let variables = variables(&cluster);
    let variable = |path: &str| -> &Variable {
        let found = variables.iter().find(|variable| variable.path() == path);
        found.unwrap_or_else(|| panic!("no {path}"))
    };
    let level = variable("Programs/tank/Inputs/level");
    assert_eq!(level.meaning(), "from the comment; as last sampled");
    let card = level.card();
    assert_eq!((card.unit.as_deref(), card.low, card.high), (Some("m"), Some(0.0), Some(2.5)));
    assert_eq!(variable("Programs/tank/Outputs/full").meaning(), "The tank is full; as driven");

    let scenario = "title = \"quiet\"\ncycles = 60\n";
    let scenario = read_scenario("quiet.toml", scenario, Some(&Members::of(&cluster)));
    let scenario = scenario.scenario.expect("no diagnostics");
    let mut model = Model::new(Arc::new(cluster.clone()), BOUNDS);
    simulate(&cluster, &scenario, 1, &mut |record| {
        model.note(record);
    })
    .expect("the cluster becomes synchronised");
    let observation = Observation::new(&model, model.snapshot(), Instant::now());
    let value = |path: &str| variable(path).value(&observation);
    let Some(Variant::UInt64(scans)) = value("Programs/tank/Markers/scans") else {
        panic!("{:?}", value("Programs/tank/Markers/scans"));
    };
    assert!((50..=80).contains(&scans), "{scans}");
    // The first call of the timer is at 0 ms, and a scan is 10 ms later than the one before.
    let elapsed = i64::try_from(scans - 1).expect("a short run") * 10_000_000;
    assert_eq!(value("Programs/tank/Markers/pause.ET"), Some(Variant::Int64(elapsed)));
}
