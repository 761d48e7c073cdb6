//! The operator's end of the channel.

use std::borrow::Cow;
use std::io;
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use serde_json::json;
use understudy_wire::{
    ChangeRequest, ClusterHash, ConfigurationHash, Force, Role, StateChoice, Unforce, Write,
};
use zenoh::Wait;

use crate::channel::{
    ATTENDANCE_KEY, Gaps, Head, JOURNAL_KEY, REFUSED_KEY, Reporter, SPARE_KEY, SpareReport,
    TlsKeys, WRITE_KEYS, endpoint, hash_key, insert, prefix, tls_config, told_below,
};
use crate::error::{BusError, reason};
use crate::refused_orders::RefusedOrder;

/// Longer than it takes a member on a network that works.
const PATIENCE: Duration = Duration::from_secs(5);

/// Time limit for a connection to an address that does not answer.
const REACH: Duration = Duration::from_secs(2);

/// A member that is followed tells its lines more often, twice a second at least: without any for this time it is not received.
const SILENT_AFTER: Duration = Duration::from_secs(2);

/// Lines of a journal that wait to be taken.
const WAITING_LINES: usize = 4096;

/// What can be asked of a member.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Request {
    /// The hash of its configuration, also where the caller has another one.
    Cluster,
    /// The canonical text of its configuration.
    Configuration,
    /// What it said when it was ready, as JSON.
    Status,
    /// To release the outputs of a program that was started cold.
    Release,
    /// To continue a program whose state is lost from the chosen state.
    Choose(StateChoice),
    /// To put a value in the place of a signal of a remote I/O.
    Force(Force),
    /// To take it back.
    Unforce(Unforce),
    /// To write a value; the caller asks under its own role.
    Write(Write),
    /// To record an order that was refused before it was sent.
    Refused(RefusedOrder),
    /// To load an online change from these texts, as JSON.
    Prepare(String),
    /// To take a step of an online change.
    Change(ChangeRequest),
    /// Records where a spare is.
    Spare(SpareReport),
    /// To end.
    Stop,
}

impl Request {
    fn key(&self) -> &'static str {
        match self {
            Self::Cluster => "cluster",
            Self::Configuration => "configuration",
            Self::Status => "status",
            Self::Release => "command/release",
            Self::Choose(_) => "command/choose",
            Self::Force(_) => "command/force",
            Self::Unforce(_) => "command/unforce",
            Self::Write(write) if write.role >= Role::Engineer => WRITE_KEYS[1].1,
            Self::Write(_) => WRITE_KEYS[0].1,
            Self::Refused(_) => REFUSED_KEY,
            Self::Spare(_) => SPARE_KEY,
            Self::Prepare(_) => "command/prepare",
            Self::Change(_) => "command/change",
            Self::Stop => "command/stop",
        }
    }

    /// Where it is asked for, below the keys of a member.
    fn place(&self) -> Cow<'static, str> {
        match self {
            // A spare reports under the name in its certificate.
            Self::Spare(report) => format!("{SPARE_KEY}/{}", report.spare).into(),
            _ => self.key().into(),
        }
    }

    /// Whether it means signals or states of a program: a member with another configuration would take it for others.
    fn is_of_configuration(&self) -> bool {
        let is_of_all = matches!(self, Self::Stop | Self::Prepare(_) | Self::Change(_));
        matches!(self, Self::Write(_)) || self.is_command() && !is_of_all
    }

    /// Whether it is answered by [`DONE`](crate::DONE), or with the reason why it is not done.
    pub fn is_command(&self) -> bool {
        self.key().starts_with("command/") && !matches!(self, Self::Write(_))
    }

    /// How long its answer may take.
    fn patience(&self) -> Duration {
        // Programs are read and compiled before.
        if matches!(self, Self::Prepare(_)) { PATIENCE * 12 } else { PATIENCE }
    }

    /// What it comes with.
    fn payload(&self) -> String {
        let text = match self {
            Self::Choose(choice) => serde_json::to_string(choice),
            Self::Force(force) => serde_json::to_string(force),
            Self::Unforce(unforce) => serde_json::to_string(unforce),
            Self::Write(write) => serde_json::to_string(write),
            Self::Refused(order) => serde_json::to_string(&order.clone().bounded()),
            Self::Spare(report) => serde_json::to_string(report),
            Self::Change(request) => serde_json::to_string(request),
            Self::Prepare(texts) => return texts.clone(),
            _ => return String::new(),
        };
        text.unwrap_or_default()
    }
}

/// What comes of a journal that is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Told<'a> {
    /// The process that tells the lines that follow; nothing where an older version does.
    By(Option<&'a Reporter>),
    /// A line.
    Line(&'a str),
    /// So many lines were lost on their way: they are in the journal of the member itself.
    Lost(u64),
    /// Nothing was received for 2 s, although a member that is followed tells its lines twice a second at least.
    Silent,
}

/// How long nothing was received from a member.
#[derive(Debug, Default)]
struct Silence {
    lasted: Duration,
}

/// What follows from a silence.
#[derive(Debug, PartialEq, Eq)]
enum Meaning {
    /// It may be a pause.
    Nothing,
    /// The member is not received.
    IsSilent,
    /// The connection is given up.
    IsOver,
}

impl Silence {
    /// How long the next line is waited for.
    fn wait(&self, patience: Duration) -> Duration {
        let until = if self.lasted < SILENT_AFTER { SILENT_AFTER.min(patience) } else { patience };
        until.saturating_sub(self.lasted)
    }

    /// Nothing was received while the next line was waited for.
    fn lasts(&mut self, patience: Duration) -> Meaning {
        let before = self.lasted;
        self.lasted += self.wait(patience);
        if self.lasted >= patience {
            Meaning::IsOver
        } else if before < SILENT_AFTER && self.lasted >= SILENT_AFTER {
            Meaning::IsSilent
        } else {
            Meaning::Nothing
        }
    }
}

/// A call to one member.
pub struct Call {
    session: zenoh::Session,
    prefix: String,
    address: SocketAddr,
    name: String,
    /// Configuration that orders are for.
    configuration: Option<ConfigurationHash>,
}

impl Call {
    /// The same call, whose orders are for this configuration: a member with another one takes none.
    #[must_use]
    pub fn with_configuration(mut self, configuration: ConfigurationHash) -> Self {
        self.configuration = Some(configuration);
        self
    }

    /// Calls the member `name` of a cluster, which listens at `address`.
    ///
    /// # Errors
    /// [`BusError::ClockOutside`] where its own certificate does not count now, [`BusError::Uncalled`] where nobody is there, or one side does not believe the other's certificate.
    pub fn to(
        address: SocketAddr,
        cluster: ClusterHash,
        name: &str,
        keys: &TlsKeys,
    ) -> Result<Self, BusError> {
        let uncalled = |error: zenoh::Error| BusError::Uncalled {
            name: name.to_owned(),
            address,
            reason: reason(&error),
        };
        if let Some(reason) = keys.validity.reason() {
            return Err(BusError::ClockOutside { address, reason });
        }
        let config = || -> zenoh::Result<zenoh::Config> {
            let mut config = tls_config("client", keys)?;
            insert(&mut config, "connect/endpoints", &json!([endpoint(address)]))?;
            insert(&mut config, "connect/timeout_ms", &json!(PATIENCE.as_millis() as u64))?;
            insert(&mut config, "connect/exit_on_failure", &json!(true))?;
            Ok(config)
        };
        let session = zenoh::open(config().map_err(uncalled)?).wait();
        Ok(Self {
            session: session.map_err(|error| BusError::Uncalled {
                name: name.to_owned(),
                address,
                reason: not_opened(address, &error),
            })?,
            prefix: prefix(cluster, name),
            address,
            name: name.to_owned(),
            configuration: None,
        })
    }

    /// Asks, and waits for the answer.
    ///
    /// # Errors
    /// [`BusError::Unanswered`] where this certificate is not admitted to what was asked, [`BusError::AnswerLost`] where
    /// the answer does not arrive and what was asked may be done.
    ///
    /// A connection that is lost and opened anew in the middle looks as if the member had not admitted the question. A write, which has one effect
    /// however often it is asked for, is asked for again before it is called refused.
    pub fn ask(&self, request: &Request) -> Result<String, BusError> {
        match (self.ask_once(request), request) {
            (Err(BusError::Unanswered { .. }), Request::Write(_)) => self.ask_once(request),
            (answer, _) => answer,
        }
    }

    fn ask_once(&self, request: &Request) -> Result<String, BusError> {
        let unanswered = || BusError::Unanswered {
            name: self.name.clone(),
            address: self.address,
            request: request.key(),
        };
        let replies = self
            .session
            .get(match request {
                Request::Cluster => hash_key(&self.name),
                _ => format!("{}/{}", self.prefix, request.place()),
            })
            .payload(request.payload())
            .attachment(
                self.configuration
                    .filter(|_| request.is_of_configuration())
                    .map(|configuration| configuration.to_string()),
            )
            .timeout(request.patience())
            .wait()
            .map_err(|_| unanswered())?;
        let mut is_late = false;
        while let Ok(reply) = replies.recv() {
            match reply.result() {
                Ok(sample) => {
                    let text = sample.payload().try_to_string();
                    return text.map(String::from).map_err(|_| unanswered());
                }
                // Members answer with samples only, so this is the time limit of Zenoh.
                Err(_) => is_late = true,
            }
        }
        // A member that does not admit the question ends it at once, over a connection that stays.
        if is_late || !self.is_connected() {
            return Err(BusError::AnswerLost {
                name: self.name.clone(),
                address: self.address,
                request: request.key(),
            });
        }
        Err(unanswered())
    }

    /// Sends a request without waiting for its answer; whether it was sent.
    pub fn tell(&self, request: &Request) -> bool {
        let asked = self.session.get(format!("{}/{}", self.prefix, request.place()));
        // Without its receiver the answer is dropped.
        asked.payload(request.payload()).timeout(PATIENCE).wait().is_ok()
    }

    fn is_connected(&self) -> bool {
        let info = self.session.info();
        info.routers_zid().wait().next().is_some() || info.peers_zid().wait().next().is_some()
    }

    /// Gives each line of the member's journal to `take`, with who tells it, what was lost on the way and when nothing is received, until that says
    /// false, or `patience` passes without a line.
    ///
    /// # Errors
    /// [`BusError::Unanswered`] where the journal cannot be followed.
    pub fn follow(
        &self,
        patience: Duration,
        take: impl FnMut(Told<'_>) -> bool,
    ) -> Result<(), BusError> {
        self.follow_key(JOURNAL_KEY, patience, take)
    }

    /// The same for the lines that tell which stations a remote I/O misses.
    ///
    /// # Errors
    /// [`BusError::Unanswered`] where they cannot be followed.
    pub fn follow_attendance(
        &self,
        patience: Duration,
        take: impl FnMut(Told<'_>) -> bool,
    ) -> Result<(), BusError> {
        self.follow_key(ATTENDANCE_KEY, patience, take)
    }

    fn follow_key(
        &self,
        key: &'static str,
        patience: Duration,
        mut take: impl FnMut(Told<'_>) -> bool,
    ) -> Result<(), BusError> {
        let unanswered = || BusError::Unanswered {
            name: self.name.clone(),
            address: self.address,
            request: key,
        };
        let subscriber = self
            .session
            .declare_subscriber(told_below(&self.prefix, key))
            .with(zenoh::handlers::FifoChannel::new(WAITING_LINES))
            .wait()
            .map_err(|_| unanswered())?;
        let (mut gaps, mut silence) = (Gaps::default(), Silence::default());
        loop {
            match subscriber.recv_timeout(silence.wait(patience)) {
                Ok(Some(sample)) => {
                    silence = Silence::default();
                    let bytes = sample.payload().to_bytes();
                    if !tell(&String::from_utf8_lossy(&bytes), &mut gaps, &mut take) {
                        return Ok(());
                    }
                }
                Ok(None) => match silence.lasts(patience) {
                    Meaning::Nothing => {}
                    Meaning::IsSilent if take(Told::Silent) => {}
                    Meaning::IsSilent => return Ok(()),
                    Meaning::IsOver => return Err(unanswered()),
                },
                Err(_) => return Err(unanswered()),
            }
        }
    }
}

/// Gives what was told at once to `take`, until that says false.
fn tell(text: &str, gaps: &mut Gaps, take: &mut impl FnMut(Told<'_>) -> bool) -> bool {
    let mut lines = text.lines();
    let mut rest = lines.clone();
    let head = rest.next().and_then(Head::of_line);
    if head.is_some() {
        lines = rest;
    }
    if !take(Told::By(head.as_ref().and_then(|head| head.reporter.as_ref()))) {
        return false;
    }
    let lost = head.map_or(0, |head| gaps.before(head.lines));
    (lost == 0 || take(Told::Lost(lost))) && lines.all(|line| take(Told::Line(line)))
}

/// Why no TLS connection to an address is opened. Zenoh says the same of a machine that is not there, of a key that is not accepted and of a clock
/// that is wrong.
pub(crate) fn not_opened(address: SocketAddr, error: &zenoh::Error) -> String {
    tracing::debug!(%error, %address, "no TLS connection");
    match TcpStream::connect_timeout(&address, REACH) {
        Ok(_) => "it listens there, and no TLS connection was opened: it has just started or is busy, or, if this lasts, one side refuses the certificate of \
                  the other: that is of another authority or revoked, or the clock of one machine is outside its validity; compare `date -u` on both machines with \
                  `understudy keys list`"
            .to_owned(),
        Err(source) => match source.kind() {
            io::ErrorKind::ConnectionRefused => "nothing listens there".to_owned(),
            io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => {
                "no answer from that address".to_owned()
            }
            _ => source.to_string(),
        },
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        if let Err(error) = self.session.close().wait() {
            tracing::debug!(%error, "a call was not closed");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A silence is told once, before the connection is given up.
    #[test]
    fn a_silence_is_told_long_before_the_connection_is_given_up() {
        let found = |patience| {
            let mut silence = Silence::default();
            let mut found = Vec::new();
            while found.last().is_none_or(|(_, meaning)| *meaning != Meaning::IsOver) {
                let meaning = silence.lasts(patience);
                found.push((silence.lasted, meaning));
            }
            found
        };
        let patience = SILENT_AFTER + Duration::from_secs(3);
        let expected = [(SILENT_AFTER, Meaning::IsSilent), (patience, Meaning::IsOver)];
        assert_eq!(found(patience), expected);
        for short in [Duration::from_millis(1), SILENT_AFTER] {
            assert_eq!(found(short), [(short, Meaning::IsOver)]);
        }
    }
}
