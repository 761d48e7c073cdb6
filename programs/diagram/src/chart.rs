//! Sequential function charts.

mod layout;

pub use layout::{ChartObject, ChartPlan, Link, Part, lay_out};

/// What a chart has. Steps and transitions are named by their places in these lists.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// Its steps.
    pub steps: Vec<Step>,
    /// Its transitions, in the order in which they are looked at.
    pub transitions: Vec<Transition>,
}

/// A step.
#[derive(Debug, Clone, Default)]
pub struct Step {
    /// Its name.
    pub name: String,
    /// Whether the chart begins in it.
    pub is_initial: bool,
    /// Qualifier, with its duration, and action.
    pub actions: Vec<(String, String)>,
    /// Whether it is active in the scan; nothing where no scan is shown.
    pub active: Option<bool>,
}

/// A transition.
#[derive(Debug, Clone, Default)]
pub struct Transition {
    /// Its condition.
    pub condition: String,
    /// What the condition came to in the scan; nothing where it was not evaluated, or no scan is shown.
    pub truth: Option<bool>,
    /// The steps that it leaves.
    pub from: Vec<usize>,
    /// The steps that it enters.
    pub to: Vec<usize>,
}
