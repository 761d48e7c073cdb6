//! `understudy explain`: descriptions of error and warning codes.

use std::fmt::Write as _;

use clap::Args;
use serde_json::json;
use understudy_text::pages::{page, pages};

use crate::answer::{Answer, Status};

/// Describe an error or warning code, with an example and the fix
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy explain U0104
  understudy explain                 all codes with their titles")]
pub(crate) struct Arguments {
    /// Code, such as U0104; default: list all codes
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
            format!("unknown code {code:?}; `understudy explain` lists all codes"),
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
