//! Expansion modules: the cheapest set against every set, the plan, the stock, and the faults of a catalogue.

use understudy_allocation::{
    AllocationError, Catalogue, Controller, Figure, Item, Kind, Mode, Need, Options, Preference,
    Quantity, Requirement, Role, Statement, Stock, Terms, Verdict, Verification, allocate, assess,
    csv, text,
};

use crate::support::controller;

const IN: Quantity = Quantity::DigitalInputs;
const OUT: Quantity = Quantity::DigitalOutputs;
const MOST: Quantity = Quantity::ExpansionModules;

fn module(model: &str, numbers: &[(Quantity, u64)]) -> Controller {
    Controller { kind: Kind::Module, ..controller(model, numbers) }
}

fn of(rows: &[Controller]) -> Catalogue {
    let mut catalogue = Catalogue::default();
    for row in rows {
        catalogue.put(row.clone());
    }
    catalogue
}

fn need(inputs: u64, outputs: u64) -> Need {
    Need { inputs, outputs, ..Need::nothing() }
}

fn with_modules() -> Terms {
    Terms { expansion: true, ..Terms::default() }
}

/// The least price of a set of at most `most` modules that suffices, of all sets.
fn naive(modules: &[[u64; 3]], most: u64, lacking: [u64; 2]) -> Option<u64> {
    let Some((first, rest)) = modules.split_first() else {
        return (lacking == [0, 0]).then_some(0);
    };
    let of_count = |count: u64| {
        let left = |place: usize| lacking[place].saturating_sub(count * first[place]);
        Some(count * first[2] + naive(rest, most - count, [left(0), left(1)])?)
    };
    (0..=most).filter_map(of_count).min()
}

#[test]
fn the_cheapest_sufficient_modules_are_found() {
    let kinds = [[4, 0, 30], [0, 4, 40], [2, 2, 35], [16, 0, 90]];
    for most in 0..4 {
        for (inputs, outputs) in (0..24).flat_map(|inputs| (0..12).map(move |out| (inputs, out))) {
            let board = controller("A", &[(IN, 3), (OUT, 2), (MOST, most), (Quantity::Price, 0)]);
            let modules = kinds.iter().enumerate().map(|(number, [inputs, outputs, price])| {
                let figures = [(IN, *inputs), (OUT, *outputs), (Quantity::Price, *price)];
                module(&format!("M{number}"), &figures)
            });
            let rows: Vec<Controller> = modules.chain([board.clone()]).collect();
            let found = assess(&of(&rows), &board, &need(inputs, outputs), &with_modules(), true);
            let lacking = [inputs.saturating_sub(3), outputs.saturating_sub(2)];
            let about = format!("{inputs} and {outputs} with up to {most}");
            let expected = naive(&kinds, most, lacking);
            if lacking == [0, 0] {
                assert_eq!((found.alone.verdict, found.extended), (Verdict::Fits, None), "{about}");
                continue;
            }
            assert_eq!(found.alone.verdict, Verdict::DoesNotFit, "{about}");
            let extended = found.extended.map(|(sum, modules)| {
                let count: u64 = modules.iter().map(|of| of.count).sum();
                assert!(count <= most, "{about}: {modules:?}");
                let enough = |quantity, need| sum.number(quantity).is_some_and(|has| has >= need);
                assert!(enough(IN, inputs) && enough(OUT, outputs), "{about}: {modules:?}");
                sum.number(Quantity::Price).expect("every part has a price")
            });
            assert_eq!(extended, expected, "{about}");
        }
    }
}

#[test]
fn what_is_not_known_of_modules_leaves_the_answer_open() {
    let check = |rows: &[Controller], expected: Verdict, words: &str| {
        let found = assess(&of(rows), &rows[0], &need(9, 1), &with_modules(), false);
        assert_eq!((found.alone.verdict, found.extended), (expected, None), "{words}");
        let message = &found.alone.findings[0].message;
        assert!(message.contains(words), "{message}");
    };
    let board = |more: &[(Quantity, u64)]| controller("A", &[&[(IN, 8), (OUT, 8)], more].concat());
    let eight = module("M", &[(IN, 8), (OUT, 0)]);
    check(&[board(&[]), eight.clone()], Verdict::Unknown, "expansion_modules");
    check(&[board(&[(MOST, 0)]), eight], Verdict::DoesNotFit, "takes no modules");
    let outputs = module("M", &[(IN, 0), (OUT, 8)]);
    check(&[board(&[(MOST, 2)]), outputs], Verdict::DoesNotFit, "do not suffice");
    let unknown = module("M", &[(OUT, 8)]);
    check(&[board(&[(MOST, 2)]), unknown], Verdict::Unknown, "digital_inputs of Works M");
    check(&[board(&[])], Verdict::DoesNotFit, "needs 9");
}

#[test]
fn modules_extend_memory_and_what_a_person_requires_with_the_reserve() {
    let memory = Quantity::ProgramMemoryBytes;
    let board = controller("A", &[(IN, 8), (memory, 100), (MOST, 3)]);
    let rows = [board.clone(), module("M", &[(IN, 4), (memory, 50)])];
    let count = |inputs: u64, require: &[&str], reserve_percent: u8| {
        let requirements = require.iter().map(|text| Requirement::parse(text).expect(text));
        let terms =
            Terms { requirements: requirements.collect(), reserve_percent, ..with_modules() };
        let found = assess(&of(&rows), &board, &need(inputs, 0), &terms, false);
        found.extended.map(|(_, modules)| modules.iter().map(|of| of.count).sum::<u64>())
    };
    assert_eq!(count(9, &[], 0), Some(1));
    assert_eq!(count(8, &["program_memory>=101"], 0), Some(1));
    assert_eq!(count(8, &["program_memory>=250", "inputs>=9"], 0), Some(3));
    assert_eq!(count(8, &["program_memory>=251"], 0), None);
    // Half of 16 is 8.
    assert_eq!(count(8, &[], 50), Some(2));
    assert_eq!(count(8, &["understudy:inputs>=9"], 0), None);
}

fn remote_io(name: &str, inputs: u64) -> Item {
    Item {
        name: name.to_owned(),
        group: None,
        need: Need { role: Role::RemoteIo, ..need(inputs, 0) },
        verification: Verification::NotAsked,
        twin_of: None,
    }
}

#[test]
fn a_plan_names_the_modules_and_draws_on_one_stock() {
    let rows = [
        controller("A", &[(IN, 8), (MOST, 4)]),
        controller("B", &[(IN, 8)]),
        module("M", &[(IN, 4)]),
    ];
    let catalogue = of(&rows);
    let items = [remote_io("one", 9), remote_io("two", 20), remote_io("three", 8)];
    let options = Options { terms: with_modules(), ..Options::default() };
    let plan = allocate(&catalogue, &items, &options).expect("a plan");
    let shown = text(&plan, true);
    assert!(shown.contains("box 1: Works A with 1 x M for one"), "{shown}");
    assert!(shown.contains("box 2: Works A with 3 x M for two"), "{shown}");
    assert!(plan.is_complete() && plan.best, "{shown}");
    let counts = plan.items.iter().map(|item| item.candidates.len());
    assert_eq!(counts.collect::<Vec<_>>(), [2, 2, 2], "one candidate for each controller");
    assert!(csv(&plan).contains("Works,A,3 x M,yes"), "{}", csv(&plan));

    let stock = |name: &str, count| Stock { name: name.to_owned(), count };
    let few = Options { stock: vec![stock("A", 2)], ..options.clone() };
    let plan = allocate(&catalogue, &items, &few).expect("a plan");
    assert_eq!(plan.boxes.len(), 2, "{}", text(&plan, true));
    let wrong = Options { stock: vec![stock("M", 2)], ..options };
    let errors = allocate(&catalogue, &items, &wrong).expect_err("a module");
    assert_eq!(errors.iter().map(AllocationError::code).collect::<Vec<_>>(), ["U1145"]);
}

#[test]
fn prices_of_modules_count_and_so_do_their_currencies() {
    let priced = |row: Controller, price: u64, currency: &str| {
        let mut row = row;
        let source = "quotation".to_owned();
        row.numbers.insert(Quantity::Price, Figure { value: price, source: source.clone() });
        row.texts.insert(Statement::Currency, Figure { value: currency.to_owned(), source });
        row
    };
    let plan = |currency: &str| {
        let rows = [
            priced(controller("A", &[(IN, 8), (MOST, 4)]), 100, "EUR"),
            priced(controller("B", &[(IN, 16)]), 190, "EUR"),
            priced(module("M", &[(IN, 8)]), 80, currency),
        ];
        let terms = with_modules();
        let options = Options { terms, preference: Preference::Cost, ..Options::default() };
        allocate(&of(&rows), &[remote_io("one", 9), remote_io("two", 17)], &options)
    };
    let shown = text(&plan("EUR").expect("a plan"), true);
    // 180 in place of 190, and 260 for what B alone does not hold.
    assert!(shown.contains("Works A with 1 x M for one"), "{shown}");
    assert!(shown.contains("Works A with 2 x M for two"), "{shown}");
    let errors = plan("USD").expect_err("two currencies");
    assert_eq!(errors[0].code(), "U1133", "{errors:?}");
}

#[test]
fn modules_that_extend_nothing_are_refused_with_what_is_known() {
    let mut catalogue = of(&[controller("A", &[(IN, 8)])]);
    let stray = Controller { family: "V".to_owned(), ..module("M", &[(IN, 8)]) };
    let empty = module("E", &[(IN, 0)]);
    let errors = catalogue.add(&of(&[stray, empty]), Mode::New).expect_err("faults");
    let shown: Vec<String> = errors.iter().map(ToString::to_string).collect();
    assert_eq!(errors.iter().map(|one| one.code()).collect::<Vec<_>>(), ["U1143", "U1142"]);
    assert!(shown[1].contains("Works M") && shown[1].contains('W'), "{shown:?}");
    assert_eq!(catalogue.rows().count(), 1, "nothing is added");
    let added = catalogue.add(&of(&[module("M", &[(IN, 8)])]), Mode::New).expect("it extends A");
    assert_eq!((added.models, added.modules), (0, 1));

    let error = catalogue.remove("Works", "A").expect_err("M extends it");
    assert!(error.to_string().starts_with("U1144: Works A is the last"), "{error}");
    assert_eq!(catalogue.rows().count(), 2, "nothing is removed");
    assert!(catalogue.remove("Works", "M").expect("not needed").is_some());
    assert!(catalogue.remove("Works", "A").expect("not needed any more").is_some());
    assert!(catalogue.remove("Works", "A").expect("not there").is_none());
}

#[test]
fn the_modules_of_the_built_in_catalogue_are_right() {
    let catalogue = Catalogue::built_in().expect("a catalogue");
    assert_eq!(catalogue.module_faults(), []);
    let taken: Vec<String> = catalogue.modules().map(ToString::to_string).collect();
    assert!(taken.len() >= 7, "{taken:?}");
    for module in catalogue.modules() {
        let takes = |one: &&Controller| {
            one.family == module.family && one.number(MOST).is_some_and(|most| most > 0)
        };
        assert!(catalogue.controllers().any(|one| takes(&one)), "{module} can be counted");
    }
}
