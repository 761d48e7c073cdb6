//! The keys of a cluster: one authority makes them, and each member has a folder of its own with what it needs and no more.
//!
//! ```text
//! keys/                       0700
//!   authority/                0700   stays where keys are issued; whoever has it can be everybody
//!     certificate.pem         0600   of the authority, self-signed
//!     private-key.pem         0600
//!     cluster-secret          0600   what all frame keys are derived from, hexadecimal
//!     register.toml           0600   who was issued what, until when, and whether it was revoked
//!   members/                  0700
//!     robot/                  0700   goes to the machine of `robot`
//!       authority.pem         0600   the certificate alone
//!       certificate.pem       0600   CN = robot.1: its name and its generation
//!       private-key.pem       0600
//!       keys.toml             0600   its own frame key, those of the senders that it hears, those of the states that it gives and takes
//!       revoked.toml          0600   whose keys no longer count; read again while the member runs
//!       life                  0600   written by the member: how often it started
//! ```
//!
//! Invariants: a file with a secret in it is never readable by anybody else, not even while it is written; a member has no key that it
//! does not need; keys of a new generation share nothing with those of the last one; a life is never used twice.
//!
//! | code | what is wrong |
//! |---|---|
//! | U0901 | a file cannot be read |
//! | U0902 | a file cannot be written |
//! | U0903 | others than the owner may read a secret |
//! | U0904 | there is an authority already |
//! | U0905 | there is no authority |
//! | U0906 | a file that is not as it was written |
//! | U0907 | nobody has this name |
//! | U0908 | a certificate that has expired |
//! | U0909 | keys that were revoked |
//! | U0910 | keys of another cluster, or of another member |
//! | U0911 | no key for a member that is to be heard |
//! | U0912 | the certificate cannot be made |
//! | U0913 | keys that are revoked already |
//! | U0914 | a certificate that is not valid yet, by the clock of the machine |

mod authority;
mod certificate;
mod date;
mod error;
mod files;
mod member;
mod register;
mod revoked;

pub use authority::{Authority, DEFAULT_PERSON, Issued, People};
pub use date::Date;
pub use error::KeysError;
pub use member::{MemberKeys, OperatorKeys, TlsFiles, Validity, authority_of};
pub use register::{Holder, Register, Revoked, Role};
pub use revoked::RevocationWatch;
