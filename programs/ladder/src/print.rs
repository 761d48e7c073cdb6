//! A program back to text; [`crate::parse`] reads the same program from it.

use std::fmt::Write;

use understudy_text::duration;

use crate::program::{Block, Coil, CoilKind, Element, Name, Program, Rung, Series, Signal};

/// Characters of a line past which a series is broken between its elements.
const LINE_WIDTH: usize = 100;

/// The text of a program in the ladder format.
///
/// Reading it gives the same program again, if this one could have been read: names are names, comments and titles stand on
/// one line each, and branches are two or more.
pub fn print(program: &Program) -> String {
    let mut text = String::new();
    comments(&mut text, &program.comments);
    let _ = write!(text, "program {}", program.name);
    describe(&mut text, &program.description);
    let groups =
        [("input ", &program.inputs), ("output", &program.outputs), ("memory", &program.memory)];
    for (keyword, signals) in groups {
        if !signals.is_empty() {
            text.push('\n');
            declarations(&mut text, keyword, signals);
        }
    }
    retained(&mut text, &program.retained);
    for rung in &program.rungs {
        text.push('\n');
        print_rung(&mut text, rung);
    }
    if !program.footer.is_empty() {
        text.push('\n');
        comments(&mut text, &program.footer);
    }
    text
}

/// The declaration of what is retentive.
fn retained(text: &mut String, names: &[Name]) {
    let Some((first, rest)) = names.split_first() else {
        return;
    };
    let mut line = format!("retain {first}");
    text.push('\n');
    for name in rest {
        line.push(',');
        if line.len() + 1 + name.len() > LINE_WIDTH {
            let _ = writeln!(text, "{line}");
            line = String::from("      ");
        }
        let _ = write!(line, " {name}");
    }
    let _ = writeln!(text, "{line}");
}

fn comments(text: &mut String, comments: &[String]) {
    for comment in comments {
        let line = format!("-- {}", one_line(comment));
        let _ = writeln!(text, "{}", line.trim_end());
    }
}

fn describe(text: &mut String, description: &Option<String>) {
    if let Some(description) = description {
        let _ = write!(text, "  -- {}", one_line(description));
    }
    text.push('\n');
}

fn one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ").trim().to_owned()
}

fn declarations(text: &mut String, keyword: &str, signals: &[Signal]) {
    let width = signals.iter().map(|signal| signal.name.chars().count()).max().unwrap_or(0);
    for signal in signals {
        comments(text, &signal.comments);
        let mut line = format!("{keyword} {:width$}", signal.name.as_str());
        if let Some(address) = &signal.address {
            let _ = write!(line, " at {address}");
        }
        if let Some(initial) = signal.initial {
            let _ = write!(line, " = {}", u8::from(initial));
        }
        text.push_str(line.trim_end());
        describe(text, &signal.description);
    }
}

fn print_rung(text: &mut String, rung: &Rung) {
    comments(text, &rung.comments);
    text.push_str("rung");
    if let Some(title) = &rung.title {
        let title = one_line_title(title);
        let _ = write!(text, " \"{title}\"");
    }
    text.push('\n');
    let mut words = Vec::new();
    words_of_series(&rung.network, &mut words);
    for coil in &rung.coils {
        words.push(coil_text(coil));
    }
    let mut line = String::from("   ");
    for word in words {
        if line.len() + 1 + word.len() > LINE_WIDTH && !line.trim().is_empty() {
            let _ = writeln!(text, "{line}");
            line = String::from("       ");
        }
        line.push(' ');
        line.push_str(&word);
    }
    if !line.trim().is_empty() {
        let _ = writeln!(text, "{line}");
    }
}

fn one_line_title(title: &str) -> String {
    title.replace('\\', "\\\\").replace('"', "\\\"").replace(['\n', '\r'], " ")
}

/// The words of a series, between which a line can be broken.
fn words_of_series(series: &Series, words: &mut Vec<String>) {
    for element in series {
        match element {
            Element::Contact(_) | Element::Comparison(_) => words.push(element_text(element)),
            Element::Branches(branches) => {
                for (place, branch) in branches.iter().enumerate() {
                    words.push(if place == 0 { "[" } else { "|" }.into());
                    words_of_series(branch, words);
                }
                words.push("]".into());
            }
            Element::Block(block) => words_of_block(block, words),
        }
    }
}

fn words_of_block(block: &Block, words: &mut Vec<String>) {
    let mut head = format!("{{{} {}", block.kind.word(), block.name);
    if let Some(time) = block.kind.preset_time() {
        let _ = write!(head, " {}", duration::text(time));
    }
    if let Some(value) = block.kind.preset_value() {
        let _ = write!(head, " {value}");
    }
    words.push(head);
    for feed in &block.pins {
        let network = match feed.network.as_slice() {
            [Element::Contact(_) | Element::Comparison(_) | Element::Branches(_)] => {
                series_text(&feed.network)
            }
            _ => format!("[{}]", series_text(&feed.network)),
        };
        words.push(format!("{}={network}", feed.pin));
    }
    if let Some(last) = words.last_mut() {
        last.push('}');
    }
}

/// A series on one line.
pub(crate) fn series_text(series: &Series) -> String {
    let mut words = Vec::new();
    words_of_series(series, &mut words);
    words.join(" ")
}

/// The text above a contact: its operand or comparison, with the sign before it.
fn element_text(element: &Element) -> String {
    match element {
        Element::Contact(contact) => format!("{}{}", contact.kind.sign(), contact.operand),
        Element::Comparison(comparison) => {
            format!("{}.CV{}{}", comparison.counter, comparison.relation.sign(), comparison.value)
        }
        Element::Branches(_) | Element::Block(_) => String::new(),
    }
}

fn coil_text(coil: &Coil) -> String {
    match coil.kind {
        CoilKind::Set | CoilKind::Reset => format!("({} {})", coil.kind.sign(), coil.target),
        _ => format!("({}{})", coil.kind.sign(), coil.target),
    }
}
