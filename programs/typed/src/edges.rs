//! The names of memories that no person declared, and that see the edges of something: they name it, so that they stay where other parts of a program
//! change.

/// What sees the edges of a contact, a coil or an input: `start.rising`, `y.power.falling_2`, `a.last`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EdgeMemory<'n> {
    /// What has the edges: `start`, `y.power`.
    pub of: &'n str,
    /// Which one of several of the same edges, from 1.
    pub number: u32,
}

impl<'n> EdgeMemory<'n> {
    /// The memory of this name; nothing where the name is of something else.
    pub fn named(name: &'n str) -> Option<Self> {
        let (of, what) = name.rsplit_once('.')?;
        let (what, number) = match what.split_once('_') {
            Some((what, number)) => (what, number.parse().ok()?),
            None => (what, 1),
        };
        let is_known = match what {
            "rising" | "falling" => true,
            // Those of an input that is declared with R_EDGE or F_EDGE.
            "edge" | "last" => number == 1,
            _ => false,
        };
        is_known.then_some(Self { of, number })
    }
}
