//! A document as Structured Text, with the lines of the document that its statements come from.
//!
//! A program that is drawn has no text of its own to be shown with values. Its statements are those that its bodies mean, and each stands in the
//! line of the element of which it is: a coil, a block, a line of a body in text.

use std::collections::BTreeMap;

use understudy_structured_text::print::{Placed, placed};
use understudy_text::Lines;

use crate::format::Format;
use crate::twincat;
use crate::typed_text::parsed;

/// The Structured Text of a program that is written in another form.
#[derive(Debug, Clone)]
pub struct Listing {
    text: String,
    /// The statements of each line of the file.
    by_file: BTreeMap<u32, Statements>,
    /// The line of the file of each line of the listing.
    by_line: BTreeMap<u32, u32>,
}

/// The statements of one line of a file.
#[derive(Debug, Clone, Default)]
struct Statements {
    /// Lines of the listing, the first of each statement.
    lines: Vec<u32>,
    /// Whether all of them are parts of the first one.
    is_one: bool,
}

impl Listing {
    /// The listing of the file `name`; nothing for one that is Structured Text itself, one of rungs, and one that cannot be read.
    pub fn of(name: &str, text: &str) -> Option<Self> {
        let is_text = matches!(Format::of(name, text)?, Format::StructuredText);
        if is_text || twincat::read(text).is_some() {
            return None;
        }
        let (file, _) = parsed(name, text)?;
        let Placed { text: listed, places } = placed(&file);
        let (own, listing) = (Lines::new(text), Lines::new(&listed));
        let line = |lines: &Lines, at| u32::try_from(lines.position(at).line).unwrap_or(u32::MAX);
        let mut found =
            Self { by_file: BTreeMap::new(), by_line: BTreeMap::new(), text: String::new() };
        let mut firsts = BTreeMap::new();
        for (span, at) in places {
            let (file_line, line) = (line(&own, span.start), line(&listing, at));
            let statements = found.by_file.entry(file_line).or_default();
            let first = firsts.entry(file_line).or_insert_with(|| span.clone());
            let is_part = first.start <= span.start && span.end <= first.end;
            statements.is_one = is_part && (statements.is_one || statements.lines.is_empty());
            statements.lines.push(line);
            found.by_line.entry(line).or_insert(file_line);
        }
        found.text = listed;
        Some(found)
    }

    /// The text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The lines of the listing in which the statements of a line of the file begin.
    pub fn lines(&self, file_line: u32) -> &[u32] {
        self.by_file.get(&file_line).map_or(&[], |found| &found.lines)
    }

    /// Whether the statements of a line of the file are one, and parts of it.
    pub fn is_one(&self, file_line: u32) -> bool {
        self.by_file.get(&file_line).is_some_and(|found| found.is_one)
    }

    /// The line of the file whose statement begins in a line of the listing.
    pub fn file_line(&self, line: u32) -> Option<u32> {
        self.by_line.get(&line).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body in text, one element in each line, and two statements in one.
    #[test]
    fn each_statement_has_the_line_of_its_element() {
        let document = "<?xml version=\"1.0\"?>
<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\"><fileHeader companyName=\"\" productName=\"\" productVersion=\"\" creationDateTime=\"2000-01-01T00:00:00\"/><contentHeader name=\"p\"/><types><dataTypes/><pous>
<pou name=\"p\" pouType=\"program\"><interface><inputVars><variable name=\"a\"><type><BOOL/></type></variable></inputVars>
<outputVars><variable name=\"b\"><type><BOOL/></type></variable><variable name=\"c\"><type><BOOL/></type></variable></outputVars></interface>
<body><ST><xhtml xmlns=\"http://www.w3.org/1999/xhtml\">b := a;
IF a THEN c := TRUE; END_IF;
b := NOT a; c := b;</xhtml></ST></body></pou></pous></types></project>";
        let listing = Listing::of("p.xml", document).expect("a document");
        let texts = |file_line: u32| -> Vec<&str> {
            let lines = listing.lines(file_line).iter();
            lines
                .map(|line| listing.text().lines().nth(*line as usize - 1).expect("a line").trim())
                .collect()
        };
        assert_eq!(texts(5), ["b := a;"]);
        assert_eq!(texts(6), ["IF a THEN", "c := TRUE;"]);
        assert_eq!(texts(7), ["b := NOT a;", "c := b;"]);
        assert_eq!([4, 5, 6, 7].map(|line| listing.is_one(line)), [false, true, true, false]);
        let first = listing.lines(7)[0];
        assert_eq!([first, first + 1].map(|line| listing.file_line(line)), [Some(7), Some(7)]);
        assert!(Listing::of("p.st", "PROGRAM p\nEND_PROGRAM\n").is_none());
    }
}
