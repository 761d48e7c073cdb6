//! Cards of signals: how inputs and outputs are shown.

use crate::common::{findings, load};
use understudy_cluster::{Card, Cluster};
use understudy_wire::ProgramId;

const TANK: &str = "PROGRAM tank
VAR_INPUT
  level : REAL; (* Level from the bottom *)
  count : UINT; pause : TIME; full : BOOL; mode : (Off, Auto); speed : REAL;
END_VAR
VAR_OUTPUT inlet : REAL; open : BOOL; END_VAR
inlet := level + speed;
open := full;
END_PROGRAM";

const FILES: [(&str, &str); 1] = [("tank.st", TANK)];

const HEAD: &str = r#"
[cluster]
name = "cell"
[[controller]]
name = "tank"
ladder = "tank.st"
[[remote_io]]
controller = "tank"
[remote_io.inputs]
speed = { operator = "setpoint", low = 0.0, high = 120.0, unit = "mm/s" }
"#;

fn loaded(cards: &str) -> Cluster {
    let loaded = load(&format!("{HEAD}[signals]\n{cards}"), &FILES);
    let findings = findings(&loaded.reports);
    loaded.cluster.unwrap_or_else(|| panic!("{findings}"))
}

fn real(value: f32) -> u64 {
    value.to_bits().into()
}

#[test]
fn a_card_is_what_the_file_says_then_the_setpoint_then_the_declaration() {
    let cluster = loaded(
        r#"
"tank.level" = { unit = "cm", decimals = 1, low = 0, high = 2.5, group = "tank" }
"tank.inlet" = { description = " Valve of the inlet ", low = -1, high = 1 }
"tank.speed" = { decimals = 0 }
"tank.pause" = { low = "0 s", high = "1.5 s" }
"#,
    );
    let card = |name: &str| cluster.card(ProgramId(0), name);
    let text = |text: &str| Some(text.to_owned());
    let level = Card {
        unit: text("cm"),
        decimals: Some(1),
        range: Some((real(0.0), real(2.5))),
        description: text("Level from the bottom"),
        group: text("tank"),
    };
    assert_eq!(card("level"), level);
    assert_eq!(card("inlet").description, text("Valve of the inlet"));
    assert_eq!(card("inlet").range, Some((real(-1.0), real(1.0))));
    let speed = card("speed");
    assert_eq!((speed.unit, speed.decimals), (text("mm/s"), Some(0)));
    assert_eq!(speed.range, Some((real(0.0), real(120.0))));
    assert_eq!(card("pause").range, Some((0, 1_500_000_000)));
    assert_eq!(card("full"), Card::default());
    assert_eq!(card("nothing"), Card::default());
    assert_eq!(cluster.card(ProgramId(7), "level"), Card::default());
}

/// A changed unit is no other configuration: members with both files work together, and there is nothing to change while they run.
#[test]
fn cards_are_in_no_hash() {
    let before = loaded("");
    let after = loaded(
        r#""tank.level" = { unit = "m", decimals = 3, low = 0, high = 1, description = "x", group = "y" }"#,
    );
    assert_eq!(before.agreement().configuration, after.agreement().configuration);
    assert_eq!(before.canonical_text(), after.canonical_text());
    assert_eq!(
        before.points_hash(ProgramId(0)),
        after.points_hash(ProgramId(0)),
        "orders name the same points"
    );
    let texts = understudy_cluster::ChangeTexts::between(&before, &after).expect("no stop");
    assert!(texts.touched().is_empty());
}

#[test]
fn every_card_that_does_not_fit_is_found_in_one_run() {
    let cards = r#"
[signals]
"tank.levle" = { unit = "cm" }
"tnak.level" = { unit = "cm" }
level = { unit = "cm" }
"tank.full" = { unit = "cm", decimals = 1, low = false, high = true }
"tank.mode" = { unit = "x", low = "Off", high = "Auto" }
"tank.count" = { decimals = 2, low = 5, high = 5 }
"tank.pause" = { unit = "s", low = "2 s", high = "1 s" }
"tank.speed" = { unit = "m/s" }
"tank.inlet" = { units = "%", decimals = 13, low = 0 }
"tank.open" = { description = "two\nlines", group = "" }
"tank.level" = { unit = "a unit that is too long", low = nan, high = 1.0 }
"#;
    let found = findings(&load(&format!("{HEAD}{cards}"), &FILES).reports);
    insta::assert_snapshot!(found);
    let nested = "[signals.tank.level]\nunit = \"cm\"\n";
    let found = findings(&load(&format!("{HEAD}{nested}"), &FILES).reports);
    insta::assert_snapshot!(found);
}

#[test]
fn a_file_of_cards_without_signals_is_bounded() {
    let cards: String = (0..20_000).map(|n| format!("\"tank.x{n}\" = {{}}\n")).collect();
    let loaded = load(&format!("{HEAD}[signals]\n{cards}"), &FILES);
    assert!(loaded.cluster.is_none());
    let unknown = loaded.reports[0].diagnostics.iter().filter(|found| found.code == "U0209");
    assert_eq!(unknown.count(), 101);
}
