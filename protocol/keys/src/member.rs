//! What one member runs with.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use understudy_cluster::Cluster;
use understudy_seal::{FrameKey, KEY_BYTES, Opener, Revocations, Seal, TransferKey};
use understudy_wire::{AuthorityHash, ClusterHash, ConfigurationHash, Member, StationId};

use crate::certificate;
use crate::date::Date;
use crate::error::KeysError;
use crate::files;
use crate::register::Role;
use crate::revoked::{HeardSender, RevocationWatch, RevokedFile, senders};

/// `keys.toml`.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct KeysFile {
    pub(crate) cluster: String,
    pub(crate) name: String,
    pub(crate) role: Role,
    pub(crate) generation: u32,
    /// When its certificate was issued; files of earlier versions do not say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) issued: Option<Date>,
    pub(crate) expires: Date,
    /// Its frame key, hexadecimal; empty for a person.
    pub(crate) own: String,
    /// Common names of all members.
    pub(crate) members: Vec<String>,
    /// Common names of all viewers.
    #[serde(default)]
    pub(crate) viewers: Vec<String>,
    /// Common names of all operators.
    pub(crate) operators: Vec<String>,
    /// Common names of all engineers.
    #[serde(default)]
    pub(crate) engineers: Vec<String>,
    #[serde(default)]
    pub(crate) heard: Vec<Heard>,
    #[serde(default)]
    pub(crate) shared: Vec<Shared>,
}

/// The key of a sender that it hears.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Heard {
    pub(crate) name: String,
    pub(crate) generation: u32,
    pub(crate) key: String,
}

/// The keys of the states that it gives to another station, and takes from it.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Shared {
    pub(crate) name: String,
    pub(crate) to: String,
    pub(crate) from: String,
}

/// Where the files of a holder's TLS lie, and whom it may talk to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TlsFiles {
    /// The certificate of the authority.
    pub authority: PathBuf,
    /// Its own certificate.
    pub certificate: PathBuf,
    /// Its own private key.
    pub private_key: PathBuf,
    /// When its own certificate is valid.
    pub validity: Validity,
    /// Common names of the members whose certificates hold.
    pub members: Vec<String>,
    /// Common names of the viewers whose certificates hold.
    pub viewers: Vec<String>,
    /// Common names of the operators whose certificates hold.
    pub operators: Vec<String>,
    /// Common names of the engineers whose certificates hold.
    pub engineers: Vec<String>,
}

/// The keys of a member, read and found good.
#[derive(Debug)]
pub struct MemberKeys {
    folder: PathBuf,
    own: Member,
    agreed: (ClusterHash, ConfigurationHash),
    expires: Date,
    key: FrameKey,
    heard: Vec<HeardSender>,
    heard_keys: Vec<(Member, FrameKey)>,
    to: Vec<(StationId, TransferKey)>,
    from: Vec<(StationId, TransferKey)>,
    revoked: Arc<Revocations>,
    tls: TlsFiles,
}

/// The keys of a person, read and found good.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OperatorKeys {
    /// Person that they were issued to.
    pub name: String,
    /// Rights.
    pub role: understudy_wire::Role,
    /// Until when its certificate holds.
    pub expires: Date,
    /// Its certificate.
    pub tls: TlsFiles,
}

impl MemberKeys {
    /// Reads the folder of a member.
    ///
    /// # Errors
    /// All that is wrong with it: [`KeysError::Read`], [`KeysError::Permissions`], [`KeysError::Damaged`],
    /// [`KeysError::Others`], [`KeysError::NotYetValid`], [`KeysError::Expired`], [`KeysError::Revoked`] and [`KeysError::NoKey`].
    pub fn load(
        folder: &Path,
        cluster: &Cluster,
        own: Member,
        now: Date,
    ) -> Result<Self, Vec<KeysError>> {
        let name = cluster.member_name(own).unwrap_or_default();
        let (file, revoked) = read(folder, cluster, Some(name), now)?;
        let mut errors = Vec::new();
        let roster = cluster.roster();
        let damaged = |whose: &str| KeysError::Damaged {
            path: folder.join("keys.toml"),
            reason: format!("the key of {whose} is not {} hexadecimal digits", 2 * KEY_BYTES),
        };
        let key = |text: &str, whose: &str, errors: &mut Vec<KeysError>| {
            files::from_hexadecimal(text).unwrap_or_else(|| {
                errors.push(damaged(whose));
                [0; KEY_BYTES]
            })
        };
        let own_key = FrameKey::new(key(&file.own, &file.name, &mut errors));
        let (mut heard, mut heard_keys) = (Vec::new(), Vec::new());
        let (mut to, mut from) = (Vec::new(), Vec::new());
        for member in cluster.members() {
            let other = cluster.member_name(member).unwrap_or_default();
            if !roster.is_received(member, own) {
                continue;
            }
            let no_key = || KeysError::NoKey { folder: folder.to_owned(), name: other.to_owned() };
            match file.heard.iter().find(|heard| heard.name == other) {
                Some(found) => {
                    heard_keys.push((member, FrameKey::new(key(&found.key, other, &mut errors))));
                    heard.push((member, found.name.clone(), found.generation));
                }
                None => errors.push(no_key()),
            }
            if let (Member::Station(_), Member::Station(rank)) = (own, member) {
                match file.shared.iter().find(|shared| shared.name == other) {
                    Some(found) => {
                        to.push((rank, TransferKey::new(key(&found.to, other, &mut errors))));
                        from.push((rank, TransferKey::new(key(&found.from, other, &mut errors))));
                    }
                    None => errors.push(no_key()),
                }
            }
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        let agreement = cluster.agreement();
        let revocations = Revocations::default();
        revocations.set(senders(&revoked, &heard));
        Ok(Self {
            folder: folder.to_owned(),
            own,
            agreed: (agreement.cluster, agreement.configuration),
            expires: file.expires,
            key: own_key,
            heard,
            heard_keys,
            to,
            from,
            revoked: Arc::new(revocations),
            tls: tls(folder, &file, &revoked),
        })
    }

    /// Until when its certificate holds.
    pub fn expires(&self) -> Date {
        self.expires
    }

    /// Of its TLS channel.
    pub fn tls(&self) -> &TlsFiles {
        &self.tls
    }

    /// The files of its channel with the common names whose certificates hold now, by the list of revoked keys as it is
    /// now; by the one of the start where that cannot be read.
    pub fn admitted(&self) -> TlsFiles {
        let gone = RevokedFile::read(&self.folder.join("revoked.toml")).unwrap_or_default();
        let tls = &self.tls;
        TlsFiles {
            members: gone.without(&tls.members),
            viewers: gone.without(&tls.viewers),
            operators: gone.without(&tls.operators),
            engineers: gone.without(&tls.engineers),
            ..tls.clone()
        }
    }

    /// What opens the frames of others.
    pub fn opener(&self) -> Opener {
        let revoked = Arc::clone(&self.revoked);
        let senders = self.heard_keys.iter().cloned();
        let (cluster, configuration) = self.agreed;
        Opener::new(self.own, senders, self.from.iter().cloned(), revoked)
            .of_configuration(cluster, configuration)
    }

    /// What seals its own frames, in a life that it never had: one more than the last that was noted, and never before the clock,
    /// so that neither a clock that is set back nor a folder that is restored brings a life again. It is noted before it is used.
    ///
    /// # Errors
    /// [`KeysError::Read`], [`KeysError::Damaged`] or [`KeysError::Write`] where it cannot be noted.
    pub fn begin_life(&self, now: Date) -> Result<Seal, KeysError> {
        let path = self.folder.join("life");
        let last: u32 = if path.exists() {
            let text = files::read(&path)?;
            text.trim().parse().map_err(|_| KeysError::Damaged {
                path: path.clone(),
                reason: "it is no whole number; issue this member new keys".to_owned(),
            })?
        } else {
            0
        };
        let exhausted = || KeysError::Damaged {
            path: path.clone(),
            reason: "there is no further life; issue this member new keys".to_owned(),
        };
        let next = last.checked_add(1).ok_or_else(exhausted)?;
        let life = next.max(u32::try_from(now.seconds()).unwrap_or(0));
        files::write(&path, &format!("{life}\n"))?;
        let to = self.to.iter().cloned();
        Ok(Seal::new(self.own, self.key.clone(), life, to))
    }

    /// Follows the list of revoked keys for as long as the answer lives.
    ///
    /// # Errors
    /// [`KeysError::Read`] where there is no thread to be had.
    pub fn watch(&self) -> Result<RevocationWatch, KeysError> {
        let path = self.folder.join("revoked.toml");
        RevocationWatch::start(path, self.heard.clone(), Arc::clone(&self.revoked))
    }
}

impl OperatorKeys {
    /// Reads the folder of an operator.
    ///
    /// # Errors
    /// As [`MemberKeys::load`].
    pub fn load(folder: &Path, cluster: &Cluster, now: Date) -> Result<Self, Vec<KeysError>> {
        let (file, revoked) = read(folder, cluster, None, now)?;
        Ok(Self {
            role: file.role.of_person().unwrap_or_default(),
            expires: file.expires,
            tls: tls(folder, &file, &revoked),
            name: file.name,
        })
    }
}

/// What holds for members and persons alike; a person may have any name.
fn read(
    folder: &Path,
    cluster: &Cluster,
    member: Option<&str>,
    now: Date,
) -> Result<(KeysFile, RevokedFile), Vec<KeysError>> {
    // Without the folder nothing else needs to be said.
    if !folder.exists() {
        let reason = "there is no such folder; `understudy keys` makes one for each member and each person, members/NAME";
        return Err(vec![KeysError::Read {
            path: folder.to_owned(),
            source: io::Error::new(io::ErrorKind::NotFound, reason),
        }]);
    }
    let mut errors = Vec::new();
    let keys = folder.join("keys.toml");
    let private_key = folder.join("private-key.pem");
    for path in [folder, &keys, &private_key] {
        errors.extend(files::private(path).err());
    }
    for path in ["authority.pem", "certificate.pem"] {
        errors.extend(files::read(&folder.join(path)).err());
    }
    let revoked = RevokedFile::read(&folder.join("revoked.toml"));
    let revoked = revoked.map_err(|error| errors.push(error)).ok();
    let file = match keys.exists().then(|| files::read_toml::<KeysFile>(&keys)) {
        Some(Ok(file)) => Some(file),
        Some(Err(error)) => {
            errors.push(error);
            None
        }
        // That it is away was said when its permissions were asked for.
        None => None,
    };
    if let Some(file) = &file {
        let others = |found: String, wanted: String| KeysError::Others {
            folder: folder.to_owned(),
            found,
            wanted,
        };
        if file.cluster != cluster.name() {
            let found = format!("the cluster {}", file.cluster);
            errors.push(others(found, format!("the cluster {}", cluster.name())));
        }
        let is_member = file.role == Role::Member;
        if is_member != member.is_some() || member.is_some_and(|name| file.name != name) {
            let wanted = member.unwrap_or("a person").to_owned();
            errors.push(others(file.name.clone(), wanted));
        }
        errors.extend(Validity::of(file).outside(now));
        let is_revoked = |list: &RevokedFile| list.holds(&file.name, file.generation);
        if revoked.as_ref().is_some_and(is_revoked) {
            errors
                .push(KeysError::Revoked { name: file.name.clone(), generation: file.generation });
        }
    }
    match (file, revoked) {
        (Some(file), Some(revoked)) if errors.is_empty() => Ok((file, revoked)),
        _ => Err(errors),
    }
}

/// When the certificate of a holder is valid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Validity {
    name: String,
    begins: Option<Date>,
    expires: Date,
}

impl Validity {
    fn of(file: &KeysFile) -> Self {
        Self {
            name: file.name.clone(),
            begins: file.issued.map(certificate::begins),
            expires: file.expires,
        }
    }

    /// Why the certificate does not count at a time; nothing where it does.
    pub fn outside(&self, now: Date) -> Option<KeysError> {
        let Self { name, begins, expires } = self.clone();
        if let Some(begins) = begins.filter(|begins| now < *begins) {
            return Some(KeysError::NotYetValid { name, begins, now });
        }
        (now >= expires).then_some(KeysError::Expired { name, expires, now })
    }
}

/// The authority that issued the keys in the folder of a member; nothing where its certificate cannot be read.
pub fn authority_of(folder: &Path) -> Option<AuthorityHash> {
    let certificate = files::read(&folder.join("authority.pem")).ok()?;
    Some(AuthorityHash::of(certificate.trim().as_bytes()))
}

fn tls(folder: &Path, file: &KeysFile, revoked: &RevokedFile) -> TlsFiles {
    TlsFiles {
        authority: folder.join("authority.pem"),
        certificate: folder.join("certificate.pem"),
        private_key: folder.join("private-key.pem"),
        validity: Validity::of(file),
        members: revoked.without(&file.members),
        viewers: revoked.without(&file.viewers),
        operators: revoked.without(&file.operators),
        engineers: revoked.without(&file.engineers),
    }
}
