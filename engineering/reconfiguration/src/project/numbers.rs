//! Whole numbers among the inputs: each of their bits is an input of its own, `level.0`, `level.1` and so on.

use super::Project;

/// How many bits the number of this name has among the inputs; 0 where there is none.
pub(super) fn bits_of(name: &str, inputs: &[&str]) -> usize {
    inputs.iter().filter(|input| number_of(input) == Some(name)).count()
}

/// The number that an input is a bit of.
fn number_of(input: &str) -> Option<&str> {
    let (number, bit) = input.rsplit_once('.')?;
    bit.bytes().all(|digit| digit.is_ascii_digit()).then_some(number)
}

impl Project {
    /// For each number whose bits may fail, but not all of them at once, what is not covered: that its sensor fails as a whole.
    pub fn partly_covered(&self) -> Vec<String> {
        let inputs: Vec<&str> =
            self.ladder.inputs.iter().map(|signal| signal.name.as_str()).collect();
        let mut numbers: Vec<&str> =
            self.channels.iter().filter_map(|place| number_of(inputs.get(*place)?)).collect();
        numbers.dedup();
        let uncovered = numbers.into_iter().filter_map(|number| {
            let bits = bits_of(number, &inputs);
            let chosen = self.channels.iter().filter_map(|place| number_of(inputs.get(*place)?));
            let chosen = chosen.filter(|other| *other == number).count();
            let at_once = self.simultaneous.min(chosen);
            (at_once < bits).then(|| {
                let of = if bits == 1 { "bit" } else { "bits" };
                format!(
                    "`{number}` has {bits} {of}, each a channel of its own, and at most {at_once} of them fail at once here: a sensor of `{number}` that fails as a whole is not covered"
                )
            })
        });
        uncovered.collect()
    }
}
