//! Whole plans: ranked, packed, explained.

use std::time::Duration;

use understudy_allocation::{
    Allocation, AllocationError, Catalogue, Figure, Group, Item, Member, Need, Options, Preference,
    Provenance, Quantity, Role, Statement, Stock, Terms, Twin, Verdict, Verification, allocate,
    csv, html, text,
};

use crate::support::{catalogue, controller, resources};

const MEMORY: Quantity = Quantity::ProgramMemoryBytes;

/// Small, medium and large, and one of which the memory is not known.
fn three_sizes() -> Catalogue {
    let sizes = [("S", 60, 900), ("M", 200, 700), ("L", 2000, 300)];
    let models = sizes.map(|(model, memory, time)| {
        controller(
            model,
            &[
                (MEMORY, memory),
                (Quantity::DataMemoryBytes, 10),
                (Quantity::BoolInstructionNs, time),
                (Quantity::DigitalInputs, 8),
                (Quantity::DigitalOutputs, 8),
            ],
        )
    });
    let mut models = models.to_vec();
    models.push(controller("X", &[(Quantity::DataMemoryBytes, 10)]));
    catalogue(models)
}

/// 4 instructions, 16 bytes in the family W; with one bit that remembers.
fn program(name: &str, group: Option<usize>, role: Role) -> Item {
    let text = "program p\ninput a\ninput b\noutput y\nmemory m\nrung [ a | m ] /b ( m )\n";
    let program = (role != Role::RemoteIo).then(|| resources(text));
    Item {
        name: name.to_owned(),
        group,
        need: Need {
            role,
            inputs: if role == Role::RemoteIo { 2 } else { 0 },
            outputs: if role == Role::RemoteIo { 1 } else { 0 },
            analog_inputs: 0,
            analog_outputs: 0,
            program,
            scan_within: None,
            ethernet: false,
        },
        verification: Verification::Passed("proved".to_owned()),
        twin_of: None,
    }
}

fn cell() -> Vec<Item> {
    vec![
        program("robot", Some(0), Role::Controller),
        program("press", Some(0), Role::Controller),
        program("understudy", Some(0), Role::Understudy),
        program("robot-io", Some(0), Role::RemoteIo),
    ]
}

fn planned(items: &[Item], options: &Options) -> Allocation {
    allocate(&three_sizes(), items, options).expect("a plan")
}

fn boxes(plan: &Allocation) -> Vec<String> {
    let boxes = plan.boxes.iter();
    let mut found: Vec<String> = boxes
        .map(|taken| format!("{}: {}", taken.controller.model, taken.items.join(" ")))
        .collect();
    found.sort();
    found
}

fn share() -> Options {
    Options { share_members: true, ..Options::default() }
}

#[test]
fn one_failure_must_not_take_two() {
    let plan = planned(&cell(), &Options::default());
    assert_eq!(boxes(&plan), ["S: press", "S: robot", "S: robot-io", "S: understudy"]);
    // Members may share where the user says so; the understudy and the remote I/O never do.
    let plan = planned(&cell(), &share());
    assert_eq!(boxes(&plan), ["S: robot press", "S: robot-io", "S: understudy"]);
    assert!(plan.is_complete() && plan.best);
}

#[test]
fn programs_without_an_understudy_share_what_holds_them() {
    let items: Vec<Item> =
        (0..5).map(|number| program(&format!("p{number}"), None, Role::Controller)).collect();
    // 80 bytes: one M of 200, for it is one box; S holds three.
    assert_eq!(boxes(&planned(&items, &Options::default())), ["M: p0 p1 p2 p3 p4"]);
    let stock = |name: &str, count| Stock { name: name.to_owned(), count };
    let few = Options { stock: vec![stock("S", 1), stock("Works S", 1)], ..Options::default() };
    assert_eq!(planned(&items, &few).boxes.len(), 2);
    let one = Options { stock: vec![stock("S", 1)], ..Options::default() };
    let plan = planned(&items, &one);
    assert_eq!(plan.boxes[0].items.len(), 3);
    let why: Vec<_> = plan.items.iter().filter_map(|item| item.left_over.clone()).collect();
    assert_eq!(why, vec!["insufficient stock: of 1 suitable controllers, all are in use"; 2]);
}

#[test]
fn groups_may_share_boxes_with_each_other() {
    let mut items = cell();
    items.truncate(3);
    items.extend([
        program("mixer", Some(1), Role::Controller),
        program("second", Some(1), Role::Understudy),
    ]);
    let plan = planned(&items, &Options::default());
    assert_eq!(plan.boxes.len(), 3, "{:?}", boxes(&plan));
    assert!(plan.is_complete());
}

/// Three plants of three programs beside each other: their stations share boxes across the plants, four boxes for twelve stations.
#[test]
fn three_groups_share_as_few_boxes_as_the_largest_of_them_wants() {
    let mut items = Vec::new();
    for group in 0..3 {
        for number in 0..3 {
            let name = format!("p{group}{number}");
            items.push(program(&name, Some(group), Role::Controller));
            items.push(program(&format!("{name}-io"), Some(group), Role::RemoteIo));
        }
        let name = format!("understudy{group}");
        items.push(program(&name, Some(group), Role::Understudy));
    }
    let plan = planned(&items, &Options::default());
    assert!(plan.is_complete());
    assert_eq!(plan.boxes.len(), 4 + 9, "{:?}", boxes(&plan));
}

#[test]
fn what_is_preferred_comes_first() {
    let first = |preference| {
        let options = Options { preference, ..Options::default() };
        let plan = planned(&cell()[..1], &options);
        let ranked: Vec<String> =
            plan.items[0].candidates.iter().map(|it| it.model.clone()).collect();
        assert_eq!(ranked[3], "X", "what is not known is last");
        assert_eq!(plan.boxes[0].controller.model, ranked[0]);
        ranked[..3].concat()
    };
    assert_eq!(first(Preference::Memory), "SML");
    assert_eq!(first(Preference::Speed), "LMS");
    assert_eq!(
        first(Preference::Reserve),
        "MLS",
        "10 % of the data memory is taken in M and in L alike"
    );
    // Nobody knows a price.
    assert_eq!(first(Preference::Cost), "SML");
}

fn priced(prices: [(&str, u64, &str); 2]) -> Catalogue {
    let mut catalogue = three_sizes();
    for (model, price, currency) in prices {
        let mut update = controller(model, &[(Quantity::Price, price)]);
        let source = "a quotation".to_owned();
        let value = currency.to_owned();
        update.texts.insert(Statement::Currency, Figure { value, source });
        catalogue.put(update);
    }
    catalogue
}

#[test]
fn prices_decide_where_they_are_known() {
    let catalogue = priced([("M", 9000, "EUR"), ("L", 5000, "EUR")]);
    let plan = allocate(&catalogue, &cell()[..2], &Options::default()).expect("a plan");
    assert_eq!(boxes(&plan), ["L: press", "L: robot"]);
    assert!(plan.remarks[0].starts_with("2 of 4 prices are unknown"), "{:?}", plan.remarks);
    let catalogue = priced([("M", 9000, "EUR"), ("L", 5000, "USD")]);
    let errors = allocate(&catalogue, &cell(), &Options::default()).expect_err("two currencies");
    assert_eq!(errors, [AllocationError::Currencies(vec!["EUR".into(), "USD".into()])]);
}

#[test]
fn a_stock_of_unknown_models_is_refused_whole() {
    let mut catalogue = three_sizes();
    let mut twin = controller("S", &[]);
    twin.vendor = "Others".to_owned();
    catalogue.put(twin);
    let stock = |name: &str| Stock { name: name.to_owned(), count: 1 };
    let options =
        Options { stock: vec![stock("S"), stock("T"), stock("Works L")], ..Options::default() };
    let errors = allocate(&catalogue, &cell(), &options).expect_err("a wrong stock");
    let codes: Vec<&str> = errors.iter().map(AllocationError::code).collect();
    assert_eq!(codes, ["U1132", "U1131"]);
}

#[test]
fn what_is_not_verified_is_not_recommended_unless_the_user_insists() {
    let mut items = cell();
    items[0].verification = Verification::NotPassed("y can never be on".to_owned());
    items[1].verification = Verification::NotAsked;
    let plan = planned(&items, &Options::default());
    assert_eq!(boxes(&plan), ["S: robot-io", "S: understudy"]);
    assert!(plan.items[0].candidates.is_empty());
    let why = plan.items[0].left_over.as_deref();
    assert_eq!(why, Some("not recommended: y can never be on"));
    let insisted = Options { unverified: true, ..Options::default() };
    assert!(planned(&items, &insisted).is_complete());
}

#[test]
fn a_controller_of_which_a_figure_is_missing_is_never_taken() {
    let catalogue = catalogue(vec![controller("X", &[(MEMORY, 100_000)])]);
    let plan = allocate(&catalogue, &cell()[..1], &Options::default()).expect("a plan");
    assert_eq!(plan.items[0].count(Verdict::Unknown), 1);
    assert_eq!(
        plan.items[0].left_over.as_deref(),
        Some(
            "no controller is known to be suitable: 1 of 1 lack a figure, the others are unsuitable"
        )
    );
}

#[test]
fn the_plan_as_lines_as_a_table_and_as_a_page() {
    let plan = planned(&cell(), &share());
    insta::assert_snapshot!("text", text(&plan, false));
    let table = csv(&plan);
    assert_eq!(table.lines().next().map(|line| line.split(',').count()), Some(15));
    assert!(
        table.contains(
            "robot,controller,1,Works,S,,yes,fits,program_memory_bytes,fits,16,60,0.7333,"
        ),
        "{table}"
    );
    let about = Provenance {
        title: "a <cell>".to_owned(),
        version: "0".to_owned(),
        date: "today".to_owned(),
        repeat: "understudy allocate cell.toml --require \"vendor=A&B\"".to_owned(),
        catalogue: "the catalogue of the tests".to_owned(),
    };
    let page = html(&plan, &Terms::default(), &about).expect("a page");
    assert!(page.contains("Controllers for a &lt;cell&gt;"));
    assert!(page.contains("<strong>3 boxes</strong> for 4 places"));
    assert!(!page.contains("vendor=A&B"), "what comes from outside is escaped");
    assert!(!page.contains("<script"), "a page without code");
}

/// Stations, remote I/Os with twins, and networks are counted and priced, next to a cell with twins and to hot-standby pairs.
#[test]
fn a_bill_counts_every_box() {
    let mut priced = Catalogue::default();
    for model in three_sizes().controllers() {
        let mut model = model.clone();
        let price = if model.model == "S" { 10_000 } else { 100_000 };
        let source = "a list".to_owned();
        model.numbers.insert(Quantity::Price, Figure { value: price, source: source.clone() });
        model.texts.insert(Statement::Currency, Figure { value: "EUR".to_owned(), source });
        priced.put(model);
    }
    let mut items = cell();
    items.push(program("press-io", Some(0), Role::RemoteIo));
    let twin_of = Some("press-io".to_owned());
    items.push(Item { twin_of, ..program("press-io-2", Some(0), Role::RemoteIo) });
    let options = Options { networks: 1, ..Options::default() };
    let rows = |catalogue: &Catalogue, items: &[Item]| {
        let plan = allocate(catalogue, items, &options).expect("a plan");
        let rows = plan.bill.iter().map(|row| {
            let price = row.price.as_ref().map(|price| (price.hundredths, price.currency.clone()));
            ((row.stations, row.remote_ios, row.switches, row.boxes), price)
        });
        (rows.collect::<Vec<_>>(), text(&plan, false))
    };
    let eur = |whole: u64| Some((100 * whole, "EUR".to_owned()));
    priced.put_family("W", three_sizes().families["W"].clone());
    let (found, shown) = rows(&priced, &items);
    assert_eq!(found[0], ((3, 3, 1, 7), eur(600)));
    assert_eq!(found[1], ((3, 4, 2, 9), eur(700)));
    assert_eq!(found[2], ((4, 4, 2, 10), eur(800)));
    assert!(shown.contains("press-io-2 (remote-io, twin of press-io)"), "{shown}");
    assert!(shown.contains("hot-standby pairs, redundant I/O, two networks"), "{shown}");
    assert!(shown.contains("800.00 EUR"), "{shown}");
    let (found, shown) = rows(&three_sizes(), &items);
    assert_eq!(found[2], ((4, 4, 2, 10), None), "no price is known");
    assert!(!shown.contains("price without"), "{shown}");
    let (found, _) = rows(&three_sizes(), &items[..3]);
    assert_eq!(found, [], "without remote I/Os it is not a cell");
}

/// The terminals of a program are wired once where its twin has none of its own, and twice where it has: so is their price.
#[test]
fn a_twin_at_the_device_of_the_first_one_has_no_terminals() {
    let source = "a list".to_owned();
    let priced = |model: &str, points: u64, price: u64| {
        let mut priced = controller(
            model,
            &[
                (MEMORY, 100_000),
                (Quantity::DataMemoryBytes, 10_000),
                (Quantity::BoolInstructionNs, 100),
                (Quantity::DigitalInputs, points),
                (Quantity::DigitalOutputs, points),
                (Quantity::Price, price),
            ],
        );
        let currency = Figure { value: "EUR".to_owned(), source: source.clone() };
        priced.texts.insert(Statement::Currency, currency);
        let ports = Figure { value: "Ethernet".to_owned(), source: source.clone() };
        priced.texts.insert(Statement::CommPorts, ports);
        priced
    };
    let catalogue = catalogue(vec![priced("none", 0, 10_000), priced("wired", 8, 50_000)]);
    let check = |has_terminals: bool, twin: u64, model: &str| {
        let text = "program p\ninput a\ninput b\noutput y\nmemory m\nrung [ a | m ] /b ( m )\n";
        let passed = Verification::Passed("proved".to_owned());
        let member = Member {
            name: "press".to_owned(),
            program: resources(text),
            verification: passed.clone(),
            remote_io: "press-io".to_owned(),
            twin: Some(Twin { name: "press-io-2".to_owned(), has_terminals }),
        };
        let group = Group {
            members: vec![member],
            understudies: vec!["understudy".to_owned()],
            understudy: resources(text),
            parity: passed,
            period: Duration::from_millis(10),
        };
        let options = Options { networks: 2, ..Options::default() };
        let plan = allocate(&catalogue, &group.items(0), &options).expect("a plan");
        let expected = [
            "none: press".to_owned(),
            "none: understudy".to_owned(),
            format!("{model}: press-io-2"),
            "wired: press-io".to_owned(),
        ];
        let mut found = boxes(&plan);
        found.sort_by_key(|it| expected.iter().position(|one| one == it));
        assert_eq!(found, expected);
        let prices: Vec<_> =
            plan.bill.iter().map(|row| row.price.as_ref().map(|it| it.hundredths)).collect();
        let redundant = 2 * 10_000 + 2 * 50_000;
        let cell = 2 * 10_000 + 50_000 + twin;
        assert_eq!(prices, [Some(cell), Some(cell), Some(redundant)], "{has_terminals}");
    };
    check(false, 10_000, "none");
    check(true, 50_000, "wired");
}
