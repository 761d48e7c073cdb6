//! A write as a person or a program asks for it: by the name of the input.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};

use understudy_cluster::{Cluster, InputSource, OperatorDeclaration, typed_value, value_text};
use understudy_remote_io::{OperatorInputKind, ValueMismatch};
use understudy_text::spelling::suggestion;
use understudy_typed::{Declared, Elementary};
use understudy_wire::{ForceError, Member, PointValue, Role, Write, WriteId, WriteRefusal};

/// A write as a person or a program asks for it.
#[derive(Debug, Clone, Copy)]
pub struct WriteRequest<'a> {
    /// Name of the operator input.
    pub input: &'a str,
    /// Value.
    pub value: RequestedValue<'a>,
    /// Rights of the writer, as the receiver of the request has found them.
    pub role: Role,
    /// Person or program that writes.
    pub owner: &'a str,
    /// Reason.
    pub reason: &'a str,
}

/// A requested value.
#[derive(Debug, Clone, Copy)]
pub enum RequestedValue<'a> {
    /// As a person types it.
    Text(&'a str),
    /// As the input stores it.
    Stored(u64),
    /// A whole number, as viewers have the value: of a TIME its nanoseconds.
    Number(i64),
}

/// Reason why a text is not a write.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WriteProblem {
    /// The program has no operator input of that name.
    #[error("U0640: `{member}` has no operator input `{input}`; {help}")]
    NoInput {
        /// Name of the remote I/O.
        member: String,
        /// Name in the request.
        input: String,
        /// The names that there are.
        help: String,
    },
    /// The text is not a value of the type of the input.
    #[error("U0641: invalid value `{text}` of the input `{input}`: {help}")]
    Value {
        /// Name of the input.
        input: String,
        /// Text in the request.
        text: String,
        /// What is written instead.
        help: String,
    },
    /// The value is outside the limits of the setpoint.
    #[error("U0642: the value `{text}` is outside the limits of the setpoint `{input}`: {help}")]
    Limits {
        /// Name of the input.
        input: String,
        /// Text in the request.
        text: String,
        /// The limits.
        help: String,
    },
    /// The owner or the reason is missing or too long.
    #[error("U0556: {0}")]
    Text(#[from] ForceError),
}

impl WriteProblem {
    /// Its code in the documentation of errors.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoInput { .. } => WriteRefusal::NotWritable.code(),
            Self::Value { .. } => WriteRefusal::Type.code(),
            Self::Limits { .. } => WriteRefusal::Limits.code(),
            Self::Text(_) => "U0556",
        }
    }
}

/// The first identifier of a new session.
pub(super) fn new_id() -> WriteId {
    // Different in each call of each process; it need not be secret.
    let session = RandomState::new().build_hasher().finish();
    WriteId { session, number: 1 }
}

/// A checked write, in a session of its own.
///
/// # Errors
/// [`WriteProblem`].
pub fn new_write(
    cluster: &Cluster,
    member: Member,
    request: &WriteRequest<'_>,
) -> Result<Write, WriteProblem> {
    let input = request.input;
    let remote_io = match member {
        Member::RemoteIo(program) | Member::Twin(program) => {
            cluster.remote_ios().get(program.index())
        }
        Member::Station(_) | Member::Plant(_) => None,
    };
    let sources = remote_io.map_or(&[][..], |remote_io| &remote_io.inputs);
    let found = sources.iter().find(|source| source.name == input);
    let Some(operator) = found.and_then(InputSource::operator) else {
        let names = sources.iter().filter(|source| source.operator().is_some());
        return Err(WriteProblem::NoInput {
            member: cluster.member_name(member).unwrap_or_default().to_owned(),
            input: input.chars().take(60).collect(),
            help: suggestion(input, names.map(|source| source.name.as_str())),
        });
    };
    let OperatorDeclaration { input: place, declared, .. } = operator;
    let of = declared.of;
    let requested = match request.value {
        RequestedValue::Number(nanoseconds) if of == Elementary::Time => {
            RequestedValue::Stored(nanoseconds as u64)
        }
        requested => requested,
    };
    let text = match requested {
        RequestedValue::Text(text) => text.trim().to_owned(),
        RequestedValue::Number(number) => number.to_string(),
        RequestedValue::Stored(stored) => value_text(declared, stored),
    };
    let invalid = |help: String| WriteProblem::Value {
        input: input.to_owned(),
        text: text.chars().take(60).collect(),
        help,
    };
    let stored = match requested {
        RequestedValue::Text(_) | RequestedValue::Number(_) => {
            typed_value(&text, declared).map_err(invalid)?
        }
        RequestedValue::Stored(stored) if declared.has(declared.limited(stored)) => stored,
        RequestedValue::Stored(_) => {
            return Err(invalid(format!("the input is {declared}, which does not have it")));
        }
    };
    let value = PointValue::new(of.bits(), stored);
    place.check(value).map_err(|mismatch| match mismatch {
        ValueMismatch::Type => invalid(format!("the input is {declared}")),
        ValueMismatch::Limits => WriteProblem::Limits {
            input: input.to_owned(),
            text: text.chars().take(60).collect(),
            help: limits(operator),
        },
    })?;
    let write = Write {
        id: new_id(),
        input: place.place.bit,
        value,
        role: request.role,
        owner: request.owner.to_owned(),
        reason: request.reason.to_owned(),
        points: member.sampled_program().and_then(|program| cluster.points_hash(program)),
    };
    write.check()?;
    Ok(write)
}

/// The value of a forced signal as a person types it.
///
/// # Errors
/// What is written instead for a signal of that type.
pub fn force_value(text: &str, declared: &Declared) -> Result<PointValue, String> {
    let stored = typed_value(text.trim(), declared).map_err(|help| {
        format!("invalid value `{text:.60}` of {} {declared}: {help}", declared.article())
    })?;
    Ok(PointValue::new(declared.of.bits(), stored))
}

fn limits(operator: &OperatorDeclaration) -> String {
    match operator.input.kind {
        OperatorInputKind::Setpoint { low, high } => {
            let text = |stored| value_text(&operator.declared, stored);
            format!("from {} to {}", text(low), text(high))
        }
        _ => String::new(),
    }
}
