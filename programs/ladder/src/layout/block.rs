//! Where the parts of a function block stand.

use understudy_text::duration;

use super::{Piece, Shape, length, series, value_of, wire};
use crate::flow::{ElementFlow, Flows, Reading};
use crate::print::series_text;
use crate::program::Block;

/// ```text
///      parts
///    ┌────────┐
/// ───┤CU CTU Q├───
///    │PV 5    │
///    │R reset │
///    └────────┘
/// ```
pub(super) fn block_piece<'e>(
    block: &Block,
    flows: &mut Flows<'e>,
) -> (Piece, Option<&'e ElementFlow>) {
    let outputs = block.kind.outputs();
    let mut rows = Vec::new();
    rows.extend(
        block
            .kind
            .preset_time()
            .map(|time| (format!("PT {}", duration::text(time)), String::new())),
    );
    rows.extend(block.kind.preset_value().map(|value| (format!("PV {value}"), String::new())));
    for feed in &block.pins {
        let before = flows.clone().next().is_some();
        let (_, power) = series(&feed.network, flows);
        let text = format!("{} {}", feed.pin, series_text(&feed.network));
        // A pin on the bare rail has power.
        let value = before.then(|| value_of(power.unwrap_or(true)));
        rows.push((text, value.unwrap_or_default()));
    }
    let flow = flows.next();
    rows.extend(flow.and_then(|flow| held(flow.reading)));
    let (input, word) = (block.kind.wire_input(), block.kind.word());
    let head = length(input) + length(word) + length(outputs[0]) + 2;
    let second = outputs.get(1).copied().unwrap_or("");
    let widths = rows.iter().enumerate().map(|(place, (row, value))| {
        let beside = if place == 0 && !second.is_empty() { length(second) + 1 } else { 0 };
        length(row) + length(value) + beside
    });
    let inner = widths.max().unwrap_or(0).max(head).max(length(&block.name));
    let latest = inner - length(outputs[0]) - 1 - length(word);
    let word_column = ((inner - length(word)) / 2).clamp(length(input) + 1, latest);
    let (left, right) = (2, 3 + inner);
    let bottom = i32::try_from(rows.len()).unwrap_or(0) + 1;
    let label = |column, row, text: &str, value: String| Shape::Label {
        column,
        row,
        text: text.to_owned(),
        value,
        signal: false,
    };
    let plain = |column, row, text| label(column, row, text, String::new());
    let mut shapes = vec![
        Shape::Outline { left, right, top: -1, bottom },
        wire(0, left, 0, flow.is_some_and(|flow| flow.enters)),
        wire(right, right + 2, 0, flow.is_some_and(|flow| flow.leaves)),
        plain(left + 1 + (inner - length(&block.name)) / 2, -2, &block.name),
        plain(left + 1, 0, input),
        plain(left + 1 + word_column, 0, word),
        plain(right - length(outputs[0]), 0, outputs[0]),
        plain(right - length(second), 1, second),
    ];
    let mut row = 0;
    for (text, value) in rows {
        row += 1;
        shapes.push(label(left + 1, row, &text, value));
    }
    let piece = Piece { width: right + 2, above: 2, below: bottom, shapes };
    (piece, flow)
}

/// What a timer or counter holds, by the name of its pin.
fn held(reading: Reading) -> Option<(String, String)> {
    match reading {
        Reading::Nothing | Reading::Bit(_) => None,
        Reading::Number(number) => Some(("CV".to_owned(), format!("={number}"))),
        Reading::Time(time) => Some(("ET".to_owned(), format!("={}", duration::text(time)))),
    }
}
