//! Programs and controllers of a few words.

use understudy_allocation::{
    Catalogue, Controller, Family, FamilyQuantity, Figure, Kind, Quantity, Resources,
};
use understudy_ladder::{Program, parse};

pub(crate) fn program(text: &str) -> Program {
    let parsed = parse(text);
    let errors: Vec<String> = parsed
        .diagnostics
        .iter()
        .map(|found| format!("{} {}", found.code, found.message))
        .filter(|found| !found.starts_with("U015"))
        .collect();
    assert!(errors.is_empty(), "{errors:?}");
    parsed.program
}

pub(crate) fn resources(text: &str) -> Resources {
    Resources::of(&program(text))
}

/// A controller of the vendor "Works" and the family "W".
pub(crate) fn controller(model: &str, numbers: &[(Quantity, u64)]) -> Controller {
    let mut controller = Controller::new("Works", model, "W", Kind::Plc);
    for &(quantity, value) in numbers {
        let source = format!("sheet of {model}");
        controller.numbers.insert(quantity, Figure { value, source });
    }
    controller
}

pub(crate) fn family(numbers: &[(FamilyQuantity, u64)]) -> Family {
    let mut family = Family::default();
    for &(quantity, value) in numbers {
        let source = "manual of W".to_owned();
        family.numbers.insert(quantity, Figure { value, source });
    }
    family
}

/// The family that stores an instruction in 4 bytes and a bit in 1.
pub(crate) fn catalogue(controllers: Vec<Controller>) -> Catalogue {
    let mut catalogue = Catalogue::default();
    for controller in controllers {
        catalogue.put(controller);
    }
    let figures =
        [(FamilyQuantity::ProgramBytesPerInstruction, 4), (FamilyQuantity::DataBytesPerBit, 1)];
    catalogue.put_family("W", family(&figures));
    catalogue
}
