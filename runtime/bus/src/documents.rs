//! Documents of other systems under keys of Zenoh, asked for one by one: the other end of [`crate::Announcer`].

use std::net::SocketAddr;
use std::time::Duration;

use serde_json::json;
use zenoh::Wait;

use crate::channel::{TlsKeys, endpoint, insert, tls_config};
use crate::error::{BusError, reason};
use crate::operator::not_opened;

/// Time within which a session opens.
const PATIENCE: Duration = Duration::from_secs(3);

/// Time within which a document is answered.
const ANSWERED_WITHIN: Duration = Duration::from_secs(1);

/// A session that asks for documents.
pub struct Documents {
    session: zenoh::Session,
}

impl std::fmt::Debug for Documents {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Documents")
    }
}

impl Documents {
    /// Connects to a gateway or a router at `address`: over TCP, or over TLS with `keys`.
    ///
    /// # Errors
    /// Nobody listens there, or one side does not accept the other's certificate.
    pub fn open(address: SocketAddr, keys: Option<&TlsKeys>) -> Result<Self, BusError> {
        if let Some(reason) = keys.and_then(|keys| keys.validity.reason()) {
            return Err(BusError::ClockOutside { address, reason });
        }
        let config = || -> zenoh::Result<zenoh::Config> {
            let (mut config, endpoint) = match keys {
                Some(keys) => (tls_config("client", keys)?, endpoint(address)),
                None => {
                    let mut config = zenoh::Config::default();
                    for (setting, value) in [
                        ("mode", json!("client")),
                        ("scouting/multicast/enabled", json!(false)),
                        ("scouting/gossip/enabled", json!(false)),
                    ] {
                        insert(&mut config, setting, &value)?;
                    }
                    (config, format!("tcp/{address}"))
                }
            };
            for (setting, value) in [
                ("connect/endpoints", json!([endpoint])),
                ("connect/timeout_ms", json!(PATIENCE.as_millis() as u64)),
                ("connect/exit_on_failure", json!(true)),
            ] {
                insert(&mut config, setting, &value)?;
            }
            Ok(config)
        };
        let failed = |error: zenoh::Error| BusError::Zenoh { address, reason: reason(&error) };
        let session = zenoh::open(config().map_err(failed)?).wait();
        session.map(|session| Self { session }).map_err(|error| match keys {
            Some(_) => BusError::Zenoh { address, reason: not_opened(address, &error) },
            None => failed(error),
        })
    }

    /// The document under a key; nothing where there is none within a second.
    pub fn ask(&self, key: &str) -> Option<String> {
        let replies = self.session.get(key).timeout(ANSWERED_WITHIN).wait().ok()?;
        let reply = replies.recv_timeout(ANSWERED_WITHIN).ok()??;
        let sample = reply.result().ok()?;
        let text = sample.payload().try_to_string().ok()?;
        Some(text.into_owned())
    }
}
