//! The settings by which a remote I/O holds its outputs and drives fail-safe ones, across online changes.

use std::hash::{Hash, Hasher};

use understudy_cycle::OnlineChange;
use understudy_remote_io::Fallback;
use understudy_wire::{ConfigurationHash, Image, Member, ProgramId};

use super::Referee;

/// The settings of the one or two remote I/Os of a program. Each has those of the configuration that it runs.
#[derive(Debug, Clone)]
pub(super) struct Fallbacks {
    first: InForce,
    /// Of each that has said which configuration it runs.
    told: Vec<(Member, InForce)>,
    /// The one whose outputs are judged.
    speaker: Option<Member>,
    /// Whether a remote I/O has started again, and has not said since which configuration it runs.
    is_new: bool,
}

#[derive(Debug, Clone)]
struct InForce {
    configuration: ConfigurationHash,
    /// Nothing where the change to this configuration was not told.
    fallback: Option<Fallback>,
}

/// By the configurations, of which the settings follow.
impl Hash for Fallbacks {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        for (by, told) in &self.told {
            (by, told.configuration).hash(hasher);
        }
        (self.speaker, self.is_new).hash(hasher);
    }
}

impl Referee {
    /// A remote I/O of the program starts again with this configuration, one of those of the change or another one that has the first settings.
    pub fn starts_with(&mut self, member: Member, own: ConfigurationHash) {
        self.points.is_new = true;
        let fallbacks = &mut self.fallbacks;
        fallbacks.told.retain(|(of, _)| *of != member);
        let speaker = fallbacks.speaker.replace(member);
        if self.programs.change.as_ref().is_some_and(|change| change.name().has(own)) {
            fallbacks.runs(own, self.programs.change.as_deref(), self.programs.place);
        }
        fallbacks.speaker = speaker;
    }

    /// The fail-safe values of the remote I/O whose outputs were judged last, at the points that count, where they are known.
    pub fn fail_safe(&self) -> Option<Image> {
        self.fallback_in_force().map(|fallback| fallback.fail_safe)
    }

    /// The remote I/O runs this configuration from now on, with its settings: ramps to other fail-safe values begin where the outputs are.
    pub(super) fn configured(&mut self, own: ConfigurationHash) {
        if self.fallbacks.runs(own, self.programs.change.as_deref(), self.programs.place) {
            self.descent.begins_anew();
        }
    }

    /// Whether outputs may still be held.
    pub(super) fn may_hold(&self) -> bool {
        let possible = self.possible_fallbacks();
        possible.is_none_or(|all| all.iter().any(|fallback| self.held <= fallback.hold_cycles))
    }

    /// Whether outputs may be driven as fail-safe.
    pub(super) fn may_fall_back_to(&self, driven: &Image) -> bool {
        let possible = self.possible_fallbacks();
        possible.is_none_or(|all| all.iter().any(|it| self.descent.permits(driven, it)))
    }

    /// The settings of the remote I/O whose outputs were judged last, for the points that count; nothing where they are not known.
    pub(super) fn fallback_in_force(&self) -> Option<Fallback> {
        let in_force = self.fallbacks.in_force();
        let own = in_force.fallback.as_ref()?;
        let (change, program) = (self.programs.change.as_ref(), self.programs.place);
        let version = self.points.version;
        let fitted = change.map(|it| it.fitted((own, in_force.configuration), program, version));
        Some(fitted.unwrap_or_else(|| own.clone()))
    }

    /// The settings that the remote I/O may have. Before the first sample after a start it may have the points of either version.
    fn possible_fallbacks(&self) -> Option<Vec<Fallback>> {
        let (change, program) = (self.programs.change.as_deref(), self.programs.place);
        let possible = self.fallbacks.possible(change, program)?;
        let Some(changed) = change.and_then(|change| Some((change, change.of(program)?))) else {
            return Some(possible.into_iter().map(|(_, fallback)| fallback.clone()).collect());
        };
        let (change, of) = changed;
        let both = [of.before.hash, of.after.hash];
        let versions = [self.points.version]
            .into_iter()
            .chain(both.into_iter().filter(|_| self.points.is_new));
        let fitted = versions.flat_map(|version| {
            possible.iter().map(move |(configuration, fallback)| {
                change.fitted((fallback, *configuration), program, version)
            })
        });
        Some(fitted.collect())
    }

    /// Whether the values on the way to the fail-safe ones count; without ramps there is one way to them.
    pub fn has_ramps(&self) -> bool {
        let changed = self.programs.change.iter().flat_map(|change| &change.fallbacks);
        let mut changed = changed.filter(|changed| changed.program == self.programs.place);
        let has = |fallback: &Fallback| !fallback.ramps.is_empty();
        let current = self.fallbacks.in_force().fallback.as_ref();
        current.is_some_and(has) || changed.any(|it| has(&it.before) || has(&it.after))
    }

    pub(super) fn hash_fallbacks(&self, hasher: &mut impl Hasher) {
        if self.has_ramps() {
            self.descent.hash(hasher);
        }
        self.fallbacks.hash(hasher);
    }
}

impl Fallbacks {
    /// Of remote I/Os that begin with this configuration.
    pub(super) fn new(configuration: ConfigurationHash, first: Fallback) -> Self {
        let first = InForce { configuration, fallback: Some(first) };
        Self { first, told: Vec::new(), speaker: None, is_new: false }
    }

    pub(super) fn starts_again(&mut self) {
        self.is_new = true;
    }

    /// From here on outputs are those of this remote I/O.
    pub(super) fn speaks(&mut self, member: Member) {
        self.speaker = Some(member);
    }

    /// The speaker runs a configuration; whether its settings are other ones by that.
    fn runs(
        &mut self,
        configuration: ConfigurationHash,
        change: Option<&OnlineChange>,
        program: ProgramId,
    ) -> bool {
        let Some(by) = self.speaker else {
            return false;
        };
        self.is_new = false;
        let before = self.in_force();
        if before.configuration == configuration {
            return false;
        }
        let change = change.filter(|change| change.name().has(configuration));
        let fallback = change.and_then(|change| {
            let changed = change.fallback_in(configuration, program);
            // A change of other settings leads on from what is known, or it is not known.
            let unchanged = before.fallback.as_ref();
            changed.or(unchanged.filter(|_| change.name().has(before.configuration))).cloned()
        });
        let is_other = fallback != before.fallback;
        self.told.retain(|(member, _)| *member != by);
        self.told.push((by, InForce { configuration, fallback }));
        is_other
    }

    fn in_force(&self) -> &InForce {
        let told = self.told.iter().find(|(member, _)| Some(*member) == self.speaker);
        told.map_or(&self.first, |(_, told)| told)
    }

    /// The settings that the speaker may have: after a start those of either configuration of the change. Nothing where they are not known.
    fn possible<'a>(
        &'a self,
        change: Option<&'a OnlineChange>,
        program: ProgramId,
    ) -> Option<Vec<(ConfigurationHash, &'a Fallback)>> {
        let in_force = self.in_force();
        let mut possible = vec![(in_force.configuration, in_force.fallback.as_ref()?)];
        if let Some(change) = change.filter(|_| self.is_new) {
            let both = [change.before, change.after].into_iter();
            possible.extend(both.filter_map(|it| Some((it, change.fallback_in(it, program)?))));
        }
        Some(possible)
    }
}
