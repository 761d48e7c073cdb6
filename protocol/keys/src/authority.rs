//! Who makes the keys of a cluster.

use std::collections::BTreeSet;
use std::net::IpAddr;
use std::path::{Path, PathBuf};

use rcgen::{Issuer, KeyPair};
use understudy_cluster::Cluster;
use understudy_seal::{ClusterSecret, Title};
use understudy_wire::Member;

use crate::certificate::{self, Subject};
use crate::date::Date;
use crate::error::KeysError;
use crate::files;
use crate::member::{Heard, KeysFile, Shared};
use crate::register::{Holder, Register, Revoked, Role, common_name};
use crate::revoked::RevokedFile;

/// The person that every authority issues keys for, with the role of the same name.
pub const DEFAULT_PERSON: &str = "engineer";

/// The authority's own certificate outlives all that it issues.
const AUTHORITY_DAYS: u32 = 20 * 365;

/// Persons, and programs that act for them, that are issued keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct People<'a> {
    /// Their names and rights.
    pub holders: &'a [(String, understudy_wire::Role)],
    /// Where they are called, if they are: the router of a site is, a person is not.
    pub address: Option<IpAddr>,
}

impl<'a> From<&'a [(String, understudy_wire::Role)]> for People<'a> {
    fn from(holders: &'a [(String, understudy_wire::Role)]) -> Self {
        Self { holders, address: None }
    }
}

/// An authority and its folder.
pub struct Authority {
    folder: PathBuf,
    certificate: String,
    issuer: Issuer<'static, KeyPair>,
    secret: ClusterSecret,
    register: Register,
}

/// What was done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Issued {
    /// Who has new keys.
    pub holders: Vec<Holder>,
    /// The folders that changed; each is to be copied to the machine of its member.
    pub folders: Vec<PathBuf>,
}

impl Authority {
    /// Makes an authority for a cluster, which has issued nothing yet.
    ///
    /// # Errors
    /// [`KeysError::Exists`], [`KeysError::Write`] or [`KeysError::Certificate`].
    pub fn init(folder: &Path, cluster: &Cluster, now: Date) -> Result<Self, KeysError> {
        let own = folder.join("authority");
        if own.exists() {
            return Err(KeysError::Exists { folder: folder.to_owned() });
        }
        let name = format!("{} authority", cluster.name());
        let pair = certificate::authority(&Subject {
            cluster: cluster.name(),
            common_name: &name,
            addresses: Vec::new(),
            issued: now,
            expires: now.plus_days(AUTHORITY_DAYS),
        })?;
        let secret = ClusterSecret::new(certificate::random(&name)?);
        let register = Register { cluster: cluster.name().to_owned(), holders: Vec::new() };
        files::make_folder(folder)?;
        files::make_folder(&own)?;
        files::make_folder(&folder.join("members"))?;
        files::write(&own.join("certificate.pem"), &pair.certificate)?;
        files::write(&own.join("private-key.pem"), &pair.private_key)?;
        let hexadecimal = files::to_hexadecimal(secret.bytes());
        files::write(&own.join("cluster-secret"), &format!("{hexadecimal}\n"))?;
        let authority = Self {
            folder: folder.to_owned(),
            issuer: certificate::issuer(&pair.certificate, &pair.private_key)?,
            certificate: pair.certificate,
            secret,
            register,
        };
        authority.keep()?;
        Ok(authority)
    }

    /// The authority that was made in a folder.
    ///
    /// # Errors
    /// [`KeysError::NoAuthority`], [`KeysError::Read`], [`KeysError::Permissions`], [`KeysError::Damaged`] or
    /// [`KeysError::Certificate`]: all that is wrong.
    pub fn open(folder: &Path) -> Result<Self, Vec<KeysError>> {
        let own = folder.join("authority");
        if !own.exists() {
            return Err(vec![KeysError::NoAuthority { folder: folder.to_owned() }]);
        }
        let secret_file = own.join("cluster-secret");
        let key_file = own.join("private-key.pem");
        let mut errors = Vec::new();
        let mut kept = |result: Result<String, KeysError>| {
            result.map_err(|error| errors.push(error)).unwrap_or_default()
        };
        let certificate = kept(files::read(&own.join("certificate.pem")));
        let key = kept(files::private(&key_file).and_then(|()| files::read(&key_file)));
        let secret = kept(files::private(&secret_file).and_then(|()| files::read(&secret_file)));
        let register = files::read_toml::<Register>(&own.join("register.toml"));
        let register = register.map_err(|error| errors.push(error)).ok();
        if !errors.is_empty() {
            return Err(errors);
        }
        let secret = files::from_hexadecimal(secret.trim()).map(ClusterSecret::new);
        let secret = secret.ok_or_else(|| KeysError::Damaged {
            path: secret_file,
            reason: "it is not 64 hexadecimal digits".to_owned(),
        });
        let issuer = certificate::issuer(&certificate, &key);
        match (register, secret, issuer) {
            (Some(register), Ok(secret), Ok(issuer)) => {
                Ok(Self { folder: folder.to_owned(), certificate, issuer, secret, register })
            }
            (_, secret, issuer) => Err(secret.err().into_iter().chain(issuer.err()).collect()),
        }
    }

    /// What was issued to whom.
    pub fn register(&self) -> &Register {
        &self.register
    }

    /// The folder of one holder.
    pub fn folder_of(&self, name: &str) -> PathBuf {
        self.folder.join("members").join(name)
    }

    /// Makes new keys for each of `names`, members of the cluster, and of `people`. Their earlier ones no longer count as soon
    /// as the others have their changed folders.
    ///
    /// # Errors
    /// [`KeysError::Others`] or [`KeysError::NoHolder`] before anything is written; [`KeysError::Write`] or
    /// [`KeysError::Certificate`].
    pub fn issue(
        &mut self,
        cluster: &Cluster,
        names: &[String],
        people: People<'_>,
        days: u32,
        now: Date,
    ) -> Result<Issued, Vec<KeysError>> {
        self.check(cluster, names, people)?;
        let address = |name: &String| {
            let member = cluster.member(name);
            let addresses = member.map(|member| cluster.addresses(member)).unwrap_or_default();
            let both = [addresses.first, addresses.second].into_iter().flatten();
            both.map(|address| address.ip()).collect::<Vec<IpAddr>>()
        };
        let all = names.iter().map(|name| (name, Role::Member, address(name)));
        let persons = people.holders.iter();
        let all =
            all.chain(persons.map(|(name, role)| {
                (name, Role::from(*role), people.address.into_iter().collect())
            }));
        let mut renewed = BTreeSet::new();
        for (name, role, addresses) in all {
            if renewed.insert(name.clone()) {
                self.renew(name, role, addresses, now, now.plus_days(days))
                    .map_err(|error| vec![error])?;
            }
        }
        let folders = self.distribute(cluster).map_err(|error| vec![error])?;
        self.keep().map_err(|error| vec![error])?;
        let holders = self.register.holders.iter();
        Ok(Issued {
            holders: holders.filter(|holder| renewed.contains(&holder.name)).cloned().collect(),
            folders,
        })
    }

    /// The keys of `names` no longer count.
    ///
    /// # Errors
    /// [`KeysError::NoHolder`] and [`KeysError::AlreadyRevoked`], all of them, before anything is written; [`KeysError::Write`].
    pub fn revoke(&mut self, names: &[String], now: Date) -> Result<Issued, Vec<KeysError>> {
        let mut errors = Vec::new();
        for name in names {
            match self.register.find(name) {
                None => errors
                    .push(KeysError::NoHolder { name: name.clone(), known: self.register.known() }),
                Some(holder) => errors.extend(
                    holder
                        .revoked
                        .map(|since| KeysError::AlreadyRevoked { name: name.clone(), since }),
                ),
            }
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        let mut revoked = Vec::new();
        for holder in &mut self.register.holders {
            if names.contains(&holder.name) {
                holder.revoked = Some(now);
                holder.revoked_through =
                    Some(Revoked { generation: holder.generation, since: now });
                revoked.push(holder.clone());
            }
        }
        let folders = self.distribute_revoked().map_err(|error| vec![error])?;
        self.keep().map_err(|error| vec![error])?;
        Ok(Issued { holders: revoked, folders })
    }

    fn check(
        &self,
        cluster: &Cluster,
        names: &[String],
        people: People<'_>,
    ) -> Result<(), Vec<KeysError>> {
        let mut errors = Vec::new();
        if self.register.cluster != cluster.name() {
            errors.push(KeysError::Others {
                folder: self.folder.clone(),
                found: format!("the cluster {}", self.register.cluster),
                wanted: format!("the cluster {}", cluster.name()),
            });
        }
        let members: Vec<&str> =
            cluster.members().filter_map(|member| cluster.member_name(member)).collect();
        let unknown = names.iter().filter(|name| !members.contains(&name.as_str()));
        errors.extend(unknown.map(|name| KeysError::NoHolder {
            name: name.clone(),
            known: format!("the cluster has {}", members.join(", ")),
        }));
        let legal = |name: &str| {
            let plain = |letter: char| letter.is_ascii_alphanumeric() || "-_".contains(letter);
            (1..=understudy_cluster::MAXIMUM_NAME_LENGTH).contains(&name.len())
                && name.chars().all(plain)
                && !members.contains(&name)
        };
        let mut persons = people.holders.iter().map(|(name, _)| name);
        let illegal = persons.by_ref().filter(|name| !legal(name));
        errors.extend(illegal.map(|name| {
            KeysError::NoHolder {
                name: name.clone(),
                known:
                    "the name of a person has letters, digits, `-` and `_`, and is not a member's"
                        .into(),
            }
        }));
        if errors.is_empty() { Ok(()) } else { Err(errors) }
    }

    fn renew(
        &mut self,
        name: &str,
        role: Role,
        addresses: Vec<IpAddr>,
        now: Date,
        expires: Date,
    ) -> Result<(), KeysError> {
        let known = self.register.find(name).cloned();
        let generation = known.as_ref().map_or(0, |holder| holder.generation) + 1;
        let pair = certificate::holder(
            &Subject {
                cluster: &self.register.cluster,
                common_name: &common_name(name, generation),
                addresses,
                issued: now,
                expires,
            },
            &self.issuer,
        )?;
        let folder = self.folder_of(name);
        files::make_folder(&folder)?;
        files::write(&folder.join("authority.pem"), &self.certificate)?;
        files::write(&folder.join("certificate.pem"), &pair.certificate)?;
        files::write(&folder.join("private-key.pem"), &pair.private_key)?;
        let holder = Holder {
            name: name.to_owned(),
            role,
            generation,
            serial: pair.serial,
            issued: now,
            expires,
            revoked: None,
            revoked_through: known.and_then(|holder| holder.revoked_through),
        };
        match self.register.holders.iter_mut().find(|known| known.name == name) {
            Some(known) => *known = holder,
            None => self.register.holders.push(holder),
        }
        Ok(())
    }

    /// Writes what each holder has to know of the others.
    fn distribute(&self, cluster: &Cluster) -> Result<Vec<PathBuf>, KeysError> {
        for holder in &self.register.holders {
            let file = self.folder_of(&holder.name).join("keys.toml");
            let title = "Made by `understudy keys`; keep it to this member alone.";
            files::write_toml(&file, title, &self.keys_of(holder, cluster))?;
        }
        self.distribute_revoked()
    }

    fn distribute_revoked(&self) -> Result<Vec<PathBuf>, KeysError> {
        let revoked = RevokedFile::of(&self.register);
        let mut folders = Vec::new();
        for holder in &self.register.holders {
            let folder = self.folder_of(&holder.name);
            revoked.write(&folder.join("revoked.toml"))?;
            folders.push(folder);
        }
        Ok(folders)
    }

    fn keys_of(&self, holder: &Holder, cluster: &Cluster) -> KeysFile {
        let roster = cluster.roster();
        let own = cluster.member(&holder.name);
        let mut file = KeysFile {
            cluster: self.register.cluster.clone(),
            name: holder.name.clone(),
            role: holder.role,
            generation: holder.generation,
            issued: Some(holder.issued),
            expires: holder.expires,
            own: String::new(),
            members: Vec::new(),
            viewers: Vec::new(),
            operators: Vec::new(),
            engineers: Vec::new(),
            heard: Vec::new(),
            shared: Vec::new(),
        };
        for other in &self.register.holders {
            match other.role {
                Role::Member => file.members.push(other.common_name()),
                Role::Viewer => file.viewers.push(other.common_name()),
                Role::Operator => file.operators.push(other.common_name()),
                Role::Engineer => file.engineers.push(other.common_name()),
            }
        }
        let Some(own) = own else {
            return file;
        };
        file.own = files::to_hexadecimal(self.secret.frame_key(self.title(holder)).bytes());
        for other in &self.register.holders {
            let Some(member) = cluster.member(&other.name) else {
                continue;
            };
            if roster.is_received(member, own) {
                let key = self.secret.frame_key(self.title(other));
                file.heard.push(Heard {
                    name: other.name.clone(),
                    generation: other.generation,
                    key: files::to_hexadecimal(key.bytes()),
                });
            }
            if let (Member::Station(_), Member::Station(_)) = (own, member)
                && own != member
            {
                let to = self.secret.transfer_key(self.title(holder), self.title(other));
                let from = self.secret.transfer_key(self.title(other), self.title(holder));
                file.shared.push(Shared {
                    name: other.name.clone(),
                    to: files::to_hexadecimal(to.bytes()),
                    from: files::to_hexadecimal(from.bytes()),
                });
            }
        }
        file
    }

    fn title<'a>(&'a self, holder: &'a Holder) -> Title<'a> {
        Title {
            cluster: &self.register.cluster,
            member: &holder.name,
            generation: holder.generation,
        }
    }

    fn keep(&self) -> Result<(), KeysError> {
        let file = self.folder.join("authority").join("register.toml");
        let title = "Who was issued what. Made by `understudy keys`.";
        files::write_toml(&file, title, &self.register)
    }
}
