//! The members that take a step of an online change: those of a laboratory on this machine, or those that are called by mutual TLS.

use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

use understudy_bus::{Call, DONE, Peer, Request, TlsKeys};
use understudy_cluster::{Addresses, ChangeTexts, Cluster};
use understudy_journal::{Command, OperatorAction, Refusal};
use understudy_keys::{Date, OperatorKeys};
use understudy_member::tls_keys;
use understudy_view::{Run, find_running_of};
use understudy_wire::{ChangeRequest, ConfigurationHash, Member, OrderRefusal};

use super::{Arguments, Asked, pause};
use crate::answer::{Answer, Status};

/// The members of a running cluster.
pub(super) struct Members<'a> {
    cluster: &'a Cluster,
    without: Vec<Member>,
    way: Way,
}

/// How often an order is given that a laboratory does not take.
const ATTEMPTS: usize = 5;

enum Way {
    Laboratory(Box<Run>),
    Calls(TlsKeys),
}

impl<'a> Members<'a> {
    pub(super) fn of(arguments: &Arguments, cluster: &'a Cluster) -> Result<Self, Answer> {
        let way = match &arguments.keys {
            Some(folder) => {
                let keys = OperatorKeys::load(folder, cluster, Date::of(SystemTime::now()));
                let keys = keys.map_err(|errors| crate::deployment::keys::failed(&errors))?;
                Way::Calls(tls_keys(&keys.tls))
            }
            None if arguments.before.is_dir() => {
                Way::Laboratory(Box::new(Run::open(&arguments.before)?))
            }
            None => Way::Laboratory(Box::new(running(arguments, cluster)?)),
        };
        let without = arguments.without.iter().map(|name| crate::member::find(cluster, name));
        Ok(Self { cluster, without: without.collect::<Result<_, _>>()?, way })
    }

    /// Those that are not left out.
    pub(super) fn all(&self) -> Vec<Member> {
        let members = self.cluster.members();
        members.filter(|member| !self.without.contains(member) && self.takes(*member)).collect()
    }

    /// The slot of a spare has no member until a spare wakes there, with the cluster file of its machine.
    fn takes(&self, member: Member) -> bool {
        !self.cluster.is_spare_slot(member)
    }

    pub(super) fn name(&self, member: Member) -> String {
        self.cluster.member_name(member).unwrap_or_default().to_owned()
    }

    /// Gives all members the texts of the change.
    pub(super) fn prepare(&self, texts: &ChangeTexts) -> Result<Asked, Answer> {
        let json = serde_json::to_string(texts).unwrap_or_default();
        let file = match &self.way {
            Way::Calls(_) => None,
            Way::Laboratory(run) => Some(written(run, texts, &json)?),
        };
        let mut asked = Asked::default();
        // Where the change is over, its remote I/Os say so, and no member loads it.
        let [first, others] = self.deciding(texts);
        for member in first.into_iter().chain(others) {
            let is_over = |why: &String| gives(why, OrderRefusal::IsOver);
            if asked.0.iter().any(|(.., said)| said.as_ref().is_err_and(is_over)) {
                break;
            }
            match &file {
                None => self.note(
                    member,
                    self.call(member, &Request::Prepare(json.clone())),
                    &mut asked,
                ),
                Some(file) => {
                    let request = ChangeRequest::Prepare { file: file.display().to_string() };
                    self.ask(member, &request, &mut asked);
                }
            }
        }
        Ok(asked)
    }

    /// The remote I/Os that have another program or other settings by the change, and all other members.
    pub(super) fn deciding(&self, texts: &ChangeTexts) -> [Vec<Member>; 2] {
        let touched = texts.touched();
        let decides = |member: &Member| {
            let program = member.sampled_program();
            program.is_some_and(|program| touched.contains(&program))
        };
        let (first, others) = self.all().into_iter().partition(decides);
        [first, others]
    }

    /// Asks these members.
    pub(super) fn ask_all(&self, members: Vec<Member>, request: &ChangeRequest) -> Asked {
        let mut asked = Asked::default();
        for member in members {
            self.ask(member, request, &mut asked);
        }
        asked
    }

    /// Asks these members, and again those that still need the other configuration, until `patience` is over; `asked` then has the newest answers.
    pub(super) fn ask_until(
        &self,
        mut left: Vec<Member>,
        request: &ChangeRequest,
        patience: Duration,
        asked: &mut Asked,
    ) {
        let begun = Instant::now();
        loop {
            let ended = self.ask_all(std::mem::take(&mut left), request);
            let waits = ended.of_code("U0634");
            asked.take(ended, &waits);
            if waits.is_empty() || begun.elapsed() >= patience {
                return asked.waits_for(self, &waits);
            }
            left = waits;
            pause();
        }
    }

    /// Of what was refused because this change is not loaded: a member that has this configuration alone is done. One that has accepted the change, has loaded
    /// another one or runs another configuration says so.
    pub(super) fn find_done(
        &self,
        texts: &ChangeTexts,
        configuration: ConfigurationHash,
        asked: &mut Asked,
    ) {
        let accepted = OrderRefusal::OtherConfiguration { own: texts.after }.to_string();
        for (member, _, said) in &mut asked.0 {
            if !said.as_ref().is_err_and(|why| gives(why, OrderRefusal::NotPrepared)) {
                continue;
            }
            let mut ended = Asked::default();
            let forget = ChangeRequest::Forget { change: texts.name(), configuration };
            self.ask(*member, &forget, &mut ended);
            let ended = ended.0.pop().map(|(.., said)| said);
            match ended {
                Some(Ok(())) => *said = Ok(()),
                Some(Err(why)) if why.contains(&accepted) => {
                    let refusal = OrderRefusal::IsOver;
                    *said = Err(format!("{}: {refusal}", refusal.code()));
                }
                Some(Err(why)) => *said = Err(why),
                None => {}
            }
        }
    }

    /// Asks one member, and notes what it says.
    pub(super) fn ask(&self, member: Member, request: &ChangeRequest, asked: &mut Asked) {
        let said = match &self.way {
            Way::Calls(_) => self.call(member, &Request::Change(request.clone())),
            Way::Laboratory(run) => {
                let command = Command::Change { request: request.clone() };
                let action = OperatorAction::Command {
                    member,
                    command,
                    owner: crate::inspect::top::owner(),
                    reason: "an online change".to_owned(),
                };
                let give = || run.commander().act_and_wait(&action);
                // A laboratory that has much to do takes the order a moment later.
                let done = (0..ATTEMPTS).find_map(|_| match give() {
                    Err(Refusal::Busy) => None,
                    done => Some(done),
                });
                let done = done.unwrap_or(Err(Refusal::Busy));
                done.map(|_| ()).map_err(|why| why.to_string())
            }
        };
        self.note(member, said, asked);
    }

    fn note(&self, member: Member, said: Result<(), String>, asked: &mut Asked) {
        asked.0.push((member, self.name(member), said));
    }

    fn call(&self, member: Member, request: &Request) -> Result<(), String> {
        let Way::Calls(keys) = &self.way else {
            return Err("U0621: the member belongs to a laboratory".to_owned());
        };
        let name = self.name(member);
        let Addresses { first, second, .. } = self.cluster.addresses(member);
        let address = first.ok_or_else(|| format!("U0608: no address for {name}"))?;
        let peer = Peer { member, name, address, second, link: None };
        let hash = self.cluster.agreement().cluster;
        let call = Call::to(peer.call_address(), hash, &peer.name, keys);
        let said = call.and_then(|call| call.ask(request)).map_err(|error| error.to_string())?;
        if said == DONE { Ok(()) } else { Err(said) }
    }
}

/// Whether a member refused for this reason.
pub(super) fn gives(why: &str, reason: OrderRefusal) -> bool {
    why.contains(&reason.to_string())
}

/// The running laboratory of the cluster.
fn running(arguments: &Arguments, cluster: &Cluster) -> Result<Run, Answer> {
    find_running_of(&arguments.out, cluster).ok_or_else(|| {
        let message = format!(
            "no laboratory of `{}` runs below {}; remote members require the keys of an engineer (--keys DIR)",
            cluster.name(),
            arguments.out.display()
        );
        Answer::failed(Status::BadInput, "U0614", message)
    })
}

/// The file of the texts, in the directory of the run: its members are on this machine.
fn written(run: &Run, texts: &ChangeTexts, json: &str) -> Result<PathBuf, Answer> {
    let failed = |error: std::io::Error| {
        let message = format!("the texts of the change cannot be written: {error}");
        Answer::failed(Status::Failed, "U0602", message)
    };
    let folder = fs::canonicalize(run.path()).map_err(failed)?;
    let file = folder.join(format!("change-{}.json", texts.after));
    fs::write(&file, json).map_err(failed)?;
    Ok(file)
}
