//! Elements one after the other, indented.

use quick_xml::Writer;
use quick_xml::events::{BytesCData, BytesDecl, BytesEnd, BytesStart, BytesText, Event};

/// A document that grows.
pub(super) struct Tree {
    writer: Writer<Vec<u8>>,
}

impl Tree {
    pub(super) fn new() -> Self {
        let mut tree = Self { writer: Writer::new_with_indent(Vec::new(), b' ', 2) };
        tree.event(Event::Decl(BytesDecl::new("1.0", Some("utf-8"), None)));
        tree
    }

    fn event(&mut self, event: Event<'_>) {
        self.writer.write_event(event).expect("a vector takes everything");
    }

    pub(super) fn open(&mut self, name: &str, attributes: &[(&str, &str)]) {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        self.event(Event::Start(start));
    }

    pub(super) fn empty(&mut self, name: &str, attributes: &[(&str, &str)]) {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        self.event(Event::Empty(start));
    }

    pub(super) fn close(&mut self, name: &str) {
        self.event(Event::End(BytesEnd::new(name)));
    }

    pub(super) fn text(&mut self, name: &str, text: &str) {
        self.open(name, &[]);
        self.event(Event::Text(BytesText::new(&printable(text))));
        self.close(name);
    }

    /// Text as the schema wants it for people: an XHTML paragraph.
    pub(super) fn formatted(&mut self, name: &str, text: &str) {
        self.open(name, &[]);
        self.open("xhtml:p", &[]);
        for part in BytesCData::escaped(&printable(text)) {
            self.event(Event::CData(part));
        }
        self.close("xhtml:p");
        self.close(name);
    }

    pub(super) fn finish(self) -> String {
        let mut text = String::from_utf8(self.writer.into_inner()).expect("text of strings");
        text.push('\n');
        text
    }
}

/// XML has no signs for most control characters.
fn printable(text: &str) -> String {
    let allowed = |letter: char| match letter {
        '\n' | '\t' => true,
        '\u{fffe}' | '\u{ffff}' => false,
        other => !other.is_control(),
    };
    text.chars().map(|letter| if allowed(letter) { letter } else { ' ' }).collect()
}
