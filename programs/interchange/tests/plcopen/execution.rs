//! The order of execution: numbers and rings, and power that is kept while what it was read from is written.

use understudy_logic::Running;

use crate::meaning::{BITS, RAIL, coil, contact, file, variables};
use crate::numbers::{Scans, typed};
use crate::support::{PERIOD, program};

/// A function that feeds another one, with their places in the order.
fn pair(orders: [u64; 2], ring: bool) -> String {
    let order = |order: u64| match order {
        0 => String::new(),
        order => format!(r#" executionOrderId="{order}""#),
    };
    let function = |id: usize, order: String, sources: [usize; 2]| {
        let pin = |at: usize| {
            let source = sources[at - 1];
            format!(
                r#"<variable formalParameter="IN{at}"><connectionPointIn><connection refLocalId="{source}"/></connectionPointIn></variable>"#
            )
        };
        format!(
            r#"<block localId="{id}" typeName="ADD"{order}><inputVariables>{}{}</inputVariables><inOutVariables/><outputVariables><variable formalParameter="OUT"><connectionPointOut/></variable></outputVariables></block>"#,
            pin(1),
            pin(2)
        )
    };
    let back = if ring { 2 } else { 3 };
    let body = function(1, order(orders[0]), [3, back]) + &function(2, order(orders[1]), [1, 3]);
    format!(
        r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous><pou name="main" pouType="program"><interface><inputVars><variable name="a"><type><INT/></type></variable></inputVars><outputVars><variable name="y"><type><INT/></type></variable></outputVars></interface><body><FBD>{body}<inVariable localId="3"><connectionPointOut/><expression>a</expression></inVariable><outVariable localId="4"{}><connectionPointIn><connection refLocalId="2"/></connectionPointIn><expression>y</expression></outVariable></FBD></body></pou></pous></types><instances><configurations/></instances></project>"#,
        order(9)
    )
}

#[test]
fn what_acts_before_its_place_is_a_warning() {
    let warned = |orders, ring| {
        let (_, found) = understudy_interchange::plcopen::read_typed(&pair(orders, ring));
        found.iter().filter(|found| found.code == "U1024").count()
    };
    assert_eq!(warned([1, 2], false), 0);
    assert_eq!(warned([2, 1], false), 1);
    // One without a number is behind all with one, also for the variable that it feeds.
    assert_eq!(warned([0, 1], false), 1);
    assert_eq!(warned([1, 0], false), 1);
    // In a ring the last scan's result is what is meant.
    assert_eq!(warned([1, 2], true), 0);
    assert_eq!(warned([2, 1], true), 0);
}

#[test]
fn a_ring_is_executed_in_the_order_of_its_numbers() {
    // y = 2a + y as it was; the ring is closed at the first or at the second function.
    for (orders, expected) in [([1, 2], [2, 6, 12, 20]), ([2, 1], [1, 4, 9, 16])] {
        let text = pair(orders, true);
        let mut scans = Scans::new(typed(&text, PERIOD).expect("no errors"));
        let shown: Vec<u64> = (1..=4).map(|given| scans.scan(&[given])[0]).collect();
        assert_eq!(shown, expected, "{orders:?}");
    }
}

#[test]
fn a_contact_keeps_its_power_while_its_bit_is_written_by_another_name() {
    let located = |name: &str| {
        format!(
            "<localVars><variable name=\"{name}\" address=\"%MX0.3\"><type><BOOL/></type></variable></localVars>"
        )
    };
    for written in ["w", "%MX0.3", "v"] {
        for is_between in [false, true] {
            let mut declared = variables(&BITS) + &located("v");
            if written == "w" {
                declared += &located("w");
            }
            let objects = [
                RAIL.to_owned(),
                contact(1, "v", &[0]),
                coil(2, written, &[1]).replace("negated=\"false\"", "negated=\"true\""),
                contact(3, "a", &[0]),
                if is_between { coil(4, "z", &[3]) } else { String::new() },
                coil(5, "y", &[1]),
            ];
            let circuit = program(&file(&declared, &objects.concat())).lower(PERIOD);
            let circuit = circuit.expect("it was checked");
            let mut run = Running::new(&circuit);
            declared += &variables(&[("output", "n", "<INT/>")]);
            let numbers = typed(&file(&declared, &objects.concat()), PERIOD).expect("no errors");
            let mut scans = Scans::new(numbers);
            for scan in 0..6 {
                let expected = scan % 2 == 1;
                let message = format!("{written} {is_between} scan {scan}");
                assert_eq!(run.step(&[false, false])[0], expected, "{message}");
                assert_eq!(scans.scan(&[0, 0])[0], u64::from(expected), "{message}");
            }
        }
    }
}

#[test]
fn what_a_program_with_numbers_does_not_keep_is_what_is_not_written() {
    // The ladder of this file has neither the ring nor the numbers; the program has both.
    let text = pair([2, 1], true);
    let kept = understudy_interchange::plcopen::fidelity_with_numbers(&text, None);
    assert_eq!(kept, Default::default());
    // `m` is read again after it has been written, which other tools do and this one does not.
    let given = |id: u32, name: &str| {
        format!(
            r#"<inVariable localId="{id}"><connectionPointOut/><expression>{name}</expression></inVariable>"#
        )
    };
    let taken = |id: u32, source: u32, name: &str| {
        format!(
            r#"<outVariable localId="{id}" executionOrderId="{id}"><connectionPointIn><connection refLocalId="{source}"/></connectionPointIn><expression>{name}</expression></outVariable>"#
        )
    };
    let add = r#"<block localId="3" typeName="ADD" executionOrderId="3"><inputVariables><variable formalParameter="IN1"><connectionPointIn><connection refLocalId="1"/></connectionPointIn></variable><variable formalParameter="IN2"><connectionPointIn><connection refLocalId="2"/></connectionPointIn></variable></inputVariables><inOutVariables/><outputVariables><variable formalParameter="OUT"><connectionPointOut/></variable></outputVariables></block>"#;
    for of in ["INT", "REAL"] {
        let body = given(1, "m") + &given(2, "a") + add + &taken(4, 3, "m") + &taken(5, 1, "y");
        let text = text.replace("<INT/>", &format!("<{of}/>"));
        let (start, _) = text.split_once("<FBD>").expect("a diagram");
        let (_, end) = text.split_once("</FBD>").expect("a diagram");
        let local = format!(
            r#"<localVars><variable name="m"><type><{of}/></type></variable></localVars></interface>"#
        );
        let start = start.replace("</interface>", &local);
        let text = format!("{start}<FBD>{body}</FBD>{end}");
        let kept = understudy_interchange::plcopen::fidelity_with_numbers(&text, None);
        assert_eq!(kept.notes.len(), 1, "{of}: {kept:?}");
        assert!(kept.notes[0].message.contains("asked for again"), "{kept:?}");
    }
}

#[test]
fn a_variable_that_is_wired_twice_is_what_it_was_first() {
    let given = |id: u32, name: &str| {
        format!(
            r#"<inVariable localId="{id}"><connectionPointOut/><expression>{name}</expression></inVariable>"#
        )
    };
    let from = |id: u32| {
        format!(r#"<connectionPointIn><connection refLocalId="{id}"/></connectionPointIn>"#)
    };
    let taken = |id: u32, source: u32, name: &str| {
        let from = from(source);
        format!(
            r#"<outVariable localId="{id}" executionOrderId="{id}">{from}<expression>{name}</expression></outVariable>"#
        )
    };
    // Both functions read `m`, and `m` is written between them.
    for of in ["BOOL", "INT"] {
        let function = |id: u32| {
            let word = if of == "BOOL" { "XOR" } else { "ADD" };
            let pins = [(1, 1), (2, 2)].map(|(pin, source)| {
                format!(r#"<variable formalParameter="IN{pin}">{}</variable>"#, from(source))
            });
            format!(
                r#"<block localId="{id}" typeName="{word}" executionOrderId="{id}"><inputVariables>{}</inputVariables><inOutVariables/><outputVariables><variable formalParameter="OUT"><connectionPointOut/></variable></outputVariables></block>"#,
                pins.concat()
            )
        };
        let written = [taken(4, 2, "m"), taken(6, 3, "x"), taken(7, 5, "y")];
        let body = given(1, "m") + &given(2, "a") + &function(3) + &function(5) + &written.concat();
        let named =
            |name: &str| format!(r#"<variable name="{name}"><type><{of}/></type></variable>"#);
        let text = format!(
            r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous><pou name="main" pouType="program"><interface><inputVars>{}</inputVars><outputVars>{}{}</outputVars><localVars>{}</localVars></interface><body><FBD>{body}</FBD></body></pou></pous></types><instances><configurations/></instances></project>"#,
            named("a"),
            named("x"),
            named("y"),
            named("m")
        );
        let mut scans = Scans::new(typed(&text, PERIOD).expect("no errors"));
        let given = [1, 1, 0, 0, 1];
        let shown = given.map(|given| scans.scan(&[given]));
        let expected = match of {
            "BOOL" => [[1, 1], [0, 0], [1, 1], [0, 0], [1, 1]],
            _ => [[1, 1], [2, 2], [1, 1], [0, 0], [1, 1]],
        };
        assert_eq!(shown, expected.map(Vec::from), "{of}");
    }
}
