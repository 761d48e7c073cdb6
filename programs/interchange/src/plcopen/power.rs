//! Power and values in a graph, as expressions over what its objects read.

use understudy_ladder::Name;

use super::document::Edge;

/// The state of an output of an object.
#[derive(Debug, Clone)]
pub(crate) enum Power {
    Constant(bool),
    /// A variable or literal as it is written, read by the object of that number.
    Read(Read),
    Not(Box<Power>),
    /// All of two or more; none of them is `All`.
    All(Vec<Power>),
    /// One of two or more; none of them is `Any`.
    Any(Vec<Power>),
    /// An output of a function block's instance.
    Output(Name, Name),
    /// What the object of that number has kept in this scan.
    Kept(usize),
    /// A function of values, with the names of its inputs.
    Function(Name, Vec<(Name, Power)>),
}

/// One reading of a variable.
#[derive(Debug, Clone)]
pub(crate) struct Read {
    pub(crate) text: Name,
    pub(crate) edge: Option<Edge>,
    pub(crate) object: usize,
}

impl PartialEq for Power {
    /// Two readings of one variable are the same, whichever object reads; two edges are two triggers.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Constant(left), Self::Constant(right)) => left == right,
            (Self::Read(left), Self::Read(right)) => {
                left.object == right.object
                    || left.edge.is_none()
                        && right.edge.is_none()
                        && left.text.eq_ignore_ascii_case(&right.text)
            }
            (Self::Not(left), Self::Not(right)) => left == right,
            (Self::All(left), Self::All(right)) | (Self::Any(left), Self::Any(right)) => {
                left == right
            }
            (Self::Output(left, pin), Self::Output(right, other)) => left == right && pin == other,
            (Self::Kept(left), Self::Kept(right)) => left == right,
            (Self::Function(left, inputs), Self::Function(right, others)) => {
                left == right && inputs == others
            }
            _ => false,
        }
    }
}

impl Power {
    /// The series of two powers.
    pub(crate) fn and(self, other: Self) -> Self {
        let mut parts = match self {
            Self::Constant(true) => return other,
            Self::Constant(false) => return self,
            Self::All(parts) => parts,
            one => vec![one],
        };
        match other {
            Self::Constant(true) => {}
            Self::Constant(false) => return other,
            Self::All(others) => parts.extend(others),
            one => parts.push(one),
        }
        if parts.len() == 1 { parts.remove(0) } else { Self::All(parts) }
    }

    /// Parallel branches, of which those that begin alike share their beginning. None at all is no power.
    pub(crate) fn any(branches: Vec<Self>) -> Self {
        let mut series: Vec<Vec<Self>> = Vec::new();
        for branch in branches {
            let parts = match branch {
                Self::Constant(false) => continue,
                Self::Constant(true) => return Self::Constant(true),
                Self::All(parts) => parts,
                one => vec![one],
            };
            if !series.contains(&parts) {
                series.push(parts);
            }
        }
        if series.is_empty() {
            return Self::Constant(false);
        }
        join(series)
    }

    pub(crate) fn not(self) -> Self {
        match self {
            Self::Constant(value) => Self::Constant(!value),
            Self::Not(inner) => *inner,
            other => Self::Not(Box::new(other)),
        }
    }

    /// How many readings it has, and how deep it is.
    pub(crate) fn measure(&self) -> (usize, usize) {
        let parts: Vec<(usize, usize)> = match self {
            Self::Constant(_) | Self::Read(_) | Self::Output(..) | Self::Kept(_) => return (1, 1),
            Self::Not(inner) => vec![inner.measure()],
            Self::All(parts) | Self::Any(parts) => parts.iter().map(Self::measure).collect(),
            Self::Function(_, inputs) => inputs.iter().map(|(_, input)| input.measure()).collect(),
        };
        let size = parts.iter().map(|(size, _)| size).sum::<usize>() + 1;
        let depth = parts.iter().map(|(_, depth)| depth).max().unwrap_or(&0) + 1;
        (size, depth)
    }

    /// Calls `see` with everything in it that has no parts.
    pub(crate) fn visit<'a>(&'a self, see: &mut impl FnMut(&'a Self)) {
        match self {
            Self::Not(inner) => inner.visit(see),
            Self::All(parts) | Self::Any(parts) => parts.iter().for_each(|part| part.visit(see)),
            Self::Function(_, inputs) => inputs.iter().for_each(|(_, input)| input.visit(see)),
            Self::Constant(_) | Self::Read(_) | Self::Output(..) | Self::Kept(_) => see(self),
        }
    }
}

/// Branches that are not empty and differ. A common beginning is before them once.
fn join(series: Vec<Vec<Power>>) -> Power {
    let mut groups: Vec<(Power, Vec<Vec<Power>>)> = Vec::new();
    for mut parts in series {
        let head = parts.remove(0);
        match groups.iter_mut().find(|(known, _)| *known == head) {
            Some((_, tails)) => tails.push(parts),
            None => groups.push((head, vec![parts])),
        }
    }
    let mut branches: Vec<Power> = groups
        .into_iter()
        .map(|(head, mut tails)| {
            if tails.iter().any(Vec::is_empty) {
                // A wire beside the rest: power passes anyway.
                return head;
            }
            let tail = if tails.len() == 1 { series_of(tails.remove(0)) } else { join(tails) };
            head.and(tail)
        })
        .collect();
    if branches.len() == 1 {
        return branches.remove(0);
    }
    let mut flat = Vec::new();
    for branch in branches {
        match branch {
            Power::Any(parts) => flat.extend(parts),
            one => flat.push(one),
        }
    }
    Power::Any(flat)
}

fn series_of(parts: Vec<Power>) -> Power {
    parts.into_iter().fold(Power::Constant(true), Power::and)
}
