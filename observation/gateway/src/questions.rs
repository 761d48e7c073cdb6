//! Writes as questions in JSON, for the key `write` of the mirror. The documents are described in `docs/reference/zenoh-keys.md`.

use serde::Deserialize;
use serde_json::{Value, json};
use understudy_bus::Question;
use understudy_journal::{Refusal, RequestedValue, WriteRequest};
use understudy_wire::{Role, WriteId, WriteRefusal};

use crate::writing::WriteGate;

/// A write in JSON.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    /// Identifier of a caller that repeats a question until it has the answer.
    #[serde(default)]
    id: Option<WriteId>,
    /// Remote I/O.
    name: String,
    /// Operator input.
    input: String,
    /// A number, of a TIME its nanoseconds, true or false, or a text as a person types it.
    value: Value,
    owner: String,
    reason: String,
}

/// Writes what a question asks for, and answers it.
pub(crate) async fn write(gate: &WriteGate, question: Question) {
    let answer = answer(gate, &question.text).await;
    question.answer(&answer.to_string());
}

/// The answer for which no write was sent, because too many are under way.
pub(crate) fn busy() -> Value {
    let refusal = WriteRefusal::Busy;
    outcome(&Err(Refusal::Write { refusal }))
}

async fn answer(gate: &WriteGate, text: &str) -> Value {
    outcome(&done(gate, text).await)
}

async fn done(gate: &WriteGate, text: &str) -> Result<u64, Refusal> {
    let asked: Asked = serde_json::from_str(text)
        .map_err(|error| Refusal::Said(format!("U0556: invalid question: {error}")))?;
    let member = gate.cluster().member(&asked.name);
    let member = member.ok_or_else(|| {
        let name: String = asked.name.chars().take(60).collect();
        let refusal = Refusal::Said(format!("U0640: the cluster has no remote I/O `{name}`"));
        gate.refuse(&asked.name, &asked.input, &asked.owner, &asked.reason, &refusal);
        refusal
    })?;
    let text = match &asked.value {
        Value::String(text) => text.clone(),
        value => value.to_string(),
    };
    let number = asked.value.as_i64().map(RequestedValue::Number);
    let request = WriteRequest {
        input: &asked.input,
        value: number.unwrap_or(RequestedValue::Text(&text)),
        role: Role::Operator,
        owner: &asked.owner,
        reason: &asked.reason,
    };
    let write = gate.check(member, &request)?;
    gate.send(member, write, asked.id).await
}

fn outcome(done: &Result<u64, Refusal>) -> Value {
    let refusal = match done {
        Ok(cycle) => return json!({ "outcome": "in-effect", "cycle": cycle }),
        Err(refusal) => refusal,
    };
    let word = match refusal.is_undecided() {
        true => "undecided",
        false => "refused",
    };
    let (code, text) = (refusal.code(), refusal.to_string());
    let message = text.strip_prefix(&format!("{code}: ")).unwrap_or(&text);
    json!({ "outcome": word, "code": code, "message": message })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outcome_is_flat_json() {
        let check = |done: Result<u64, Refusal>, expected: Value| {
            assert_eq!(outcome(&done), expected, "{done:?}");
        };
        check(Ok(7), json!({ "outcome": "in-effect", "cycle": 7 }));
        let text = "the value is outside the limits of the setpoint";
        let limits = Refusal::Write { refusal: WriteRefusal::Limits };
        check(Err(limits), json!({ "outcome": "refused", "code": "U0642", "message": text }));
        let undecided = outcome(&Err(Refusal::Undecided));
        assert_eq!(undecided["outcome"], "undecided");
        assert_eq!(undecided["code"], "U0648");
    }
}
