//! Why a member does not load an online change.

use understudy_wire::{ConfigurationHash, ProgramId};

use super::Unfit;

/// Why a member does not load an online change.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ChangeError {
    /// It is one of another cluster.
    #[error("the change is one of another cluster")]
    OtherCluster,
    /// The member runs neither configuration.
    #[error("the change leads on from configuration {before}, and this member runs {own}")]
    OtherConfiguration {
        /// Configuration of the member.
        own: ConfigurationHash,
        /// Configuration that the change leads on from.
        before: ConfigurationHash,
    },
    /// The cluster has no program in the place of one of the change.
    #[error("the cluster has no program {}", .program.0)]
    NoSuchProgram {
        /// The program.
        program: ProgramId,
    },
    /// The program of the change is another one than that of the cluster file.
    #[error("the change is of another text of `{program}` than that which this member runs")]
    OtherProgram {
        /// Name of the controller.
        program: String,
    },
    /// The settings of a remote I/O do not fit the outputs of its program.
    #[error("the settings of the remote I/O of `{program}` in the change do not fit its program")]
    NoSettings {
        /// Name of the controller.
        program: String,
    },
    /// The settings of a remote I/O before the change are other ones than those of the cluster file.
    #[error(
        "the change is of other settings of the remote I/O of `{program}` than those that this member has"
    )]
    OtherSettings {
        /// Name of the controller.
        program: String,
    },
    /// The texts do not make the configuration that they are said to make.
    #[error(
        "these texts do not make configuration {claimed} of the cluster file that this member runs"
    )]
    NotItsResult {
        /// That configuration.
        claimed: ConfigurationHash,
    },
    /// A text is not the program that its hash names.
    #[error("`{file}` is read as another program here: this release differs from that of the tool")]
    Unreadable {
        /// File of the text.
        file: String,
    },
    /// A program cannot be replaced while it runs.
    #[error(transparent)]
    Unfit(#[from] Unfit),
}
