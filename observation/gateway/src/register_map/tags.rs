//! The register map as a list of tags that a SCADA imports: CSV by RFC 4180.

use super::{Area, Place, RegisterMap};

/// Heads of the columns.
const HEADS: [&str; 12] = [
    "name",
    "table",
    "address",
    "registers",
    "type",
    "writable",
    "unit",
    "decimals",
    "low",
    "high",
    "group",
    "description",
];

impl Area {
    /// The name of the table.
    pub fn word(self) -> &'static str {
        match self {
            Self::DiscreteInput => "discrete input",
            Self::Coil => "coil",
            Self::Register => "register",
        }
    }
}

impl RegisterMap {
    /// The places as CSV with a line of heads, each line ended by CR LF.
    pub fn tags(&self) -> String {
        let heads = line(HEADS.map(str::to_owned));
        self.places().iter().fold(heads, |text, place| text + &line(columns(place)))
    }
}

fn columns(place: &Place) -> [String; 12] {
    let Place { area, address, width, name, meaning, writable, of, card } = place;
    let text = |text: &Option<String>| text.clone().unwrap_or_default();
    let number = |number: Option<f64>| number.map_or_else(String::new, |it| it.to_string());
    let decimals = card.decimals.map_or_else(String::new, |it| it.to_string());
    [
        name.clone(),
        area.word().to_owned(),
        address.to_string(),
        width.to_string(),
        of.to_string(),
        writable.to_string(),
        text(&card.unit),
        decimals,
        number(card.low),
        number(card.high),
        text(&card.group),
        // What a signal means, or what a value of the run means.
        card.description.clone().unwrap_or_else(|| meaning.to_string()),
    ]
}

fn line(cells: [String; 12]) -> String {
    let quoted = cells.map(|cell| match cell.contains(['"', ',', '\r', '\n']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell,
    });
    quoted.join(",") + "\r\n"
}
