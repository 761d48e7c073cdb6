//! What a remote I/O does where nothing is proved, as a change tells it to the members.

use serde::{Deserialize, Serialize};
use understudy_cycle::{Fallback, PointPlace, Ramp, Release, Restart, StaleState, ValueFault};
use understudy_typed::Points;
use understudy_wire::{Image, ProgramId};

use super::settings::ChangedSetting;
use crate::cluster::RemoteIo;
use crate::format::MANY_CYCLES;

/// What a remote I/O does where nothing is proved, before and after.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChangedFallback {
    /// Its program.
    pub program: ProgramId,
    /// Before.
    pub before: FallbackText,
    /// After.
    pub after: FallbackText,
}

/// What a remote I/O does where nothing is proved.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FallbackText {
    hold_cycles: u32,
    trial_cycles: u32,
    fail_safe: Image,
    /// First bits of outputs with a ramp, and the bits of the greatest change from one deadline to the next.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    ramps: Vec<(u16, u64)>,
    release: Release,
    value_fault: ValueFault,
    stale_state: StaleState,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    restart: Option<Restart>,
}

impl ChangedFallback {
    /// Nothing where the two do the same.
    ///
    /// # Errors
    /// A setting that no online change replaces: stations and remote I/Os would have to begin or to end to keep retentive values.
    pub(super) fn between(
        program: ProgramId,
        before: &RemoteIo,
        after: &RemoteIo,
    ) -> Result<Option<Self>, ChangedSetting> {
        let [old, new] = [before, after].map(|remote_io| &remote_io.fallback);
        if old == new {
            return Ok(None);
        }
        if old.restart.is_some() != new.restart.is_some() {
            let of = format!("remote I/O `{}`", before.name);
            return Err(ChangedSetting::Key { of, key: "`restart`".to_owned(), values: None });
        }
        let [before, after] = [old, new].map(FallbackText::of);
        Ok(Some(Self { program, before, after }))
    }

    pub(super) fn back(self) -> Self {
        let Self { program, before, after } = self;
        Self { program, before: after, after: before }
    }
}

impl FallbackText {
    fn of(fallback: &Fallback) -> Self {
        let Fallback {
            hold_cycles,
            trial_cycles,
            fail_safe,
            ramps,
            release,
            value_fault,
            stale_state,
            restart,
        } = fallback.clone();
        let ramps = ramps.iter().map(|ramp| (ramp.place.bit, ramp.step.to_bits())).collect();
        Self {
            hold_cycles,
            trial_cycles,
            fail_safe,
            ramps,
            release,
            value_fault,
            stale_state,
            restart,
        }
    }

    /// The settings for a program with these outputs; nothing where they do not fit them, or are beyond the bounds of the cluster file.
    pub(super) fn read(&self, outputs: &Points) -> Option<Fallback> {
        let Self {
            hold_cycles,
            trial_cycles,
            fail_safe,
            ramps,
            release,
            value_fault,
            stale_state,
            restart,
        } = self.clone();
        let is_bounded = hold_cycles.max(trial_cycles) <= MANY_CYCLES;
        if !is_bounded || fail_safe.width() != outputs.width() {
            return None;
        }
        let ramp = |&(bit, step): &(u16, u64)| {
            let output = outputs.iter().find(|output| output.bit == u32::from(bit))?;
            let is_number = output.of.is_integer() || output.of.is_real();
            let step = Some(f64::from_bits(step)).filter(|step| *step > 0.0 && step.is_finite())?;
            is_number.then_some(Ramp { place: PointPlace::of(output), step })
        };
        let ramps = ramps.iter().map(ramp).collect::<Option<_>>()?;
        Some(Fallback {
            hold_cycles,
            trial_cycles,
            fail_safe,
            ramps,
            release,
            value_fault,
            stale_state,
            restart,
        })
    }
}
