//! Input channels that report their own failure.
//!
//! An input module knows of each wire whether it is broken, short or out of its range. A program that has an input
//! `NAME` and an input `NAME.failed` receives this status, and NAME keeps its last good value as long as its channel is
//! failed: a broken wire is no event. Such programs are what `understudy reconfigure` makes.

use understudy_wire::Image;

/// What stands behind the name of an input in the name of its status.
const STATUS: &str = ".failed";

/// An input and the input that is 1 while its channel is failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Channel {
    /// Its place in u(i).
    pub input: usize,
    /// The place of its status in u(i).
    pub status: usize,
}

impl Channel {
    /// The channels of a program with these inputs.
    pub fn of_inputs(names: &[String]) -> Vec<Self> {
        let places = names.iter().enumerate();
        let channel = |(status, name): (usize, &String)| {
            let input = name.strip_suffix(STATUS)?;
            let input = names.iter().position(|other| other == input)?;
            Some(Self { input, status })
        };
        places.filter_map(channel).collect()
    }
}

/// What the program sees of `sensors`, where it has seen `last` before and `unsteady` inputs are not believed yet.
pub(crate) fn seen(
    channels: &[Channel],
    last: &Image,
    sensors: &Image,
    unsteady: Option<&Image>,
) -> Image {
    let mut seen = sensors.clone();
    for input in 0..unsteady.map_or(0, Image::width) {
        if unsteady.is_some_and(|unsteady| unsteady.get(input)) {
            seen.set(input, last.get(input));
        }
    }
    for channel in channels {
        if sensors.get(channel.status) {
            seen.set(channel.input, last.get(channel.input));
        }
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn a_channel_is_an_input_with_a_status() {
        let channel = |input, status| Channel { input, status };
        let check = |text: &str, expected: &[Channel]| {
            assert_eq!(Channel::of_inputs(&names(text)), expected, "{text}");
        };
        check("a b", &[]);
        check("a b b.failed", &[channel(1, 2)]);
        check("b.failed a.failed a b", &[channel(3, 0), channel(2, 1)]);
        check("a.failed", &[]);
        check(".failed a", &[]);
    }

    #[test]
    fn a_failed_channel_keeps_its_last_good_value_in_every_case() {
        let channels = Channel::of_inputs(&names("a b a.failed b.failed"));
        for case in 0..256_u32 {
            let bit = |place: u32| case >> place & 1 == 1;
            let last = Image::from_bits((0..4).map(bit));
            let sensors = Image::from_bits((4..8).map(bit));
            let seen: Vec<bool> = seen(&channels, &last, &sensors, None).bits().collect();
            for input in 0..2 {
                let expected = if bit(6 + input) { bit(input) } else { bit(4 + input) };
                assert_eq!(seen[input as usize], expected, "{case:08b}");
            }
            assert_eq!(seen[2..], [bit(6), bit(7)]);
        }
    }

    #[test]
    fn an_unsteady_input_keeps_its_last_value() {
        for case in 0..8_u32 {
            let [last, sensors, unsteady] =
                [0, 1, 2].map(|place| Image::from_bits([case >> place & 1 == 1]));
            let expected = if unsteady.get(0) { &last } else { &sensors };
            assert_eq!(seen(&[], &last, &sensors, Some(&unsteady)), *expected);
        }
    }
}
