//! What a member answers to the requests of operators.

use understudy_wire::Configurations;
use zenoh::Wait;
use zenoh::query::{Query, Queryable};

use super::{DONE, ORDER_PATIENCE};
use crate::changes::Changes;
use crate::control::{LINE_BYTES, order};
use crate::orders::{Control, Order, Unknown};

/// The answer to a command.
pub(crate) fn given(control: &Control, order: Order) -> String {
    match control.ask(order, ORDER_PATIENCE) {
        Ok(Some(Ok(()))) => DONE.to_owned(),
        Ok(Some(Err(refusal))) => format!("{}: {refusal}", refusal.code()),
        Ok(None) => "U0554: this member cannot do that: it is for remote I/Os".to_owned(),
        Err(Unknown::Full) => {
            "U0557: too many commands wait at this member; repeat the command".to_owned()
        }
        Err(Unknown::Late) => {
            "U0581: the member does not answer: the command may be done; ask for its state"
                .to_owned()
        }
    }
}

/// Whether an order is for this configuration, where its sender says one: the signals of another one are others.
pub(super) fn of_configuration(query: &Query, changes: &Changes) -> Result<(), String> {
    let theirs = query.attachment().map(|theirs| theirs.to_bytes());
    match theirs.map(|theirs| String::from_utf8_lossy(&theirs).into_owned()) {
        Some(theirs) if !changes.admits(&theirs) => Err(format!(
            "U0563: this member runs configuration {}, and the order is for configuration {theirs:.32}: take the file that it runs",
            changes.configurations().own
        )),
        _ => Ok(()),
    }
}

/// The configurations of a member, as it tells them to a caller who may have another one.
pub(super) fn hashes(Configurations { own, prepared }: Configurations) -> String {
    prepared.map_or_else(|| own.to_string(), |prepared| format!("{own} {prepared}"))
}

/// A command that comes with a value.
pub(super) fn with_value(word: &str, query: &Query) -> Result<Order, String> {
    let bytes = query.payload().map(|payload| payload.to_bytes());
    let bytes = bytes.unwrap_or_default();
    let line = format!("{word} {}", String::from_utf8_lossy(&bytes));
    if line.len() > LINE_BYTES {
        return Err(format!("more than {LINE_BYTES} bytes"));
    }
    order(&line).ok_or_else(|| format!("invalid command `{line:.200}`"))
}

pub(super) fn answer(
    session: &zenoh::Session,
    key: String,
    say: impl Fn(&Query) -> String + Send + Sync + 'static,
) -> zenoh::Result<Queryable<()>> {
    session
        .declare_queryable(key.clone())
        .callback(move |query: Query| {
            // A key for many names is answered under the one that was asked for.
            let asked = query.key_expr().as_str();
            let answered = if key.contains('*') { asked.to_owned() } else { key.clone() };
            if let Err(error) = query.reply(answered, say(&query)).wait() {
                tracing::debug!(%error, "an answer was not sent");
            }
        })
        .wait()
}
