//! Texts under keys of Zenoh, for other systems: said when they change, and to be asked for.
//!
//! A session of its own, over TCP and without the cluster's keys: nothing that it does reaches a member. Questions under a key of their own
//! are handed to the program that answers them.

use std::collections::BTreeMap;
use std::net::{SocketAddr, TcpListener};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};

use crate::connections::{Connections, Relay, inner_address};
use crate::error::{BusError, reason};

/// Connections at once, each of which takes three descriptors.
const MOST_CONNECTIONS: usize = 64;

/// A caller who has not opened a session by then is gone.
const HANDSHAKE_TIMEOUT_MS: u32 = 3_000;

/// An open session gives signs of life more often.
const PATIENCE: Duration = Duration::from_secs(30);

/// Bytes of a question.
const LONGEST_QUESTION: usize = 4096;

/// A question of a client, with the text that came with it.
pub struct Question {
    query: Query,
    /// Its text.
    pub text: String,
}

impl std::fmt::Debug for Question {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Question({})", self.text)
    }
}

impl Question {
    /// Answers in JSON. A client that has gone gets nothing.
    pub fn answer(self, text: &str) {
        let key = self.query.key_expr().clone();
        let reply = self.query.reply(key, text);
        let _ = reply.encoding(Encoding::APPLICATION_JSON).wait();
    }
}

/// The newest text under each key.
type Newest = Arc<Mutex<BTreeMap<String, String>>>;

/// Says texts to whoever has called its address.
pub struct Announcer {
    root: String,
    address: SocketAddr,
    // No call comes to a session that ends.
    _relay: Relay,
    session: zenoh::Session,
    newest: Newest,
    _queryable: Queryable<()>,
    questions: Option<Queryable<()>>,
}

impl Announcer {
    /// Listens on `address`; all keys stand below `root`.
    ///
    /// # Errors
    /// The port is in use, or Zenoh does not start.
    pub fn open(address: SocketAddr, root: &str) -> Result<Self, BusError> {
        let listen = |source| BusError::listen(address, source);
        let listener = TcpListener::bind(address).map_err(listen)?;
        let inner = inner_address().map_err(listen)?;
        let failed = |error: zenoh::Error| BusError::Zenoh { address, reason: reason(&error) };
        let session =
            settings(inner).and_then(|config| zenoh::open(config).wait()).map_err(failed)?;
        let newest = Newest::default();
        let known = Arc::clone(&newest);
        let queryable = session
            .declare_queryable(format!("{root}/**"))
            .callback(move |query| {
                let known = known.lock().unwrap_or_else(PoisonError::into_inner).clone();
                for (key, text) in known {
                    let asked = zenoh::key_expr::KeyExpr::new(key.as_str())
                        .is_ok_and(|key| query.key_expr().intersects(&key));
                    if asked {
                        // Who asked is gone where this fails.
                        let reply = query.reply(key, text);
                        if let Err(error) = reply.encoding(Encoding::APPLICATION_JSON).wait() {
                            tracing::debug!(%error, "an answer was not sent");
                        }
                    }
                }
            })
            .wait()
            .map_err(failed)?;
        let connections = Connections::new(MOST_CONNECTIONS, 3);
        let relay = Relay::start(listener, connections, PATIENCE, inner).map_err(listen)?;
        Ok(Self {
            root: root.to_owned(),
            address,
            _relay: relay,
            session,
            newest,
            _queryable: queryable,
            questions: None,
        })
    }

    /// Hands each question under the key that ends in `key` to `take`, which must not wait. A question has a text; a longer one than
    /// 4,096 bytes is not answered.
    ///
    /// # Errors
    /// Zenoh does not take it.
    pub fn take_questions(
        &mut self,
        key: &str,
        take: impl Fn(Question) + Send + Sync + 'static,
    ) -> Result<(), BusError> {
        let key = format!("{}/{key}", self.root);
        let own = key.clone();
        let declared = self.session.declare_queryable(key).callback(move |query| {
            // Questions about several keys ask for texts.
            if query.key_expr().as_str() != own {
                return;
            }
            let payload = query.payload().filter(|text| text.len() <= LONGEST_QUESTION);
            let text = payload.and_then(|text| text.try_to_string().ok());
            if let Some(text) = text.map(|text| text.into_owned()) {
                take(Question { query, text });
            }
        });
        let declared = declared
            .wait()
            .map_err(|error| BusError::Zenoh { address: self.address, reason: reason(&error) })?;
        self.questions = Some(declared);
        Ok(())
    }

    /// Says `text` under the key that ends in `key`, and keeps it for those who ask.
    pub fn say(&self, key: &str, text: &str) {
        let key = format!("{}/{key}", self.root);
        self.put(&key, text);
        let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        newest.insert(key, text.to_owned());
    }

    /// Says `text` to those who listen now.
    pub fn say_once(&self, key: &str, text: &str) {
        self.put(&format!("{}/{key}", self.root), text);
    }

    /// Keeps nothing any more for those who ask.
    pub fn forget(&self) {
        let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        newest.clear();
    }

    fn put(&self, key: &str, text: &str) {
        // One that is not sent is replaced by the next.
        let put = self.session.put(key, text);
        if let Err(error) = put.encoding(Encoding::APPLICATION_JSON).wait() {
            tracing::warn!(%error, key, "a value was not published");
        }
    }
}

fn settings(address: SocketAddr) -> zenoh::Result<zenoh::Config> {
    let mut config = zenoh::Config::default();
    for (setting, value) in [
        ("mode", "\"peer\"".to_owned()),
        ("listen/endpoints", format!("[\"tcp/{address}\"]")),
        ("connect/endpoints", "[]".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
        ("transport/unicast/accept_timeout", HANDSHAKE_TIMEOUT_MS.to_string()),
    ] {
        config
            .insert_json5(setting, &value)
            .map_err(|error| format!("{setting} = {value}: {error}"))?;
    }
    Ok(config)
}
