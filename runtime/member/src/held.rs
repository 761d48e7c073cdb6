//! The keys that a member holds while it runs.

use std::sync::Arc;
use std::time::SystemTime;

use understudy_bus::{
    Admitted, Changes, ChannelSettings, Guard, LinesInEffect, NewLife, TlsKeys, Validity,
    hold_back_signals,
};
use understudy_cluster::{Cluster, Security};
use understudy_cycle::spare::AttendanceCount;
use understudy_journal::{RecordsInEffect, heard_at_deadline};
use understudy_keys::{Date, MemberKeys, RevocationWatch, TlsFiles};
use understudy_wire::Member;

use crate::error::MemberError;
use crate::first_numbers::FirstNumbers;
use crate::run::MemberOptions;

/// What a member seals and opens with, and what follows its list of revoked keys.
pub(crate) struct Held {
    pub(crate) guard: Guard,
    pub(crate) channel: Option<ChannelSettings>,
    _watch: Option<RevocationWatch>,
}

pub(crate) fn read_keys(
    options: &MemberOptions,
    cluster: &Cluster,
    member: Member,
    changes: Changes,
) -> Result<Held, MemberError> {
    let folder = match (&options.keys, cluster.security()) {
        (_, Security::Off) => {
            return Ok(Held { guard: Guard::Off, channel: None, _watch: None });
        }
        (None, Security::Keys) => {
            return Err(MemberError::NoKeys);
        }
        (Some(folder), Security::Keys) => folder,
    };
    let now = Date::of(SystemTime::now());
    // Whoever follows the list of revoked keys is a thread.
    hold_back_signals()?;
    let keys = MemberKeys::load(folder, cluster, member, now);
    let keys = keys.map_err(MemberError::Keys)?;
    let keys = Arc::new(keys);
    let sealed = FirstNumbers::now()?.sealed;
    let seal = keys.begin_life(now).map(|seal| seal.after(sealed));
    let watch = keys.watch();
    match (seal, watch) {
        (Ok(seal), Ok(watch)) => Ok(Held {
            guard: Guard::with_keys(seal, keys.opener()).with_lives(new_life(&keys)),
            // In a laboratory standard input is the operator.
            channel: (!options.in_laboratory).then(|| channel(keys, cluster, changes)),
            _watch: Some(watch),
        }),
        (Err(error), _) | (_, Err(error)) => Err(MemberError::Keys(vec![error])),
    }
}

/// A life of now, noted where the lives before it are.
fn new_life(keys: &Arc<MemberKeys>) -> NewLife {
    let keys = Arc::clone(keys);
    Arc::new(move || {
        let life = keys.begin_life(Date::of(SystemTime::now()));
        life.map_err(|error| error.to_string())
    })
}

fn channel(keys: Arc<MemberKeys>, cluster: &Cluster, changes: Changes) -> ChannelSettings {
    let tls = keys.tls().clone();
    ChannelSettings {
        keys: tls_keys(&tls),
        admitted: Box::new(move || {
            let admitted = keys.admitted();
            Admitted {
                engineers: admitted.engineers,
                operators: admitted.operators,
                viewers: admitted.viewers,
                members: admitted.members,
            }
        }),
        changes,
        in_effect: Box::new(InEffect {
            records: RecordsInEffect::default(),
            attendance: AttendanceCount::new(&cluster.agreement().schedule),
        }),
    }
}

/// The records of a member that are in effect, and the stations that it misses, in the lines of its journal.
struct InEffect {
    records: RecordsInEffect,
    attendance: AttendanceCount,
}

impl LinesInEffect for InEffect {
    fn note(&mut self, line: &[u8]) {
        // A line that was cut is no record.
        if let Ok(line) = std::str::from_utf8(line) {
            self.records.note_line(line);
            if let Some(heard) = heard_at_deadline(line) {
                self.attendance.deadline(heard);
            }
        }
    }

    fn repetition(&self) -> Vec<u8> {
        self.records.repetition()
    }

    fn attendance(&mut self) -> Option<Vec<u8>> {
        let mut line = serde_json::to_vec(&self.attendance.take()?).ok()?;
        line.push(b'\n');
        Some(line)
    }
}

/// The files of a holder of keys, as the link takes them.
pub fn tls_keys(tls: &TlsFiles) -> TlsKeys {
    TlsKeys {
        authority: tls.authority.clone(),
        certificate: tls.certificate.clone(),
        private_key: tls.private_key.clone(),
        validity: {
            let validity = tls.validity.clone();
            Validity::by(move || {
                let outside = validity.outside(Date::of(SystemTime::now()));
                // The error of a call has a code of its own.
                outside.map(|error| {
                    let text = error.to_string();
                    let words = text.strip_prefix(&format!("{}: ", error.code()));
                    words.unwrap_or(&text).to_owned()
                })
            })
        },
    }
}
