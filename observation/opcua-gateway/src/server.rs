//! The server: nodes that are made once, and values that are set when they change.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use opcua::crypto::SecurityPolicy;
use opcua::nodes::{BaseEventType, EventNotifier, ObjectBuilder, VariableBuilder};
use opcua::server::address_space::AddressSpace;
use opcua::server::{
    ANONYMOUS_USER_TOKEN_ID, Server, ServerBuilder, ServerEndpoint, ServerHandle, ServerUserToken,
};
use opcua::types::{
    BuildInfo, ByteString, DataTypeId, DataValue, DateTime, EUInformation, ExtensionObject,
    LocalizedText, MessageSecurityMode, NodeId, ObjectId, ObjectTypeId, QualifiedName, Range,
    VariableTypeId, Variant,
};
use tokio::net::TcpListener;
use understudy_bus::{Connections, Listener, relay};
use understudy_cluster::CardFacts;
use understudy_gateway::{Feed, Followed, WriteGate, serve_until_asked};
use understudy_view::{Event, Level, Run};
use understudy_wire::Role;

use crate::error::OpcuaError;
use crate::manager::{NodeManager, Writing, node_manager};
use crate::security::{Login, Settings, certificate_and_key};
use crate::tree::{Kind, Reading, Seen, Variable, message, variables};
use crate::trust;

/// Between two looks at what is newest; a run is followed no faster.
const LOOK: Duration = Duration::from_millis(100);

/// At once, each of which takes three descriptors.
const MOST_CONNECTIONS: usize = 64;

/// Time limit in seconds for the hello message of a client.
const HELLO_TIMEOUT_S: u32 = 3;

/// The longest lifetime of the keys of a connection, a day: clients ask for an hour, and renew the keys after three quarters of it.
///
/// async-opcua-server 0.19 forgets the old keys at a renewal that is later than 5/4 of the lifetime after the connection was opened; a request
/// that is on its way at that moment closes the connection. With its default of 5 minutes that happened after 6 to 19 minutes.
const LONGEST_TOKEN_MS: u32 = 24 * 3_600_000;

/// A connection over which the server sends nothing for so long is closed; a subscription is kept alive more often.
const PATIENCE: Duration = Duration::from_secs(300);

/// Sessions at once; further ones are refused.
const MOST_SESSIONS: usize = 64;

/// Of a monitored item, for events that come at once.
const LONGEST_QUEUE: usize = 1000;

/// Between 1601, where the time of OPC UA begins, and 1970.
const SECONDS_TO_1970: u64 = 11_644_473_600;

/// The folder that all others are in.
const ROOT: &str = "Understudy";

#[rustfmt::skip]
const SECURE: [(&str, SecurityPolicy, MessageSecurityMode); 4] = [
    ("basic256sha256_sign", SecurityPolicy::Basic256Sha256, MessageSecurityMode::Sign),
    ("basic256sha256_encrypt", SecurityPolicy::Basic256Sha256, MessageSecurityMode::SignAndEncrypt),
    ("aes256_sha256_rsapss_sign", SecurityPolicy::Aes256Sha256RsaPss, MessageSecurityMode::Sign),
    ("aes256_sha256_rsapss_encrypt", SecurityPolicy::Aes256Sha256RsaPss, MessageSecurityMode::SignAndEncrypt),
];

/// Serves `run` until SIGINT or SIGTERM; `ready` gets the address.
///
/// # Errors
/// All that can be wrong with `settings`; it cannot listen there.
pub fn serve(
    run: &Run,
    settings: &Settings,
    ready: impl FnOnce(SocketAddr),
) -> Result<(), OpcuaError> {
    settings.prepare()?;
    // The library looks for the folder that it is started in, and panics where that is gone.
    std::env::current_dir().map_err(|source| understudy_gateway::GatewayError::System {
        what: "the folder that it is started in",
        source,
    })?;
    let variables = variables(run.cluster());
    let logins = tokens(&settings.logins);
    let may_write = logins.values().any(|login| login.role >= Role::Operator);
    let followed = Followed::new(run)?;
    let writing =
        may_write.then(|| Writing::new(WriteGate::new(run, &followed), logins, &variables));
    let shown = Shown {
        variables,
        writing: writing.map(Arc::new),
        journal: run.path().join("journal.jsonl"),
        followed,
    };
    let served =
        serve_until_asked(settings.address, ready, |listener| listen(listener, settings, shown));
    Ok(served?)
}

/// The logins by the tokens of their users.
fn tokens(logins: &[Login]) -> BTreeMap<String, Login> {
    let logins = logins.iter();
    logins.map(|login| (format!("login {}", login.user), login.clone())).collect()
}

/// What is served.
struct Shown {
    variables: Vec<Variable>,
    /// Nothing where no login may write.
    writing: Option<Arc<Writing>>,
    journal: PathBuf,
    followed: Followed,
}

async fn listen(listener: TcpListener, settings: &Settings, shown: Shown) -> io::Result<()> {
    let port = listener.local_addr()?.port();
    let name = shown.followed.cluster().name().to_owned();
    let namespace = format!("urn:understudy:{name}");
    let writing = shown.writing.clone();
    let (server, handle) = server(settings, port, &namespace, writing).map_err(io::Error::other)?;
    let manager = handle.node_managers().get_of_type::<NodeManager>();
    let (Some(manager), Some(index)) = (manager, handle.get_namespace_index(&namespace)) else {
        return Err(io::Error::other("the server has no place for nodes"));
    };
    add_nodes(
        &mut manager.address_space().write(),
        index,
        &name,
        &shown.variables,
        shown.writing.is_some(),
    );
    let mut showing = Showing::new(&shown, &handle, manager, index);
    // Clients are served once there is a state.
    showing.look();
    let again = async {
        let mut looks = tokio::time::interval(LOOK);
        loop {
            looks.tick().await;
            showing.look();
        }
    };
    // The library accepts whatever calls.
    let inner = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await?;
    let address = inner.local_addr()?;
    let connections = Connections::new(MOST_CONNECTIONS, 3);
    let listener = Listener::new(listener, connections, PATIENCE);
    tokio::select! {
        ended = server.run_with(inner) => ended.map_err(io::Error::other),
        never = relay(listener, address) => match never {},
        () = again => Ok(()),
    }
}

fn server(
    settings: &Settings,
    port: u16,
    namespace: &str,
    writing: Option<Arc<Writing>>,
) -> Result<(Server, ServerHandle), String> {
    let version = env!("CARGO_PKG_VERSION");
    let product = "urn:understudy:opcua-gateway";
    let mut builder = ServerBuilder::new()
        .application_name("Understudy OPC UA gateway")
        .application_uri(settings.application_uri())
        .product_uri(product)
        .host(settings.host())
        .port(port)
        .discovery_urls(vec!["/".to_owned()])
        .build_info(BuildInfo {
            product_uri: product.into(),
            product_name: "understudy-opcua".into(),
            software_version: version.into(),
            ..Default::default()
        })
        .with_node_manager(node_manager(namespace.to_owned(), writing));
    builder = builder
        .hello_timeout(HELLO_TIMEOUT_S)
        .max_secure_channel_token_lifetime_ms(LONGEST_TOKEN_MS);
    builder.limits_mut().max_sessions = MOST_SESSIONS;
    builder.limits_mut().subscriptions.max_monitored_item_queue_size = LONGEST_QUEUE;
    let logins = tokens(&settings.logins);
    let mut users: Vec<String> = logins.keys().cloned().collect();
    if users.is_empty() {
        users.push(ANONYMOUS_USER_TOKEN_ID.to_owned());
    }
    for (token, login) in logins {
        let user = ServerUserToken::user_pass(login.user.as_str(), login.password());
        builder = builder.add_user_token(token, user);
    }
    let builder = match &settings.certificates {
        None => builder
            // No folder can be made there, so that nothing is written unasked.
            .pki_dir("/dev/null/none")
            .add_endpoint("none", ServerEndpoint::new_none("/", &users)),
        Some(folder) => {
            let (certificate, key) = certificate_and_key(std::path::Path::new(""));
            SECURE
                .iter()
                .fold(builder, |builder, (name, policy, mode)| {
                    builder.add_endpoint(*name, ServerEndpoint::new("/", *policy, *mode, &users))
                })
                .pki_dir(folder)
                .certificate_path(certificate)
                .private_key_path(key)
        }
    };
    builder.build()
}

/// The folders and variables, without values.
fn add_nodes(
    space: &mut AddressSpace,
    index: u16,
    cluster: &str,
    variables: &[Variable],
    writes: bool,
) {
    let root = NodeId::new(index, ROOT);
    ObjectBuilder::new(&root, QualifiedName::new(index, cluster), cluster)
        .is_folder()
        .event_notifier(EventNotifier::SUBSCRIBE_TO_EVENTS)
        .organized_by(ObjectId::ObjectsFolder)
        .insert(space);
    let mut made = BTreeSet::new();
    for variable in variables {
        let folders = variable.folders();
        let mut parent = root.clone();
        for depth in 1..=folders.len() {
            let path = folders[..depth].join("/");
            let folder = NodeId::new(index, path.as_str());
            if made.insert(path) {
                let name = folders[depth - 1].as_str();
                ObjectBuilder::new(&folder, QualifiedName::new(index, name), name)
                    .is_folder()
                    .organized_by(parent)
                    .insert(space);
            }
            parent = folder;
        }
        let kind = variable.kind();
        let name = variable.name();
        let node = NodeId::new(index, variable.path());
        let rank = if kind == Kind::Strings { 1 } else { -1 };
        let card = variable.card();
        let type_of = match (card.low.zip(card.high), &card.unit) {
            _ if !variable.names().is_empty() => VariableTypeId::MultiStateDiscreteType,
            (Some(_), _) => VariableTypeId::AnalogItemType,
            (None, Some(_)) => VariableTypeId::AnalogUnitType,
            (None, None) => VariableTypeId::BaseDataVariableType,
        };
        let builder = VariableBuilder::new(&node, QualifiedName::new(index, name), name)
            .description(variable.meaning())
            .data_type(kind.data_type())
            .value_rank(rank)
            .minimum_sampling_interval(LOOK.as_millis() as f64)
            .has_type_definition(type_of)
            .organized_by(parent);
        let builder = match variable.is_writable() && writes {
            true => builder.writable(),
            false => builder,
        };
        builder.insert(space);
        add_properties(space, index, &variable.path(), card);
        if !variable.names().is_empty() {
            let names = variable.names().iter().map(|name| name.as_str().into());
            let names: Vec<LocalizedText> = names.collect();
            let property = NodeId::new(index, format!("{}/EnumStrings", variable.path()));
            VariableBuilder::new(&property, QualifiedName::new(0, "EnumStrings"), "EnumStrings")
                .data_type(DataTypeId::LocalizedText)
                .value_rank(1)
                .value(Variant::from(names))
                .has_type_definition(VariableTypeId::PropertyType)
                .property_of(node)
                .insert(space);
        }
    }
}

/// Range and unit of a signal.
fn add_properties(space: &mut AddressSpace, index: u16, path: &str, card: &CardFacts) {
    let mut add = |name: &str, of: DataTypeId, value: ExtensionObject| {
        let property = NodeId::new(index, format!("{path}/{name}"));
        VariableBuilder::new(&property, QualifiedName::new(0, name), name)
            .data_type(of)
            .value(Variant::from(value))
            .has_type_definition(VariableTypeId::PropertyType)
            .property_of(NodeId::new(index, path))
            .insert(space);
    };
    if let Some((low, high)) = card.low.zip(card.high) {
        let range = ExtensionObject::from_message(Range { low, high });
        add("EURange", DataTypeId::Range, range);
    }
    if let Some(unit) = &card.unit {
        // Without a code of UNECE the name is the unit.
        let unit = EUInformation {
            unit_id: -1,
            display_name: unit.as_str().into(),
            ..EUInformation::default()
        };
        let unit = ExtensionObject::from_message(unit);
        add("EngineeringUnits", DataTypeId::EUInformation, unit);
    }
}

/// What was shown, so that only what has changed is set.
struct Showing<'a> {
    shown: &'a Shown,
    handle: &'a ServerHandle,
    manager: Arc<NodeManager>,
    index: u16,
    nodes: Vec<NodeId>,
    set: Vec<Option<Reading>>,
    service_level: Option<u8>,
}

impl<'a> Showing<'a> {
    fn new(
        shown: &'a Shown,
        handle: &'a ServerHandle,
        manager: Arc<NodeManager>,
        index: u16,
    ) -> Self {
        let variables = shown.variables.iter();
        let nodes: Vec<NodeId> =
            variables.map(|variable| NodeId::new(index, variable.path())).collect();
        Self {
            shown,
            handle,
            manager,
            index,
            set: vec![None; nodes.len()],
            service_level: None,
            nodes,
        }
    }

    /// Sets changed values and emits the events.
    fn look(&mut self) {
        // Until the journal is read, every variable waits for its first value.
        let observation = self.shown.followed.observation().ok();
        let seen = observation
            .as_deref()
            .map(|observation| Seen { observation, feed: observation.feed(Instant::now()) });
        let stamp = stamp(self.shown, seen.map_or(Feed::Silent, |seen| seen.feed));
        let mut changed = Vec::new();
        for (place, variable) in self.shown.variables.iter().enumerate() {
            let reading = seen.map_or(Reading::WAITING, |seen| variable.read(&seen));
            if self.set[place].as_ref() != Some(&reading) {
                let value = DataValue {
                    // The library leaves out the status of a value that is not there.
                    value: Some(reading.value.clone().unwrap_or(Variant::Empty)),
                    status: Some(reading.status),
                    source_timestamp: Some(stamp),
                    server_timestamp: Some(DateTime::now()),
                    ..DataValue::default()
                };
                changed.push((place, value));
                self.set[place] = Some(reading);
            }
        }
        let nodes = &self.nodes;
        let values = changed.into_iter().map(|(place, value)| (&nodes[place], None, value));
        // Every one of these nodes is there, and is a variable.
        let _ = self.manager.set_values(self.handle.subscriptions(), values);
        let level = trust::service_level(seen.map(|seen| (seen.observation, seen.feed)));
        if self.service_level.replace(level) != Some(level) {
            self.handle.set_service_level(level);
        }
        if seen.is_some() {
            let events = self.shown.followed.take_events();
            tell(self.handle, self.index, &events, stamp);
        }
    }
}

/// When what is shown was so: when the journal was written last, and for a silence now.
fn stamp(shown: &Shown, feed: Feed) -> DateTime {
    let written = fs::metadata(&shown.journal).and_then(|metadata| metadata.modified());
    let since = written
        .ok()
        .filter(|_| feed != Feed::Silent)
        .and_then(|written: SystemTime| written.duration_since(UNIX_EPOCH).ok());
    since.map_or_else(DateTime::now, |since| {
        let ticks = (since.as_secs() + SECONDS_TO_1970) * 10_000_000;
        i64::try_from(ticks + u64::from(since.subsec_nanos()) / 100)
            .map_or_else(|_| DateTime::now(), DateTime::from)
    })
}

/// Emits every event to the subscribers of the server and of the cluster.
fn tell(handle: &ServerHandle, index: u16, events: &[Event], stamp: DateTime) {
    let told: Vec<BaseEventType> = events
        .iter()
        .map(|event| {
            let number = ByteString::from(event.number.to_be_bytes().to_vec());
            let kind = ObjectTypeId::BaseEventType;
            BaseEventType::new(kind, number, message(event).as_str(), stamp)
                .set_source_node(NodeId::new(index, ROOT))
                .set_source_name(event.name.as_str().into())
                .set_severity(severity(event.level))
        })
        .collect();
    let places = [ObjectId::Server.into(), NodeId::new(index, ROOT)];
    for place in &places {
        let events = told.iter().map(|event| (event as &dyn opcua::nodes::Event, place));
        handle.subscriptions().notify_events(events);
    }
}

/// From 1 to 1000.
fn severity(level: Level) -> u16 {
    match level {
        Level::Info => 100,
        Level::Notice => 300,
        Level::Warning => 600,
        Level::Alarm => 900,
    }
}
