//! The table of the schema, read once.

use std::collections::{BTreeMap, HashMap};

/// All types by name.
pub(super) struct Rules {
    pub(super) types: HashMap<String, Type>,
}

/// What an element of a type may have.
#[derive(Default)]
pub(super) struct Type {
    pub(super) attributes: BTreeMap<String, Attribute>,
    pub(super) content: Particle,
    /// The type of each child by its name, which is the same wherever it stands in the parent.
    pub(super) children: HashMap<String, String>,
    /// One element of any kind stands in it.
    pub(super) holds_any: bool,
    /// Text may stand between its elements.
    pub(super) is_mixed: bool,
}

#[derive(Clone)]
pub(super) struct Attribute {
    pub(super) kind: String,
    pub(super) required: bool,
}

/// A part of a content model.
#[derive(Clone)]
pub(super) enum Particle {
    Element(String),
    Sequence(Vec<Particle>),
    Choice(Vec<Particle>),
    Repeated {
        part: Box<Particle>,
        least: bool,
        many: bool,
    },
}

impl Default for Particle {
    fn default() -> Self {
        Self::Sequence(Vec::new())
    }
}

impl Particle {
    pub(super) fn begins_with(&self, name: &str) -> bool {
        match self {
            Self::Element(element) => element == name,
            Self::Sequence(parts) => {
                for part in parts {
                    if part.begins_with(name) {
                        return true;
                    }
                    if !part.may_be_empty() {
                        return false;
                    }
                }
                false
            }
            Self::Choice(parts) => parts.iter().any(|part| part.begins_with(name)),
            Self::Repeated { part, .. } => part.begins_with(name),
        }
    }

    pub(super) fn may_be_empty(&self) -> bool {
        match self {
            Self::Element(_) => false,
            Self::Sequence(parts) => parts.iter().all(Self::may_be_empty),
            Self::Choice(parts) => parts.iter().any(Self::may_be_empty),
            Self::Repeated { part, least, .. } => !least || part.may_be_empty(),
        }
    }

    /// Whether the name stands anywhere in it.
    pub(super) fn knows(&self, name: &str) -> bool {
        match self {
            Self::Element(element) => element == name,
            Self::Sequence(parts) | Self::Choice(parts) => {
                parts.iter().any(|part| part.knows(name))
            }
            Self::Repeated { part, .. } => part.knows(name),
        }
    }

    /// The names that it can begin with, for people.
    pub(super) fn beginnings(&self) -> String {
        match self {
            Self::Element(element) => format!("`{element}`"),
            Self::Sequence(parts) => parts.first().map_or_else(String::new, Self::beginnings),
            Self::Choice(parts) => {
                let names: Vec<String> = parts.iter().map(Self::beginnings).collect();
                names.join(", ")
            }
            Self::Repeated { part, .. } => part.beginnings(),
        }
    }
}

impl Rules {
    /// Reads the table; it is part of the program and right.
    pub(super) fn read(text: &str) -> Self {
        let lines = || {
            text.lines()
                .filter(|line| !line.is_empty() && !line.starts_with('#'))
        };
        let bodies: HashMap<&str, &str> = lines().filter_map(|line| line.split_once(' ')).collect();
        let mut rules = Self {
            types: HashMap::new(),
        };
        for name in bodies.keys().filter(|name| !name.starts_with('%')) {
            let mut found = Type::default();
            let mut parts = Vec::new();
            merge(name, &bodies, &mut found, &mut parts);
            found.content = Particle::Sequence(parts);
            rules.types.insert((*name).to_owned(), found);
        }
        rules
    }
}

/// Adds attributes and content of a type, and of what it extends, to `found`.
fn merge(name: &str, bodies: &HashMap<&str, &str>, found: &mut Type, parts: &mut Vec<Particle>) {
    let Some((attributes, content)) = bodies
        .get(name)
        .and_then(|body| body.split_once('{').map(|_| split(body)))
    else {
        return;
    };
    for word in attributes.split_whitespace() {
        if let Some((attribute, kind)) = word.split_once('=') {
            let required = kind.ends_with('!');
            let kind = kind.trim_end_matches('!').to_owned();
            let attribute = attribute.to_owned();
            found
                .attributes
                .insert(attribute, Attribute { kind, required });
        }
    }
    found.is_mixed |= bodies
        .get(name)
        .is_some_and(|body| body.ends_with(" mixed"));
    let mut reader = Reader {
        words: words(content),
        place: 0,
        bodies,
        found,
    };
    let read = reader.sequence();
    parts.extend(read);
}

/// The content stands between the last braces that begin after white space: `{a,b}` is a kind.
fn split(body: &str) -> (&str, &str) {
    let start = if body.starts_with('{') {
        0
    } else {
        body.find(" {").map_or(body.len(), |place| place + 1)
    };
    let content = &body[start..];
    let end = content.rfind('}').unwrap_or(content.len());
    (&body[..start], content.get(1..end).unwrap_or_default())
}

fn words(content: &str) -> Vec<String> {
    let spaced = content.replace('(', " ( ").replace(')', " )");
    spaced.split_whitespace().map(str::to_owned).collect()
}

struct Reader<'a, 'b> {
    words: Vec<String>,
    place: usize,
    bodies: &'a HashMap<&'a str, &'a str>,
    found: &'b mut Type,
}

impl Reader<'_, '_> {
    fn next(&mut self) -> Option<String> {
        let word = self.words.get(self.place).cloned();
        self.place += usize::from(word.is_some());
        word
    }

    fn sequence(&mut self) -> Vec<Particle> {
        let mut parts = Vec::new();
        while let Some(word) = self.next() {
            parts.extend(self.particle(&word));
        }
        parts
    }

    fn particle(&mut self, word: &str) -> Option<Particle> {
        if word == "(" {
            return Some(self.choice());
        }
        if word == "any" {
            self.found.holds_any = true;
            return None;
        }
        if let Some(base) = word.strip_prefix('+') {
            let mut parts = Vec::new();
            merge(base, self.bodies, self.found, &mut parts);
            return Some(Particle::Sequence(parts));
        }
        if let Some(group) = word.strip_prefix('%') {
            let key = format!("%{group}");
            let body = self.bodies.get(key.as_str())?;
            let mut reader = Reader {
                words: words(split(body).1),
                place: 0,
                bodies: self.bodies,
                found: self.found,
            };
            let parts = reader.sequence();
            return Some(Particle::Sequence(parts));
        }
        let (name, type_name) = word.split_once(':')?;
        let bare = type_name.trim_end_matches(['?', '*', '+']);
        let sign = &type_name[bare.len()..];
        self.found.children.insert(name.to_owned(), bare.to_owned());
        Some(repeated(Particle::Element(name.to_owned()), sign))
    }

    /// `a | b )`, with `?`, `*` or `+` behind it; without `|` it is a sequence.
    fn choice(&mut self) -> Particle {
        let mut parts = Vec::new();
        let mut branch = Vec::new();
        let mut sign = String::new();
        while let Some(word) = self.next() {
            if let Some(rest) = word.strip_prefix(')') {
                sign = rest.to_owned();
                break;
            }
            if word == "|" {
                parts.push(Particle::Sequence(std::mem::take(&mut branch)));
            } else {
                branch.extend(self.particle(&word));
            }
        }
        parts.push(Particle::Sequence(branch));
        repeated(Particle::Choice(parts), &sign)
    }
}

fn repeated(part: Particle, sign: &str) -> Particle {
    let (least, many) = match sign {
        "?" => (false, false),
        "*" => (false, true),
        "+" => (true, true),
        _ => return part,
    };
    let part = Box::new(part);
    Particle::Repeated { part, least, many }
}
