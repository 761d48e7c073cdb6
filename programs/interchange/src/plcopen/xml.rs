//! XML with bounds: no document type, so no entities but the five of XML itself; at most so many bytes, nodes and levels.

mod passage;

use std::ops::Range;

use roxmltree::{Document, Node, ParsingOptions};
use understudy_ladder::Name;
use understudy_text::Diagnostic;

pub(crate) use passage::Passage;

/// The largest file in bytes.
pub const MAXIMUM_BYTES: usize = 16 << 20;

/// The most elements, texts and comments.
pub const MAXIMUM_NODES: u32 = 1_000_000;

/// The most elements within each other.
pub const MAXIMUM_DEPTH: usize = 64;

/// A tree within the bounds, or the reason why the text is refused.
#[expect(clippy::result_large_err, reason = "once for a file")]
pub(crate) fn parse(text: &str) -> Result<Document<'_>, Diagnostic> {
    if text.len() > MAXIMUM_BYTES {
        let message = format!("the file has {} bytes, more than {MAXIMUM_BYTES}", text.len());
        return Err(Diagnostic::error("U1001", message, 0..0));
    }
    let options = ParsingOptions { nodes_limit: MAXIMUM_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let place = error.pos();
        let offset = offset(text, place.row as usize, place.col as usize);
        let message = format!("this is not well-formed XML: {error}");
        Diagnostic::error("U1001", message, offset..offset)
    })?;
    match too_deep(document.root_element()) {
        None => Ok(document),
        Some(span) => {
            let message = format!("elements nest deeper than {MAXIMUM_DEPTH}");
            Err(Diagnostic::error("U1001", message, span))
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
pub(crate) fn start_tag(node: Node<'_, '_>) -> Range<usize> {
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
pub(crate) fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}

/// All child elements of that name.
pub(crate) fn children<'a, 'i>(
    node: Node<'a, 'i>,
    name: &str,
) -> impl Iterator<Item = Node<'a, 'i>> {
    elements(node).filter(move |child| child.tag_name().name() == name)
}

/// All child elements.
pub(crate) fn elements<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(Node::is_element)
}

/// The PLCopen documents in a document: it, or those among the files of a project.
pub(crate) fn projects<'a, 'i>(root: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    let is_one = root.tag_name().name() == "project";
    is_one.then_some(root).into_iter().chain(children(root, "project").filter(move |_| !is_one))
}

/// An attribute with its place, without the white space around it.
pub(crate) fn attribute(node: Node<'_, '_>, name: &str) -> Option<Name> {
    let attribute = node.attribute_node(name)?;
    Some(Name::at(attribute.value().trim(), attribute.range_value()))
}

/// The program that an instance is of: `typeName`, or `type` as 1.0 has it. CODESYS and TwinCAT leave it empty, and the instance has the name
/// of its program.
pub(crate) fn program_type(instance: Node<'_, '_>) -> Option<Name> {
    let is_empty = attribute(instance, "typeName").is_some_and(|of| of.is_empty());
    let named = ["typeName", "type", if is_empty { "name" } else { "type" }];
    named.into_iter().find_map(|name| attribute(instance, name).filter(|of| !of.is_empty()))
}

/// The last word of the name of additional data: what it holds.
pub(crate) fn held<'a>(data: Node<'a, '_>) -> &'a str {
    let name = data.attribute("name").unwrap_or_default();
    name.rsplit('/').next().unwrap_or_default()
}

/// The additional data of an element that hold what `word` says.
fn additional<'a, 'i>(
    node: Node<'a, 'i>,
    word: &'static str,
) -> impl Iterator<Item = Node<'a, 'i>> {
    let data = children(node, "addData").flat_map(elements);
    data.filter(move |data| held(*data).eq_ignore_ascii_case(word))
}

/// The resources of the applications in the additional data of a project: CODESYS and TwinCAT export them there.
pub(crate) fn applications<'a, 'i>(root: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    let applications = additional(root, "application");
    let within = applications
        .flat_map(|data| children(data, "configuration").flat_map(elements).chain(elements(data)));
    within.filter(|part| part.tag_name().name() == "resource")
}

/// What holds the parts of a program that stand in additional data: units (`pou`), types (`datatype`) or variables (`globalvars`).
pub(crate) fn parts_of_tools<'a, 'i>(
    root: Node<'a, 'i>,
    word: &'static str,
) -> impl Iterator<Item = Node<'a, 'i>> {
    let configurations = children(root, "instances").flat_map(elements);
    let resources = configurations
        .flat_map(|list| children(list, "configuration"))
        .flat_map(|configuration| children(configuration, "resource"));
    let holders = [root].into_iter().chain(applications(root)).chain(resources);
    holders.flat_map(move |holder| additional(holder, word))
}

/// The text of an element and of those in it.
pub(crate) fn text(node: Node<'_, '_>) -> Passage {
    Passage::of(node)
}

/// The text of an element without white space around it; an empty text is placed at the element.
pub(crate) fn word(node: Node<'_, '_>) -> Name {
    let whole = text(node);
    let trimmed = whole.as_str().trim();
    if trimmed.is_empty() {
        return Name::at("", start_tag(node));
    }
    let lead = whole.as_str().len() - whole.as_str().trim_start().len();
    let span = whole.place(lead..lead + trimmed.len());
    Name::at(trimmed, span)
}
