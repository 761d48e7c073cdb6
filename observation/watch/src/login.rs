//! Who may look, and who may command: a file of tokens, and the sessions of those who showed one.
//!
//! A line of the file is a role (`viewer`, `operator` or `engineer`), a name and a token. A token is a secret of 32 characters or more, made by chance, so
//! it needs no slow hash; what is kept in memory of tokens and sessions are their hashes, compared in constant time.

use std::collections::HashMap;
use std::fs;
use std::io::Write;
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use axum::http::HeaderMap;
use axum::http::header::COOKIE;
use blake3::Hash;
use ring::rand::{SecureRandom, SystemRandom};
use understudy_wire::Role;

use crate::error::WatchError;

/// Bytes of a token or of a session's name.
const SECRET_BYTES: usize = 32;

/// The shortest token that is believed to be made by chance.
const LEAST_TOKEN_LENGTH: usize = 32;

/// Sessions at once; the oldest goes for another one.
const MAXIMUM_SESSIONS: usize = 256;

const SESSION_TIME: Duration = Duration::from_secs(12 * 3600);

/// Time between two failed logins, of any client.
const FAILURE_PAUSE: Duration = Duration::from_millis(300);

const COOKIE_NAME: &str = "understudy_session";

/// A person who is logged in, or whose keys the page uses; without a name where neither is so.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Person {
    pub(crate) name: String,
    pub(crate) role: Role,
}

/// Those who may log in, and those who have.
#[derive(Debug)]
pub struct Logins {
    tokens: Vec<(Hash, Person)>,
    sessions: Mutex<HashMap<Hash, (Person, Instant)>>,
    failures: tokio::sync::Mutex<()>,
}

impl Logins {
    /// Reads the file of logins; makes one with an engineer if there is none.
    ///
    /// # Errors
    /// [`WatchError::Logins`] where it cannot be read or made, is readable by others, or has an invalid line.
    pub fn of_file(path: &Path) -> Result<Self, WatchError> {
        let bad = |reason: String| WatchError::Logins { path: path.to_owned(), reason };
        if !path.exists() {
            make_file(path).map_err(bad)?;
        }
        let rights = fs::metadata(path).map_err(|error| bad(error.to_string()))?;
        if rights.permissions().mode() & 0o077 != 0 {
            return Err(bad("others may read it: chmod 600".to_owned()));
        }
        let text = fs::read_to_string(path).map_err(|error| bad(error.to_string()))?;
        let tokens = read_tokens(&text).map_err(bad)?;
        Ok(Self { tokens, sessions: Mutex::default(), failures: tokio::sync::Mutex::default() })
    }

    /// The person with this token. A wrong token costs time.
    pub(crate) async fn admit(&self, token: &str) -> Option<Person> {
        let hash = blake3::hash(token.trim().as_bytes());
        let found = self.tokens.iter().find(|(known, _)| *known == hash);
        if found.is_none() {
            let _one_at_a_time = self.failures.lock().await;
            tokio::time::sleep(FAILURE_PAUSE).await;
        }
        found.map(|(_, person)| person.clone())
    }

    /// Opens a session: the text of its cookie.
    pub(crate) fn open(&self, person: Person, now: Instant) -> Option<String> {
        let secret = secret()?;
        let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        sessions.retain(|_, (_, opened)| now.duration_since(*opened) < SESSION_TIME);
        if sessions.len() >= MAXIMUM_SESSIONS {
            let oldest = sessions.iter().min_by_key(|(_, (_, opened))| *opened);
            if let Some(oldest) = oldest.map(|(hash, _)| *hash) {
                sessions.remove(&oldest);
            }
        }
        sessions.insert(blake3::hash(secret.as_bytes()), (person, now));
        let seconds = SESSION_TIME.as_secs();
        Some(format!(
            "{COOKIE_NAME}={secret}; HttpOnly; Secure; SameSite=Strict; Path=/; Max-Age={seconds}"
        ))
    }

    /// Whose session the request belongs to.
    pub(crate) fn person(&self, headers: &HeaderMap, now: Instant) -> Option<Person> {
        let hash = blake3::hash(session_of(headers)?.as_bytes());
        let sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        let (person, opened) = sessions.get(&hash)?;
        (now.duration_since(*opened) < SESSION_TIME).then(|| person.clone())
    }

    /// Ends the session of a request: the text that takes its cookie back.
    pub(crate) fn close(&self, headers: &HeaderMap) -> String {
        if let Some(session) = session_of(headers) {
            let hash = blake3::hash(session.as_bytes());
            let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
            sessions.remove(&hash);
        }
        format!("{COOKIE_NAME}=; HttpOnly; Secure; SameSite=Strict; Path=/; Max-Age=0")
    }
}

fn session_of(headers: &HeaderMap) -> Option<&str> {
    let cookies = headers.get_all(COOKIE).iter();
    let cookies = cookies.filter_map(|value| value.to_str().ok());
    let mut pairs = cookies.flat_map(|value| value.split(';'));
    pairs.find_map(|pair| {
        let (name, value) = pair.trim().split_once('=')?;
        (name == COOKIE_NAME).then_some(value)
    })
}

fn secret() -> Option<String> {
    let mut bytes = [0; SECRET_BYTES];
    SystemRandom::new().fill(&mut bytes).ok()?;
    Some(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

fn make_file(path: &Path) -> Result<(), String> {
    let secret = secret().ok_or("the system gives no random numbers")?;
    let mut file = fs::OpenOptions::new()
        .write(true)
        .create_new(true)
        .mode(0o600)
        .open(path)
        .map_err(|error| error.to_string())?;
    writeln!(file, "engineer engineer {secret}").map_err(|error| error.to_string())
}

fn read_tokens(text: &str) -> Result<Vec<(Hash, Person)>, String> {
    let lines = text.lines().map(str::trim).enumerate();
    let lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let mut tokens = Vec::new();
    let mut wrong = Vec::new();
    for (number, line) in lines {
        let words: Vec<&str> = line.split_whitespace().collect();
        let role = words.first().and_then(|word| Role::of_word(word));
        match (role, words.as_slice()) {
            (Some(role), [_, name, token]) if token.len() >= LEAST_TOKEN_LENGTH => {
                let person = Person {
                    name: (*name).to_owned(),
                    role,
                };
                tokens.push((blake3::hash(token.as_bytes()), person));
            }
            (Some(_), [_, _, _]) => wrong.push(format!(
                "line {}: a token has at least {LEAST_TOKEN_LENGTH} characters",
                number + 1
            )),
            _ => wrong.push(format!(
                "line {}: expected `viewer NAME TOKEN`, `operator NAME TOKEN` or `engineer NAME TOKEN`",
                number + 1
            )),
        }
    }
    if !wrong.is_empty() {
        return Err(wrong.join("; "));
    }
    if tokens.is_empty() {
        return Err("it contains no login".to_owned());
    }
    Ok(tokens)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOKEN: &str = "0123456789abcdef0123456789abcdef";

    #[test]
    fn a_line_is_a_person() {
        let check = |text: &str, expected: Result<&[(&str, Role)], &str>| {
            let found = read_tokens(text);
            let found = found.map(|tokens| {
                let people = tokens.into_iter().map(|(_, person)| person);
                people.map(|person| (person.name, person.role)).collect::<Vec<_>>()
            });
            let expected = expected
                .map(|people| {
                    people
                        .iter()
                        .map(|(name, role)| ((*name).to_owned(), *role))
                        .collect::<Vec<_>>()
                })
                .map_err(str::to_owned);
            assert_eq!(found, expected, "{text}");
        };
        let line = |role: &str| format!("# who\n\n{role} anna {TOKEN}\n");
        check(&line("viewer"), Ok(&[("anna", Role::Viewer)]));
        check(&line("operator"), Ok(&[("anna", Role::Operator)]));
        check(&line("engineer"), Ok(&[("anna", Role::Engineer)]));
        check("", Err("it contains no login"));
        check(
            "viewer anna secret\nanna\n",
            Err(
                "line 1: a token has at least 32 characters; line 2: expected `viewer NAME TOKEN`, `operator NAME TOKEN` or `engineer NAME TOKEN`",
            ),
        );
    }

    fn logins() -> Logins {
        Logins {
            tokens: read_tokens(&format!("operator anna {TOKEN}")).expect("a line"),
            sessions: Mutex::default(),
            failures: tokio::sync::Mutex::default(),
        }
    }

    fn headers(cookie: &str) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(COOKIE, cookie.parse().expect("a header"));
        headers
    }

    #[test]
    fn a_session_lasts_until_it_is_closed_or_over() {
        let logins = logins();
        let anna = logins.tokens[0].1.clone();
        let now = Instant::now();
        let cookie = logins.open(anna.clone(), now).expect("random numbers");
        let sent = headers(&format!("other=1; {}", cookie.split(';').next().unwrap()));
        assert_eq!(logins.person(&sent, now), Some(anna.clone()));
        assert_eq!(logins.person(&sent, now + SESSION_TIME), None);
        assert_eq!(logins.person(&HeaderMap::new(), now), None);
        assert_eq!(logins.person(&headers("understudy_session=guess"), now), None);
        logins.close(&sent);
        assert_eq!(logins.person(&sent, now), None);
    }

    #[test]
    fn sessions_are_bounded() {
        let logins = logins();
        let anna = logins.tokens[0].1.clone();
        let now = Instant::now();
        for number in 0..MAXIMUM_SESSIONS as u64 + 10 {
            let later = now + Duration::from_millis(number);
            assert!(logins.open(anna.clone(), later).is_some());
        }
        let sessions = logins.sessions.lock().expect("no panic");
        assert_eq!(sessions.len(), MAXIMUM_SESSIONS);
    }
}
