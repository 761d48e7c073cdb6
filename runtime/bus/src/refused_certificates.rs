//! Certificates of callers that the TLS listener of a member refuses. Zenoh reports them to `tracing` alone, and the far end learns no reason.

use std::fmt::{Debug, Write as _};
use std::sync::{Mutex, PoisonError};

use time::OffsetDateTime;
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::{Event, Subscriber};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::{Context, Layer};
use tracing_subscriber::registry::LookupSpan;

/// Crate that accepts TLS connections.
const TARGET: &str = "zenoh_link_tls";

/// Characters of a reason that are kept.
const REASON_LENGTH: usize = 300;

/// Certificates refused since they were taken last.
static REFUSED: Mutex<Option<RefusedCertificates>> = Mutex::new(None);

/// Certificates of callers that were refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RefusedCertificates {
    /// Their number.
    pub(crate) connections: u64,
    /// Why the last one was refused, with dates in place of seconds.
    pub(crate) reason: String,
}

/// Certificates that were refused since this was last asked.
pub(crate) fn take() -> Option<RefusedCertificates> {
    REFUSED.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// Notes each refused certificate.
pub(crate) fn layer<S>() -> impl Layer<S>
where
    S: Subscriber + for<'span> LookupSpan<'span>,
{
    Noting.with_filter(Targets::new().with_target(TARGET, LevelFilter::WARN))
}

struct Noting;

impl<S: Subscriber> Layer<S> for Noting {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut message = Message::default();
        event.record(&mut message);
        if let Some(reason) = reason(&message.0) {
            let mut refused = REFUSED.lock().unwrap_or_else(PoisonError::into_inner);
            let connections = refused.take().map_or(0, |refused| refused.connections) + 1;
            *refused = Some(RefusedCertificates { connections, reason });
        }
    }
}

/// The message of an event.
#[derive(Default)]
struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            // A string takes everything.
            let _ = write!(self.0, "{value:?}");
        }
    }
}

/// The reason of a refusal in a message about a certificate; without the hint on open files, which is that of another error.
fn reason(message: &str) -> Option<String> {
    let reason = message.split(". Hint:").next().unwrap_or(message);
    let is_of_certificate = reason.to_ascii_lowercase().contains("certificate");
    is_of_certificate.then(|| dated(reason).chars().take(REASON_LENGTH).collect())
}

/// The same with dates in place of seconds since 1970.
fn dated(reason: &str) -> String {
    let reason = reason.replace(" (UNIX)", "");
    let words = reason.split(' ').map(|word| {
        let digits = word.trim_end_matches([',', '.']);
        // Shorter numbers are spans of time.
        let seconds = digits.parse().ok().filter(|_| digits.len() >= 9);
        seconds.and_then(date).map_or_else(|| word.to_owned(), |date| word.replace(digits, &date))
    });
    words.collect::<Vec<_>>().join(" ")
}

/// `2026-11-26T17:00:00Z`; nothing beyond the calendar.
fn date(seconds: i64) -> Option<String> {
    let time = OffsetDateTime::from_unix_timestamp(seconds).ok()?;
    let (date, (hour, minute, second)) = (time.date(), time.to_hms());
    Some(format!("{date}T{hour:02}:{minute:02}:{second:02}Z"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_has_both_times_as_dates() {
        let message = "invalid peer certificate: certificate expired: verification time 1795712345 (UNIX), but certificate is not valid after 1709210096 (86502249 seconds ago). Hint: increase the system open file limit.";
        let said = "invalid peer certificate: certificate expired: verification time 2026-11-26T16:59:05Z, but certificate is not valid after 2024-02-29T12:34:56Z (86502249 seconds ago)";
        assert_eq!(reason(message).as_deref(), Some(said));
        assert_eq!(reason("Too many open files (os error 24). Hint: increase it."), None);
        assert_eq!(date(0).as_deref(), Some("1970-01-01T00:00:00Z"));
        assert_eq!(date(951_782_399).as_deref(), Some("2000-02-28T23:59:59Z"));
        assert_eq!(date(951_868_800).as_deref(), Some("2000-03-01T00:00:00Z"));
    }
}
