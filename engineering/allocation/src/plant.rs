//! Controller positions required by the programs of a plant.
//!
//! Where remote I/Os have the terminals, a group of programs wants a controller for each, its understudies, a remote I/O for each, and its twin;
//! all of them speak over a network, and scan once a period. A twin that reaches the terminals of the first remote I/O has none. A program that stands alone wants one controller with its terminals.

use std::time::Duration;

use crate::allocate::{Item, Verification};
use crate::need::Need;
use crate::requirement::Role;
use crate::resources::Resources;

/// A program that is to run somewhere.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// Name of the program in the plant.
    pub name: String,
    /// Resources of the program.
    pub program: Resources,
    /// Verification result of the program.
    pub verification: Verification,
    /// The name of the remote I/O with its terminals.
    pub remote_io: String,
    /// The twin of this remote I/O.
    pub twin: Option<Twin>,
}

/// A second remote I/O of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Twin {
    /// Its name.
    pub name: String,
    /// Whether it has terminals of its own; otherwise both reach those of the first one.
    pub has_terminals: bool,
}

/// Programs with one generated understudy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// Programs of the group.
    pub members: Vec<Member>,
    /// The names of its understudies.
    pub understudies: Vec<String>,
    /// Resources of the generated program.
    pub understudy: Resources,
    /// Result of the proof of the generated program.
    pub parity: Verification,
    /// Period of the scan.
    pub period: Duration,
}

impl Group {
    /// Controller positions of the group; `number` distinguishes it from other groups.
    pub fn items(&self, number: usize) -> Vec<Item> {
        let station = |role, program| Need {
            role,
            inputs: 0,
            outputs: 0,
            analog_inputs: 0,
            analog_outputs: 0,
            program: Some(program),
            scan_within: Some(self.period),
            ethernet: true,
        };
        let controllers = self.members.iter().map(|member| Item {
            name: member.name.clone(),
            group: Some(number),
            need: station(Role::Controller, member.program),
            verification: member.verification.clone(),
            twin_of: None,
        });
        let verification = self.verification();
        let understudies = self.understudies.iter().map(|name| Item {
            name: name.clone(),
            group: Some(number),
            need: station(Role::Understudy, self.understudy),
            verification: verification.clone(),
            twin_of: None,
        });
        let without_terminals = Need { role: Role::RemoteIo, ethernet: true, ..Need::nothing() };
        let with_terminals = |member: &Member| Need {
            inputs: member.program.inputs,
            outputs: member.program.outputs,
            analog_inputs: member.program.analog_inputs,
            analog_outputs: member.program.analog_outputs,
            ..without_terminals.clone()
        };
        let remote_ios = self.members.iter().flat_map(|member| {
            let first = Item {
                name: member.remote_io.clone(),
                group: Some(number),
                need: with_terminals(member),
                verification: member.verification.clone(),
                twin_of: None,
            };
            let twin = member.twin.as_ref().map(|twin| Item {
                name: twin.name.clone(),
                need: if twin.has_terminals {
                    with_terminals(member)
                } else {
                    without_terminals.clone()
                },
                twin_of: Some(member.remote_io.clone()),
                ..first.clone()
            });
            [first].into_iter().chain(twin)
        });
        controllers.chain(understudies).chain(remote_ios).collect()
    }

    /// An understudy is every member at once: it has passed when all of them have.
    fn verification(&self) -> Verification {
        let failed = self.members.iter().find(|member| !member.verification.has_passed());
        match (&self.parity, failed) {
            (Verification::Passed(_), Some(member)) => {
                let message = member.verification.message();
                Verification::NotPassed(format!("it runs {} too: {message}", member.name))
            }
            (parity, _) => parity.clone(),
        }
    }
}

/// The box that a program without a group wants: with its terminals, and no network.
pub fn alone(member: &Member) -> Item {
    Item {
        name: member.name.clone(),
        group: None,
        need: Need {
            role: Role::Controller,
            inputs: member.program.inputs,
            outputs: member.program.outputs,
            analog_inputs: member.program.analog_inputs,
            analog_outputs: member.program.analog_outputs,
            program: Some(member.program),
            scan_within: None,
            ethernet: false,
        },
        verification: member.verification.clone(),
        twin_of: None,
    }
}
