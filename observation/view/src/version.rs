//! The programs that were in the place of one program in a run: that with which it began, and those that online changes brought.
//!
//! A scan is explained by the program that took it: the text, the rungs and the variables are those of that one.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use understudy_cluster::Controller;
use understudy_interchange::{Bodies, DrawnUnit, Listing, drawn_units};
use understudy_ladder::Observer;
use understudy_typed::Interpreter;
use understudy_wire::ProgramHash;

use crate::source_text::SourceText;
use crate::state_signal::{self, StateSignal};

/// Programs in the place of one that are kept, at most.
const MOST: usize = 32;

/// One program, with what is made of it when it is asked for.
#[derive(Debug, Clone)]
pub(crate) struct Version {
    controller: Controller,
    observer: OnceLock<Option<Observer>>,
    interpreter: OnceLock<Interpreter>,
    drawing: OnceLock<Vec<DrawnUnit>>,
    listing: OnceLock<Option<Listing>>,
    signals: OnceLock<BTreeMap<String, StateSignal>>,
}

impl Version {
    fn of(controller: &Controller) -> Self {
        Self {
            controller: controller.clone(),
            observer: OnceLock::new(),
            interpreter: OnceLock::new(),
            drawing: OnceLock::new(),
            listing: OnceLock::new(),
            signals: OnceLock::new(),
        }
    }

    /// The controller with this program.
    pub(crate) fn controller(&self) -> &Controller {
        &self.controller
    }

    /// The observer of its power flow; none where it is no ladder.
    pub(crate) fn observer(&self) -> Option<&Observer> {
        self.observer.get_or_init(|| self.controller.code.observer()).as_ref()
    }

    /// The interpreter of its statements, whose states are those of [`Code::typed_state`](understudy_cluster::Code::typed_state).
    pub(crate) fn interpreter(&self) -> &Interpreter {
        self.interpreter.get_or_init(|| Interpreter::new(self.controller.code.typed()))
    }

    /// Its text, of a program that is shown as statements: that of its file, or what the bodies of a document mean.
    pub(crate) fn text(&self) -> Option<SourceText<'_>> {
        let code = &self.controller.code;
        if code.ladder().is_some() {
            return None;
        }
        let source = code.source();
        let listing = self.listing.get_or_init(|| Listing::of(&source.file, &source.text));
        let text = || SourceText::new(&source.text);
        Some(listing.as_ref().map_or_else(text, SourceText::of_listing))
    }

    /// Its units as they are drawn; none of one in rungs.
    pub(crate) fn drawing(&self) -> &[DrawnUnit] {
        self.drawing.get_or_init(|| {
            let source = self.controller.code.source();
            drawn_units(&source.file, &source.text, Bodies::Blocks).unwrap_or_default()
        })
    }

    /// A signal of its state that is that one: the same, or the one of that name and type in another program.
    pub(crate) fn signal<'s>(&'s self, of: &'s StateSignal) -> Option<&'s StateSignal> {
        if of.program() == self.controller.hash {
            return Some(of);
        }
        let signals = self.signals.get_or_init(|| {
            let signals = state_signal::state_signals_of(&self.controller).into_iter();
            signals.map(|signal| (signal.name.clone(), signal)).collect()
        });
        signals.get(&of.name).filter(|own| own.of == of.of)
    }
}

/// The programs in the place of one.
#[derive(Debug, Clone)]
pub(crate) struct Versions {
    first: Version,
    /// Of online changes, the newest last.
    changed: Vec<Version>,
}

impl Versions {
    /// Of a run that begins with this one.
    pub(crate) fn of(first: &Controller) -> Self {
        Self { first: Version::of(first), changed: Vec::new() }
    }

    /// Its program may become this one.
    pub(crate) fn learn(&mut self, controller: &Controller) {
        if controller.hash == self.first.controller.hash {
            return;
        }
        let known = self.changed.iter().position(|it| it.controller.hash == controller.hash);
        let version = match known {
            Some(known) => self.changed.remove(known),
            None => Version::of(controller),
        };
        self.changed.push(version);
        if self.changed.len() == MOST {
            self.changed.remove(0);
        }
    }

    /// That with which the run began.
    pub(crate) fn first(&self) -> &Version {
        &self.first
    }

    /// The one with this hash.
    pub(crate) fn find(&self, program: ProgramHash) -> Option<&Version> {
        let all = std::iter::once(&self.first).chain(&self.changed);
        all.into_iter().find(|version| version.controller.hash == program)
    }
}
