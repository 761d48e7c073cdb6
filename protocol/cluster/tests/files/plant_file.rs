//! Plant files: what is read, and that one run finds everything that is wrong.

use understudy_cluster::{Cluster, LoadedPlant, plant_file_schema, read_plant_file};
use understudy_wire::StationId;

use crate::common::{findings, load};

const PUMP: (&str, &str) = (
    "pump.st",
    "PROGRAM pump VAR_INPUT on : BOOL; END_VAR VAR_OUTPUT run : BOOL; END_VAR run := on; END_PROGRAM",
);

/// A group with an understudy and these slots, under a name of its own.
fn group(slots: &[&str]) -> Cluster {
    let mut text =
        "[cluster]\nname = \"CELL\"\n[[controller]]\nname = \"pump\"\nladder = \"pump.st\"\n\
                    [[understudy]]\nname = \"understudy\"\n"
            .replace("CELL", &format!("cell-{}", slots.len()));
    for slot in slots {
        text += &format!("[[understudy]]\nname = \"{slot}\"\nspare = true\n");
    }
    let loaded = load(&text, &[PUMP]);
    loaded.cluster.unwrap_or_else(|| panic!("{}", findings(&loaded.reports)))
}

fn plant(text: &str) -> LoadedPlant {
    read_plant_file("plant.toml", text, &mut |file| match file {
        "none.toml" => Ok(group(&[])),
        "one.toml" => Ok(group(&["spare"])),
        "two.toml" => Ok(group(&["spare", "second"])),
        _ => Err(format!("{file}: no such file")),
    })
}

const GROUPS: &str = "[[group]]\nname = \"a\"\ncluster = \"one.toml\"\nfailure_domain = \"rack-1\"\n\
                      [[group]]\nname = \"b\"\ncluster = \"two.toml\"\n";

#[test]
fn groups_and_spares_are_read_in_their_order() {
    let loaded = plant(&format!(
        "{GROUPS}[[spare]]\nname = \"x\"\ngroups = {{ b = \"second\", a = \"spare\" }}\nspare_after = 7\nretire_after = \"2s\"\n"
    ));
    let plant = loaded.plant.unwrap_or_else(|| panic!("{:?}", loaded.report));
    let [spare] = &plant.spares[..] else { panic!("{:?}", plant.spares) };
    let serves: Vec<_> = spare.serves.iter().map(|it| (it.group, it.station, it.fits)).collect();
    assert_eq!(serves, [(0, StationId(2), true), (1, StationId(3), true)]);
    assert_eq!((spare.spare_after, spare.retire_after.as_secs()), (7, 2));
    assert!(plant.groups[0].cluster.agreement().schedule.expected().len() == 2);
}

#[test]
fn one_run_finds_everything_that_is_wrong() {
    let check = |text: &str, wanted: &[&str]| {
        let loaded = plant(text);
        let found = findings(&[loaded.report]);
        for wanted in wanted {
            assert!(found.contains(wanted), "{wanted} in {found}");
        }
        assert_eq!(loaded.plant.is_none(), found.contains(" error "), "{found}");
    };
    let spare = |name: &str, rest: &str| format!("[[spare]]\nname = \"{name}\"\n{rest}\n");
    check("", &["U0203 there is no [[group]]", "U0203 there is no [[spare]]"]);
    check(&format!("{GROUPS}{}", spare("x", "groups = {}")), &["U0236 spare `x` serves no group"]);
    let wrong = [
        "[[group]]\nname = \"a\"\ncluster = \"one.toml\"\n",
        "[[group]]\nname = \"a\"\ncluster = \"two.toml\"\n",
        "[[group]]\nname = \"n\"\ncluster = \"none.toml\"\n",
        "[[group]]\nname = \"m\"\ncluster = \"missing.toml\"\n",
        &spare("x", "groups = { a = \"spare\", q = \"spare\", m = \"spare\", n = \"spare\" }"),
        &spare("y", "groups = { a = \"spare\" }\nspare_after = 0"),
        &spare("z", "groups = { a = \"understudy\" }\nretire_after = 3"),
    ];
    check(
        &wrong.concat(),
        &[
            "U0208 two groups are named `a`",
            "U0209 there is no group `q`",
            "U0231 group `m`: missing.toml: no such file",
            "U0232 group `n` has no slot of a spare named `spare`\n    add an `[[understudy]]`",
            "U0232 group `a` has no slot of a spare named `understudy`\n    its slots are spare",
            "U0234 two spares have the slot `spare` of group `a`",
            "U0205",
            "U0204",
        ],
    );
    let small = spare("x", "groups = { a = \"spare\" }\ncapacity = 1");
    check(&format!("{GROUPS}{small}"), &["error U0233 group `a` needs"]);
    let near = spare("x", "groups = { a = \"spare\" }\nfailure_domain = \"rack-1\"");
    check(&format!("{GROUPS}{near}"), &["warning U0257 group `a` is in the failure domain"]);
    check(&format!("{GROUPS}[[spares]]\n"), &["U0202"]);
    let one = spare("x", "groups = { a = \"spare\" }");
    let machines = "[[machine]]\nname = \"m\"\nrack = \"r\"\n[[machine]]\nname = \"m\"\nfeeder = \"f\"\nstations = 0\n";
    check(
        &format!("{GROUPS}{one}{machines}"),
        &[
            "error U0235 a machine has no `rack`, and another one has",
            "error U0235 a machine has no `feeder`, and another one has",
            "U0208 two machines are named `m`",
        ],
    );
}

/// The slot is part of the configuration, and only there where a file has one.
#[test]
fn members_agree_on_the_slots_of_spares() {
    let [none, one] = [&[][..], &["spare"]].map(group);
    let has = |cluster: &Cluster| cluster.canonical_text().contains("understudy spare spare");
    assert!(has(&one) && !has(&none));
    let slots = |cluster: &Cluster| cluster.agreement().schedule.spare_slots();
    assert!(slots(&none).is_empty());
    assert!(slots(&one).contains(StationId(2)) && slots(&one).len() == 1);
}

#[test]
fn a_cluster_with_spares_alone_or_in_the_mode_of_the_paper_is_warned_about() {
    let check = |cluster: &str, understudy: &str, wanted: &str| {
        let text = format!(
            "[cluster]\nname = \"cell\"\n{cluster}\n[[controller]]\nname = \"pump\"\nladder = \"pump.st\"\n{understudy}\
             [[understudy]]\nname = \"spare\"\nspare = true\n"
        );
        let found = findings(&load(&text, &[PUMP]).reports);
        assert!(found.contains(wanted), "{found}");
    };
    check("", "", "U0253 there is no understudy: no failure is masked until a spare is awake");
    let understudy = "[[understudy]]\nname = \"u\"\n";
    check("mode = \"paper\"", understudy, "U0253 the paper's mode has one understudy");
}

#[test]
fn the_schema_of_a_plant_file_has_its_sections() {
    let schema = plant_file_schema();
    let properties = schema.get("properties").and_then(|it| it.as_object()).expect("an object");
    assert_eq!(properties.keys().collect::<Vec<_>>(), ["group", "machine", "spare"]);
}

#[test]
fn a_group_is_named_once_and_served() {
    let report = |text: &str| {
        let found = plant(text).report.diagnostics;
        found.iter().map(|one| format!("{} {}", one.code, one.message)).collect::<Vec<_>>()
    };
    let spare = "[[spare]]\nname = \"x\"\ngroups = { a = \"spare\" }\n";
    let unserved = report(&format!("{GROUPS}{spare}"));
    assert_eq!(unserved, ["U0257 no spare serves group `b`"]);
    let twice = report(&format!("{GROUPS}{spare}").replace("two.toml", "one.toml"));
    assert_eq!(twice, ["U0208 groups `a` and `b` are one cluster"]);
}
