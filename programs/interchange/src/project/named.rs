//! What the file of a TwinCAT project (`.plcproj`) names: its files, and libraries that are not here.

use std::ops::Range;

use understudy_text::Diagnostic;
use understudy_text::xml::Node;

use super::is_part;
use crate::plcopen::xml::{attribute, child, elements, parse, start_tag, word};

/// The library whose blocks and functions are here.
const PROVIDED: [&str; 2] = ["Tc2_Standard", "Standard"];

/// Names that a finding lists.
const SHOWN: usize = 12;

/// The file of a project.
#[derive(Debug, Clone, Default)]
pub struct ProjectFile {
    /// Its name.
    pub name: String,
    /// Its text.
    pub text: String,
    /// The files that it names, in its order, with the places of the elements. Those that are excluded from the build are left out.
    pub files: Vec<(String, Range<usize>)>,
    /// The libraries that it refers to and that are not here, with the places of the references.
    pub libraries: Vec<(String, Range<usize>)>,
}

/// Reads the file of a project.
///
/// # Errors
/// A text that is not well-formed, or no project (U1001).
#[expect(clippy::result_large_err, reason = "once for a project")]
pub fn read_project(name: &str, text: &str) -> Result<ProjectFile, Diagnostic> {
    let document = parse(text)?;
    let root = document.root_element();
    if root.tag_name().name() != "Project" {
        let message = format!("this is no project: its root is `{}`", root.tag_name().name());
        return Err(Diagnostic::error("U1001", message, start_tag(root)));
    }
    let mut project =
        ProjectFile { name: name.to_owned(), text: text.to_owned(), ..ProjectFile::default() };
    for item in elements(root).filter(|part| part.tag_name().name() == "ItemGroup") {
        for item in elements(item) {
            let Some(named) = attribute(item, "Include") else {
                continue;
            };
            match item.tag_name().name() {
                "Compile" if is_part(&named) && !is_excluded(item) => {
                    project.files.push((named.replace('\\', "/"), item.range()));
                }
                "PlaceholderReference" | "LibraryReference" => {
                    // `NAME,VERSION,COMPANY`
                    let library = named.split(',').next().unwrap_or_default().trim();
                    let mut known = project.libraries.iter().map(|(known, _)| known.as_str());
                    let is_new = known.all(|known| !known.eq_ignore_ascii_case(library));
                    if is_new && !PROVIDED.iter().any(|it| it.eq_ignore_ascii_case(library)) {
                        project.libraries.push((library.to_owned(), named.span()));
                    }
                }
                _ => {}
            }
        }
    }
    Ok(project)
}

/// Whether an item is not compiled.
fn is_excluded(item: Node<'_, '_>) -> bool {
    child(item, "ExcludeFromBuild").is_some_and(|is| word(is).eq_ignore_ascii_case("true"))
}

/// The one finding on names that libraries of a project would bring (U1091); the single ones are taken out of those on the `document`.
pub(super) fn missed(
    libraries: &[(String, Range<usize>)],
    document: &str,
    found: &mut Vec<Diagnostic>,
    position: &dyn Fn(&Diagnostic) -> String,
) -> Option<Diagnostic> {
    let (_, place) = libraries.first()?;
    let mut names: Vec<(String, String)> = Vec::new();
    found.retain(|found| {
        // What is spelt like a name of the project is a mistake there.
        let is_alike = found.help.as_ref().is_some_and(|help| help.ends_with('?'));
        let name = document.get(found.span.clone()).unwrap_or_default();
        if found.code != "U1041" || is_alike || name.is_empty() {
            return true;
        }
        if !names.iter().any(|(known, _)| known.eq_ignore_ascii_case(name)) {
            names.push((name.to_owned(), position(found)));
        }
        false
    });
    let message = format!(
        "libraries of the project are not here, and {} declared in none of its files: {}",
        if names.len() == 1 { "a name is" } else { "names are" },
        listed(names.iter().map(|(name, place)| format!("`{name}` ({place})")))
    );
    let help = format!(
        "the project refers to {}: add the source of what it uses of them, or give what they answer as inputs",
        listed(libraries.iter().map(|(name, _)| format!("`{name}`")))
    );
    let error = Diagnostic::error("U1091", message, place.clone()).with_help(help);
    (!names.is_empty()).then_some(error)
}

/// The first of some texts, and how many more there are.
fn listed(texts: impl Iterator<Item = String>) -> String {
    let texts: Vec<String> = texts.collect();
    let shown = texts.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", ");
    match texts.len().saturating_sub(SHOWN) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}
