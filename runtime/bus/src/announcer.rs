//! Texts under keys of Zenoh, for other systems: said when they change, and to be asked for.
//!
//! A session of its own, over TCP and without the cluster's keys: nothing that it does reaches a member.

use std::collections::BTreeMap;
use std::net::{SocketAddr, TcpListener};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::query::Queryable;

use crate::connections::{Connections, Relay, inner_address};
use crate::error::{BusError, reason};

/// Connections at once, each of which takes three descriptors.
const MOST_CONNECTIONS: usize = 64;

/// A caller who has not opened a session by then is gone.
const HANDSHAKE_TIMEOUT_MS: u32 = 3_000;

/// An open session gives signs of life more often.
const PATIENCE: Duration = Duration::from_secs(30);

/// The newest text under each key.
type Newest = Arc<Mutex<BTreeMap<String, String>>>;

/// Says texts to whoever has called its address.
pub struct Announcer {
    root: String,
    // No call comes to a session that ends.
    _relay: Relay,
    session: zenoh::Session,
    newest: Newest,
    _queryable: Queryable<()>,
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
        let failed = |error: zenoh::Error| BusError::Zenoh {
            address,
            reason: reason(&error),
        };
        let session = settings(inner)
            .and_then(|config| zenoh::open(config).wait())
            .map_err(failed)?;
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
                        let _ = query
                            .reply(key, text)
                            .encoding(Encoding::APPLICATION_JSON)
                            .wait();
                    }
                }
            })
            .wait()
            .map_err(failed)?;
        let connections = Connections::new(MOST_CONNECTIONS, 3);
        let relay = Relay::start(listener, connections, PATIENCE, inner).map_err(listen)?;
        Ok(Self {
            root: root.to_owned(),
            _relay: relay,
            session,
            newest,
            _queryable: queryable,
        })
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
        let _ = put.encoding(Encoding::APPLICATION_JSON).wait();
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
        (
            "transport/unicast/accept_timeout",
            HANDSHAKE_TIMEOUT_MS.to_string(),
        ),
    ] {
        config
            .insert_json5(setting, &value)
            .map_err(|error| format!("{setting} = {value}: {error}"))?;
    }
    Ok(config)
}
