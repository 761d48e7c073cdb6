//! Inputs that nothing drives: they keep the initial values of their variables.

use understudy_typed::{Point, Points};
use understudy_wire::Image;

/// u where nothing drives it; of an image that is too wide for every member, which is an error, an empty one.
pub(crate) fn initial_image(points: &Points) -> Image {
    Image::from_words(points.width(), &points.initial_image()).unwrap_or_default()
}

/// What inputs are while nothing drives them, as a part of a sentence.
pub(crate) fn remains(inputs: &[&Point]) -> String {
    let values = inputs.iter().filter(|point| point.initial != 0);
    let values: Vec<String> = values
        .map(|point| format!("`{}` {}", point.name, point.declared().text(point.initial)))
        .collect();
    match (inputs, values.as_slice()) {
        ([_], []) => "it stays 0".to_owned(),
        (_, []) => "they stay 0".to_owned(),
        ([point], _) => {
            format!("it keeps its initial value {}", point.declared().text(point.initial))
        }
        _ if values.len() == inputs.len() => {
            format!("they keep their initial values {}", values.join(", "))
        }
        _ => format!("they keep their initial values {}, and 0", values.join(", ")),
    }
}
