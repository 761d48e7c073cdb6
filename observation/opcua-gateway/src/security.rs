//! Who may read and write: the certificate of the server, those of clients that are trusted, and logins with roles.
//!
//! ```text
//!   FOLDER/own/cert.der          for clients to trust; made where there is none
//!   FOLDER/private/private.pem   its RSA key, mode 0600
//!   FOLDER/trusted/*.der         clients that may read
//!   FOLDER/rejected/*.der        clients that called and are not trusted: move one to trusted/, and it is
//! ```

use std::fs::{self, DirBuilder, Permissions};
use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::path::{Path, PathBuf};

use opcua::crypto::{CertificateStore, X509Data};
use understudy_wire::{MAXIMUM_OWNER_LENGTH, Role};

use crate::error::OpcuaError;

/// Of RSA.
const KEY_BITS: u32 = 2048;

/// That the certificate holds, as those of `understudy keys` do.
const DAYS: u32 = 730;

/// What a line of a file of logins is.
const EXPECTED: &str =
    "expected `viewer NAME PASSWORD`, `operator NAME PASSWORD` or `engineer NAME PASSWORD`";

/// Where the server listens, and who may read.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Where.
    pub address: SocketAddr,
    /// What clients call this machine; its address where nothing is said.
    pub host: Option<String>,
    /// With a folder everything is signed and encrypted, and clients are known by their certificates.
    pub certificates: Option<PathBuf>,
    /// Without logins, every client with a trusted certificate may read, and none may write.
    pub logins: Vec<Login>,
}

/// A name with its password and its role.
#[derive(Clone)]
pub struct Login {
    /// Who.
    pub user: String,
    /// Rights: a viewer reads, others also write operator inputs.
    pub role: Role,
    /// The secret.
    password: String,
}

impl std::fmt::Debug for Login {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Login({})", self.user)
    }
}

impl Login {
    /// The logins of `file`, which only its owner may read: a line `ROLE NAME PASSWORD` each.
    ///
    /// # Errors
    /// [`OpcuaError::Password`].
    pub fn read_all(file: &Path) -> Result<Vec<Self>, OpcuaError> {
        let wrong = |reason: String| OpcuaError::Password { path: file.to_owned(), reason };
        let text = fs::read_to_string(file).map_err(|error| wrong(error.to_string()))?;
        private(file).map_err(wrong)?;
        let mut logins: Vec<Self> = Vec::new();
        for (number, line) in text.lines().map(str::trim).enumerate() {
            let number = number + 1;
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let words: Vec<&str> = line.split_whitespace().collect();
            let [role, user, password] = words[..] else {
                return Err(wrong(format!("line {number}: {EXPECTED}")));
            };
            let role = Role::of_word(role);
            let role = role.ok_or_else(|| wrong(format!("line {number}: {EXPECTED}")))?;
            if user.chars().count() > MAXIMUM_OWNER_LENGTH {
                return Err(wrong(format!(
                    "line {number}: a name has at most {MAXIMUM_OWNER_LENGTH} characters"
                )));
            }
            if logins.iter().any(|login| login.user == user) {
                return Err(wrong(format!("line {number}: {user} has a line already")));
            }
            logins.push(Self { user: user.to_owned(), role, password: password.to_owned() });
        }
        if logins.is_empty() {
            return Err(wrong("it contains no login".to_owned()));
        }
        Ok(logins)
    }

    /// A viewer. The password is the first line of `file`, which only its owner may read.
    ///
    /// # Errors
    /// [`OpcuaError::Password`].
    pub fn read(user: &str, file: &Path) -> Result<Self, OpcuaError> {
        let wrong = |reason: String| OpcuaError::Password { path: file.to_owned(), reason };
        let text = fs::read_to_string(file).map_err(|error| wrong(error.to_string()))?;
        private(file).map_err(wrong)?;
        match text.lines().next() {
            Some(password) if !password.is_empty() => Ok(Self {
                user: user.to_owned(),
                role: Role::Viewer,
                password: password.to_owned(),
            }),
            _ => Err(wrong("its first line is to be the password".to_owned())),
        }
    }

    pub(crate) fn password(&self) -> &str {
        &self.password
    }
}

impl Settings {
    /// What clients call this machine.
    pub(crate) fn host(&self) -> String {
        let address = self.address.ip();
        let host = self.host.clone().unwrap_or_else(|| {
            let own = X509Data::computer_hostnames().into_iter().next();
            own.filter(|_| address.is_unspecified()).unwrap_or_else(|| address.to_string())
        });
        // An IPv6 address is in brackets in a URL.
        if host.contains(':') && !host.starts_with('[') { format!("[{host}]") } else { host }
    }

    /// Names this server among all.
    pub(crate) fn application_uri(&self) -> String {
        format!("urn:{}:understudy-opcua", self.host())
    }

    /// Checks the settings before serving, and makes the certificate if there is none.
    ///
    /// # Errors
    /// [`OpcuaError::InTheClear`], [`OpcuaError::Certificate`].
    pub(crate) fn prepare(&self) -> Result<(), OpcuaError> {
        match &self.certificates {
            Some(folder) => self.certificate(folder),
            None if self.address.ip().is_loopback() => Ok(()),
            None => Err(OpcuaError::InTheClear { address: self.address }),
        }
    }

    fn certificate(&self, folder: &Path) -> Result<(), OpcuaError> {
        let wrong =
            |path: &Path, reason: String| OpcuaError::Certificate { path: path.to_owned(), reason };
        for (name, mode) in
            [("own", 0o755), ("private", 0o700), ("trusted", 0o755), ("rejected", 0o755)]
        {
            let path = folder.join(name);
            let mut builder = DirBuilder::new();
            let made = builder.recursive(true).mode(mode).create(&path);
            made.map_err(|error| wrong(&path, error.to_string()))?;
        }
        let (certificate, key) = certificate_and_key(folder);
        match (certificate.exists(), key.exists()) {
            (true, true) => {}
            (false, false) => {
                private(&folder.join("private"))
                    .map_err(|reason| wrong(&folder.join("private"), reason))?;
                self.make(&certificate, &key).map_err(|reason| wrong(folder, reason))?;
            }
            (true, false) => return Err(wrong(&key, "the certificate has no key".to_owned())),
            (false, true) => {
                return Err(wrong(&certificate, "the key has no certificate".to_owned()));
            }
        }
        private(&key).map_err(|reason| wrong(&key, reason))?;
        CertificateStore::read_pkey(&key)
            .map_err(|_| wrong(&key, "this is no RSA key in PEM".to_owned()))?;
        let known = CertificateStore::read_cert(&certificate)
            .map_err(|_| wrong(&certificate, "this is no certificate in DER".to_owned()))?;
        let uri = self.application_uri();
        known.is_application_uri_valid(&uri).map_err(|_| {
            let reason = format!(
                "it is not for {uri}: say --host as it was made for, or remove own/ and private/ for a new one"
            );
            wrong(&certificate, reason)
        })
    }

    fn make(&self, certificate: &Path, key: &Path) -> Result<(), String> {
        let address = self.host().trim_matches(['[', ']']).to_owned();
        let mut names = X509Data::computer_hostnames();
        names.retain(|name| *name != address);
        names.insert(0, address);
        let names =
            X509Data::alt_host_names(&self.application_uri(), Some(names), false, false, false);
        let data = X509Data {
            key_size: KEY_BITS,
            common_name: "understudy-opcua".to_owned(),
            organization: "Understudy".to_owned(),
            organizational_unit: String::new(),
            country: String::new(),
            state: String::new(),
            alt_host_names: names,
            certificate_duration_days: DAYS,
        };
        CertificateStore::create_certificate_and_key(&data, false, certificate, key)?;
        // The folder was closed to others before the key was there.
        fs::set_permissions(key, Permissions::from_mode(0o600)).map_err(|error| error.to_string())
    }
}

/// Where they are in the folder.
pub(crate) fn certificate_and_key(folder: &Path) -> (PathBuf, PathBuf) {
    (folder.join("own/cert.der"), folder.join("private/private.pem"))
}

/// Readable by its owner only.
fn private(path: &Path) -> Result<(), String> {
    let mode = fs::metadata(path)
        .map(|metadata| metadata.permissions().mode())
        .map_err(|error: io::Error| error.to_string())?;
    if mode & 0o077 == 0 {
        Ok(())
    } else {
        Err(format!("others can read it (mode {:o}): chmod go= {}", mode & 0o777, path.display()))
    }
}
