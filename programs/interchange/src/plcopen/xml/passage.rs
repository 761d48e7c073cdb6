//! A text of an XML file with the exact place of each of its parts.

use std::ops::Range;

use understudy_text::xml::Node;

const CDATA: (&str, &str) = ("<![CDATA[", "]]>");

/// What an element says, and where.
#[derive(Debug, Clone, Default)]
pub(crate) struct Passage {
    text: String,
    /// From which byte of the text on, and the place of that byte in the file; ascending. Up to the next one, both go on together.
    places: Vec<(usize, usize)>,
}

impl Passage {
    /// The texts in an element and in those in it; those of different elements are on lines of their own.
    pub(super) fn of(node: Node<'_, '_>) -> Self {
        let mut passage = Self::default();
        let mut last = None;
        for part in node.descendants().filter(Node::is_text) {
            if last.is_some() && last != part.parent() && !passage.text.ends_with('\n') {
                passage.text.push('\n');
            }
            last = part.parent();
            let content = part.text().unwrap_or_default();
            passage.add(content, node.document().input_text(), part.range().start);
        }
        passage
    }

    /// Adds what `file` says from `at` on: `content`, once marks of CDATA, references and ends of lines are resolved.
    fn add(&mut self, content: &str, file: &str, mut at: usize) {
        let (opening, closing) = CDATA;
        let mut in_cdata = false;
        let mut rest = content;
        // The difference of the places in file and text, where both go on together.
        let mut offset = None;
        while let Some(letter) = rest.chars().next() {
            let raw = file.get(at..).unwrap_or_default();
            if !in_cdata && raw.starts_with(opening) {
                (in_cdata, at) = (true, at + opening.len());
                continue;
            }
            if in_cdata && raw.starts_with(closing) {
                (in_cdata, at) = (false, at + closing.len());
                continue;
            }
            let length = match raw.find(';') {
                Some(end) if !in_cdata && raw.starts_with('&') => end + 1,
                _ if raw.starts_with("\r\n") => 2,
                _ => letter.len_utf8(),
            };
            let here = at.wrapping_sub(self.text.len());
            if offset != Some(here) {
                self.places.push((self.text.len(), at));
                offset = Some(here);
            }
            self.text.push(letter);
            rest = &rest[letter.len_utf8()..];
            at += length;
        }
    }

    pub(crate) fn as_str(&self) -> &str {
        &self.text
    }

    /// The place of a part of the text in the file.
    pub(crate) fn place(&self, part: Range<usize>) -> Range<usize> {
        let at = |offset: usize| {
            let next = self.places.partition_point(|(start, _)| *start <= offset);
            let known = next.checked_sub(1).or((next == 0).then_some(0));
            known
                .and_then(|known| self.places.get(known))
                .map_or(0, |(start, place)| place + offset.saturating_sub(*start))
        };
        let start = at(part.start);
        match part.end.checked_sub(1) {
            Some(last) if last >= part.start => start..(at(last) + 1).max(start),
            _ => start..start,
        }
    }

    /// A part of the text, with its places.
    pub(crate) fn slice(&self, part: Range<usize>) -> Self {
        let first = self.place(part.start..part.start).start;
        let inner =
            self.places.iter().filter(|(start, _)| part.contains(start) && *start > part.start);
        let inner = inner.map(|(start, place)| (start - part.start, *place));
        Self {
            text: self.text[part.clone()].to_owned(),
            places: std::iter::once((0, first)).chain(inner).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use roxmltree::Document;

    use super::Passage;

    /// Each word of the text is in the file where the passage says.
    fn check(file: &str, words: &[(&str, &str)]) {
        let document = Document::parse(file).expect("XML");
        let passage = Passage::of(document.root_element());
        for (word, raw) in words {
            let start = passage.as_str().find(word).expect(word);
            let place = passage.place(start..start + word.len());
            assert_eq!(&file[place], *raw, "{word} of {:?}", passage.as_str());
            let slice = passage.slice(start..passage.as_str().len());
            assert_eq!(&file[slice.place(0..word.len())], *raw, "{word}");
        }
    }

    #[test]
    fn each_part_has_its_exact_place() {
        check("<a>one two</a>", &[("one", "one"), ("two", "two")]);
        check("<a>\n   <p>one two</p>\n</a>", &[("one", "one"), ("two", "two")]);
        check("<a>\r\none\r\ntwo\r\n</a>", &[("one", "one"), ("two", "two")]);
        check(
            "<a> <p><![CDATA[\nLD a\r\nST y]]></p></a>",
            &[("LD", "LD"), ("a\nST", "a\r\nST"), ("y", "y")],
        );
        check(
            "<a>x &lt;= y &#38; z <![CDATA[u]]> v</a>",
            &[
                ("<= y", "&lt;= y"),
                ("y", "y"),
                ("& z", "&#38; z"),
                ("z", "z"),
                ("u", "u"),
                ("v", "v"),
            ],
        );
        check("<a>é &amp; ü<!-- c -->w</a>", &[("ü", "ü"), ("w", "w")]);
    }

    #[test]
    fn paragraphs_are_lines() {
        let document = Document::parse("<a><p>LD a</p><p>ST y</p></a>").expect("XML");
        assert_eq!(Passage::of(document.root_element()).as_str(), "LD a\nST y");
    }
}
