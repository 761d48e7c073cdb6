//! The settings in which two cluster files differ, in the words of the file.

use std::fmt;

/// A setting that differs between two configurations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChangedSetting {
    /// Only one of the files has a section.
    Section {
        /// What it is of, such as "controller `press`".
        of: String,
        /// Whether it is the new file that has it.
        is_new: bool,
    },
    /// A key has another value.
    Key {
        /// What it is of; empty for the cluster.
        of: String,
        /// The key of the cluster file, or what differs in words.
        key: String,
        /// The values, where they are short.
        values: Option<[String; 2]>,
    },
}

impl fmt::Display for ChangedSetting {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Section { of, is_new } => {
                let side = if *is_new { "new" } else { "old" };
                write!(formatter, "only the {side} file has {of}")
            }
            Self::Key { of, key, values } => {
                let of = if of.is_empty() { "the cluster" } else { of };
                match values {
                    Some([before, after]) => {
                        write!(formatter, "{key} of {of} changes from {before} to {after}")
                    }
                    None => write!(formatter, "{key} of {of} changes"),
                }
            }
        }
    }
}

/// A section of the text of a configuration, with its keys and the text of each.
#[derive(Debug, Default)]
pub(super) struct Section {
    of: String,
    keys: Vec<Key>,
}

#[derive(Debug)]
struct Key {
    name: String,
    value: String,
    is_short: bool,
}

/// The differences of two configurations, without their programs: first those of the cluster.
pub(super) fn changed_settings(before: &str, after: &str) -> Vec<ChangedSetting> {
    let (old, new) = (sections(before), sections(after));
    let mut changed = changed_sections(&old, &new);
    let names = |sections: &[Section]| sections.iter().map(|it| it.of.clone()).collect::<Vec<_>>();
    if changed.is_empty() && names(&old) != names(&new) {
        let key = "the order of controllers or understudies".to_owned();
        changed.push(ChangedSetting::Key { of: String::new(), key, values: None });
    }
    changed
}

/// The differences of two lists of sections: first those of the sections before, in their order.
pub(super) fn changed_sections(old: &[Section], new: &[Section]) -> Vec<ChangedSetting> {
    let mut changed = Vec::new();
    for section in old {
        match new.iter().find(|other| other.of == section.of) {
            Some(other) => changed.extend(section.changed(other)),
            None => changed.push(ChangedSetting::Section { of: section.of.clone(), is_new: false }),
        }
    }
    let is_new = |section: &&Section| old.iter().all(|other| other.of != section.of);
    let added = new.iter().filter(is_new);
    changed.extend(
        added.map(|section| ChangedSetting::Section { of: section.of.clone(), is_new: true }),
    );
    changed
}

impl Section {
    /// A section without keys; `of` says what it is of, and is empty for the cluster.
    pub(super) fn of(of: &str) -> Self {
        Self { of: of.to_owned(), keys: Vec::new() }
    }

    /// A key of the file with its value.
    pub(super) fn set(&mut self, key: &str, value: impl fmt::Display) {
        self.add(format!("`{key}`"), &format!("`{value}`"), true);
    }

    /// What differs in words, with its value.
    pub(super) fn set_words(&mut self, words: &str, value: &str) {
        self.add(words.to_owned(), &format!("`{value}`"), true);
    }

    fn changed(&self, other: &Self) -> Vec<ChangedSetting> {
        let value = |section: &Self, name: &str| {
            section.keys.iter().find(|key| key.name == name).map(|key| key.value.clone())
        };
        let mut names: Vec<&Key> = self.keys.iter().collect();
        names.extend(other.keys.iter().filter(|key| value(self, &key.name).is_none()));
        let differs = |key: &&Key| value(self, &key.name) != value(other, &key.name);
        let changed = names.into_iter().filter(differs).map(|key| {
            let both = [self, other].map(|section| value(section, &key.name));
            let values = match both {
                [Some(before), Some(after)] if key.is_short => Some([before, after]),
                _ => None,
            };
            ChangedSetting::Key { of: self.of.clone(), key: key.name.clone(), values }
        });
        changed.collect()
    }

    /// Adds a line to what a key says: of one with several lines, all together are its value.
    fn add(&mut self, name: String, value: &str, is_short: bool) {
        match self.keys.last_mut().filter(|key| key.name == name) {
            Some(key) => {
                key.value.push('\n');
                key.value.push_str(value);
            }
            None => self.keys.push(Key { name, value: value.to_owned(), is_short }),
        }
    }
}

/// Beginnings of the lines of a configuration that have a short value, and their keys in the file.
const SHORT: [(&str, &str); 12] = [
    ("mode ", "mode"),
    ("copies ", "copies"),
    ("history ", "history"),
    ("flag after ", "flag_after"),
    ("shadow ", "shadow_cycles"),
    ("listen ", "listen_cycles"),
    ("  hold ", "hold_cycles"),
    ("  trial ", "trial_cycles"),
    ("  release ", "release"),
    ("  value fault ", "value_fault"),
    ("  stale state ", "stale_state"),
    ("  restart ", "restart"),
];

/// The same of those whose text is none of the file.
const LONG: [(&str, &str); 7] = [
    ("schedule ", "schedule"),
    ("  fail-safe ", "fail_safe"),
    ("  ramp ", "ramp"),
    ("  twin ", "twin"),
    ("  tolerance ", "tolerance"),
    ("  share ", "share"),
    ("  input ", "inputs"),
];

fn sections(text: &str) -> Vec<Section> {
    let mut sections = vec![Section::default()];
    let mut remote_io = String::new();
    for line in text.lines() {
        let named = ["controller ", "remote io ", "plant ", "understudy "];
        let heading = named.iter().find_map(|word| Some((*word, line.strip_prefix(word)?)));
        if let Some((word, name)) = heading {
            let word = if word == "remote io " { "remote I/O " } else { word };
            let name = match name.strip_suffix(" spare") {
                Some(name) if word == "understudy " => format!("{name}` (spare)"),
                _ => format!("{name}`"),
            };
            let of = format!("{word}`{name}");
            if word == "remote I/O " {
                remote_io.clone_from(&of);
            }
            sections.push(Section { of, keys: Vec::new() });
            continue;
        }
        if line == "diagnosis" {
            let of = format!("a diagnosis of {remote_io}");
            sections.push(Section { of, keys: Vec::new() });
            continue;
        }
        let Some(section) = sections.last_mut() else {
            continue;
        };
        let found = |keys: &[(&str, &str)]| {
            let found = keys.iter().find_map(|(word, key)| {
                Some((format!("`{key}`"), line.strip_prefix(word)?.to_owned()))
            });
            found.filter(|_| !section.of.starts_with("plant") && !section.of.starts_with("a diag"))
        };
        if let Some((name, value)) = found(&SHORT) {
            section.add(name, &as_in_file(&value), true);
        } else if let Some((name, value)) = found(&LONG) {
            section.add(name, &value, false);
        } else if let Some(period) = line.strip_prefix("period ") {
            let nanoseconds = period.strip_suffix(" ns").and_then(|number| number.parse().ok());
            let period = std::time::Duration::from_nanos(nanoseconds.unwrap_or(0));
            section.add("`period`".to_owned(), &format!("`{period:?}`"), true);
        } else {
            section.add("the content".to_owned(), line, false);
        }
    }
    sections
}

/// A value as the file writes it: `FailSafe` is `fail-safe`.
fn as_in_file(value: &str) -> String {
    let mut word = String::new();
    for letter in value.chars() {
        if letter.is_ascii_uppercase() && !word.is_empty() {
            word.push('-');
        }
        word.push(letter.to_ascii_lowercase());
    }
    format!("`{word}`")
}
