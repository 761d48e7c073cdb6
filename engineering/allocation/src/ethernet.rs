//! Whether a controller has an Ethernet port, from what its ports are said to be.

/// Statement of a text about ports on Ethernet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ethernet {
    /// It has one.
    Present,
    /// It has ports, and none is Ethernet.
    Absent,
    /// The text does not decide it; also where Ethernet needs a module that is bought apart.
    Undecided,
}

const ETHERNET: [&str; 2] = ["ethernet", "profinet"];
const SERIAL: [&str; 4] = ["rs-232", "rs232", "rs-485", "rs485"];

pub(crate) fn ethernet(ports: &str) -> Ethernet {
    let ports = ports.to_lowercase();
    if ports.contains("ethernet: no") {
        return Ethernet::Absent;
    }
    if ports.contains("module") {
        return Ethernet::Undecided;
    }
    if ETHERNET.iter().any(|word| ports.contains(word)) {
        return Ethernet::Present;
    }
    if SERIAL.iter().any(|word| ports.contains(word)) {
        return Ethernet::Absent;
    }
    Ethernet::Undecided
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_data_sheets_say_of_ports() {
        let check = |ports: &str, expected| assert_eq!(ethernet(ports), expected, "{ports}");
        check("1x PROFINET", Ethernet::Present);
        check("2x Ethernet (1 IP)", Ethernet::Present);
        check("RS-232/485 combo; 10/100 Ethernet; RS-232", Ethernet::Present);
        check("Ethernet: Yes; WiFi: No", Ethernet::Present);
        check("Ethernet: Yes; WiFi: Yes - on the Opta WiFi model", Ethernet::Present);
        check("Ethernet: No; WiFi: Yes", Ethernet::Absent);
        check("1x RS-485 (PPI)", Ethernet::Absent);
        check("RS-232/485", Ethernet::Absent);
        check("Ethernet: Yes with Ethernet module; WiFi: No", Ethernet::Undecided);
        check("1 built-in, up to 5", Ethernet::Undecided);
    }
}
