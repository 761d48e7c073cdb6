//! An online change in progress: who has given which step, which members have taken it, and which programs have changed.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_cluster::ChangeTexts;
use understudy_wire::{
    ChangeName, ChangeRequest, ConfigurationHash, Configurations, Member, ProgramHash, ProgramId,
};

use crate::model::{Model, Standing};

/// What is known of online changes in a cycle.
#[derive(Debug, Clone, Default)]
pub(crate) struct ChangeStanding {
    /// Of the members that a change has reached; nothing of one whose process has begun anew since.
    configurations: BTreeMap<Member, Option<Configurations>>,
    loaded: Option<LoadedChange>,
    given: Option<GivenStep>,
    /// The change of the newest step that names it.
    named: Option<ChangeName>,
}

/// The change whose texts members were given last.
#[derive(Debug, Clone)]
pub(crate) struct LoadedChange {
    name: ChangeName,
    /// The programs that it replaces, by the new ones.
    programs: Vec<(ProgramId, ProgramHash)>,
}

/// An online change in progress.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ChangeSnapshot {
    /// Hash of the configuration before.
    pub before: String,
    /// Hash of the configuration after.
    pub after: String,
    /// The programs that it replaces, where they are known.
    pub programs: Vec<ChangingProgram>,
    /// The members that take part in it.
    pub members: Vec<ChangingMember>,
    /// The step that was given last, where it is in the journal.
    pub given: Option<GivenStep>,
}

/// A program that an online change replaces.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ChangingProgram {
    /// Its controller.
    pub program: String,
    /// Whether the new one runs.
    pub is_new: bool,
}

/// A member in an online change.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ChangingMember {
    /// Its name.
    pub name: String,
    /// Where it is.
    pub place: ChangePlace,
}

/// Where a member is in an online change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChangePlace {
    /// It has loaded nothing but the configuration before.
    NotLoaded,
    /// It has loaded the configuration after, too.
    Prepared,
    /// The configuration after is its own, and it can go back.
    Accepted,
    /// It has the configuration after alone.
    Ended,
    /// It is down, or its process has begun anew and has said nothing of the change since.
    NotKnown,
}

impl ChangePlace {
    const ALL: [Self; 5] =
        [Self::NotLoaded, Self::Prepared, Self::Accepted, Self::Ended, Self::NotKnown];

    /// The place in words.
    pub const fn word(self) -> &'static str {
        match self {
            Self::NotLoaded => "not loaded",
            Self::Prepared => "prepared",
            Self::Accepted => "accepted",
            Self::Ended => "ended",
            Self::NotKnown => "not known",
        }
    }
}

/// A step that a person has given.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct GivenStep {
    /// Who.
    pub by: String,
    /// `prepare`, `switch`, `switch back`, `accept`, `cancel` or `end`.
    pub step: &'static str,
    /// The cycle in which it was given first.
    pub cycle: i64,
}

/// What changes the standing.
#[derive(Debug, Clone)]
pub(crate) enum ChangeReport {
    Configured(Member, Configurations),
    Loaded(LoadedChange),
    Given { by: String, request: ChangeRequest },
}

impl LoadedChange {
    pub(crate) fn of(texts: &ChangeTexts) -> Self {
        let programs = texts.programs.iter();
        let programs = programs.map(|changed| (changed.program, changed.after.hash));
        Self { name: texts.name(), programs: programs.collect() }
    }
}

impl ChangeStanding {
    pub(crate) fn apply(&mut self, report: &ChangeReport, cycle: i64) {
        match report {
            ChangeReport::Configured(member, configurations) => {
                self.configurations.insert(*member, Some(*configurations));
            }
            ChangeReport::Loaded(loaded) => self.loaded = Some(loaded.clone()),
            ChangeReport::Given { by, request } => {
                let step = self.step(request);
                self.named = match request {
                    ChangeRequest::Prepare { .. } => self.named,
                    ChangeRequest::Switch { change, .. }
                    | ChangeRequest::Run { change, .. }
                    | ChangeRequest::Forget { change, .. } => Some(*change),
                };
                // Each member is asked.
                let is_known =
                    self.given.as_ref().is_some_and(|given| given.by == *by && given.step == step);
                if !is_known {
                    self.given = Some(GivenStep { by: by.clone(), step, cycle });
                }
            }
        }
    }

    /// What it knows of the change, it may have lost with its process.
    pub(crate) fn begins_anew(&mut self, member: Member) {
        if let Some(known) = self.configurations.get_mut(&member) {
            *known = None;
        }
    }

    pub(crate) fn shift(&mut self, by: i64) {
        if let Some(given) = &mut self.given {
            given.cycle = given.cycle.saturating_add(by);
        }
    }

    fn step(&self, request: &ChangeRequest) -> &'static str {
        let is_forward = |change: &ChangeName, to: &ConfigurationHash| change.after == *to;
        match request {
            ChangeRequest::Prepare { .. } => "prepare",
            ChangeRequest::Switch { to, .. } => {
                let programs = self.loaded.iter().flat_map(|loaded| &loaded.programs);
                let is_new = programs.into_iter().any(|(_, after)| after == to);
                if is_new { "switch" } else { "switch back" }
            }
            ChangeRequest::Run { change, configuration } => {
                if is_forward(change, configuration) {
                    "accept"
                } else {
                    "cancel"
                }
            }
            ChangeRequest::Forget { .. } => "end",
        }
    }
}

impl Model {
    /// The online change in progress in a cycle: as long as a member that is up has two configurations.
    pub(crate) fn change_in(
        &self,
        standing: &Standing,
        cycle: Option<i64>,
    ) -> Option<ChangeSnapshot> {
        let known = standing.change();
        let of = |member: Member| {
            let known = known.configurations.get(&member).copied();
            if standing.is_down(member) { known.map(|_| None) } else { known }
        };
        let members = || {
            let members = self.cluster().members();
            let members = members.filter(|member| !matches!(member, Member::Plant(_)));
            members.filter(|member| !self.cluster().is_spare_slot(*member))
        };
        let two = members().find_map(|member| {
            let Configurations { own, prepared } = of(member).flatten()?;
            Some([own, prepared?])
        })?;
        let loaded = known.loaded.as_ref();
        let is_it = |name: &ChangeName| two.iter().all(|it| name.has(*it));
        let loaded = loaded.filter(|loaded| is_it(&loaded.name));
        let named = loaded.map(|loaded| loaded.name).or(known.named.filter(is_it));
        // Who began to read within the change does not know which one was before: that of the cluster file, or the members' own until it is accepted.
        let [own, prepared] = two;
        let first = self.cluster().agreement().configuration;
        let read = if prepared == first { [prepared, own] } else { two };
        let [before, after] = named.map_or(read, |name| [name.before, name.after]);
        let place = |member| match of(member) {
            None => ChangePlace::NotLoaded,
            Some(None) => ChangePlace::NotKnown,
            Some(Some(Configurations { own, prepared })) => match (own == after, prepared) {
                (true, Some(_)) => ChangePlace::Accepted,
                (true, None) => ChangePlace::Ended,
                (false, Some(prepared)) if prepared == after => ChangePlace::Prepared,
                (false, _) => ChangePlace::NotLoaded,
            },
        };
        let members = members().map(|member| ChangingMember {
            name: self.members().name(member).to_owned(),
            place: place(member),
        });
        let programs = loaded.into_iter().flat_map(|loaded| &loaded.programs);
        let programs = programs.map(|(program, new)| ChangingProgram {
            program: self.program_name(*program).to_owned(),
            is_new: self.controller_at(*program, cycle).is_some_and(|it| it.hash == *new),
        });
        Some(ChangeSnapshot {
            before: before.to_string(),
            after: after.to_string(),
            programs: programs.collect(),
            members: members.collect(),
            given: known.given.clone(),
        })
    }
}

impl ChangeSnapshot {
    /// The change, its steps and the places of its members in a sentence.
    pub fn text(&self) -> String {
        let mut parts = Vec::new();
        if let Some(GivenStep { by, step, cycle }) = &self.given {
            parts.push(format!("{step} by {by} in cycle {cycle}"));
        }
        parts.extend(self.programs.iter().map(|ChangingProgram { program, is_new }| {
            let which = if *is_new { "new" } else { "old" };
            format!("{program} runs the {which} program")
        }));
        for place in ChangePlace::ALL {
            let members = self.members.iter().filter(|member| member.place == place);
            let names: Vec<&str> = members.map(|member| member.name.as_str()).collect();
            if !names.is_empty() {
                parts.push(format!("{}: {}", place.word(), names.join(", ")));
            }
        }
        parts.join("; ")
    }
}
