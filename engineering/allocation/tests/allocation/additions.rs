//! The catalogue that comes with the program, and what is added to one.

use understudy_allocation::{
    AdditionError, Catalogue, Controller, Family, FamilyQuantity, Figure, Kind, Mode, Quantity,
    Statement, file,
};

fn figure<T>(value: T) -> Figure<T> {
    let source = "a data sheet".to_owned();
    Figure { value, source }
}

fn one(model: &str, inputs: u64) -> Catalogue {
    let mut controller = Controller::new("Works", model, "W", Kind::Plc);
    controller.numbers.insert(Quantity::DigitalInputs, figure(inputs));
    controller.texts.insert(Statement::CommPorts, figure("1x Ethernet".to_owned()));
    let mut catalogue = Catalogue::default();
    catalogue.put(controller);
    catalogue
}

fn codes(errors: &[AdditionError]) -> Vec<&'static str> {
    errors.iter().map(AdditionError::code).collect()
}

#[test]
fn what_comes_with_the_program_is_whole_and_every_figure_has_a_source() {
    let known = Catalogue::built_in().expect("no errors");
    assert_eq!(known.len(), 87);
    for controller in known.controllers() {
        let numbers = controller.numbers.values().map(|figure| &figure.source);
        let texts = controller.texts.values().map(|figure| &figure.source);
        assert!(numbers.chain(texts).all(|source| !source.is_empty()), "{controller}");
    }
    for family in known.families.keys() {
        let used = known.controllers().any(|known| known.family == *family);
        assert!(used, "the family {family} has no controller");
    }
    let siemens = known.get("Siemens", "CPU 1214C").expect("it is there");
    assert_eq!(siemens.number(Quantity::BoolInstructionNs), Some(85));
    assert_eq!(siemens.number(Quantity::DataMemoryBytes), None, "blank is unknown");
    let read = file::read("c.csv", &file::write(&known)).catalogue;
    assert_eq!(read, Some(known));
}

#[test]
fn a_model_that_is_there_is_updated_only_when_asked() {
    let mut catalogue = one("A", 8);
    let mut two = one("A", 9);
    for controller in one("B", 9).controllers() {
        two.put(controller.clone());
    }
    let errors = catalogue.add(&two, Mode::New).expect_err("A is there");
    assert_eq!(codes(&errors), ["U1125"]);
    assert_eq!(catalogue, one("A", 8), "nothing is half-written");
    let added = catalogue.add(&two, Mode::Update).expect("updated");
    assert_eq!((added.models, added.updated), (1, 1));
    assert_eq!(added.changed, ["Works A: digital_inputs"]);
    let mut other = Catalogue::default();
    other.put(Controller::new("Works", "A", "V", Kind::Embedded));
    let errors = catalogue.add(&other, Mode::Update);
    let errors = errors.expect_err("another family");
    assert_eq!(codes(&errors), ["U1129", "U1129"]);
}

#[test]
fn figures_of_families_are_new_or_updated_too() {
    let part = |value| {
        let mut family = Family::default();
        family.numbers.insert(FamilyQuantity::DataBytesPerBit, figure(value));
        let mut part = Catalogue::default();
        part.put_family("W", family);
        part
    };
    let mut catalogue = Catalogue::default();
    catalogue.add(&part(1), Mode::New).expect("new");
    let again = catalogue.add(&part(2), Mode::New);
    assert_eq!(codes(&again.expect_err("it is there")), ["U1125"]);
    catalogue.add(&part(2), Mode::Update).expect("updated");
    assert_eq!(catalogue, part(2));
}
