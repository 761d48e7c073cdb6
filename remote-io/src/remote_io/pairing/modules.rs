//! Two remote I/Os that are both wired to the plant, each with modules of its own.
//!
//! - **Outputs.** The author sends the outputs that it drives at each deadline, and the follower's modules drive the same. So no output comes of a sample
//!   that the author does not know of, and forces, ramps and held values are those of the author. A follower that receives none keeps the last ones for as
//!   long as a switchover may take ([`PairSettings::lasting`]), and then releases them: they are 0. So do those of an author that steps aside.
//! - **Inputs.** The follower sends what its modules show, and u(i) is made of both ([`PairedInputs`]).
//!
//! - **Numbers** that the modules of both drive together add up: each drives a part ([`Sharing`]), and the author sends the other one its part.
//!
//! What is received counts where it answers a frame of the last [`AGE`] periods, so nothing is older, whatever the network and the hosts delay.
//!
//! Invariant: the modules of a follower drive what the author has sent in one of the last `lasting` + [`AGE`] periods, or 0.

use understudy_cycle::Output;
use understudy_wire::{Image, Member, Modules as Sent, Pair, Part, Share, Time};

use super::super::RemoteIo;
use crate::event::Event;
use crate::paired_inputs::{InputChange, Module, PairedInputs};
use crate::settings::{Settings, Wiring};
use crate::sharing::{Lasts, Sharing};

/// Age in periods up to which inputs and outputs of the other one count: those of the last deadline, where no frame is a period late.
const AGE: u32 = 2;

/// What one of the two knows of the modules of both.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Modules {
    /// Samples in a row in which two readings differ until an operator is told.
    discrepancy_cycles: u32,
    inputs: PairedInputs,
    /// The sensors of this remote I/O are old.
    is_stale: bool,
    /// The newest inputs of the other one.
    theirs: Option<Readings>,
    /// Outputs that the other one drives, as this author has decided, until they are sent.
    driven: Option<(Image, Share)>,
    /// The parts of shared numbers, where the program has such.
    sharing: Option<Sharing>,
    /// Outputs that this follower drives.
    followed: Option<Followed>,
    /// Modules that are not trusted, at the first remote I/O and at the twin, as the author has them.
    distrusted: [Image; 2],
    /// When the newest frame of the other one was sent, on its clock.
    answers: Option<Time>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Readings {
    /// `None` where its field does not answer.
    inputs: Option<Image>,
    at: Time,
    /// Whether no sample was made of them yet.
    is_new: bool,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Followed {
    outputs: Image,
    share: Share,
    at: Time,
    /// When they were sent, on the clock of the author.
    sent: Time,
}

impl Modules {
    /// Of a remote I/O with these settings; `None` where only the author is wired to the plant.
    pub(super) fn of(settings: &Settings) -> Option<Self> {
        let Wiring::Parallel { discrepancy_cycles } = settings.pair?.wiring else {
            return None;
        };
        let inputs = PairedInputs::new(&settings.paired_inputs, settings.layout.undriven.clone());
        Some(Self {
            discrepancy_cycles,
            distrusted: inputs.distrusted(&settings.paired_inputs),
            inputs,
            is_stale: false,
            theirs: None,
            driven: None,
            sharing: None,
            followed: None,
            answers: None,
        })
    }
}

impl RemoteIo {
    fn modules(&mut self) -> Option<&mut Modules> {
        self.pairing.as_mut()?.modules.as_mut()
    }

    /// Whether it has modules that nothing else writes, so that it is connected to them whatever its part is.
    pub(in crate::remote_io) fn has_own_modules(&self) -> bool {
        self.pairing.as_ref().is_some_and(|pairing| pairing.modules.is_some())
    }

    // ── inputs ──────────────────────────────────────────────────────────────────────────────────────────────────────

    /// The inputs of the other one, where it was received lately and its field answers.
    fn their_readings(&self) -> Option<&Readings> {
        let pairing = self.pairing.as_ref()?;
        let theirs = pairing.modules.as_ref()?.theirs.as_ref()?;
        let lasts = self.period() * (pairing.settings.take_over_after + 1);
        let is_recent = pairing.now.since(theirs.at) <= lasts;
        (is_recent && theirs.inputs.is_some()).then_some(theirs)
    }

    /// Whether its own sensors are old: they are not compared with those of the other one.
    pub(in crate::remote_io) fn note_stale(&mut self, is_stale: bool) {
        if let Some(modules) = self.modules() {
            modules.is_stale = is_stale;
        }
    }

    /// Whether the sensors are known, by modules of this remote I/O or of the other one.
    pub(in crate::remote_io) fn is_sensed(&self) -> bool {
        self.inputs.sensors.is_some() || self.their_readings().is_some()
    }

    /// What the sensors show; `None` where it is not known. Called once for each sample.
    pub(in crate::remote_io) fn read_field(&mut self) -> Option<Image> {
        if !self.has_own_modules() {
            return self.inputs.sensors.clone();
        }
        let theirs = self.their_readings().map(|it| (it.inputs.clone(), it.is_new));
        let (theirs, is_new) = theirs.unwrap_or((None, true));
        let pairing = self.pairing.as_mut()?;
        let is_twin = pairing.settings.is_twin;
        let modules = pairing.modules.as_mut()?;
        let own = self.inputs.sensors.clone().filter(|_| theirs.is_none() || !modules.is_stale);
        if let Some(theirs) = &mut modules.theirs {
            theirs.is_new = false;
        }
        // One reading alone says nothing of the other one, which is on its way.
        if !is_new && own.is_some() {
            return Some(modules.inputs.last().clone());
        }
        let (own, theirs) = (own.as_ref(), theirs.as_ref());
        let readings = if is_twin { [theirs, own] } else { [own, theirs] };
        let paired = &self.settings.paired_inputs;
        let read = modules.inputs.take(paired, readings, modules.discrepancy_cycles);
        self.report_inputs();
        read
    }

    /// The operator releases all modules that were excluded or in doubt.
    pub(in crate::remote_io) fn release_inputs(&mut self) {
        if let Some(modules) = self.pairing.as_mut().and_then(|it| it.modules.as_mut()) {
            modules.inputs.release(&self.settings.paired_inputs);
            self.report_inputs();
        }
    }

    fn report_inputs(&mut self) {
        let (program, moment) = (self.settings.program, self.moment());
        let Some(modules) = self.modules() else {
            return;
        };
        for (input, change) in modules.inputs.take_changes() {
            self.report(match change {
                InputChange::Agrees => Event::InputsAgree { moment, input },
                InputChange::Differs => Event::InputsDiffer { moment, input },
                InputChange::Excluded(Module::First) => {
                    Event::InputExcluded { moment, input, at: Member::RemoteIo(program) }
                }
                InputChange::Excluded(Module::Twin) => {
                    Event::InputExcluded { moment, input, at: Member::Twin(program) }
                }
            });
        }
    }

    /// Begins as the author: with the inputs that were sampled last, and the modules that were excluded or in doubt.
    pub(super) fn take_over_modules(&mut self) {
        let paired = &self.settings.paired_inputs;
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        let sampled = pairing.received.as_ref().and_then(|sample| sample.without_forces());
        let last = sampled.unwrap_or(&self.layout.undriven).clone();
        let Some(modules) = &mut pairing.modules else {
            return;
        };
        let share = modules.followed.as_ref().map(|followed| followed.share);
        let known = share.map_or_else(
            || Sharing::unknown(pairing.now),
            |share| Sharing::following(pairing.now, share),
        );
        modules.sharing = Some(known).filter(|_| !self.settings.shared_outputs.places.is_empty());
        modules.inputs = PairedInputs::new(paired, last);
        modules.inputs.distrust(paired, &modules.distrusted);
        modules.followed = None;
        modules.driven = None;
        self.report_inputs();
    }

    // ── outputs ─────────────────────────────────────────────────────────────────────────────────────────────────────

    /// Divides what this author drives between the modules of both. What its own drive; the other one is sent its part.
    pub(in crate::remote_io) fn divide(&mut self, driven: &Image) -> Image {
        let is_of_use = [self.inputs.sensors.is_some(), self.is_followed_by_modules()];
        let period = self.period();
        let shared = &self.settings.shared_outputs;
        let Some(pairing) = &mut self.pairing else {
            return driven.clone();
        };
        let Some(modules) = &mut pairing.modules else {
            return driven.clone();
        };
        let is_twin = pairing.settings.is_twin;
        let [own, other] = modules.sharing.as_mut().map_or([Share::Whole; 2], |sharing| {
            let lasts = Lasts::of(period, pairing.settings.lasting(), shared.delay);
            sharing.decide(pairing.now, is_of_use, lasts)
        });
        modules.driven = Some((shared.part(driven, other, !is_twin), other));
        shared.part(driven, own, is_twin)
    }

    /// Whether the modules of the other one drive what they are sent, as far as it is known.
    fn is_followed_by_modules(&self) -> bool {
        let theirs = self.pairing.as_ref().and_then(|pairing| pairing.theirs.as_ref());
        self.their_readings().is_some() && theirs.is_some_and(|theirs| !are_away(theirs))
    }

    /// An author that ends to be one knows best which modules are not trusted, until it receives the next author.
    pub(super) fn note_distrusted(&mut self) {
        if let Some(modules) = self.pairing.as_mut().and_then(|it| it.modules.as_mut()) {
            modules.distrusted = modules.inputs.distrusted(&self.settings.paired_inputs);
        }
    }

    /// The modules of this remote I/O drive nothing until the author is received.
    pub(super) fn release_modules(&mut self) {
        let released = Image::zero(self.settings.fallback.fail_safe.width());
        let Some(modules) = self.pairing.as_mut().and_then(|it| it.modules.as_mut()) else {
            return;
        };
        modules.driven = None;
        modules.followed = None;
        self.member.put(Output::Follow(released));
    }

    /// A deadline is over, at which a follower has received no outputs for a period: they stay, and are released after some time.
    pub(super) fn follow_outputs(&mut self, now: Time) {
        let period = self.period();
        let released = Image::zero(self.settings.fallback.fail_safe.width());
        let Some(pairing) = self.pairing.as_mut().filter(|it| it.part != Part::Author) else {
            return;
        };
        let lasts = period * pairing.settings.lasting();
        let Some(modules) = &mut pairing.modules else {
            return;
        };
        let outputs = match &modules.followed {
            Some(followed) if now.since(followed.at) <= period * 5 / 4 => return,
            Some(followed) if now.since(followed.at) <= lasts => followed.outputs.clone(),
            _ => {
                modules.followed = None;
                released
            }
        };
        self.member.put(Output::Follow(outputs));
    }

    // ── frames ──────────────────────────────────────────────────────────────────────────────────────────────────────

    pub(super) fn modules_to_send(&mut self) -> Option<Sent> {
        let pairing = self.pairing.as_mut()?;
        let modules = pairing.modules.as_mut()?;
        Some(match pairing.part {
            Part::Author => {
                let (outputs, share) = modules.driven.take().unzip();
                Sent::Author {
                    outputs,
                    share: share.unwrap_or_default(),
                    answers: modules.answers,
                    distrusted: modules.inputs.distrusted(&self.settings.paired_inputs),
                }
            }
            Part::Follower | Part::TakingOver => {
                let inputs = self.inputs.sensors.clone().filter(|_| !modules.is_stale);
                Sent::Follower { inputs, follows: modules.followed.is_some() }
            }
        })
    }

    /// Takes what the other one has sent of its modules. What is not sent in answer to a frame of the last periods may be older, and does not count.
    pub(super) fn receive_modules(&mut self, now: Time, theirs: &Pair) {
        let (inputs, outputs) =
            (self.layout.input_width(), self.settings.fallback.fail_safe.width());
        let oldest = self.period() * AGE;
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        let (Some(modules), Some(sent)) = (&mut pairing.modules, &theirs.modules) else {
            return;
        };
        modules.answers = Some(theirs.sent);
        let asked = &pairing.sent;
        let is_present = |answers: Option<Time>| {
            answers.is_some_and(|at| asked.contains(&at) && now.since(at) <= oldest)
        };
        match sent {
            Sent::Follower { inputs: readings, .. } if is_present(theirs.bound_by) => {
                let inputs = readings.clone().filter(|image| image.width() == inputs);
                modules.theirs = Some(Readings { inputs, at: now, is_new: true });
            }
            Sent::Author { outputs: driven, share, answers, distrusted }
                if pairing.part != Part::Author && is_present(*answers) =>
            {
                if distrusted.iter().all(|image| image.width() == inputs) {
                    modules.distrusted.clone_from(distrusted);
                }
                let is_newer =
                    modules.followed.as_ref().is_none_or(|before| theirs.sent > before.sent);
                let driven = driven.as_ref().filter(|image| image.width() == outputs && is_newer);
                if let Some(outputs) = driven.cloned() {
                    modules.followed = Some(Followed {
                        outputs: outputs.clone(),
                        share: *share,
                        at: now,
                        sent: theirs.sent,
                    });
                    self.member.put(Output::Follow(outputs));
                }
            }
            Sent::Follower { .. } | Sent::Author { .. } => {}
        }
    }
}

/// Whether the modules of the other one do not drive the outputs of the author.
pub(super) fn are_away(theirs: &Pair) -> bool {
    matches!(theirs.modules, Some(Sent::Follower { follows: false, .. }))
}
