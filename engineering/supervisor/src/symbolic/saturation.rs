//! Closure of a set under events, level by level from below.

use std::collections::HashMap;

use understudy_logic::bdd::{BddError, Diagram};

use super::space::Space;

/// An event as it moves the levels that know it: pairs of states, from and to, for each of them by ascending level.
#[derive(Debug, Clone)]
pub(super) struct Moves {
    pub(super) levels: Vec<(usize, Vec<(u32, u32)>)>,
}

impl Moves {
    /// The same backwards.
    pub(super) fn reversed(&self) -> Self {
        let turned = self.levels.iter().map(|(level, pairs)| {
            let pairs = pairs.iter().map(|&(from, to)| (to, from));
            (*level, pairs.collect())
        });
        Self { levels: turned.collect() }
    }
}

/// Closes sets under some events. Invariant of all that is remembered: the result for level k is closed under every event whose
/// topmost level is k or below.
pub(super) struct Saturation<'a> {
    space: &'a Space,
    events: Vec<Moves>,
    /// For each level, the events whose topmost level it is.
    topmost: Vec<Vec<usize>>,
    saturated: HashMap<(usize, Diagram, Diagram), Diagram>,
    fired: HashMap<(usize, usize, usize, Diagram, Diagram), Diagram>,
}

impl<'a> Saturation<'a> {
    /// Events that no level knows move nothing.
    pub(super) fn new(space: &'a Space, events: Vec<Moves>) -> Self {
        let mut topmost = vec![Vec::new(); space.levels()];
        for (number, event) in events.iter().enumerate() {
            if let Some((level, _)) = event.levels.first() {
                topmost[*level].push(number);
            }
        }
        Self { space, events, topmost, saturated: HashMap::new(), fired: HashMap::new() }
    }

    /// What is reached from `start` by the events without leaving `within`, which holds `start`.
    pub(super) fn closure(
        &mut self,
        start: &Diagram,
        within: &Diagram,
    ) -> Result<Diagram, BddError> {
        self.saturate(0, start, within)
    }

    fn saturate(
        &mut self,
        level: usize,
        set: &Diagram,
        within: &Diagram,
    ) -> Result<Diagram, BddError> {
        if level == self.space.levels() || set.is_constant(false) {
            return Ok(set.clone());
        }
        let key = (level, set.clone(), within.clone());
        if let Some(known) = self.saturated.get(&key) {
            return Ok(known.clone());
        }
        let mut parts = self.space.split(set, level);
        let withins = self.space.split(within, level);
        for (part, within) in parts.iter_mut().zip(&withins) {
            *part = self.saturate(level + 1, part, within)?;
        }
        let result = self.fixed_point(level, parts, &withins)?;
        self.saturated.insert(key, result.clone());
        Ok(result)
    }

    /// Fires the events whose topmost level is this one until nothing is new; `parts` are closed below.
    fn fixed_point(
        &mut self,
        level: usize,
        mut parts: Vec<Diagram>,
        withins: &[Diagram],
    ) -> Result<Diagram, BddError> {
        let events = self.topmost[level].clone();
        let mut grows = !events.is_empty();
        while grows {
            grows = false;
            for &event in &events {
                for place in 0..self.events[event].levels[0].1.len() {
                    let (from, to) = self.events[event].levels[0].1[place];
                    let (from, to) = (from as usize, to as usize);
                    if parts[from].is_constant(false) || withins[to].is_constant(false) {
                        continue;
                    }
                    let fired = self.fire(event, 1, level + 1, &parts[from], &withins[to])?;
                    // A union of closed sets is closed.
                    let grown = self.space.or(&parts[to], &fired)?;
                    if grown != parts[to] {
                        parts[to] = grown;
                        grows = true;
                    }
                }
            }
        }
        self.space.join(parts, level)
    }

    /// What `event` makes of `set` on the levels from `level` down, closed there; `place` is the next of the event's own levels.
    fn fire(
        &mut self,
        event: usize,
        place: usize,
        level: usize,
        set: &Diagram,
        within: &Diagram,
    ) -> Result<Diagram, BddError> {
        let Some(&(own_level, _)) = self.events[event].levels.get(place) else {
            let set = self.space.and(set, within)?;
            return self.saturate(level, &set, within);
        };
        if set.is_constant(false) || within.is_constant(false) {
            return Ok(self.space.nothing());
        }
        let key = (event, place, level, set.clone(), within.clone());
        if let Some(known) = self.fired.get(&key) {
            return Ok(known.clone());
        }
        let sources = self.space.split(set, level);
        let withins = self.space.split(within, level);
        let mut parts = vec![self.space.nothing(); sources.len()];
        if own_level > level {
            for (number, part) in parts.iter_mut().enumerate() {
                *part = self.fire(event, place, level + 1, &sources[number], &withins[number])?;
            }
        } else {
            for pair in 0..self.events[event].levels[place].1.len() {
                let (from, to) = self.events[event].levels[place].1[pair];
                let (from, to) = (from as usize, to as usize);
                let fired = self.fire(event, place + 1, level + 1, &sources[from], &withins[to])?;
                parts[to] = self.space.or(&parts[to], &fired)?;
            }
        }
        let result = self.fixed_point(level, parts, &withins)?;
        self.fired.insert(key, result.clone());
        Ok(result)
    }
}

/// From where `event` leads into `set`, in one step.
pub(super) fn predecessors(
    space: &Space,
    event: &Moves,
    set: &Diagram,
) -> Result<Diagram, BddError> {
    step_back(space, event, 0, 0, set, &mut HashMap::new())
}

fn step_back(
    space: &Space,
    event: &Moves,
    place: usize,
    level: usize,
    set: &Diagram,
    known: &mut HashMap<(usize, Diagram), Diagram>,
) -> Result<Diagram, BddError> {
    let Some((own_level, pairs)) = event.levels.get(place) else {
        return Ok(set.clone());
    };
    if set.is_constant(false) {
        return Ok(set.clone());
    }
    // The place follows from the level.
    let key = (level, set.clone());
    if let Some(done) = known.get(&key) {
        return Ok(done.clone());
    }
    let targets = space.split(set, level);
    let mut parts = vec![space.nothing(); targets.len()];
    if *own_level > level {
        for (part, target) in parts.iter_mut().zip(&targets) {
            *part = step_back(space, event, place, level + 1, target, known)?;
        }
    } else {
        for &(from, to) in pairs {
            let target = &targets[to as usize];
            parts[from as usize] = step_back(space, event, place + 1, level + 1, target, known)?;
        }
    }
    let result = space.join(parts, level)?;
    known.insert(key, result.clone());
    Ok(result)
}
