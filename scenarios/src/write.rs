//! A scenario as the text of a file that [`crate::read`] reads back unchanged.

use std::fmt::Write as _;
use std::time::Duration;
use understudy_text::duration;

use understudy_journal::{Members, source_word};
use understudy_simulator::{Action, Disturbance, Fault, Network};
use understudy_wire::{Member, Via};

use crate::scenario::{Expectation, Scenario, action_word, set, set_value, written};

/// The text; `members` are those of the scenario's cluster, and `remarks` stand above it for people.
pub fn write(scenario: &Scenario, members: &Members, remarks: &[String]) -> String {
    let mut text = String::new();
    for line in remarks.iter().flat_map(|remark| remark.lines()) {
        let _ = writeln!(text, "# {line}");
    }
    let _ = writeln!(text, "title = {}", quoted(&scenario.title));
    let _ = writeln!(text, "cycles = {}", scenario.cycles);
    if let Some(seed) = scenario.seed {
        let _ = writeln!(text, "seed = {seed}");
    }
    if let Some(cycles) = scenario.spare_after {
        let _ = writeln!(text, "spare_after = {cycles}");
    }
    if let Some(disturbance) = scenario.disturbance() {
        write_network(&mut text, &disturbance);
    }
    for step in &scenario.steps {
        write_step(&mut text, step, members);
    }
    write_expectation(&mut text, &scenario.expect, members);
    text
}

fn write_network(text: &mut String, disturbance: &Disturbance) {
    let (network, usual) = (disturbance.network, Network::default());
    text.push_str("\n[network]\n");
    let shares = [
        ("loss", network.loss),
        ("duplicate", network.duplicate),
        ("corruption", network.corruption),
    ];
    for (key, share) in shares.into_iter().filter(|(_, share)| *share > 0.0) {
        let _ = writeln!(text, "{key} = {share:?}");
    }
    if let Some(number) = network.over.and_then(Via::network) {
        let _ = writeln!(text, "network = {number}");
    }
    if network.latency != usual.latency {
        let _ = writeln!(text, "latency = {}", time(network.latency));
    }
    if network.jitter != usual.jitter {
        let _ = writeln!(text, "jitter = {}", time(network.jitter));
    }
    if let Some(cycles) = &disturbance.cycles {
        let _ = writeln!(text, "from = {}\nto = {}", cycles.start, cycles.end);
    }
}

fn write_step(text: &mut String, step: &Fault, members: &Members) {
    let name = |member| quoted(members.name(member));
    let _ = writeln!(text, "\n[[step]]\nat = {}", step.at_cycle);
    if step.phase > 0.0 {
        let _ = writeln!(text, "phase = {:?}", step.phase);
    }
    let _ = writeln!(text, "action = {}", quoted(action_word(step.action)));
    let _ = writeln!(text, "station = {}", name(step.member));
    let _ = match step.action {
        Action::Write { input, value } => match written(step.member, (input, value), members) {
            Some((name, value)) => writeln!(text, "input = {}\nvalue = {value}", quoted(&name)),
            None => Ok(()),
        },
        Action::Set { input, value } => match set(step.member, input, members) {
            Some(signal) => {
                let (name, value) = (quoted(&signal.name), set_value(signal, value));
                writeln!(text, "input = {name}\nvalue = {value}")
            }
            None => Ok(()),
        },
        Action::StickInput { input, value } => match set(step.member, input, members) {
            Some(signal) => writeln!(text, "input = {}\nvalue = {value}", quoted(&signal.name)),
            None => Ok(()),
        },
        Action::Unset { input } | Action::FreeInput { input } => {
            match set(step.member, input, members) {
                Some(signal) => writeln!(text, "input = {}", quoted(&signal.name)),
                None => Ok(()),
            }
        }
        Action::Cut { to } | Action::Heal { to } => writeln!(text, "to = {}", name(to)),
        Action::Unplug { network } | Action::Plug { network } => match network.network() {
            Some(number) => writeln!(text, "network = {number}"),
            None => writeln!(text, "direct_link = true"),
        },
        Action::Delay { to, by } => {
            writeln!(text, "to = {}\nby = {}", name(to), time(by))
        }
        Action::RestartInEpoch { epoch } => writeln!(text, "epoch = {epoch}"),
        Action::Slow { by } => writeln!(text, "by = {}", time(by)),
        Action::Corrupt { frames } => writeln!(text, "frames = {frames}"),
        Action::Replay { age } => writeln!(text, "age = {age}"),
        Action::FlipState { program, bit } => {
            let controller = name(Member::Station(program.controller()));
            writeln!(text, "program = {controller}\nbit = {bit}")
        }
        Action::FlipSample { bit, frames } | Action::FlipWord { bit, frames } => {
            writeln!(text, "bit = {bit}\nframes = {frames}")
        }
        _ => Ok(()),
    };
}

fn write_expectation(text: &mut String, expect: &Expectation, members: &Members) {
    let _ = writeln!(text, "\n[expect]\nwrong = {}", expect.wrong);
    let counts = [
        ("held", expect.held),
        ("fail_safe", expect.fail_safe),
        ("missed", expect.missed),
        ("plant_faults", expect.plant_faults),
    ];
    for (key, count) in counts {
        if let Some(count) = count {
            let _ = writeln!(text, "{key} = {count}");
        }
    }
    if expect.protected {
        text.push_str("protected = true\n");
    }
    let plant = |program| quoted(members.name(Member::Plant(program)));
    if !expect.functional.is_empty() {
        let names: Vec<String> = expect.functional.iter().copied().map(plant).collect();
        let _ = writeln!(text, "functional = [{}]", names.join(", "));
    }
    if !expect.finished.is_empty() {
        let finished = expect.finished.iter();
        let counts: Vec<String> =
            finished.map(|(&program, count)| format!("{} = {count}", plant(program))).collect();
        let _ = writeln!(text, "finished = {{ {} }}", counts.join(", "));
    }
    for during in &expect.during {
        let sources: Vec<String> =
            during.sources.iter().map(|&source| quoted(source_word(source))).collect();
        let _ = writeln!(
            text,
            "\n[[expect.during]]\nfrom = {}\nto = {}\nremote_io = {}\nsource = [{}]",
            during.from,
            during.to,
            quoted(members.name(Member::RemoteIo(during.remote_io))),
            sources.join(", ")
        );
    }
}

/// A TOML text in quotes.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for letter in text.chars() {
        match letter {
            '"' | '\\' => quoted.extend(['\\', letter]),
            letter if letter.is_control() => {
                let _ = write!(quoted, "\\u{:04x}", u32::from(letter));
            }
            letter => quoted.push(letter),
        }
    }
    quoted.push('"');
    quoted
}

fn time(duration: Duration) -> String {
    quoted(&duration::text(duration))
}
