//! The pages of all codes: what each means, an example of it, and the way out.
//!
//! They are the files of `docs/errors`, a file for each group of codes and a section for each code:
//!
//! ```text
//! # U01: ladder programs
//! About the group; its ```sh blocks set up the folder in which each example runs.
//!
//! ## U0101: a title in lower case
//! What it means; ```toml NAME and ```text NAME blocks are files, ```sh blocks are commands, ```rust blocks are run as well.
//! ```
//!
//! The tests of the command line run each example and look for its code in the answer.

/// A file for each group, ascending.
const GROUPS: [&str; 12] = [
    include_str!("../../../docs/errors/U01.md"),
    include_str!("../../../docs/errors/U02.md"),
    include_str!("../../../docs/errors/U03.md"),
    include_str!("../../../docs/errors/U04.md"),
    include_str!("../../../docs/errors/U05.md"),
    include_str!("../../../docs/errors/U06.md"),
    include_str!("../../../docs/errors/U07.md"),
    include_str!("../../../docs/errors/U08.md"),
    include_str!("../../../docs/errors/U09.md"),
    include_str!("../../../docs/errors/U10.md"),
    include_str!("../../../docs/errors/U11.md"),
    include_str!("../../../docs/errors/U12.md"),
];

/// What is to be known about one code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Page {
    /// Such as `U0104`.
    pub code: &'static str,
    /// What it means, in a few words.
    pub title: &'static str,
    /// The rest, as Markdown.
    pub text: &'static str,
    /// The introduction of its group, as Markdown.
    pub group: &'static str,
}

/// All pages, ascending within their groups.
pub fn pages() -> impl Iterator<Item = Page> {
    GROUPS.into_iter().flat_map(|text| {
        let mut sections = text.split("\n## ");
        let group = sections.next().unwrap_or_default();
        sections.map(move |section| {
            let (heading, text) = section.split_once('\n').unwrap_or((section, ""));
            let (code, title) = heading.split_once(": ").unwrap_or((heading, ""));
            Page { code, title, text: text.trim(), group }
        })
    })
}

/// The page of `code`, whose letter may be small.
pub fn page(code: &str) -> Option<Page> {
    pages().find(|page| page.code.eq_ignore_ascii_case(code))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_code_has_one_page_in_its_group_and_in_order() {
        let all: Vec<Page> = pages().collect();
        assert!(all.len() > 200, "{}", all.len());
        for pair in all.windows(2) {
            assert!(pair[0].code < pair[1].code, "{} is before {}", pair[0].code, pair[1].code);
        }
        for page in all {
            let digits = page.code.strip_prefix('U').unwrap_or_default();
            assert!(
                digits.len() == 4 && digits.bytes().all(|byte| byte.is_ascii_digit()),
                "{}",
                page.code
            );
            let group = format!("# {}: ", &page.code[..3]);
            assert!(page.group.starts_with(&group), "{}", page.code);
            assert!(!page.title.is_empty() && !page.title.ends_with('.'), "{}", page.code);
            assert!(!page.text.is_empty(), "{}", page.code);
        }
    }

    #[test]
    fn a_page_is_found_by_its_code() {
        let found = page("u0104").map(|page| page.code);
        assert_eq!(found, Some("U0104"));
        assert_eq!(page("U9999"), None);
        assert_eq!(page(""), None);
    }
}
