//! What the commands that look at a run have in common.

use understudy_view::ViewError;

use crate::answer::{Answer, Status};

/// The newest run, where nobody names one.
pub(crate) const RUN: &str = "runs/latest";

/// A question that has no answer.
pub(crate) fn refused(error: &ViewError) -> Answer {
    several(std::slice::from_ref(error))
}

/// All that is wrong with it.
pub(crate) fn several(errors: &[ViewError]) -> Answer {
    let mut answer = Answer::done("", ()).with_status(Status::BadInput);
    for error in errors {
        if let ViewError::Kept(understudy_journal::KeptError::Files { reports }) = error {
            answer.reports.extend(reports.iter().cloned());
        }
        answer = answer.and_failure(Status::BadInput, error.code(), error.to_string());
    }
    answer
}
