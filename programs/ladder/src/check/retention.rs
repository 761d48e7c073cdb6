//! What a program declares retentive.

use std::collections::HashMap;

use understudy_text::Diagnostic;

use super::{Checker, Role};
use crate::program::Name;

impl Checker<'_> {
    /// Every name is that of an output, a memory bit or a block, and stands there once.
    pub(super) fn retained(&mut self, names: &[Name]) {
        let mut first: HashMap<&str, &Name> = HashMap::new();
        for name in names {
            if let Some(first) = first.insert(name.as_str(), name) {
                let message = format!("`{name}` is declared retentive twice");
                self.diagnostics.push(
                    Diagnostic::error("U0105", message, name.span())
                        .with_related(first.span(), "the first declaration")
                        .with_help("remove one of them"),
                );
                continue;
            }
            if self.blocks.contains_key(name.as_str()) {
                continue;
            }
            let role = self.places.get(name.as_str()).map(|&place| self.symbols[place].role);
            let help = match role {
                Some(Role::Output | Role::Memory) => continue,
                Some(Role::Input) => "remove it: an input is sampled before every scan".to_owned(),
                Some(Role::Pin) => {
                    let block = name.rsplit_once('.').map_or("", |(block, _)| block);
                    format!("write `retain {block}`: the whole block is kept")
                }
                None => {
                    self.undefined(name);
                    continue;
                }
            };
            let what = role.map_or("", Role::words);
            let message = format!("{what} `{name}` cannot be retentive");
            self.diagnostics.push(Diagnostic::error("U0120", message, name.span()).with_help(help));
        }
    }
}
