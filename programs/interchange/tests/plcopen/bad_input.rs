//! Malformed, hostile and wrong files: everything is said in one run, with its place, in bounded time.

use understudy_interchange::plcopen::{MAXIMUM_BYTES, read, write};

use crate::support::{PERIOD, findings};
use understudy_testing::random::{Dice, random_program};

const START: &str = r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><pous><pou name="p" pouType="program"><interface><localVars>
<variable name="a" address="%IX0.0"><type><BOOL/></type></variable><variable name="y" address="%QX0.0"><type><BOOL/></type></variable>
</localVars></interface><body><LD>
<leftPowerRail localId="1"><position x="0" y="0"/></leftPowerRail>
"#;

const END: &str = "</LD></body></pou></pous></types></project>";

fn errors(text: &str) -> Vec<String> {
    let reading = read(text, None);
    let mut found = findings(text, &reading);
    found.retain(|line| line.contains(" error "));
    assert_eq!(reading.program.is_some(), found.is_empty(), "errors, and a program");
    found
}

fn objects(objects: &str) -> Vec<String> {
    errors(&format!("{START}{objects}{END}"))
}

fn contact(id: u64, variable: &str, x: i32, from: &[u64]) -> String {
    element("contact", id, variable, x, from)
}

fn coil(id: u64, variable: &str, x: i32, from: &[u64]) -> String {
    element("coil", id, variable, x, from)
}

fn element(name: &str, id: u64, variable: &str, x: i32, from: &[u64]) -> String {
    let wires: String =
        from.iter().map(|from| format!("<connection refLocalId=\"{from}\"/>")).collect();
    format!(
        "<{name} localId=\"{id}\"><position x=\"{x}\" y=\"0\"/><connectionPointIn>{wires}</connectionPointIn><variable>{variable}</variable></{name}>\n"
    )
}

#[test]
fn all_that_is_wrong_with_the_wires_is_said_at_once() {
    let text = [
        contact(2, "a", 10, &[1, 99]),
        contact(3, "a", 20, &[4]),
        contact(4, "a", 30, &[3]),
        coil(5, "y", 40, &[4]),
        contact(6, "b", 50, &[]),
        coil(7, "a", 60, &[6, 8]),
        contact(8, "a", 70, &[1]),
        coil(8, "y", 80, &[2]),
        contact(9, "", 90, &[1]),
        coil(10, "y", 100, &[9]),
        "<coil localId=\"x\"><variable>y</variable></coil>\n".to_owned(),
        "<label localId=\"11\" label=\"l\"><position x=\"0\" y=\"0\"/></label>\n".to_owned(),
        "<block localId=\"12\" typeName=\"TON\" instanceName=\"T\"><position x=\"0\" y=\"0\"/><inputVariables><variable formalParameter=\"INN\"><connectionPointIn><connection refLocalId=\"1\"/></connectionPointIn></variable></inputVariables><inOutVariables/><outputVariables/></block>\n".to_owned(),
        "<coil localId=\"13\"><position x=\"200\" y=\"9\"/><connectionPointIn><connection refLocalId=\"12\" formalParameter=\"QQ\"/></connectionPointIn><variable>y</variable></coil>\n".to_owned(),
    ];
    insta::assert_snapshot!(objects(&text.concat()).join("\n"));
}

#[test]
fn files_that_are_none() {
    let deep = "<a>".repeat(100_000);
    let bomb =
        "<!DOCTYPE p [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]><project>&b;</project>";
    let cases = [
        ("", "nothing"),
        ("\u{feff}<project/>", "no namespace"),
        ("<project xmlns=\"http://www.plcopen.org/xml/tc6.xsd\"/>", "another version"),
        ("<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\"/>", "no program"),
        ("<a><b></a>", "crossed tags"),
        ("<a", "cut"),
        ("\0\0", "no text"),
        (bomb, "an entity bomb"),
        (&deep, "too deep, and not closed"),
    ];
    let mut lines = Vec::new();
    for (text, name) in cases {
        lines.push(format!("{name}: {}", errors(text).join("; ")));
    }
    insta::assert_snapshot!(lines.join("\n"));
    let closed = format!("{deep}{}", "</a>".repeat(100_000));
    assert!(errors(&closed)[0].contains("U1001"));
    let large = format!("<project>{}</project>", " ".repeat(MAXIMUM_BYTES));
    assert!(errors(&large)[0].contains("U1001"));
}

#[test]
fn a_long_chain_and_a_full_mesh_end() {
    let mut chain: String = (2..20_000).map(|id| contact(id, "a", id as i32, &[id - 1])).collect();
    chain += &coil(20_000, "y", 20_000, &[19_999]);
    assert_eq!(objects(&chain), Vec::<String>::new());
    let mut mesh = String::new();
    for id in 2..60_u64 {
        let all: Vec<u64> = (1..id).collect();
        mesh += &contact(id, "a", id as i32, &all);
    }
    mesh += &coil(60, "y", 60, &(2..60).collect::<Vec<u64>>());
    assert_eq!(objects(&mesh), Vec::<String>::new());
}

#[test]
fn cut_and_changed_files_never_panic() {
    let text = write(&random_program(5, 8), PERIOD);
    let mut dice = Dice::new(1);
    for _ in 0..300 {
        let mut bytes = text.clone().into_bytes();
        for _ in 0..=dice.below(4) {
            let place = dice.below(bytes.len());
            match dice.below(3) {
                0 => bytes[place] = dice.below(256) as u8,
                1 => bytes.truncate(place.max(1)),
                _ => {
                    let piece = bytes[place..(place + 40).min(bytes.len())].to_vec();
                    let to = dice.below(bytes.len());
                    bytes.splice(to..to, piece);
                }
            }
        }
        let _ = errors(&String::from_utf8_lossy(&bytes));
    }
    // What stands in quotes is changed and the XML stays: ids, references, names.
    let quotes: Vec<usize> = text.match_indices('"').map(|(place, _)| place).collect();
    for _ in 0..300 {
        let pair = dice.below(quotes.len() / 2) * 2;
        let other = dice.below(quotes.len() / 2) * 2;
        let value = &text[quotes[other]..quotes[other + 1]];
        let changed = format!("{}{value}{}", &text[..quotes[pair]], &text[quotes[pair + 1]..]);
        let _ = errors(&changed);
    }
}

#[test]
fn changed_examples_are_read_or_refused_and_what_is_read_can_be_written() {
    let tries = std::env::var("FUZZ_TRIES").ok().and_then(|tries| tries.parse().ok());
    let mut dice = Dice::new(9);
    for name in ["pump", "probes"] {
        let path = format!("{}/../../examples/plcopen/{name}.xml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).expect("an example");
        let quotes: Vec<usize> = text.match_indices('"').map(|(place, _)| place).collect();
        let words: Vec<&str> = text.split(['<', '>']).skip(1).collect();
        for _ in 0..tries.unwrap_or(60) {
            let mut changed = text.clone();
            if dice.rarely(2) {
                let pair = dice.below(quotes.len() / 2) * 2;
                let other = dice.below(quotes.len() / 2) * 2;
                let value = &text[quotes[other]..quotes[other + 1]];
                changed.replace_range(quotes[pair]..quotes[pair + 1], value);
            } else {
                // One element's tag or text in place of another's.
                let (from, to) = (dice.pick(&words), dice.pick(&words));
                changed = changed.replacen(&format!(">{from}<"), &format!(">{to}<"), 1);
            }
            let reading = read(&changed, None);
            let Some(program) = reading.program else {
                assert!(!reading.diagnostics.is_empty(), "no program and no reason\n{changed}");
                continue;
            };
            assert!(program.lower(PERIOD).is_ok(), "{changed}");
            let again = read(&write(&program, PERIOD), None);
            assert!(again.program.is_some(), "{:?}\n{changed}", again.diagnostics);
        }
    }
}

#[test]
fn too_many_wires_are_refused() {
    let many: Vec<u64> = vec![1; 1001];
    let found = objects(&coil(2, "y", 20, &many));
    assert!(found[0].contains("U1001"), "{found:?}");
}

/// The order of a scan depends on these numbers.
#[test]
fn an_order_and_a_place_that_are_no_numbers_are_told() {
    let right = contact(2, "a", 10, &[1]) + &coil(3, "y", 20, &[2]);
    assert_eq!(objects(&right), [""; 0]);
    for (from, to) in [
        ("localId=\"3\"", "localId=\"3\" executionOrderId=\"2x\""),
        ("x=\"20\"", "x=\"-\""),
        ("y=\"0\"", "y=\"1,5\""),
    ] {
        let found = objects(&right.replacen(from, to, 1));
        // A place that is none can be told of the wires too.
        assert!(found.first().is_some_and(|first| first.contains("U1002")), "{to}: {found:?}");
    }
    let empty = right.replace("localId=\"3\"", "localId=\"3\" executionOrderId=\"\"");
    assert_eq!(objects(&empty), [""; 0]);
}
