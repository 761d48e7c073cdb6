//! The database: what comes with the program, what is written, and what is no catalogue.

use std::fs;
use std::path::PathBuf;

use rusqlite::Connection;
use understudy_allocation::{
    Catalogue, Controller, Family, FamilyQuantity, Figure, Kind, Quantity, Statement, file,
};
use understudy_catalogue::{Mode, Store, StoreError, VERSION, seed};

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn figure<T>(value: T) -> Figure<T> {
    let source = "a data sheet".to_owned();
    Figure { value, source }
}

fn one(model: &str, inputs: u64) -> Catalogue {
    let mut controller = Controller::new("Works", model, "W", Kind::Plc);
    controller
        .numbers
        .insert(Quantity::DigitalInputs, figure(inputs));
    controller
        .texts
        .insert(Statement::CommPorts, figure("1x Ethernet".to_owned()));
    let mut catalogue = Catalogue::default();
    catalogue.put(controller);
    catalogue
}

fn codes(errors: &[StoreError]) -> Vec<&'static str> {
    errors.iter().map(StoreError::code).collect()
}

#[test]
fn what_comes_with_the_program_is_whole_and_every_figure_has_a_source() {
    let seed = seed().expect("no errors");
    assert_eq!(seed.len(), 87);
    for controller in seed.controllers() {
        let numbers = controller.numbers.values().map(|figure| &figure.source);
        let texts = controller.texts.values().map(|figure| &figure.source);
        assert!(
            numbers.chain(texts).all(|source| !source.is_empty()),
            "{controller}"
        );
    }
    for family in seed.families.keys() {
        let used = seed.controllers().any(|known| known.family == *family);
        assert!(used, "the family {family} has no controller");
    }
    let known = seed.get("Siemens", "CPU 1214C").expect("it is there");
    assert_eq!(known.number(Quantity::BoolInstructionNs), Some(85));
    assert_eq!(
        known.number(Quantity::DataMemoryBytes),
        None,
        "blank is unknown"
    );
}

#[test]
fn the_database_holds_what_was_put_into_it() {
    let seed = seed().expect("no errors");
    let path = folder("holds").join("c.db");
    let mut store = Store::create(&path, &seed).expect("made");
    let written = store.put(&one("A", 8), Mode::New).expect("new");
    assert_eq!((written.added, written.updated), (1, 0));
    drop(store);
    let read = Store::open(&path, false)
        .expect("opens")
        .read()
        .expect("reads");
    let mut expected = seed;
    for controller in one("A", 8).controllers() {
        expected.put(controller.clone());
    }
    assert_eq!(read, expected);
    // By way of a file, too.
    assert_eq!(
        file::read("c.csv", &file::write(&read)).catalogue,
        Some(read)
    );
}

#[test]
fn a_model_that_is_there_is_updated_only_when_asked() {
    let mut store = Store::in_memory().expect("opens");
    store.put(&one("A", 8), Mode::New).expect("new");
    let mut two = one("A", 9);
    for controller in one("B", 9).controllers() {
        two.put(controller.clone());
    }
    let errors = store.put(&two, Mode::New).expect_err("A is there");
    assert_eq!(codes(&errors), ["U1125"]);
    assert_eq!(
        store.read().expect("reads"),
        one("A", 8),
        "nothing is half-written"
    );
    let written = store.put(&two, Mode::Update).expect("updated");
    assert_eq!((written.added, written.updated), (1, 1));
    assert_eq!(written.changed, ["Works A: digital_inputs"]);
    let mut other = Catalogue::default();
    other.put(Controller::new("Works", "A", "V", Kind::Embedded));
    let errors = store.put(&other, Mode::Update).expect_err("another family");
    assert_eq!(codes(&errors), ["U1129", "U1129"]);
}

#[test]
fn figures_of_families_are_new_or_updated_too() {
    let mut store = Store::in_memory().expect("opens");
    let part = |value| {
        let mut family = Family::default();
        family
            .numbers
            .insert(FamilyQuantity::DataBytesPerBit, figure(value));
        let mut part = Catalogue::default();
        part.put_family("W", family);
        part
    };
    store.put(&part(1), Mode::New).expect("new");
    assert_eq!(
        codes(&store.put(&part(2), Mode::New).expect_err("it is there")),
        ["U1125"]
    );
    store.put(&part(2), Mode::Update).expect("updated");
    assert_eq!(store.read().expect("reads"), part(2));
}

#[test]
fn what_is_no_catalogue_is_refused_with_its_reason() {
    let folder = folder("refused");
    let refused = |name: &str| {
        let path = folder.join(name);
        match Store::open(&path, true).and_then(|store| store.read()) {
            Ok(_) => panic!("{name} was read"),
            Err(error) => error.code(),
        }
    };
    fs::write(folder.join("text"), "vendor,model\n".repeat(100)).expect("written");
    assert_eq!(refused("text"), "U1121");
    Connection::open(folder.join("other"))
        .and_then(|other| other.execute_batch("CREATE TABLE t (a)"))
        .expect("made");
    assert_eq!(refused("other"), "U1122");
    fs::write(folder.join("empty"), "").expect("written");
    assert_eq!(refused("empty"), "U1122");
    assert_eq!(refused("absent"), "U1128");

    let catalogue = |name: &str, change: &str| {
        let path = folder.join(name);
        drop(Store::create(&path, &one("A", 8)).expect("made"));
        let connection = Connection::open(&path).expect("opens");
        connection.execute_batch(change).expect("changed");
    };
    catalogue("newer", &format!("PRAGMA user_version = {}", VERSION + 1));
    assert_eq!(refused("newer"), "U1123");
    catalogue("dangling", "PRAGMA foreign_keys = off; DELETE FROM sources");
    assert_eq!(refused("dangling"), "U1124");
    catalogue(
        "unknown",
        "UPDATE figures SET name = 'colour' WHERE number = 8",
    );
    assert_eq!(refused("unknown"), "U1124");
    catalogue(
        "large",
        "UPDATE figures SET number = 9000000000000 WHERE number = 8",
    );
    assert_eq!(refused("large"), "U1124");
    // The schema itself refuses what is none.
    let path = folder.join("checked");
    drop(Store::create(&path, &one("A", 8)).expect("made"));
    let connection = Connection::open(&path).expect("opens");
    for change in [
        "UPDATE figures SET number = -1 WHERE number = 8",
        "UPDATE controllers SET kind = 'toaster'",
        "UPDATE figures SET text = 'eight' WHERE number = 8",
    ] {
        assert!(connection.execute_batch(change).is_err(), "{change}");
    }
}

/// Every page of the file is overwritten once: it is refused, or what is read is what was there; nothing panics.
#[test]
fn a_damaged_file_is_refused_or_still_right() {
    let folder = folder("damaged");
    let path = folder.join("whole.db");
    drop(Store::create(&path, &one("A", 8)).expect("made"));
    let whole = fs::read(&path).expect("read");
    let page = 4096;
    let mut refused = 0;
    for start in (0..whole.len()).step_by(page / 4) {
        let mut bytes = whole.clone();
        let end = (start + page / 4).min(bytes.len());
        bytes[start..end].fill(0xa5);
        let damaged = folder.join("damaged.db");
        fs::write(&damaged, bytes).expect("written");
        match Store::open(&damaged, false).and_then(|store| store.read()) {
            Ok(read) => assert_eq!(read, one("A", 8), "damage at {start} is not seen"),
            Err(_) => refused += 1,
        }
    }
    assert!(refused > 0);
    let short = folder.join("short.db");
    fs::write(&short, &whole[..whole.len() / 2]).expect("written");
    assert!(
        Store::open(&short, false)
            .and_then(|store| store.read())
            .is_err()
    );
}

#[test]
fn a_file_appears_whole_or_not_at_all() {
    let folder = folder("whole");
    let path = folder.join("c.db");
    drop(Store::create(&path, &one("A", 8)).expect("made"));
    let errors = Store::create(&path, &one("B", 8)).expect_err("it is there");
    assert_eq!(codes(&errors), ["U1126"]);
    let nowhere = folder.join("absent").join("c.db");
    assert!(Store::create(&nowhere, &one("B", 8)).is_err());
    let left: Vec<_> = fs::read_dir(&folder).expect("read").flatten().collect();
    assert_eq!(left.len(), 1, "{left:?}");
}

#[test]
fn people_ask_their_own_questions_of_views_and_indices() {
    let path = folder("views").join("c.db");
    drop(Store::create(&path, &seed().expect("no errors")).expect("made"));
    let connection = Connection::open(&path).expect("opens");
    let count = |query: &str| -> i64 {
        connection
            .query_row(query, [], |row| row.get(0))
            .expect(query)
    };
    assert_eq!(count("SELECT count(*) FROM controller_list"), 87);
    let known = count("SELECT count(*) FROM controller_list WHERE digital_inputs >= 24");
    assert!(known > 5, "{known}");
    assert_eq!(
        count("SELECT count(*) FROM provenance WHERE source = ''"),
        0
    );
    assert_eq!(
        count(
            "SELECT value FROM family_provenance WHERE family = 'LOGO! 0BA8' AND figure = 'program_bytes_per_instruction'"
        ),
        12
    );
    let plan: String = connection
        .query_row(
            "EXPLAIN QUERY PLAN SELECT controller_id FROM figures WHERE name = 'digital_inputs' AND number >= 24",
            [],
            |row| row.get(3),
        )
        .expect("a plan");
    assert!(plan.contains("figures_by_number"), "{plan}");
}
