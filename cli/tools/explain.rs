//! `understudy explain`: what a code means, with an example and the way out.

use std::fmt::Write as _;

use clap::Args;
use serde_json::json;
use understudy_diagnostic::pages::{page, pages};

use crate::answer::{Answer, Status};

/// Say what the code of an error or a warning means, with an example and the way out
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy explain U0104
  understudy explain                 all codes with their titles")]
pub(crate) struct Arguments {
    /// The code, such as U0104; without one all are listed
    #[arg(value_name = "CODE")]
    code: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let Some(code) = &arguments.code else {
        return list();
    };
    match page(code) {
        Some(page) => {
            let text = format!("{}: {}\n\n{}\n", page.code, page.title, page.text);
            let result = json!({ "code": page.code, "title": page.title, "text": page.text });
            Answer::done(text, result)
        }
        None => Answer::failed(
            Status::BadInput,
            "U0613",
            format!("there is no code {code:?}; without one, all codes are listed"),
        ),
    }
}

fn list() -> Answer {
    let mut text = String::new();
    let mut codes = Vec::new();
    for page in pages() {
        let _ = writeln!(text, "{}  {}", page.code, page.title);
        codes.push(json!({ "code": page.code, "title": page.title }));
    }
    Answer::done(text, json!({ "codes": codes }))
}
