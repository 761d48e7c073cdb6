//! Trimming, step 7: what leads to where nothing leads back from.

use super::{Label, MegaController};
use crate::controller::Controller;
use crate::relation::Relation;
use crate::signals::Event;

/// How the dangling states of Θ are come to.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Trimming {
    /// Events of Σ that the revised feedback disables, each with the state in which it does.
    pub disabled: Vec<(usize, Vec<Event>)>,
    /// What cannot be disabled: failures, repairs, ω, and events that are uncontrollable where they happen.
    pub unavoidable: Vec<(usize, Label)>,
}

impl MegaController {
    /// Looks at every transition from a state that stays to one that does not.
    pub fn trim(&self, controller: &Controller, relation: &Relation) -> Trimming {
        let mut trimming = Trimming::default();
        for (source, edges) in self.edges.iter().enumerate() {
            let leads_off = |target: usize| !self.dangling[source] && self.dangling[target];
            for (label, _) in edges.iter().filter(|(_, target)| leads_off(*target)) {
                match label {
                    Label::Seen(events)
                        if self.can_disable(controller, relation, source, events) =>
                    {
                        trimming.disabled.push((source, events.clone()));
                    }
                    _ => trimming.unavoidable.push((source, label.clone())),
                }
            }
        }
        trimming
    }

    /// Whether outputs can keep `events` from happening in every member in which they happen.
    fn can_disable(
        &self,
        controller: &Controller,
        relation: &Relation,
        place: usize,
        events: &[Event],
    ) -> bool {
        let members = self.states[place].members.iter().map(|&member| member as usize);
        let mut happening = members.flat_map(|member| {
            let defined = events.iter().filter(move |&&event| controller.is_defined(member, event));
            defined.map(move |&event| (member, event))
        });
        !events.is_empty()
            && happening.all(|(member, event)| !relation.rows(member, event).is_empty())
    }
}
