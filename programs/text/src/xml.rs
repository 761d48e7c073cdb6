//! XML with bounds: no document type, so no entities but the five of XML itself; at most so many bytes, nodes and levels.

use std::ops::Range;

use roxmltree::ParsingOptions;
pub use roxmltree::{Document, Node};

use crate::Diagnostic;

/// The largest file in bytes.
pub const MAXIMUM_BYTES: usize = 16 << 20;

/// The most elements, texts and comments.
pub const MAXIMUM_NODES: u32 = 1_000_000;

/// The most elements within each other.
pub const MAXIMUM_DEPTH: usize = 64;

/// A tree within the bounds, or the reason why the text is refused, with the code of its reader.
///
/// # Errors
/// A text that is too large, not well-formed, of too many nodes or nested too deep.
#[expect(clippy::result_large_err, reason = "once for a file")]
pub fn parse<'t>(text: &'t str, code: &'static str) -> Result<Document<'t>, Diagnostic> {
    if text.len() > MAXIMUM_BYTES {
        let message = format!("the file has {} bytes, more than {MAXIMUM_BYTES}", text.len());
        return Err(Diagnostic::error(code, message, 0..0));
    }
    let options = ParsingOptions { nodes_limit: MAXIMUM_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let place = error.pos();
        let offset = offset(text, place.row as usize, place.col as usize);
        let message = format!("this is not well-formed XML: {error}");
        Diagnostic::error(code, message, offset..offset)
    })?;
    match too_deep(document.root_element()) {
        None => Ok(document),
        Some(span) => {
            let message = format!("elements nest deeper than {MAXIMUM_DEPTH}");
            Err(Diagnostic::error(code, message, span))
        }
    }
}

/// The byte offset of a 1-based row and column.
fn offset(text: &str, row: usize, column: usize) -> usize {
    let mut start = 0;
    for line in text.split_inclusive('\n').take(row.saturating_sub(1)) {
        start += line.len();
    }
    let line = &text[start..];
    let within = line.char_indices().nth(column.saturating_sub(1));
    start + within.map_or(line.len(), |(offset, _)| offset)
}

/// The first element that is too deep, found without recursion.
fn too_deep(root: Node<'_, '_>) -> Option<Range<usize>> {
    let mut node = root;
    let mut depth = 1;
    loop {
        if depth > MAXIMUM_DEPTH {
            return Some(start_tag(node));
        }
        if let Some(child) = node.first_element_child() {
            node = child;
            depth += 1;
            continue;
        }
        loop {
            if node == root {
                return None;
            }
            if let Some(next) = node.next_sibling_element() {
                node = next;
                break;
            }
            node = node.parent_element()?;
            depth -= 1;
        }
    }
}

/// The place of the start tag of an element: a whole element may be long.
pub fn start_tag(node: Node<'_, '_>) -> Range<usize> {
    let range = node.range();
    let text = &node.document().input_text()[range.clone()];
    let end = node
        .attributes()
        .next_back()
        .map_or(range.start + 1 + node.tag_name().name().len(), |last| last.range().end);
    let length = text[end.min(range.end) - range.start..].find('>').map_or(0, |place| place + 1);
    range.start..(end + length).min(range.end)
}

/// The first child element of that name, whatever its namespace.
pub fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}

/// All child elements of that name.
pub fn children<'a, 'i>(node: Node<'a, 'i>, name: &str) -> impl Iterator<Item = Node<'a, 'i>> {
    elements(node).filter(move |child| child.tag_name().name() == name)
}

/// All child elements.
pub fn elements<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(Node::is_element)
}
