//! A chart of the syntax as it is drawn.

use std::collections::HashMap;

use understudy_diagram::chart::{Chart, Step, Transition};
use understudy_structured_text::print;
use understudy_structured_text::syntax::{self, Name};

/// Steps of a chart that is drawn.
const MAXIMUM_STEPS: usize = 500;

/// The chart, and for each of its transitions the place in the syntax. Those of higher priority come first.
///
/// # Errors
/// Why it is not drawn, in words.
pub(crate) fn chart(of: &syntax::Chart) -> Result<(Chart, Vec<usize>), String> {
    if of.steps.len() > MAXIMUM_STEPS || of.transitions.len() > 2 * MAXIMUM_STEPS {
        let (steps, transitions) = (of.steps.len(), of.transitions.len());
        return Err(format!(
            "a chart of {steps} steps and {transitions} transitions, and at most {MAXIMUM_STEPS} steps with {} transitions are drawn",
            2 * MAXIMUM_STEPS
        ));
    }
    let steps = of.steps.iter().map(|step| {
        let actions = step.associations.iter().map(|association| {
            let mut when = association.qualifier.to_string();
            if let Some(duration) = &association.duration {
                when += &format!(" {}", print::expression(duration));
            }
            (when, association.action.to_string())
        });
        Step {
            name: step.name.to_string(),
            is_initial: step.is_initial,
            actions: actions.collect(),
            active: None,
        }
    });
    let places = of.steps.iter().enumerate();
    let places: HashMap<String, usize> =
        places.map(|(place, step)| (step.name.key(), place)).collect();
    let found = |names: &[Name]| -> Vec<usize> {
        let mut found = Vec::new();
        for place in names.iter().filter_map(|name| places.get(&name.key())) {
            if !found.contains(place) {
                found.push(*place);
            }
        }
        found
    };
    let mut order: Vec<usize> = (0..of.transitions.len()).collect();
    order.sort_by_key(|at| of.transitions[*at].priority.unwrap_or(i64::MAX));
    let transitions = order.iter().map(|at| {
        let transition = &of.transitions[*at];
        Transition {
            condition: print::expression(&transition.condition),
            truth: None,
            from: found(&transition.from),
            to: found(&transition.to),
        }
    });
    let chart = Chart { steps: steps.collect(), transitions: transitions.collect() };
    Ok((chart, order))
}
