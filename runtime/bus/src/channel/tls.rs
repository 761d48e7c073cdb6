//! Mutual TLS, and who may do what over it: the settings that both ends of the channel share.

use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

use serde_json::json;
use understudy_wire::{ClusterHash, Role};

/// Where a holder's TLS files lie.
#[derive(Debug, Clone)]
pub struct TlsKeys {
    /// The certificate of the authority, whom alone a listener trusts.
    pub authority: PathBuf,
    /// Its own certificate.
    pub certificate: PathBuf,
    /// Its own private key.
    pub private_key: PathBuf,
    /// Whether its own certificate counts now.
    pub validity: Validity,
}

/// Says why a certificate does not count by the clock of this machine, with both times.
#[derive(Clone, Default)]
pub struct Validity(Option<Arc<Check>>);

type Check = dyn Fn() -> Option<String> + Send + Sync;

impl Validity {
    /// By a function that is asked whenever it matters, since clocks are set and time passes.
    pub fn by(check: impl Fn() -> Option<String> + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(check)))
    }

    /// Why the certificate does not count now; nothing where it does, or where that is not known.
    pub fn reason(&self) -> Option<String> {
        self.0.as_ref().and_then(|check| check())
    }
}

impl fmt::Debug for Validity {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Validity").field(&self.reason()).finish()
    }
}

/// Whose calls are answered, by the common names of their certificates.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Admitted {
    /// May also command.
    pub engineers: Vec<String>,
    /// May also write operator inputs.
    pub operators: Vec<String>,
    /// May also follow the journal, and report an order that was refused.
    pub viewers: Vec<String>,
    /// May ask.
    pub members: Vec<String>,
}

impl Admitted {
    /// All but the members.
    pub(crate) fn people(&self) -> impl Iterator<Item = &String> {
        let people = self.engineers.iter().chain(&self.operators);
        people.chain(&self.viewers)
    }
}

/// Where a member takes writes, by the role that may ask there.
pub(crate) const WRITE_KEYS: [(Role, &str); 2] =
    [(Role::Operator, "write/operator"), (Role::Engineer, "write/engineer")];

/// Where a member is told of orders that were refused before they were sent.
pub(crate) const REFUSED_KEY: &str = "refused";

/// Where the lines of a journal are told.
pub(crate) const JOURNAL_KEY: &str = "journal";

/// Where a remote I/O tells which stations it misses.
pub(crate) const ATTENDANCE_KEY: &str = "attendance";

/// The key of those who follow what is told: it ends with a wildcard.
///
/// Zenoh 1.10.2 reads the faces of a resource without a lock where a message of a key that the receiver has declared passes the access control
/// (`Resource::get_egress_cache`), while another thread removes the face of a caller who leaves: the process dies. What is told has a longer key than
/// any that callers declare, so it is sent with its whole key, and nothing is looked up there.
pub(crate) fn told_below(prefix: &str, what: &str) -> String {
    format!("{prefix}/{what}/*")
}

/// The key under which it is told.
pub(crate) fn told_as(prefix: &str, what: &str) -> String {
    format!("{prefix}/{what}/lines")
}

/// Where spares report, each below it under its own name.
pub(crate) const SPARE_KEY: &str = "spare";

/// Whom a certificate names: its common name without the generation.
fn holder(common_name: &str) -> &str {
    common_name.rsplit_once('.').map_or(common_name, |(name, _)| name)
}

/// Where a member's keys begin.
pub(crate) fn prefix(cluster: ClusterHash, name: &str) -> String {
    format!("understudy/{cluster}/{name}")
}

/// Where a member says the hash of its configuration to whoever does not know it.
pub(crate) fn hash_key(name: &str) -> String {
    format!("understudy/cluster/{name}")
}

/// The endpoint of an address. Zenoh takes what is before the last colon for the name in the certificate, and an IPv6
/// address in brackets is no name there.
pub(crate) fn endpoint(address: SocketAddr) -> String {
    format!("tls/{}:{}", address.ip(), address.port())
}

/// Nothing but mutual TLS to and from named addresses.
pub(crate) fn tls_config(mode: &str, keys: &TlsKeys) -> zenoh::Result<zenoh::Config> {
    let mut config = zenoh::Config::default();
    let tls = json!({
        "root_ca_certificate": keys.authority,
        "listen_certificate": keys.certificate,
        "listen_private_key": keys.private_key,
        "connect_certificate": keys.certificate,
        "connect_private_key": keys.private_key,
        "enable_mtls": true,
        "verify_name_on_connect": true,
        "close_link_on_expiration": true,
    });
    for (setting, value) in [
        ("mode", json!(mode)),
        ("scouting/multicast/enabled", json!(false)),
        ("scouting/gossip/enabled", json!(false)),
        ("transport/link/protocols", json!(["tls"])),
        ("transport/link/tls", tls),
    ] {
        insert(&mut config, setting, &value)?;
    }
    Ok(config)
}

pub(crate) fn insert(
    config: &mut zenoh::Config,
    setting: &str,
    value: &serde_json::Value,
) -> zenoh::Result<()> {
    config
        .insert_json5(setting, &value.to_string())
        .map_err(|error| format!("{setting}: {error}").into())
}

/// The table above as Zenoh's rules; what no rule allows is denied.
pub(super) fn access_control(prefix: &str, hash: &str, admitted: &Admitted) -> serde_json::Value {
    let asked = ["configuration", "status"].map(|what| format!("{prefix}/{what}"));
    let asked: Vec<String> = asked.into_iter().chain([hash.to_owned()]).collect();
    let commands = vec![format!("{prefix}/command/*")];
    let writes = WRITE_KEYS.map(|(_, key)| vec![format!("{prefix}/{key}")]);
    let told = [JOURNAL_KEY, ATTENDANCE_KEY].map(|what| told_below(prefix, what));
    let refused = [format!("{prefix}/{REFUSED_KEY}")];
    let spares = [format!("{prefix}/{SPARE_KEY}/*")];
    let rule = |id: &str, messages: &[&str], flow: &str, keys: &[String]| {
        json!({
            "id": id,
            "permission": "allow",
            "messages": messages,
            "flows": [flow],
            "key_exprs": keys,
        })
    };
    let answers = ["reply", "declare_queryable"];
    let mut rules = vec![
        rule("ask", &["query"], "ingress", &asked),
        rule("ask-answer", &answers, "egress", &asked),
        rule("follow", &["declare_subscriber"], "ingress", &told),
        rule("follow-lines", &["put"], "egress", &told),
        rule("refused", &["query"], "ingress", &refused),
        rule("refused-answer", &answers, "egress", &refused),
        rule("spare-answer", &answers, "egress", &spares),
        rule("write", &["query"], "ingress", &writes[0]),
        rule("write-answer", &answers, "egress", &writes[0]),
        rule("engineer-write", &["query"], "ingress", &writes[1]),
        rule("engineer-write-answer", &answers, "egress", &writes[1]),
        rule("command", &["query"], "ingress", &commands),
        rule("command-answer", &answers, "egress", &commands),
    ];
    let all: Vec<serde_json::Value> = rules.iter().map(|rule| rule["id"].clone()).collect();
    // Each may do what the one before it may.
    let groups = [
        ("members", &admitted.members, &all[..2]),
        ("viewers", &admitted.viewers, &all[..7]),
        ("operators", &admitted.operators, &all[..9]),
        ("engineers", &admitted.engineers, &all[..]),
    ];
    // A group of nobody would be one of everybody: Zenoh takes a missing list for a wildcard, and refuses an empty one.
    let groups = groups.iter().filter(|(_, names, _)| !names.is_empty());
    let subject = |id: &str, names: &[String]| json!({"id": id, "cert_common_names": names, "link_protocols": ["tls"]});
    let policy = |id: &str, rules: &[serde_json::Value]| json!({"subjects": [id], "rules": rules});
    let mut subjects: Vec<_> = groups.clone().map(|(id, names, _)| subject(id, names)).collect();
    let mut policies: Vec<_> = groups.map(|(id, _, rules)| policy(id, rules)).collect();
    // Each person may report as the spare that the own certificate names, and as no other one.
    for name in admitted.people() {
        let id = format!("spare {name}");
        let own = [format!("{prefix}/{SPARE_KEY}/{}", holder(name))];
        rules.push(rule(&id, &["query"], "ingress", &own));
        subjects.push(subject(&id, std::slice::from_ref(name)));
        policies.push(policy(&id, &[json!(id)]));
    }
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_router_of_a_site_is_one_that_zenoh_knows() {
        let text = include_str!("../../../../deployment/site-router.json5");
        let config = zenoh::Config::from_json5(text).expect("Zenoh reads it");
        let rules = config.get_json("access_control/default_permission");
        assert_eq!(rules.expect("it is set"), "\"deny\"");
    }

    /// A report of a spare is taken from the holder of its name only.
    #[test]
    fn a_spare_reports_under_the_name_of_its_certificate() {
        let admitted = Admitted {
            viewers: vec!["spare-1.1".into(), "spare-1.2".into(), "desk.1".into()],
            ..Admitted::default()
        };
        let rules = access_control("understudy/1/io", &hash_key("io"), &admitted);
        let all = rules["rules"].as_array().expect("rules");
        for (name, own) in [("spare-1.1", "spare-1"), ("spare-1.2", "spare-1"), ("desk.1", "desk")]
        {
            let id = format!("spare {name}");
            let rule = all.iter().find(|rule| rule["id"] == *id).expect("it has one");
            assert_eq!(rule["key_exprs"], json!([format!("understudy/1/io/spare/{own}")]));
            assert_eq!(
                (&rule["messages"], &rule["flows"]),
                (&json!(["query"]), &json!(["ingress"]))
            );
        }
        let may_all = |rule: &serde_json::Value| {
            let keys = rule["key_exprs"].to_string();
            keys.contains("/spare/*") && rule["flows"] == json!(["ingress"])
        };
        assert!(!all.iter().any(may_all));
    }

    #[test]
    fn nobody_is_not_everybody() {
        let rules = access_control("understudy/1/robot", &hash_key("robot"), &Admitted::default());
        assert_eq!(rules["default_permission"], "deny");
        assert_eq!(rules["subjects"], json!([]));
        assert_eq!(rules["policies"], json!([]));
        let admitted = Admitted {
            engineers: vec!["engineer.1".into()],
            operators: vec!["operator.1".into()],
            members: vec!["press.1".into()],
            ..Admitted::default()
        };
        let rules = access_control("understudy/1/robot", &hash_key("robot"), &admitted);
        assert_eq!(rules["policies"][0]["rules"], json!(["ask", "ask-answer"]));
        let of_operators = rules["policies"][1]["rules"].to_string();
        assert!(of_operators.contains("\"write\"") && !of_operators.contains("engineer-write"));
        assert!(!of_operators.contains("command"));
        zenoh::Config::default()
            .insert_json5("access_control", &rules.to_string())
            .expect("Zenoh knows such rules");
    }
}
