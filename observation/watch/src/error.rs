//! Errors of the page and of its requests.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::json;
use understudy_view::{Reading, ViewError};

/// Why the page cannot be served. The codes are stable.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// The address cannot be listened at.
    #[error(
        "U0671: cannot serve the page at {address}: {source}; choose another address (port 0 takes any free port)"
    )]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system said.
        source: io::Error,
    },
    /// The certificate or its key cannot be used.
    #[error("U0672: cannot use the certificate of the page: {0}")]
    Certificate(String),
    /// The file of logins cannot be used.
    #[error("U0673: {}: {reason}", path.display())]
    Logins {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The address can be reached from other machines, and there are no logins.
    #[error(
        "U0674: {0} can be reached from other machines: add logins (--logins FILE), or serve the page at 127.0.0.1"
    )]
    NoLogins(SocketAddr),
    /// The system refused something else.
    #[error("U0675: {what}: {source}")]
    System {
        /// What was wanted.
        what: &'static str,
        /// What the system said.
        source: io::Error,
    },
}

impl WatchError {
    /// The code alone.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Listen { .. } => "U0671",
            Self::Certificate(_) => "U0672",
            Self::Logins { .. } => "U0673",
            Self::NoLogins(_) => "U0674",
            Self::System { .. } => "U0675",
        }
    }
}

/// The answer to a request that cannot be done: a status, a stable code, and a sentence for people.
#[derive(Debug)]
pub(crate) struct Problem {
    status: StatusCode,
    code: String,
    message: String,
}

impl Problem {
    fn new(status: StatusCode, code: &str, message: impl Into<String>) -> Self {
        Self { status, code: code.to_owned(), message: message.into() }
    }

    /// The run cannot answer the question.
    pub(crate) fn of_view(error: &ViewError) -> Self {
        Self::new(StatusCode::NOT_FOUND, error.code(), error.words())
    }

    /// A value or a name in a command is invalid.
    pub(crate) fn invalid(code: &str, message: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, code, message)
    }

    /// Code and message, as records have them.
    pub(crate) fn words(&self) -> String {
        format!("{}: {}", self.code, self.message)
    }

    /// The laboratory refused a command; its text begins with the code.
    pub(crate) fn refused(words: &str) -> Self {
        let (code, message) = words.split_once(": ").unwrap_or(("U0682", words));
        Self::new(StatusCode::CONFLICT, code, message)
    }
}

/// Constructors of problems: name, status and code.
macro_rules! problems {
    ($($(#[$meaning:meta])* $name:ident $status:ident $code:literal;)*) => {
        impl Problem {
            $($(#[$meaning])*
            pub(crate) fn $name(message: impl Into<String>) -> Self {
                Self::new(StatusCode::$status, $code, message)
            })*
        }
    };
}

problems! {
    /// Unknown name.
    unknown NOT_FOUND "U0681";
    /// Malformed request.
    bad BAD_REQUEST "U0682";
    /// Wrong method.
    wrong_method METHOD_NOT_ALLOWED "U0682";
    /// The journal does not contain it.
    unrecorded NOT_FOUND "U0683";
    /// The page or the person is not allowed to do this.
    forbidden FORBIDDEN "U0684";
    /// The request comes from another page.
    foreign FORBIDDEN "U0685";
    /// The journal is being read.
    reading SERVICE_UNAVAILABLE "U0688";
    /// Login required.
    log_in UNAUTHORIZED "U0686";
    /// Too many requests at once.
    too_many SERVICE_UNAVAILABLE "U0687";
}

impl From<Reading> for Problem {
    /// What is known so far is the past.
    fn from(reading: Reading) -> Self {
        Self::reading(reading.to_string())
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let body = json!({ "error": { "code": self.code, "message": self.message } });
        (self.status, Json(body)).into_response()
    }
}
