//! Whether a file is as the schema of PLCopen XML wants it, by a table of our own (`schema/rules.txt`).
//!
//! Files that other tools wrote are often a little off, so every finding is a warning, with its place; what a program means
//! is decided by the reader, not here. The schema of 2.0 is taken to be that of 2.01.

mod rules;
mod simple;

use std::collections::HashMap;
use std::sync::LazyLock;

use roxmltree::Node;
use understudy_text::{Diagnostic, shortened};

use self::rules::{Particle, Rules, Type};
use super::xml::{attribute, elements, start_tag};

/// Findings after which the rest is counted only.
const MAXIMUM_FINDINGS: usize = 100;

static RULES: LazyLock<Rules> = LazyLock::new(|| Rules::read(include_str!("schema/rules.txt")));

/// What is not by the schema, in the order of the places.
pub(crate) fn validate(root: Node<'_, '_>) -> Vec<Diagnostic> {
    let mut validator = Validator {
        rules: &RULES,
        identifiers: HashMap::new(),
        findings: Vec::new(),
        more: 0,
    };
    validator.element(root, "project");
    let Validator { findings, more, .. } = validator;
    let mut findings = findings;
    findings.sort_by_key(|finding| finding.span.start);
    if more > 0 {
        let message = format!("{more} more places are not by the schema");
        findings.push(Diagnostic::warning("U1021", message, start_tag(root)));
    }
    findings
}

struct Validator<'a> {
    rules: &'a Rules,
    /// Values of kind ID, which are unique in a file.
    identifiers: HashMap<String, usize>,
    findings: Vec<Diagnostic>,
    more: usize,
}

impl<'a> Validator<'a> {
    fn find(&mut self, message: String, node: Node<'_, '_>) {
        if self.findings.len() < MAXIMUM_FINDINGS {
            let finding = Diagnostic::warning("U1021", message, start_tag(node));
            self.findings.push(finding);
        } else {
            self.more += 1;
        }
    }

    /// The depth of the recursion is that of the tree, which is bounded.
    fn element(&mut self, node: Node<'_, '_>, type_name: &str) {
        if let Some(kind) = type_name.strip_prefix('$') {
            self.plain(node, kind);
            return;
        }
        // Empty elements of the table have no line of their own.
        let nothing = Type::default();
        let rule = self.rules.types.get(type_name).unwrap_or(&nothing);
        self.attributes(node, rule);
        let is_text = |part: &Node<'_, '_>| {
            part.is_text() && !part.text().unwrap_or_default().trim().is_empty()
        };
        if !rule.is_mixed && node.children().any(|part| is_text(&part)) {
            let name = node.tag_name().name();
            self.find(format!("text does not stand in `{name}` itself"), node);
        }
        if rule.holds_any {
            self.any(node, type_name);
            return;
        }
        let children: Vec<Node<'_, '_>> = elements(node).collect();
        let mut place = 0;
        self.content(node, &rule.content, &children, &mut place);
        for left in &children[place..] {
            self.unexpected(node, *left);
        }
        for child in children {
            if let Some(type_name) = rule.children.get(child.tag_name().name()) {
                self.element(child, type_name);
            }
        }
    }

    /// One element: of XHTML where people are to read it.
    fn any(&mut self, node: Node<'_, '_>, type_name: &str) {
        const XHTML: &str = "http://www.w3.org/1999/xhtml";
        let mut parts = elements(node);
        let first = parts.next();
        let name = node.tag_name().name();
        match first {
            None => self.find(format!("`{name}` lacks an element in it"), node),
            Some(part)
                if type_name == "formattedText" && part.tag_name().namespace() != Some(XHTML) =>
            {
                self.find(format!("what stands in `{name}` is not XHTML"), part);
            }
            Some(_) => {}
        }
        if let Some(second) = parts.next() {
            self.unexpected(node, second);
        }
    }

    fn plain(&mut self, node: Node<'_, '_>, kind: &str) {
        for child in elements(node) {
            self.unexpected(node, child);
        }
        let text = node.text().unwrap_or_default();
        if let Err(expected) = simple::check(kind, text) {
            let name = node.tag_name().name();
            self.find(format!("the text of `{name}` is not {expected}"), node);
        }
    }

    fn unexpected(&mut self, parent: Node<'_, '_>, child: Node<'_, '_>) {
        let message = format!(
            "the schema has no `{}` at this place of `{}`",
            child.tag_name().name(),
            parent.tag_name().name()
        );
        self.find(message, child);
    }

    fn attributes(&mut self, node: Node<'_, '_>, rule: &Type) {
        let name = node.tag_name().name();
        for given in node
            .attributes()
            .filter(|given| given.namespace().is_none())
        {
            let Some(expected) = rule.attributes.get(given.name()) else {
                let message = format!("the schema has no attribute `{}` of `{name}`", given.name());
                self.find(message, node);
                continue;
            };
            if let Err(kind) = simple::check(&expected.kind, given.value()) {
                let message = format!(
                    "the attribute `{}` of `{name}` is {:?}, and that is not {kind}",
                    given.name(),
                    shortened(given.value(), 40)
                );
                self.find(message, node);
            } else if expected.kind == "ID" {
                let count = self.identifiers.entry(given.value().to_owned());
                let count = count.or_insert(0);
                *count += 1;
                if *count == 2 {
                    let message = format!("the identifier {:?} is used twice", given.value());
                    self.find(message, node);
                }
            }
        }
        for (needed, _) in rule.attributes.iter().filter(|(_, kind)| kind.required) {
            if attribute(node, needed).is_none() {
                self.find(format!("`{name}` lacks the attribute `{needed}`"), node);
            }
        }
    }

    /// Matches the children from `place` on. The schema is deterministic: the next name decides.
    fn content(
        &mut self,
        parent: Node<'_, '_>,
        particle: &Particle,
        children: &[Node<'_, '_>],
        place: &mut usize,
    ) {
        match particle {
            Particle::Element(name) => {
                if children
                    .get(*place)
                    .is_some_and(|child| child.tag_name().name() == name)
                {
                    *place += 1;
                } else {
                    let message = format!("`{}` lacks `{name}`", parent.tag_name().name());
                    self.find(message, parent);
                }
            }
            Particle::Sequence(parts) => {
                for part in parts {
                    self.skip_to(parent, particle, part, children, place);
                    self.content(parent, part, children, place);
                }
            }
            Particle::Choice(parts) => {
                let next = children.get(*place).map(|child| child.tag_name().name());
                let taken = next.and_then(|next| parts.iter().find(|part| part.begins_with(next)));
                match taken {
                    Some(part) => self.content(parent, part, children, place),
                    None if parts.iter().any(Particle::may_be_empty) => {}
                    None => {
                        let message = format!(
                            "`{}` lacks one of {}",
                            parent.tag_name().name(),
                            particle.beginnings()
                        );
                        self.find(message, parent);
                    }
                }
            }
            Particle::Repeated { part, least, many } => {
                let mut count = 0;
                while children
                    .get(*place)
                    .is_some_and(|child| part.begins_with(child.tag_name().name()))
                {
                    let before = *place;
                    self.content(parent, part, children, place);
                    count += 1;
                    if !many || *place == before {
                        break;
                    }
                }
                if *least && count == 0 {
                    self.content(parent, part, children, place);
                }
            }
        }
    }

    /// Reports a child that no part of the sequence knows, so that what follows it is still checked.
    fn skip_to(
        &mut self,
        parent: Node<'_, '_>,
        whole: &Particle,
        part: &Particle,
        children: &[Node<'_, '_>],
        place: &mut usize,
    ) {
        while let Some(child) = children.get(*place) {
            let name = child.tag_name().name();
            if part.begins_with(name) || whole.knows(name) {
                return;
            }
            self.unexpected(parent, *child);
            *place += 1;
        }
    }
}
