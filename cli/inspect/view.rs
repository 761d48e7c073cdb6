//! Shared by the commands that inspect a run.

use understudy_view::ViewError;

use crate::answer::{Answer, Status};

/// The newest run, the default.
pub(crate) const RUN: &str = "runs/latest";

impl From<ViewError> for Answer {
    fn from(error: ViewError) -> Self {
        several(&[error])
    }
}

/// Failure with several errors.
pub(crate) fn several(errors: &[ViewError]) -> Answer {
    let mut answer = Answer::done("", ()).with_status(Status::BadInput);
    for error in errors {
        if let ViewError::Kept(understudy_journal::KeptError::Files { reports }) = error {
            answer.reports.extend(reports.iter().cloned());
        }
        answer = answer.and_failure(Status::BadInput, error.code(), error);
    }
    answer
}
