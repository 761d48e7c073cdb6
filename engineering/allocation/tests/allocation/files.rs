//! Catalogue files: everything that is wrong in one run, and what is written is read again.

use proptest::prelude::*;
use understudy_allocation::file::{read, write};
use understudy_allocation::{
    Catalogue, Controller, Family, FamilyQuantity, Figure, Kind, Quantity, Statement,
};

fn shown(text: &str) -> String {
    let report = read("c.csv", text).report;
    let lines = report.diagnostics.iter().map(|found| {
        let place = report.line_and_column(found.span.start);
        let help = found.help.as_deref().unwrap_or("");
        format!("{place} {} {} / {help}\n", found.code, found.message)
    });
    lines.collect()
}

#[test]
fn everything_that_is_wrong_is_said_in_one_run() {
    let text = "vendor,model,family,kind,digital_imputs,timers,price,source_url,timers
Works,A,W,plc,8,16,,a sheet,16
Works,A,W,plc,8,16,,a sheet,16
Works,B,W,toaster,8,sixteen,12.345,a sheet,16
,C,W,plc,8,-1,,,
Works,D,W,plc,8,4,9.99,a sheet,
Works,E,W,plc
Works,\"F\"G,W,plc,8,99999999999999999999,,a sheet,
";
    insta::assert_snapshot!(shown(text));
}

#[test]
fn everything_that_is_wrong_is_said_of_a_file_with_a_figure_a_line() {
    let text = "vendor,model,family,kind,figure,value,source,notes
Works,A,W,plc,timers,16,a sheet,
Works,A,W,plc,timers,17,a sheet,
Works,A,V,embedded,counters,4,a sheet,
Works,A,W,plc,currency,,a sheet,
Works,B,W,plc,timrs,4,a sheet,
Works,B,W,plc,price,4,a sheet,
Works,B,W,plc,digital_inputs,4,,
,,W,,data_bytes_per_bit,x,a manual,
,,W,,colour,4,a manual,
Works,,W,plc,memory_bytes_base,4,a manual,
";
    insta::assert_snapshot!(shown(text));
}

#[test]
fn an_empty_file_and_one_without_columns_are_no_catalogues() {
    insta::assert_snapshot!(shown("") + &shown("a,b\n1,2\n"));
}

#[test]
fn a_blank_field_is_unknown_and_a_zero_is_a_statement() {
    let text =
        "vendor,model,family,kind,analog_in,analog_out,source_url\nWorks,A,W,plc,,0,a sheet\n";
    let catalogue = read("c.csv", text).catalogue.expect("no errors");
    let controller = catalogue.get("Works", "A").expect("it is there");
    assert_eq!(controller.number(Quantity::AnalogIn), None);
    assert_eq!(controller.number(Quantity::AnalogOut), Some(0));
    assert!(controller.unknown().contains(&"analog_in"));
    assert!(!controller.unknown().contains(&"analog_out"));
}

fn word() -> impl Strategy<Value = String> {
    "[A-Za-z0-9 ,\"é;:/.-]{0,12}".prop_map(|word| format!("x{word}x"))
}

fn figure<T>(value: T, source: String) -> Figure<T> {
    Figure { value, source }
}

fn catalogues() -> impl Strategy<Value = Catalogue> {
    let number = (prop::sample::select(Quantity::ALL.to_vec()), 0_u64..100_000, word());
    let number = number.prop_map(|(quantity, value, source)| {
        // A larger one is refused.
        (quantity, value.min(quantity.most()), source)
    });
    let text = (prop::sample::select(Statement::ALL.to_vec()), word(), word());
    let kind = prop::sample::select(Kind::ALL.to_vec());
    let controller = (
        (word(), word(), word(), kind),
        prop::collection::vec(number, 0..5),
        prop::collection::vec(text, 0..4),
        prop_oneof![Just(String::new()), word()],
    );
    let controller =
        controller.prop_map(|((vendor, model, family, kind), numbers, texts, notes)| {
            let mut controller = Controller::new(&vendor, &model, &family, kind);
            for (quantity, value, source) in numbers {
                controller.numbers.insert(quantity, figure(value, source));
            }
            for (statement, value, source) in texts {
                controller.texts.insert(statement, figure(value, source));
            }
            if controller.numbers.contains_key(&Quantity::Price) {
                let euro = figure("EUR".to_owned(), "a list".to_owned());
                controller.texts.insert(Statement::Currency, euro);
            }
            controller.notes = notes;
            controller
        });
    let family =
        (word(), prop::sample::select(FamilyQuantity::ALL.to_vec()), 0_u64..1000, word(), word());
    let controllers = prop::collection::vec(controller, 0..6);
    (controllers, prop::collection::vec(family, 0..4)).prop_map(|(controllers, families)| {
        let mut catalogue = Catalogue::default();
        for controller in controllers {
            // A model stands once; a second of the same name would be an update.
            if catalogue.get(&controller.vendor, &controller.model).is_none() {
                catalogue.put(controller);
            }
        }
        for (name, quantity, value, source, notes) in families {
            let mut family = Family { notes, ..Family::default() };
            family.numbers.insert(quantity, figure(value, source));
            catalogue.put_family(&name, family);
        }
        catalogue
    })
}

proptest! {
    #[test]
    fn what_is_written_is_read_again(catalogue in catalogues()) {
        let text = write(&catalogue);
        let loaded = read("c.csv", &text);
        prop_assert_eq!(&loaded.report.diagnostics, &vec![]);
        prop_assert_eq!(loaded.catalogue, Some(catalogue));
    }

    #[test]
    fn any_text_is_read_without_panic(text in "[a-z,\"\n\ré0-9 ]{0,80}") {
        let header = "vendor,model,family,kind,digital_inputs,source_url\n";
        let _ = read("c.csv", &text);
        let _ = read("c.csv", &(header.to_owned() + &text));
    }
}
