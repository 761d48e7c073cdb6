//! User requirements in addition to those of the program: `digital_inputs>=24`, `vendor=Siemens`, `remote-io:ethernet`.

use std::time::Duration;

use understudy_text::duration;
use understudy_text::words;

use crate::controller::Kind;
use crate::figures::{Quantity, Statement};

words! {
    /// Purpose of a position.
    pub enum Role by name {
        /// Runs one program.
        Controller = "controller",
        /// Runs the program that is generated from all others of its group.
        Understudy = "understudy",
        /// Has the terminals of one program.
        RemoteIo = "remote-io",
    }
}

/// Comparison with a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// `>=`
    AtLeast,
    /// `<=`
    AtMost,
    /// `=`
    Exactly,
}

/// The requested property.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Asked {
    /// A number in its bound.
    Number(Quantity, Bound, u64),
    /// A text that contains this, whatever the capitals.
    Contains(Statement, String),
    /// The vendor.
    Vendor(String),
    /// The family.
    Family(String),
    /// The model.
    Model(String),
    /// PLC or embedded.
    Kind(Kind),
    /// The scan takes no longer.
    ScanTime(Duration),
    /// It has an Ethernet port.
    Ethernet,
}

/// One requirement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Requirement {
    /// Role of the controllers concerned; none: all roles.
    pub role: Option<Role>,
    /// The requested property.
    pub asked: Asked,
    /// The requirement as it was written.
    pub text: String,
}

/// Invalid requirement.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("U1130: `{text}` is not a requirement: {reason}")]
pub struct RequirementError {
    /// The requirement as it was written.
    pub text: String,
    /// The reason.
    pub reason: String,
}

impl Requirement {
    /// Reads `[role:]name>=number`, `[role:]name~words`, `[role:]name=word` or `[role:]ethernet`.
    ///
    /// # Errors
    /// An unknown role or name, an invalid number, or a comparison that the name does not support.
    pub fn parse(text: &str) -> Result<Self, RequirementError> {
        let wrong = |reason: String| RequirementError { text: text.to_owned(), reason };
        let (role, rest) = match text.split_once(':') {
            // A blank belongs to a name (`vendor=A: B`), a role has none.
            Some((role, rest)) if !role.contains(['=', '~', ' ', '<', '>']) => {
                let role = Role::of(role).ok_or_else(|| {
                    wrong(format!(
                        "`{role}` is not a role; expected controller, understudy or remote-io"
                    ))
                })?;
                (Some(role), rest)
            }
            _ => (None, text),
        };
        Ok(Self { role, asked: asked(rest.trim()).map_err(wrong)?, text: text.to_owned() })
    }

    /// The name of its criterion in a comparison.
    pub(crate) fn criterion(&self) -> String {
        format!("required: {}", self.text)
    }

    /// Whether it applies to controllers of this role.
    pub fn is_of(&self, role: Role) -> bool {
        self.role.is_none_or(|asked| asked == role)
    }
}

fn asked(text: &str) -> Result<Asked, String> {
    if text.eq_ignore_ascii_case("ethernet") {
        return Ok(Asked::Ethernet);
    }
    let Some(at) = text.find(['=', '~', '<', '>']) else {
        let help = "a comparison such as digital_inputs>=24, vendor=Siemens or languages~ladder is expected, or ethernet";
        return Err(help.to_owned());
    };
    let (name, rest) = text.split_at(at);
    let signs = [">=", "<=", "=", "~"];
    let Some(sign) = signs.into_iter().find(|sign| rest.starts_with(sign)) else {
        return Err("the comparisons are >=, <=, = and ~ (contains)".to_owned());
    };
    let name = name.trim().replace('-', "_");
    let value = rest[sign.len()..].trim();
    if value.is_empty() {
        return Err("missing value after the comparison".to_owned());
    }
    if let Some(quantity) = quantity(&name) {
        return number(quantity, sign, value);
    }
    let only = |allowed: &str, asked: Asked| {
        if sign == allowed {
            Ok(asked)
        } else {
            Err(format!("`{name}` is compared by `{allowed}`"))
        }
    };
    if let Some(statement) = Statement::of(&name) {
        return only("~", Asked::Contains(statement, value.to_lowercase()));
    }
    match name.as_str() {
        "vendor" => only("=", Asked::Vendor(value.to_owned())),
        "family" => only("=", Asked::Family(value.to_owned())),
        "model" => only("=", Asked::Model(value.to_owned())),
        "kind" => match Kind::of(value) {
            Some(kind) => only("=", Asked::Kind(kind)),
            None => Err(format!("`{value}` is not a kind; expected {}", Kind::WORDS)),
        },
        "scan_time" => match duration::parse_positive(value) {
            Ok(time) => only("<=", Asked::ScanTime(time)),
            Err(error) => Err(error.to_string()),
        },
        _ => Err(format!("there is no `{name}`; {}", known_names())),
    }
}

fn quantity(name: &str) -> Option<Quantity> {
    match name {
        "inputs" => Some(Quantity::DigitalInputs),
        "outputs" => Some(Quantity::DigitalOutputs),
        "program_memory" => Some(Quantity::ProgramMemoryBytes),
        "data_memory" => Some(Quantity::DataMemoryBytes),
        _ => Quantity::of(name),
    }
}

fn number(quantity: Quantity, sign: &str, value: &str) -> Result<Asked, String> {
    let bound = match sign {
        ">=" => Bound::AtLeast,
        "<=" => Bound::AtMost,
        "=" => Bound::Exactly,
        _ => return Err(format!("{quantity} is compared by >=, <= or =")),
    };
    let is_memory = matches!(quantity, Quantity::ProgramMemoryBytes | Quantity::DataMemoryBytes);
    let units = [("KiB", 1 << 10), ("MiB", 1 << 20), ("KB", 1000), ("MB", 1_000_000)];
    let unit = units.into_iter().find(|(unit, _)| is_memory && value.ends_with(unit));
    let (digits, scale) = unit
        .map_or((value, 1), |(unit, scale)| (value[..value.len() - unit.len()].trim_end(), scale));
    let number = quantity.parse(digits);
    let number = number.and_then(|number| number.checked_mul(scale));
    let number = number.filter(|number| *number <= quantity.most());
    match number {
        Some(number) => Ok(Asked::Number(quantity, bound, number)),
        None => Err(format!("`{value}` is not a valid {quantity}")),
    }
}

fn known_names() -> String {
    let quantities = Quantity::ALL.map(Quantity::name).join(", ");
    let statements = Statement::ALL.map(Statement::name).join(", ");
    format!(
        "known are {quantities}, {statements}, vendor, family, model, kind, scan_time, ethernet"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, role: Option<Role>, expected: Asked) {
        let found = Requirement::parse(text).expect(text);
        assert_eq!((found.role, found.asked), (role, expected), "{text}");
    }

    #[test]
    fn requirements_are_read() {
        let number = Asked::Number;
        let inputs = Quantity::DigitalInputs;
        check("inputs>=24", None, number(inputs, Bound::AtLeast, 24));
        check("digital-inputs = 8", None, number(inputs, Bound::Exactly, 8));
        let memory = number(Quantity::ProgramMemoryBytes, Bound::AtLeast, 64 << 10);
        check("understudy:program-memory>=64KiB", Some(Role::Understudy), memory);
        check("price<=99.5", None, number(Quantity::Price, Bound::AtMost, 9950));
        check("remote-io:ethernet", Some(Role::RemoteIo), Asked::Ethernet);
        let languages = Asked::Contains(Statement::Languages, "ladder".into());
        check("languages~Ladder", None, languages);
        check("vendor=A: B", None, Asked::Vendor("A: B".into()));
        check("scan_time<=10ms", None, Asked::ScanTime(Duration::from_millis(10)));
    }

    #[test]
    fn what_is_no_requirement_is_refused() {
        for text in [
            "",
            "inputs",
            "inputs>24",
            "inputs>=",
            "inputs>=x",
            "inputs~3",
            "inputs>=99999999999",
            "vendor>=A",
            "brain:inputs>=3",
            "scan_time<=0ms",
            "kind=toaster",
            "colour=red",
            "timers>=4KiB",
            "price>=1.234",
        ] {
            assert!(Requirement::parse(text).is_err(), "{text}");
        }
    }
}
