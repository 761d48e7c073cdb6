//! What a person asks: properties to prove, nets, and words of a command line.

use std::time::Duration;

use understudy_allocation::Requirement;
use understudy_supervisor::petri::{read_net, write_net};
use understudy_verification::property::{read, read_one};

use crate::attack::attack;

/// From one scan to the next.
const PERIOD: Duration = Duration::from_millis(10);

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn properties() {
    let seeds =
        ["examples/vents/vents.properties", "examples/painting-system/painting-system.properties"];
    attack("properties", &seeds, |bytes| {
        let text = text(bytes);
        let found = read(&text, PERIOD);
        for diagnostic in &found.diagnostics {
            assert!(diagnostic.span.end <= text.len(), "{diagnostic:?}");
        }
        // What was read as a part of a file can be asked alone.
        for property in &found.properties {
            assert!(read_one(&property.text, PERIOD).is_ok(), "{}", property.text);
        }
    });
}

#[test]
fn net() {
    attack("net", &["examples/assembly-cell/net.toml"], |bytes| {
        let Some(file) = read_net(&text(bytes)).file else {
            return;
        };
        // What is right is right when it was written.
        let written = write_net(&file);
        assert!(read_net(&written).file.is_some(), "{written}");
    });
}

#[test]
fn words() {
    attack("words", &[], |bytes| {
        for word in text(bytes).split_whitespace() {
            let _ = understudy_ladder::parse_address(word);
            let _ = understudy_text::duration::parse(word);
            let _ = Requirement::parse(word);
            let _ = understudy_network::Impairment::parse_delay(word);
            let _ = serde_json::from_str::<understudy_network::Impairment>(word);
        }
    });
}
