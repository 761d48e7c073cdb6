//! Sources of applied outputs in words.

use understudy_wire::Source;

/// All sources, in the order of their worth.
pub const SOURCES: [Source; 4] =
    [Source::Direct, Source::Reconstructed, Source::Held, Source::FailSafe];

/// A source as files and tables write it.
pub fn source_word(source: Source) -> &'static str {
    match source {
        Source::Direct => "direct",
        Source::Reconstructed => "reconstructed",
        Source::Held => "held",
        Source::FailSafe => "fail-safe",
    }
}
