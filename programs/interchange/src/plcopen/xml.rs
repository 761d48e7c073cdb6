//! The XML of PLCopen, CODESYS and TwinCAT: names with their places, and what the tools add to the standard.

mod passage;

use understudy_ladder::Name;
use understudy_text::Diagnostic;

pub(crate) use passage::Passage;
pub(crate) use understudy_text::xml::{Document, Node, child, children, elements, start_tag};

/// A tree within the bounds.
#[expect(clippy::result_large_err, reason = "once for a file")]
pub(crate) fn parse(text: &str) -> Result<Document<'_>, Diagnostic> {
    understudy_text::xml::parse(text, "U1001")
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
