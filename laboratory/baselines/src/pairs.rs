//! A redundant pair for each program of a cluster, with its remote I/O and its plant, over the simulator's network in virtual time.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use understudy_cluster::Cluster;
use understudy_cycle::{Agreement, Input, Machine, Output, RemoteIoInput};
use understudy_executable::Executable;
use understudy_plant::Plant;
use understudy_simulator::Network;
use understudy_wire::{Body, Field, Frame, Image, Member, ProgramId, Time, encode};

use crate::module::Module;
use crate::partner::{Event, Partner, Redundancy, Settings};

/// What happened in so many cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Account {
    /// Deadlines of all remote I/Os.
    pub(crate) deadlines: u64,
    /// Those with nothing that was computed from this cycle's sample.
    pub(crate) lost: u64,
    /// Those of a hot-standby pair in which both boxes drove.
    pub(crate) two_masters: u64,
    /// Those in which two boxes drove different things.
    pub(crate) differing: u64,
    /// Take-overs while the other box worked.
    pub(crate) false_take_overs: u64,
    /// Samples that were acted upon, and that no state holds any more.
    pub(crate) forgotten: u64,
    /// Frames to each receiver.
    pub(crate) frames: u64,
    /// Their bytes.
    pub(crate) bytes: u64,
}

/// A frame on its way, or somebody's wake-up; earlier first, and then as they were sent.
type Due = Reverse<(Time, u64, usize)>;

/// One program.
struct Cell {
    partners: [Option<Partner>; 2],
    module: Module,
    plant: Option<Plant>,
    shown: Option<Field>,
    fed_by: Option<ProgramId>,
    taken: u64,
}

/// All pairs of a cluster.
pub(crate) struct Pairs {
    redundancy: Redundancy,
    agreement: Arc<Agreement>,
    scans: Vec<Arc<Executable>>,
    cells: Vec<Cell>,
    network: Network,
    random: Pcg64Mcg,
    now: Time,
    due: BinaryHeap<Due>,
    /// By place in `due`.
    frames: Vec<Option<(usize, Place, Arc<Frame>)>>,
    free: Vec<usize>,
    sent: u64,
    account: Account,
}

/// Who hears a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Partner(usize),
    Module,
}

impl Pairs {
    /// All boxes are switched on at time 0.
    pub(crate) fn new(
        cluster: &Cluster,
        agreement: &Arc<Agreement>,
        redundancy: Redundancy,
        network: Network,
        seed: u64,
    ) -> Self {
        let now = Time::default();
        let scans: Vec<Arc<Executable>> =
            cluster.programs().iter().map(|program| Arc::new(program.executable.clone())).collect();
        let mut pairs = Self {
            redundancy,
            agreement: Arc::clone(agreement),
            scans,
            cells: Vec::new(),
            network,
            random: Pcg64Mcg::seed_from_u64(seed),
            now,
            due: BinaryHeap::new(),
            frames: Vec::new(),
            free: Vec::new(),
            sent: 0,
            account: Account::default(),
        };
        for (index, place) in cluster.plants().iter().enumerate() {
            let program = ProgramId(index as u8);
            let scan = &pairs.scans[index];
            let mut module =
                Module::new(now, program, agreement, scan.input_count(), scan.output_count());
            let plant = place.as_ref().map(|place| place.plant.clone());
            let shown = plant.as_ref().map(Plant::field);
            if let Some(field) = &shown {
                module.handle_input(now, Input::RemoteIo(RemoteIoInput::Field(&field.sensors)));
            }
            let partner = |rank| Some(Partner::first(now, pairs.settings(index, rank)));
            let cell = Cell {
                partners: [partner(0), partner(1)],
                module,
                plant,
                shown,
                fed_by: place.as_ref().and_then(|place| place.fed_by),
                taken: 0,
            };
            pairs.cells.push(cell);
        }
        pairs
    }

    fn settings(&self, cell: usize, rank: usize) -> Settings {
        Settings {
            rank: rank as u8,
            redundancy: self.redundancy,
            agreement: Arc::clone(&self.agreement),
            program: ProgramId(cell as u8),
            scan: Arc::clone(&self.scans[cell]),
        }
    }

    /// Runs for `cycles` periods.
    pub(crate) fn run(&mut self, cycles: f64) {
        let end = self.now + self.agreement.schedule.period().mul_f64(cycles);
        loop {
            let arrival = self.due.peek().map(|Reverse((at, _, _))| *at);
            let (wakeup, cell, place) = self.next_wakeup();
            let next = arrival.map_or(wakeup, |arrival| arrival.min(wakeup));
            if next > end {
                self.now = end;
                return;
            }
            self.now = next;
            if arrival == Some(next) {
                self.deliver();
            } else {
                self.give(cell, place, Input::Wakeup);
            }
        }
    }

    /// A box that drives is gone, with all that it knew.
    pub(crate) fn crash_a_driver(&mut self, cell: usize) -> usize {
        let partners = &mut self.cells[cell].partners;
        let drives = |partner: &Option<Partner>| partner.as_ref().is_some_and(Partner::drives);
        let rank = usize::from(!drives(&partners[0]));
        partners[rank] = None;
        rank
    }

    /// It is switched on again.
    pub(crate) fn repair(&mut self, cell: usize, rank: usize) {
        let partner = Partner::repaired(self.now, self.settings(cell, rank));
        self.cells[cell].partners[rank] = Some(partner);
    }

    /// The network is another one from now on.
    pub(crate) fn set_network(&mut self, network: Network) {
        self.network = network;
    }

    /// What happened since it was taken last.
    pub(crate) fn take_account(&mut self) -> Account {
        std::mem::take(&mut self.account)
    }

    /// Boxes, without remote I/Os.
    pub(crate) fn boxes(&self) -> usize {
        2 * self.cells.len()
    }

    fn next_wakeup(&self) -> (Time, usize, Place) {
        let mut next = (Time(u64::MAX), 0, Place::Module);
        for (index, cell) in self.cells.iter().enumerate() {
            let mut offer = |at: Time, place| {
                if at < next.0 {
                    next = (at, index, place);
                }
            };
            offer(cell.module.wakeup(), Place::Module);
            for (rank, partner) in cell.partners.iter().enumerate() {
                if let Some(partner) = partner {
                    offer(partner.wakeup(), Place::Partner(rank));
                }
            }
        }
        (next.0.max(self.now), next.1, next.2)
    }

    fn deliver(&mut self) {
        let Some(Reverse((_, _, slot))) = self.due.pop() else {
            return;
        };
        if let Some((cell, place, frame)) = self.frames[slot].take() {
            self.free.push(slot);
            self.give(cell, place, Input::Frame(&frame));
        }
    }

    fn give(&mut self, cell: usize, place: Place, input: Input<'_>) {
        let now = self.now;
        match place {
            Place::Module => {
                self.cells[cell].module.handle_input(now, input);
                while let Some(output) = self.cells[cell].module.poll_output() {
                    match output {
                        Output::Send(frame) => self.send(cell, &frame),
                        Output::Drive { outputs, .. } => self.drive(cell, &outputs),
                        Output::Report(deadline) => {
                            let standby = self.redundancy != Redundancy::ActiveActive;
                            let account = &mut self.account;
                            account.deadlines += 1;
                            account.lost += u64::from(deadline.drivers == 0);
                            account.two_masters += u64::from(standby && deadline.drivers > 1);
                            account.differing += u64::from(deadline.differ);
                        }
                        Output::Retain(_)
                        | Output::Follow(_)
                        | Output::Connect(_)
                        | Output::EndWith(_)
                        | Output::LayOut(_)
                        | Output::Answer(_)
                        | Output::Obeyed(_) => {}
                    }
                }
            }
            Place::Partner(rank) => {
                if let Some(partner) = &mut self.cells[cell].partners[rank] {
                    partner.handle_input(now, input);
                }
                while let Some(output) = self.poll(cell, rank) {
                    match output {
                        Output::Send(frame) => self.send(cell, &frame),
                        Output::Report(Event::TookOver { forgotten }) => {
                            let other = &self.cells[cell].partners[1 - rank];
                            let works = other.as_ref().is_some_and(Partner::drives);
                            self.account.false_take_overs += u64::from(works);
                            self.account.forgotten += forgotten;
                        }
                        Output::Report(Event::SteppedDown)
                        | Output::Drive { .. }
                        | Output::Follow(_)
                        | Output::Connect(_)
                        | Output::EndWith(_)
                        | Output::LayOut(_)
                        | Output::Answer(_)
                        | Output::Obeyed(_)
                        | Output::Retain(_) => {}
                    }
                }
            }
        }
    }

    fn poll(&mut self, cell: usize, rank: usize) -> Option<Output<Event>> {
        self.cells[cell].partners[rank].as_mut()?.poll_output()
    }

    fn drive(&mut self, cell: usize, outputs: &Image) {
        let handed_over = self.cells[cell].fed_by.map_or(0, |feeder| {
            let field = self.cells[feeder.index()].shown.as_ref();
            field.map_or(0, |field| field.handed_over)
        });
        let Cell { module, plant, shown, taken, .. } = &mut self.cells[cell];
        if let Some(plant) = plant {
            let field = plant.step(outputs, handed_over - *taken);
            *taken = handed_over;
            module.handle_input(self.now, Input::RemoteIo(RemoteIoInput::Field(&field.sensors)));
            *shown = Some(field);
        }
    }

    fn send(&mut self, cell: usize, frame: &Arc<Frame>) {
        let mut bytes = Vec::new();
        encode(frame, &mut bytes).expect("a pair's frames keep the promises of frames");
        let sender = match frame.header.sender {
            Member::Station(station) => Place::Partner(station.index()),
            _ => Place::Module,
        };
        let receivers: &[Place] = match (&frame.body, sender) {
            (Body::Sample(_), _) => &[Place::Partner(0), Place::Partner(1)],
            (Body::Transfer(_), Place::Partner(0)) => &[Place::Partner(1)],
            (Body::Transfer(_), _) => &[Place::Partner(0)],
            _ => &[Place::Module],
        };
        for &receiver in receivers {
            self.account.frames += 1;
            self.account.bytes += bytes.len() as u64;
            for delay in self.network.arrivals(&mut self.random) {
                let entry = Some((cell, receiver, Arc::clone(frame)));
                let slot = match self.free.pop() {
                    Some(slot) => {
                        self.frames[slot] = entry;
                        slot
                    }
                    None => {
                        self.frames.push(entry);
                        self.frames.len() - 1
                    }
                };
                self.sent += 1;
                self.due.push(Reverse((self.now + delay, self.sent, slot)));
            }
        }
    }
}

#[cfg(test)]
mod tests;
