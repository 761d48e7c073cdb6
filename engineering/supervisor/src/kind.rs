//! Which of the files of this crate a TOML text is.

use toml::de::DeTable;

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// Plants and specifications: [`read_model`](crate::read_model).
    Model,
    /// An automation Petri net: [`read_net`](crate::petri::read_net).
    Net,
    /// A map of signals: [`read_map`](crate::ladder::read_map).
    SignalMap,
}

impl FileKind {
    /// What a text looks like, by keys that only one kind has.
    pub fn of(text: &str) -> Option<Self> {
        let (table, _) = DeTable::parse_recoverable(text);
        let has = |keys: &[&str]| keys.iter().any(|key| table.get_ref().contains_key(*key));
        if has(&["cluster"]) {
            None
        } else if has(&["place", "transition"]) {
            Some(Self::Net)
        } else if has(&["program", "input", "switch", "pulse"]) {
            Some(Self::SignalMap)
        } else if has(&["specification", "supervisor", "events"]) {
            Some(Self::Model)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_example_is_what_it_is() {
        let check =
            |text: &str, expected: Option<FileKind>| assert_eq!(FileKind::of(text), expected);
        let net = include_str!("../../../examples/assembly-cell/net.toml");
        check(net, Some(FileKind::Net));
        let model = include_str!("../../../examples/small-factory/model.toml");
        check(model, Some(FileKind::Model));
        let model = include_str!("../../../examples/assembly-cell/model.toml");
        check(model, Some(FileKind::Model));
        let map = include_str!("../../../examples/motivating-example/map.toml");
        check(map, Some(FileKind::SignalMap));
        check(include_str!("../../../examples/press-cell/cluster.toml"), None);
        check("title = \"Kill\"\ncycles = 10\n", None);
        check("", None);
    }
}
