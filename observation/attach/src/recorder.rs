//! Writes what the members say into the journal of a run, and passes commands on to them.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tokio::sync::mpsc::{Receiver, channel};
use tokio::sync::oneshot;
use understudy_bus::{DONE, HostEvent, RefusedOrders, Request};
use understudy_cluster::AlarmDeclaration;
use understudy_journal::{
    Command, Commanded, Commander, Commands, Done, Happening, Journal, OperatorAction, Record,
    Refusal, RunDirectory, RunEvent, RunSocket, commands, monotonic_ns, repeated,
};
use understudy_node::Event as StationEvent;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_wire::{ChangeRequest, Member, Moment, Write, WriteAnswer};

use crate::error::AttachError;
use crate::follower::{Calls, Follower, Told};
use crate::found::Found;
use crate::in_effect::InEffect;

/// Lines that wait to be written, at most; then their followers wait, and lose what comes meanwhile.
const UNWRITTEN: usize = 16_384;

/// How often readers of the journal see what is new.
const SHOW: Duration = Duration::from_millis(50);

/// Stations that report turns for this time without a deadline of any remote I/O: none of them lives, or none is received here.
const WITHOUT_DEADLINES: Duration = Duration::from_millis(500);

const PROCESS: &str = "its process runs elsewhere: end, start or suspend it on its own machine";
const LINKS: &str = "links between members on other machines cannot be cut from here";

/// The commands that cannot be given to a cluster elsewhere, each with the reason.
pub fn impossible() -> Vec<(&'static str, String)> {
    let processes = ["kill", "restart", "stop", "continue"].map(|word| (word, PROCESS.to_owned()));
    let links = ["isolate", "rejoin"].map(|word| (word, LINKS.to_owned()));
    processes.into_iter().chain(links).collect()
}

/// A cluster elsewhere whose words are written down, until this is dropped.
pub struct Attached {
    commander: Commander,
    ends: Arc<AtomicBool>,
    end: Option<oneshot::Sender<()>>,
    recorder: Option<JoinHandle<()>>,
}

impl Attached {
    /// Reaches it.
    pub fn commander(&self) -> Commander {
        self.commander.clone()
    }
}

impl Drop for Attached {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        self.end = None;
        if let Some(recorder) = self.recorder.take() {
            // A panic has been reported. Followers that wait for a member end with the process.
            let _ = recorder.join();
        }
    }
}

impl Found {
    /// Who of its members is heard, and who is not, by their names.
    pub fn names(&self) -> (Vec<&str>, Vec<&str>) {
        let names = |heard| {
            let members = self.members.iter();
            let those = members.filter(move |(_, call)| call.is_ok() == heard);
            those.map(|(peer, _)| peer.name.as_str()).collect()
        };
        (names(true), names(false))
    }

    /// Writes what they say to `journal.jsonl` of a run directory, of so many bytes at most.
    ///
    /// # Errors
    /// [`AttachError::System`].
    pub fn record(
        self,
        directory: &RunDirectory,
        journal_limit_bytes: u64,
    ) -> Result<Attached, AttachError> {
        let system = |what| move |source| AttachError::System { what, source };
        let journal = Journal::create(&directory.file("journal.jsonl"), journal_limit_bytes)
            .map_err(system("to write journal.jsonl"))?;
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(system("a runtime"))?;
        let (told, lines) = channel(UNWRITTEN);
        let (commander, commands) = commands();
        let (end, ended) = oneshot::channel();
        let ends = Arc::new(AtomicBool::new(false));
        let calls = Calls::default();
        let mut names = BTreeMap::new();
        for (peer, call) in self.members {
            names.insert(peer.member, peer.name.clone());
            let follower = Follower {
                peer,
                line: self.line.clone(),
                told: told.clone(),
                calls: calls.clone(),
                ends: Arc::clone(&ends),
            };
            std::thread::Builder::new()
                .name("attach".to_owned())
                .spawn(move || follower.run(call))
                .map_err(system("a thread for a member"))?;
        }
        let recorder = Recorder {
            journal,
            calls,
            names,
            alarms: self.alarms,
            refused_orders: RefusedOrders::default(),
            has_origin: false,
            published: None,
            in_effect: InEffect::default(),
        };
        let directory = directory.clone();
        let recorder = std::thread::Builder::new()
            .name("attach-recorder".to_owned())
            .spawn(move || {
                runtime.block_on(async {
                    // Without it no other process can give commands.
                    let _socket = RunSocket::open(directory.path(), commands.commander());
                    recorder.run(lines, commands, ended).await;
                });
            })
            .map_err(system("a thread that writes the journal"))?;
        Ok(Attached { commander, ends, end: Some(end), recorder: Some(recorder) })
    }
}

struct Recorder {
    journal: Journal,
    calls: Calls,
    names: BTreeMap<Member, String>,
    refused_orders: RefusedOrders,
    alarms: Arc<[AlarmDeclaration]>,
    has_origin: bool,
    /// The first turn that was reported, and when.
    published: Option<(Moment, Instant)>,
    in_effect: InEffect,
}

impl Recorder {
    async fn run(
        mut self,
        mut lines: Receiver<Told>,
        mut commands: Commands,
        mut ended: oneshot::Receiver<()>,
    ) {
        let mut show = tokio::time::interval(SHOW);
        loop {
            tokio::select! {
                biased;
                _ = &mut ended => break,
                commanded = commands.next() => self.obey(commanded).await,
                told = lines.recv() => match told {
                    Some(told) => self.note(told),
                    None => break,
                },
                _ = show.tick() => self.show(),
            }
        }
        self.own(RunEvent::Finished);
        self.journal.finish();
    }

    fn own(&mut self, event: RunEvent) {
        self.journal.write(&Record::of_run(monotonic_ns(), event));
    }

    fn note(&mut self, told: Told) {
        let (member, line) = match told {
            Told::Line(member, line) => (member, line),
            Told::Lost(member, records) => return self.lost(member, records),
            Told::Attached(member) => {
                self.in_effect.attached(member);
                return self.own(RunEvent::Attached { member });
            }
            Told::Detached(member, reason) => {
                return self.own(RunEvent::Detached { member, reason });
            }
        };
        if let Ok(repeated) = repeated(&line) {
            for record in self.in_effect.repeated(member, repeated, self.has_origin) {
                self.write_of_member(&record);
            }
            return;
        }
        // A line that is not a record of its sender is dropped.
        let Ok(record) = serde_json::from_str::<Record>(&line) else {
            return;
        };
        if record.member != Some(member) {
            return;
        }
        self.write_of_member(&record);
        match &record.event {
            Happening::RemoteIo(RemoteIoEvent::Applied { moment, .. }) => self.origin(*moment),
            Happening::Station(StationEvent::Published { moment, .. }) => {
                self.published.get_or_insert_with(|| (*moment, Instant::now()));
            }
            _ => {}
        }
    }

    /// The journal of the run lacks lines that the member has written.
    fn lost(&mut self, member: Member, records: u64) {
        let name = self.names.get(&member).cloned().unwrap_or_default();
        let event = Happening::Host(HostEvent::JournalLost { records });
        self.write_of_member(&Record { at_ns: monotonic_ns(), name, member: Some(member), event });
    }

    fn write_of_member(&mut self, record: &Record) {
        self.in_effect.note(record);
        self.journal.write(record);
    }

    /// The cycles of the cluster are counted from here on: with the first deadline of a remote I/O, and with a turn where no remote I/O reports one.
    fn origin(&mut self, moment: Moment) {
        if !self.has_origin {
            self.has_origin = true;
            self.own(RunEvent::Origin { moment, cycle: moment.cycle.0 });
        }
    }

    fn show(&mut self) {
        if let Some((moment, first)) = self.published
            && first.elapsed() > WITHOUT_DEADLINES
        {
            self.origin(moment);
        }
        self.journal.flush();
    }

    /// Sends a write; its outcome takes cycles, in which the journal goes on.
    fn write(&mut self, member: Member, write: Write, commanded: Commanded) {
        let name = self.names.get(&member).cloned().unwrap_or_default();
        let Some(call) = self.calls.to(member) else {
            let reason = "it takes no call now".to_owned();
            return commanded.answer(Err(Refusal::Elsewhere { name, reason }));
        };
        let asking = std::thread::Builder::new().spawn(move || {
            let answer = call.ask(&Request::Write(write));
            let answer =
                answer.map(|text| serde_json::from_str::<WriteAnswer>(&text).map_err(|_| text));
            commanded.answer(match answer {
                Ok(Ok(answer)) => Done::of_write(answer.outcome),
                Ok(Err(why)) => Err(Refusal::of_answer(why)),
                Err(_) => Err(Refusal::Undecided),
            });
        });
        // Without a thread the caller is told that the run takes no command now.
        drop(asking);
    }

    async fn obey(&mut self, commanded: Commanded) {
        let OperatorAction::Command { member, command, .. } = commanded.action.clone() else {
            let (event, done) = commanded.action.recorded(&self.alarms, &self.refused_orders);
            if let Some(event) = event {
                self.own(event);
                self.journal.flush();
            }
            commanded.answer(done);
            return;
        };
        if let Command::Write(write) = command {
            self.commanded(&commanded, None);
            return self.write(member, write, commanded);
        }
        let done = self.command(member, &command).await;
        self.commanded(&commanded, done.as_ref().err());
        commanded.answer(done);
    }

    /// Records a command, with why it was refused.
    fn commanded(&mut self, commanded: &Commanded, refused: Option<&Refusal>) {
        if let Some(event) = commanded.action.commanded(refused) {
            self.own(event);
            self.journal.flush();
        }
    }

    async fn command(&self, member: Member, command: &Command) -> Result<Done, Refusal> {
        let name = self.names.get(&member).cloned().unwrap_or_default();
        let elsewhere =
            |reason: &str| Refusal::Elsewhere { name: name.clone(), reason: reason.to_owned() };
        let request = match command {
            Command::Release => Request::Release,
            Command::Choose { choice } => Request::Choose(*choice),
            Command::Force(force) => Request::Force(force.clone()),
            // Handled before, because its outcome takes cycles.
            Command::Write(_) => return Err(Refusal::Busy),
            Command::Unforce(unforce) => Request::Unforce(*unforce),
            Command::Change { request: ChangeRequest::Prepare { .. } } => {
                return Err(elsewhere("`understudy change` sends the texts to its machine"));
            }
            Command::Change { request } => Request::Change(request.clone()),
            Command::Isolate | Command::Rejoin => return Err(elsewhere(LINKS)),
            Command::Kill | Command::Restart | Command::Stop | Command::Continue => {
                return Err(elsewhere(PROCESS));
            }
        };
        if member.sampled_program().is_none() {
            return Err(Refusal::WrongMember { name, needs: "it is for remote I/Os" });
        }
        let Some(call) = self.calls.to(member) else {
            return Err(elsewhere("it takes no call now"));
        };
        // Zenoh waits in threads of its own only.
        let (tell, told) = oneshot::channel();
        let asking = std::thread::Builder::new().spawn(move || {
            // The receiver is gone when the program ends.
            let _ = tell.send(call.ask(&request));
        });
        let system = |reason: String| Refusal::System { name: name.clone(), reason };
        asking.map_err(|error| system(error.to_string()))?;
        match told.await {
            Ok(Ok(answer)) if answer == DONE => Ok(Done::default()),
            Ok(Ok(why)) => Err(Refusal::of_answer(why)),
            Ok(Err(error)) => Err(system(error.to_string())),
            Err(_) => Err(Refusal::Busy),
        }
    }
}
