//! The tables and the documentation.

use super::*;

/// Each row of the documentation, so that it cannot differ from what is read.
#[test]
fn the_documentation_has_every_key_with_its_bounds() {
    let page = include_str!("../../../../docs/reference/cluster-file.md");
    let parameters = [
        &ROBOT_PARAMETERS,
        &PRESS_PARAMETERS,
        &FIELD,
        &TWIN,
        &POINT,
        &OPERATOR_INPUT,
        &SIGNAL_INPUT,
        &SIGNAL,
    ];
    for section in SECTIONS.into_iter().chain(parameters) {
        has_rows(page, section);
    }
    let page = include_str!("../../../../docs/reference/plant-file.md");
    PLANT_FILE_SECTIONS.into_iter().for_each(|section| has_rows(page, section));
}

fn has_rows(page: &str, section: &Section) {
    assert!(page.contains(&section.header()), "{}", section.header());
    for key in section.keys {
        let default = match (key.required, key.kind.default()) {
            (true, _) => "required".into(),
            (false, Some(default)) => format!("`{default}`"),
            (false, None) => "—".into(),
        };
        let expected = key.kind.expected();
        let row = format!("| `{}` | {expected} | {default} | {} |", key.name, key.meaning);
        assert!(page.contains(&row), "docs/reference lacks the row\n{row}");
    }
}
