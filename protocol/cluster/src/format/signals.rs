//! The keys of the card of a signal.

use super::{Kind, Section, key};
use crate::card::MAXIMUM_DECIMALS;

/// The table of the cards of signals.
pub(crate) const SIGNALS: &str = "signals";

pub(crate) static SIGNAL: Section = Section {
    name: "signals.NAME",
    repeated: false,
    meaning: "how an input or output is shown, by controller and name, such as `\"tank.level\"`",
    keys: keys! {
        key unit: Kind::Text, "unit of a number, such as `°C`; that of a setpoint where absent";
        key decimals: Kind::Digits { most: MAXIMUM_DECIMALS }, "digits after the decimal point of a REAL or LREAL";
        key low: Kind::Value, "lowest value of scales; that of a setpoint where absent";
        key high: Kind::Value, "highest value of scales; that of a setpoint where absent";
        key description: Kind::Text, "what the signal means; the comment of its declaration where absent";
        key group: Kind::Text, "the part of the plant that it belongs to, such as `heating`";
    },
};
