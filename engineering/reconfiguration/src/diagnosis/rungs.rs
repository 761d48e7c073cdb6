//! The rungs of the diagnosing ladder, in the order of its scan.

use understudy_ladder::{BlockKind, CoilKind, Element, Name};

use super::{Writer, any, block, coil, contact, of, off, on};
use crate::controller::Move;

use CoilKind::{Plain, Reset, Set};

impl Writer<'_> {
    /// What was known before this scan: repairs, releases, what a restart has left, and what the outputs let happen.
    pub(super) fn prepare(&mut self) {
        let release = Name::from("diagnosis.release");
        let started = Name::from("diagnosis.started");
        for channel in self.channels() {
            let [diagnosed, last, moves, moved, recalled] =
                ["diagnosed", "last", "moves", "moved", "recalled"].map(|what| of(&channel, what));
            let raw = Name::from(channel.clone());
            let title = format!("{channel}: value changed");
            let differs = vec![vec![on(&raw), off(&last)], vec![off(&raw), on(&last)]];
            let mut network = vec![on(&started)];
            network.extend(any(differs));
            self.program.push_titled(&title, network, vec![coil(Plain, &moves)]);
            self.program.push_rung(vec![on(&raw)], vec![coil(Plain, &last)]);
            self.program.push_rung(vec![on(&moves), on(&diagnosed)], vec![coil(Set, &moved)]);
            let title =
                format!("{channel}: repaired when its value is stable and possible in the model");
            let quiet = BlockKind::Ton(self.ground.patience.quiet);
            let network = vec![
                on(&diagnosed),
                on(&moved),
                off(&moves),
                off(&of(&channel, "failed")),
                on(&of(&channel, "fits")),
                off(&of(&channel, "spent")),
                block(of(&channel, "quiet"), quiet),
            ];
            let mended = of(&channel, "mended");
            self.program.push_titled(&title, network, vec![coil(Plain, &mended)]);
            let network = any(vec![vec![on(&mended)], vec![on(&release)]]);
            self.program.push_rung(network, vec![coil(Reset, &diagnosed)]);
            let network = vec![off(&started), on(&recalled)];
            self.program.push_rung(network, vec![coil(Set, &diagnosed)]);
        }
        let anywhere = Name::from("diagnosis.anywhere");
        let lost = Name::from("diagnosis.lost");
        let network = any(vec![vec![off(&started)], vec![on(&release)], vec![on(&lost)]]);
        self.program.push_titled(
            "state of the plant unknown",
            network,
            vec![coil(Plain, &anywhere)],
        );
        let outputs = self.ground.controller.signals.outputs.clone();
        for number in 0..self.rows.len() {
            let wanted = self.rows[number].0.iter().zip(&outputs);
            let mut network: Vec<Element> = wanted
                .filter_map(|(wanted, name)| Some(contact(&Name::from(name.clone()), (*wanted)?)))
                .collect();
            let name = Name::from(format!("lets.{}", number + 1));
            network.push(block(name, BlockKind::Tof(self.ground.patience.grace)));
            self.program.push_rung(network, vec![coil(Plain, &self.row(number))]);
        }
        for state in self.states() {
            let own = &self.ground.controller.states()[state].outputs.0;
            let network = outputs.iter().zip(own);
            let network = network.map(|(name, &value)| contact(&Name::from(name.clone()), value));
            self.program.push_rung(network.collect(), vec![coil(Plain, &self.bit("at", state))]);
        }
    }

    /// What the channels show, once it has lasted.
    pub(super) fn look(&mut self) {
        let started = Name::from("diagnosis.started");
        let mut outs = Vec::new();
        let mut changes = Vec::new();
        for channel in self.channels() {
            let raw = Name::from(channel.clone());
            let [out, seen, differs, accepted, waits, gone] =
                ["out", "seen", "differs", "accepted", "waits", "gone"]
                    .map(|what| of(&channel, what));
            let failed = ["failed", "diagnosed"].map(|what| vec![on(&of(&channel, what))]);
            let title = format!("{channel}: accepted value");
            self.program.push_titled(&title, any(failed.into()), vec![coil(Plain, &out)]);
            // A failed channel, and a channel in its first scan, is accepted as it is.
            let as_it_is = any(vec![vec![off(&started)], vec![on(&out)]]);
            for value in [true, false] {
                let mut network = as_it_is.clone();
                network.push(contact(&raw, value));
                self.program.push_rung(network, vec![coil(if value { Set } else { Reset }, &seen)]);
            }
            let other = vec![vec![on(&raw), off(&seen)], vec![off(&raw), on(&seen)]];
            self.program.push_rung(any(other), vec![coil(Plain, &differs)]);
            let mut network = vec![on(&differs)];
            if self.is_filtered(&channel) {
                let steady = BlockKind::Ton(self.ground.patience.steady);
                network.push(block(of(&channel, "lasts"), steady));
            }
            self.program.push_rung(network, vec![coil(Plain, &accepted)]);
            self.program
                .push_rung(vec![on(&waits), off(&differs), off(&out)], vec![coil(Plain, &gone)]);
            self.program.push_rung(
                vec![on(&differs), off(&accepted)],
                vec![coil(Plain, &waits), coil(Plain, &of(&channel, "unsteady"))],
            );
            for value in [true, false] {
                let network = vec![on(&accepted), contact(&raw, value)];
                self.program.push_rung(network, vec![coil(if value { Set } else { Reset }, &seen)]);
            }
            outs.push(vec![on(&out)]);
            changes.push(vec![on(&accepted)]);
        }
        for name in self.unwatched() {
            let (raw, last) = (Name::from(name.clone()), of(&name, "last"));
            let other = vec![vec![on(&raw), off(&last)], vec![off(&raw), on(&last)]];
            changes.extend(other);
        }
        let out = Name::from("diagnosis.out");
        self.program.push_titled("at least one channel failed", any(outs), vec![coil(Plain, &out)]);
        let change = Name::from("diagnosis.change");
        self.program.push_titled("input change", any(changes), vec![coil(Plain, &change)]);
        for name in self.unwatched() {
            let network = vec![on(&Name::from(name.clone()))];
            self.program.push_rung(network, vec![coil(Plain, &of(&name, "last"))]);
        }
    }

    /// Whether changes of a channel must be stable: the shortest pulse in the model is still detected.
    fn is_filtered(&self, channel: &str) -> bool {
        let inputs = &self.ground.controller.signals.inputs;
        let place = inputs.iter().position(|input| input == channel);
        let pulse = place.and_then(|place| self.ground.timing.shortest_pulse[place]);
        let steady = self.ground.patience.steady;
        !steady.is_zero() && pulse.is_none_or(|scans| self.ground.period * scans > steady * 2)
    }

    /// Where the plant may be after one move at most, or none, whatever the inputs show.
    pub(super) fn follow(&mut self) {
        let followed = Name::from("diagnosis.followed");
        let two = Name::from("diagnosis.two");
        let anywhere = Name::from("diagnosis.anywhere");
        for state in self.states() {
            let stays = on(&self.bit("m", state));
            let (at, old, left) =
                (self.bit("at", state), self.bit("old", state), self.bit("left", state));
            if let Some(scans) = self.ground.timing.longest_stay[state] {
                let time = self.ground.period * scans + self.ground.patience.late;
                let timer = block(self.bit("stay", state), BlockKind::Ton(time));
                let network = vec![on(&followed), off(&two), stays.clone(), on(&at), timer];
                self.program.push_rung(network, vec![coil(Plain, &old)]);
            }
            let timer = BlockKind::Ton(self.ground.patience.grace);
            let timer = block(self.bit("other", state), timer);
            let network = vec![on(&followed), stays, off(&at), timer];
            self.program.push_rung(network, vec![coil(Plain, &left)]);
        }
        let mut into: Vec<Vec<Vec<Element>>> = self
            .states()
            .map(|state| {
                let mut stays = vec![on(&self.bit("m", state))];
                if self.ground.timing.longest_stay[state].is_some() {
                    stays.push(off(&self.bit("old", state)));
                }
                vec![vec![on(&anywhere)], stays]
            })
            .collect();
        for state in self.states() {
            for step in self.ground.controller.moves(state) {
                let mut network = vec![on(&self.bit("m", state))];
                network.extend(self.lets(state, step));
                into[step.target].push(network);
            }
        }
        for (state, branches) in into.into_iter().enumerate() {
            let target = coil(Plain, &self.bit("n", state));
            self.program.push_rung(any(branches), vec![target]);
        }
    }

    /// Whether the outputs let a move happen; ω is the ladder's own, and shows in them.
    fn lets(&self, state: usize, step: &Move) -> Vec<Element> {
        let controller = self.ground.controller;
        if step.events.is_empty() {
            let before = &controller.states()[state].outputs.0;
            let after = &controller.states()[step.target].outputs.0;
            let names = controller.signals.outputs.iter();
            let changed = names.zip(before.iter().zip(after));
            return changed
                .filter(|(_, (before, after))| before != after)
                .map(|(name, (_, &after))| contact(&Name::from(name.clone()), after))
                .collect();
        }
        let mut network = Vec::new();
        for &event in &step.events {
            let rows = self.ground.relation.rows(state, event);
            let bits = rows.iter().filter_map(|row| {
                let number = self.rows.iter().position(|known| known == row)?;
                Some(vec![on(&self.row(number))])
            });
            let bits: Vec<_> = bits.collect();
            if !bits.is_empty() {
                network.extend(any(bits));
            }
        }
        network
    }

    /// Whether the inputs show what a state shows, but for failed channels and, where given, the channel `but`; with those that are
    /// `accused` in this scan.
    fn shows(&self, state: usize, but: Option<usize>, accused: bool) -> Vec<Element> {
        let signals = &self.ground.controller.signals;
        let own = &self.ground.controller.states()[state].inputs.0;
        let places = own.iter().enumerate().filter(|(place, _)| but != Some(*place));
        let shown = places.map(|(place, &value)| {
            let name = &signals.inputs[place];
            if self.ground.channels.contains(&place) {
                let seen = contact(&of(name, "seen"), value);
                let mut branches = vec![vec![seen], vec![on(&of(name, "out"))]];
                if accused {
                    branches.push(vec![on(&of(name, "accused"))]);
                }
                Element::Branches(branches)
            } else {
                contact(&Name::from(name.clone()), value)
            }
        });
        shown.collect()
    }

    /// Where nothing that may be explains what is seen, the channels that would if they were failed.
    pub(super) fn accuse(&mut self) {
        let possible = Name::from("diagnosis.possible");
        let [change, tracked, followed] =
            ["change", "tracked", "followed"].map(|what| Name::from(format!("diagnosis.{what}")));
        let branches = self.states().map(|state| {
            let mut network = vec![on(&self.bit("n", state))];
            network.extend(self.shows(state, None, false));
            network
        });
        self.program.push_titled(
            "a state of the model explains the inputs",
            any(branches.collect()),
            vec![coil(Plain, &possible)],
        );
        for (&place, channel) in self.ground.channels.iter().zip(self.channels()) {
            let branches = self.states().map(|state| {
                let mut network = vec![on(&self.bit("n", state))];
                network.extend(self.shows(state, Some(place), false));
                network
            });
            let explains = of(&channel, "explains");
            let mut network = vec![off(&possible), off(&of(&channel, "out"))];
            // What somebody else has shown is no reason to accuse this one, and time alone only where the plant was in one state.
            network.push(on(&tracked));
            let own = of(&channel, "accepted");
            network.extend(any(vec![vec![on(&own)], vec![off(&change), on(&followed)]]));
            network.extend(any(branches.collect()));
            let title = format!("{channel}: its failure would explain the inputs");
            self.program.push_titled(&title, network, vec![coil(Plain, &explains)]);
        }
        for channel in self.channels() {
            let [explains, gone, accused, diagnosed, moved] =
                ["explains", "gone", "accused", "diagnosed", "moved"]
                    .map(|what| of(&channel, what));
            let network = any(vec![vec![on(&explains)], vec![on(&gone)]]);
            let title = format!("{channel}: fault detected");
            self.program.push_titled(&title, network, vec![coil(Plain, &accused)]);
            self.program.push_rung(vec![on(&accused)], vec![coil(Set, &diagnosed)]);
            let release = vec![on(&Name::from("diagnosis.release"))];
            let counter = Element::Block(understudy_ladder::Block {
                name: of(&channel, "count"),
                kind: BlockKind::Ctu(self.ground.patience.repairs),
                pins: vec![understudy_ladder::Feed { pin: Name::from("R"), network: release }],
            });
            let spent = coil(Plain, &of(&channel, "spent"));
            self.program.push_rung(vec![on(&accused), counter], vec![spent]);
            // A channel that recovered by itself has changed; a value that caused the diagnosis must change once more.
            self.program.push_rung(vec![on(&accused), off(&gone)], vec![coil(Reset, &moved)]);
            self.program.push_rung(vec![on(&accused), on(&gone)], vec![coil(Set, &moved)]);
        }
    }

    /// Where the plant may be from now on, and whether it can be told by time.
    pub(super) fn settle(&mut self) {
        let [possible, one, two, followed, out] = ["possible", "one", "two", "followed", "out"]
            .map(|what| Name::from(format!("diagnosis.{what}")));
        let driven = Name::from("diagnosis.driven");
        for state in self.states() {
            let [may, next, left] = ["m", "n", "left"].map(|what| self.bit(what, state));
            let mut network =
                any(vec![vec![on(&next), off(&left)], vec![on(&may), off(&possible)]]);
            network.extend(self.shows(state, None, true));
            self.program.push_rung(network, vec![coil(Plain, &may)]);
        }
        self.count(&one, &two);
        let tracked = Name::from("diagnosis.tracked");
        self.program.push_rung(vec![on(&one)], vec![coil(Plain, &tracked)]);
        let lost = Name::from("diagnosis.lost");
        self.program.push_titled(
            "no state of the model explains the inputs: state of the plant unknown",
            vec![off(&one)],
            vec![coil(Plain, &lost)],
        );
        let network =
            any(vec![vec![off(&one)], vec![on(&two)], vec![off(&driven)], vec![on(&out)]]);
        self.program.push_rung(network, vec![coil(Reset, &followed)]);
        let own = self.states().map(|state| {
            let [may, at] = ["m", "at"].map(|what| self.bit(what, state));
            vec![on(&may), on(&at)]
        });
        let mut network = vec![on(&one), off(&two), on(&driven), off(&out)];
        network.extend(any(own.collect()));
        self.program.push_titled(
            "exactly one state possible, with the outputs of this state",
            network,
            vec![coil(Set, &followed)],
        );
        for channel in self.channels() {
            let raw = Name::from(channel.clone());
            let place = self.ground.controller.signals.inputs.iter();
            let place = place.clone().position(|input| *input == channel).unwrap_or_default();
            let branches = self.states().map(|state| {
                let value = self.ground.controller.states()[state].inputs.0[place];
                vec![on(&self.bit("m", state)), contact(&raw, value)]
            });
            let network = any(branches.collect());
            self.program.push_rung(network, vec![coil(Plain, &of(&channel, "fits"))]);
        }
        let started = Name::from("diagnosis.started");
        self.program.push_rung(Vec::new(), vec![coil(Set, &started)]);
    }

    /// Whether the plant may be in one state, and in two.
    fn count(&mut self, one: &Name, two: &Name) {
        self.program.push_titled(
            "number of possible states: none, one, or at least two",
            Vec::new(),
            vec![coil(Reset, one), coil(Reset, two)],
        );
        for state in self.states() {
            let may = self.bit("m", state);
            self.program.push_rung(vec![on(&may), on(one)], vec![coil(Set, two)]);
            self.program.push_rung(vec![on(&may)], vec![coil(Set, one)]);
        }
    }
}
