//! Three values: fits, does not fit, and not known; nothing unknown ever fits.

use std::time::Duration;

use understudy_allocation::{
    Catalogue, Controller, Family, FamilyQuantity, Figure, Fit, Kind, Need, Quantity, Requirement,
    Resources, Role, Statement, Terms, Verdict, assess, fit,
};

use crate::support::{controller, family, resources};

fn sample() -> Resources {
    resources(
        "program p
input a
input b
output y
memory m
rung [ a | m ] /b ( m )
rung m {TON pause 1s} ( y )
",
    )
}

fn need() -> Need {
    Need {
        role: Role::Controller,
        inputs: 2,
        outputs: 1,
        analog_inputs: 0,
        analog_outputs: 0,
        program: Some(sample()),
        scan_within: Some(Duration::from_millis(1)),
        ethernet: false,
    }
}

const ALL: [(Quantity, u64); 6] = [
    (Quantity::DigitalInputs, 8),
    (Quantity::DigitalOutputs, 4),
    (Quantity::ProgramMemoryBytes, 1000),
    (Quantity::DataMemoryBytes, 100),
    (Quantity::Timers, 16),
    (Quantity::BoolInstructionNs, 500),
];

fn known_family() -> Family {
    family(&[
        (FamilyQuantity::ProgramBytesPerInstruction, 4),
        (FamilyQuantity::ProgramBytesPerTimer, 10),
        (FamilyQuantity::DataBytesPerBit, 1),
        (FamilyQuantity::DataBytesPerTimer, 6),
    ])
}

fn compared(numbers: &[(Quantity, u64)], family: Option<&Family>) -> Fit {
    fit(&controller("A", numbers), family, &need(), &Terms::default())
}

fn messages(fit: &Fit) -> Vec<String> {
    let findings = fit.findings.iter();
    findings
        .map(|found| format!("{}, {}: {}", found.verdict.words(), found.criterion, found.message))
        .collect()
}

#[test]
fn with_every_figure_it_fits_and_says_how_much_is_left() {
    let found = compared(&ALL, Some(&known_family()));
    assert_eq!(found.verdict, Verdict::Fits, "{:?}", messages(&found));
    insta::assert_debug_snapshot!(messages(&found));
    // 8 instructions of 500 ns.
    assert_eq!(found.scan_ns, Some(sample().instructions * 500));
    let smallest = found.smallest_margin().expect("margins");
    assert!((smallest - 0.75).abs() < 1e-12, "1 of 4 outputs and 2 of 8 inputs, not {smallest}");
}

/// Leaving out any figure makes it unknown; making any too small makes it fail; both together fail.
#[test]
fn one_missing_figure_is_unknown_and_one_that_is_too_small_fails() {
    for place in 0..ALL.len() {
        let mut without = ALL.to_vec();
        let (quantity, _) = without.remove(place);
        let found = compared(&without, Some(&known_family()));
        assert_eq!(found.verdict, Verdict::Unknown, "{quantity}");
        assert_eq!(found.with(Verdict::Unknown).count(), 1, "{quantity}");
        let small = if quantity == Quantity::BoolInstructionNs { 1_000_000 } else { 0 };
        without.push((quantity, small));
        let found = compared(&without, Some(&known_family()));
        assert_eq!(found.verdict, Verdict::DoesNotFit, "{quantity}");
        assert_eq!(compared(&without, None).verdict, Verdict::DoesNotFit, "{quantity}");
    }
}

#[test]
fn a_family_of_which_nothing_is_known_says_what_would_be_enough() {
    let found = compared(&ALL, None);
    assert_eq!(found.verdict, Verdict::Unknown);
    insta::assert_debug_snapshot!(messages(&found));
    let terms = Terms {
        assumptions: known_family()
            .numbers
            .into_iter()
            .map(|(quantity, figure)| (quantity, figure.value))
            .collect(),
        ..Terms::default()
    };
    let found = fit(&controller("A", &ALL), None, &need(), &terms);
    assert_eq!(found.verdict, Verdict::Fits);
    let memory = found.findings.iter().find(|it| it.criterion == "program_memory_bytes");
    let sources = &memory.expect("a finding").sources;
    assert!(sources.iter().any(|source| source.starts_with("assumed: ")), "{sources:?}");
}

#[test]
fn a_rule_for_program_and_data_together_needs_no_data_memory() {
    let rule = family(&[
        (FamilyQuantity::MemoryBytesBase, 500),
        (FamilyQuantity::MemoryBytesPerPoint, 100),
    ]);
    let mut numbers = ALL.to_vec();
    numbers.retain(|(quantity, _)| *quantity != Quantity::DataMemoryBytes);
    assert_eq!(compared(&numbers, Some(&rule)).verdict, Verdict::Fits);
    numbers.retain(|(quantity, _)| *quantity != Quantity::ProgramMemoryBytes);
    numbers.push((Quantity::ProgramMemoryBytes, 799));
    // 500 + 3 * 100
    assert_eq!(compared(&numbers, Some(&rule)).verdict, Verdict::DoesNotFit);
}

#[test]
fn a_reserve_is_kept_of_every_capacity() {
    for (percent, expected) in [(0, Verdict::Fits), (75, Verdict::Fits), (76, Verdict::DoesNotFit)]
    {
        let terms = Terms { reserve_percent: percent, ..Terms::default() };
        let found = fit(&controller("A", &ALL), Some(&known_family()), &need(), &terms);
        assert_eq!(found.verdict, expected, "{percent}: {:?}", messages(&found));
    }
}

fn with_text(statement: Statement, text: &str) -> Controller {
    let mut controller = controller("A", &ALL);
    let source = "sheet of A".to_owned();
    let value = text.to_owned();
    controller.texts.insert(statement, Figure { value, source });
    controller
}

#[test]
fn modules_do_not_count_unless_asked_and_then_leave_it_open() {
    let mut need = need();
    need.inputs = 9;
    let controller = with_text(Statement::MaxExpansionIo, "7 modules");
    let mut terms = Terms::default();
    let found = fit(&controller, Some(&known_family()), &need, &terms);
    assert_eq!(found.verdict, Verdict::DoesNotFit);
    assert!(messages(&found)[0].contains("7 modules"), "{:?}", messages(&found));
    terms.expansion = true;
    let found = assess(&Catalogue::default(), &controller, &need, &terms, false);
    assert_eq!((found.alone.verdict, found.extended), (Verdict::Unknown, None));
}

#[test]
fn an_ethernet_port_is_needed_to_speak_with_a_remote_io() {
    let mut need = need();
    need.ethernet = true;
    let check = |controller: &Controller, expected| {
        let found = fit(controller, Some(&known_family()), &need, &Terms::default());
        assert_eq!(found.verdict, expected, "{:?}", messages(&found));
        let asked_too = Terms {
            requirements: vec![Requirement::parse("ethernet").expect("a requirement")],
            ..Terms::default()
        };
        let once = fit(controller, Some(&known_family()), &need, &asked_too);
        assert_eq!(messages(&once), messages(&found));
    };
    check(&controller("A", &ALL), Verdict::Unknown);
    check(&with_text(Statement::CommPorts, "2x Ethernet"), Verdict::Fits);
    check(&with_text(Statement::CommPorts, "RS-485"), Verdict::DoesNotFit);
    check(&with_text(Statement::CommPorts, "some"), Verdict::Unknown);
}

#[test]
fn requirements_of_a_person_are_three_valued_too() {
    let check = |text: &str, expected| {
        let terms =
            Terms { requirements: vec![Requirement::parse(text).expect(text)], ..Terms::default() };
        let found = fit(&controller("A", &ALL), Some(&known_family()), &need(), &terms);
        assert_eq!(found.verdict, expected, "{text}: {:?}", messages(&found));
    };
    check("inputs>=8", Verdict::Fits);
    check("inputs>=9", Verdict::DoesNotFit);
    check("outputs=4", Verdict::Fits);
    check("program-memory<=1KB", Verdict::Fits);
    check("counters>=1", Verdict::Unknown);
    check("price<=100", Verdict::Unknown);
    check("vendor=works", Verdict::Fits);
    check("vendor=Others", Verdict::DoesNotFit);
    check("family=W", Verdict::Fits);
    check("model=B", Verdict::DoesNotFit);
    check("kind=plc", Verdict::Fits);
    check("kind=embedded", Verdict::DoesNotFit);
    check("languages~ladder", Verdict::Unknown);
    check("ethernet", Verdict::Unknown);
    check("scan-time<=1ms", Verdict::Fits);
    check("scan-time<=1us", Verdict::DoesNotFit);
    check("understudy:inputs>=9", Verdict::Fits);
    check("controller:inputs>=9", Verdict::DoesNotFit);
}

#[test]
fn what_is_not_needed_need_not_be_known() {
    let nothing = Need::nothing();
    let bare = Controller::new("Works", "Z", "W", Kind::Plc);
    let found = fit(&bare, None, &nothing, &Terms::default());
    assert_eq!((found.verdict, found.findings.len()), (Verdict::Fits, 0));
}

#[test]
fn an_assumed_time_of_an_instruction_decides_and_is_named() {
    let numbers: Vec<_> =
        ALL.into_iter().filter(|(quantity, _)| *quantity != Quantity::BoolInstructionNs).collect();
    let assumptions = [(FamilyQuantity::BoolInstructionNs, 1000)].into();
    let assumed = Terms { assumptions, ..Terms::default() };
    let scan = |family: &Family, terms: &Terms| {
        let found = fit(&controller("A", &numbers), Some(family), &need(), terms);
        let mut findings = found.findings.into_iter();
        let finding = findings.find(|finding| finding.criterion == "scan_time");
        let finding = finding.expect("it is asked for");
        (finding.verdict, finding.sources.join(", "))
    };
    let silent = known_family();
    assert_eq!(scan(&silent, &Terms::default()).0, Verdict::Unknown);
    let (verdict, source) = scan(&silent, &assumed);
    assert_eq!(verdict, Verdict::Fits);
    assert_eq!(source, "assumed: bool_instruction_ns = 1000");
    // What the family says goes before what is assumed.
    let slow = family(&[(FamilyQuantity::BoolInstructionNs, 1_000_000)]);
    assert_eq!(scan(&slow, &assumed).0, Verdict::DoesNotFit);
}
