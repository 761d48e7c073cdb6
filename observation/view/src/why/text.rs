//! A chain of reasons as a tree in text.

use std::fmt::Write as _;

use serde_json::Value;
use understudy_typed::Declared;

use super::{Reason, Why, WhyForced};
use crate::value::{stored_text, value_text};
use crate::zone::Zone;

impl Why {
    /// For a terminal, with times of day in a zone; lines end in a newline.
    pub fn to_text(&self, zone: Zone) -> String {
        let mut text = String::new();
        let value = self.text_of(&self.value);
        let at = self.at.map_or_else(String::new, |at| format!(", {}", zone.whole(at)));
        let _ = writeln!(
            text,
            "{}.{} is {value} in cycle {}{at}",
            self.program, self.signal, self.cycle
        );
        if let Some(age) = self.age_cycles {
            let _ = writeln!(
                text,
                "  NOT THE PRESENT: {} has reported nothing for {age} cycles",
                self.remote_io
            );
        }
        self.write_driving(&mut text);
        if let Some(scanned) = &self.scanned {
            let scanned = self.text_of(scanned);
            let _ = writeln!(text, "  the scan of this cycle yields {scanned}");
        }
        if let Some(inputs) = self.inputs_text.as_ref().filter(|it| !it.is_empty()) {
            let _ = writeln!(text, "  inputs: {inputs}");
        }
        if let Some(restored) = &self.reconstructed {
            let not_received = if restored.not_received.is_empty() {
                "no station".to_owned()
            } else {
                restored.not_received.join(", ")
            };
            let _ = writeln!(text, "  not received: {not_received}");
            let mask = restored.mask.join(" + ");
            let _ = writeln!(
                text,
                "  parity word of {} over {mask}: {}",
                restored.word_of, restored.word
            );
            for other in &restored.others {
                let _ = writeln!(text, "  + {} of {}", other.outputs, other.published_by);
                if let Some(values) = &other.values_text {
                    let _ = writeln!(text, "    {values}");
                }
            }
            let proof = if restored.proved {
                "the outputs that the samples yield"
            } else {
                "NOT the outputs that the samples yield"
            };
            let _ = writeln!(text, "  = {}, {proof}; lineage {}", restored.sum, restored.lineage);
            if let Some(values) = &restored.values_text {
                let _ = writeln!(text, "    {values}");
            }
        }
        // Of a forced output the value without the force.
        let it = if self.forced.is_some() { "that" } else { "it" };
        if let Some(configured) = &self.ramp_to {
            let configured = self.text_of(configured);
            let _ = writeln!(text, "  {it} is on its ramp to the fail-safe value {configured}");
        } else if self.source == Some(FAIL_SAFE) {
            let _ = writeln!(text, "  {it} is the configured fail-safe value");
        }
        if let Some(reason) = &self.because {
            line(&mut text, reason, self.cycle, zone);
            children(&mut text, reason, "", zone);
        }
        text
    }
}

impl Why {
    fn text_of(&self, value: &Value) -> String {
        text_of(value, self.of.as_ref(), self.unit.as_deref())
    }

    /// The remote I/O that drives an output, with the force that is in effect or the cycle that it missed.
    fn write_driving(&self, text: &mut String) {
        if let Some(force) = &self.forced {
            let WhyForced { owner, reason, seconds, since, .. } = force;
            let _ = writeln!(
                text,
                "  forced by {owner} since cycle {since}, for {seconds} s: {reason}"
            );
        }
        if let Some(kept) = self.kept_since {
            let _ = writeln!(
                text,
                "  {} missed this deadline: the device kept the value of cycle {kept}",
                self.remote_io
            );
        }
        let Some(source) = self.source else {
            return;
        };
        let why = self.missing.map_or(String::new(), |missing| format!(": {missing}"));
        let unforced = self.forced.as_ref().and_then(|force| force.unforced.as_ref());
        let _ = match unforced {
            Some(value) => {
                let value = self.text_of(value);
                writeln!(
                    text,
                    "  {} drives it; without the force it would be {value}, {source}{why}",
                    self.remote_io
                )
            }
            None => writeln!(text, "  {} drives it, {source}{why}", self.remote_io),
        };
    }
}

/// The source of values that no program computed.
const FAIL_SAFE: &str = "fail-safe";

/// A value as people read it, with its unit and all digits: a comparison reads them all.
fn text_of(value: &Value, declared: Option<&Declared>, unit: Option<&str>) -> String {
    let text = match (declared, value.as_i64()) {
        (Some(declared), Some(stored)) if declared.of.is_time() => {
            stored_text(declared, stored as u64)
        }
        _ => value_text(value),
    };
    match unit {
        Some(unit) => format!("{text} {unit}"),
        None => text,
    }
}

fn children(text: &mut String, reason: &Reason, indent: &str, zone: Zone) {
    let last = reason.because.len().saturating_sub(1);
    for (place, child) in reason.because.iter().enumerate() {
        let (branch, below) = if place == last { ("└ ", "  ") } else { ("├ ", "│ ") };
        let _ = write!(text, "{indent}{branch}");
        line(text, child, reason.cycle, zone);
        children(text, child, &format!("{indent}{below}"), zone);
    }
}

fn line(text: &mut String, reason: &Reason, parent: i64, zone: Zone) {
    let value = text_of(&reason.value, reason.of.as_ref(), reason.unit.as_deref());
    let at = reason.at.map_or_else(String::new, |at| format!(", {}", zone.clock(at)));
    let when = if reason.cycle == parent {
        String::new()
    } else {
        format!(" in cycle {}{at}", reason.cycle)
    };
    let rung = reason.rung.map_or(String::new(), |rung| {
        let title = reason.title.as_ref();
        let title = title.map_or(String::new(), |title| format!(" \"{title}\""));
        format!(" [rung {rung}{title}]")
    });
    let written = match (reason.line, &reason.statement) {
        (Some(line), Some(statement)) => format!(" [line {line} \"{statement}\"]"),
        (Some(line), None) => format!(" [line {line}]"),
        (None, _) => String::new(),
    };
    let _ = writeln!(text, "{} = {value}{when}: {}{rung}{written}", reason.signal, reason.text);
}
