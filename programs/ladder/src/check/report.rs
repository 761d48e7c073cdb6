//! What becomes of the reads, writes and undefined names that the check has met.

use understudy_text::Diagnostic;
use understudy_text::spelling;

use super::{Checker, Role, Symbol};

/// Misspelt names for which the nearest known one is searched; past it a text is wrong as a whole.
const MAXIMUM_SUGGESTIONS: usize = 50;

impl Checker<'_> {
    pub(super) fn report_undefined(&mut self) {
        for (count, (name, places)) in self.undefined.iter().enumerate() {
            let mut diagnostic =
                Diagnostic::error("U0104", format!("nothing is called `{name}`"), name.span());
            for place in places.iter().skip(1).take(3) {
                diagnostic = diagnostic.with_related(place.clone(), "and here");
            }
            let block = self.blocks.get(name.as_str()).or_else(|| {
                let (block, _) = name.rsplit_once('.')?;
                self.blocks.get(block)
            });
            let signals = self.places.keys().map(String::as_str);
            let names = signals.chain(self.blocks.keys().copied());
            let timing =
                block.filter(|block| block.kind.preset_time().is_some() && name.ends_with(".TT"));
            diagnostic = if let Some(timer) = timing {
                diagnostic.with_help(format!(
                    "a timer here has no timing bit: write its power into a memory bit above it, and read that bit with `/{0}.Q` for TON or \
                     the closed bit with `{0}.Q` for TOF",
                    timer.name
                ))
            } else if let Some(block) = block {
                let outputs: Vec<String> = block
                    .kind
                    .outputs()
                    .iter()
                    .map(|pin| format!("`{}.{pin}`", block.name))
                    .collect();
                diagnostic.with_help(format!(
                    "the {} `{}` is read as {}",
                    block.kind.word(),
                    block.name,
                    outputs.join(" or ")
                ))
            } else if count >= MAXIMUM_SUGGESTIONS {
                diagnostic
            } else if let Some(help) = spelling::question(name, names) {
                diagnostic.with_help(help)
            } else {
                diagnostic.with_help(format!("declare it, such as `input {name}`"))
            };
            self.diagnostics.push(diagnostic);
        }
    }

    pub(super) fn report_use(&mut self) {
        for symbol in &self.symbols {
            if symbol.role == Role::Pin {
                continue;
            }
            let warning = |code, message: &str| {
                let message = format!("{} `{}` {message}", symbol.role.words(), symbol.name);
                Diagnostic::warning(code, message, symbol.name.span())
            };
            let written = !symbol.writes.is_empty();
            let found = match (symbol.role, &symbol.read, written) {
                (Role::Input, None, _) => Some(warning("U0151", "is not used")),
                (Role::Memory, None, false) => Some(warning("U0151", "is not used")),
                (Role::Memory, None, true) => Some(warning("U0151", "is written and never read")),
                (Role::Output, _, false) if !symbol.has_initial => {
                    Some(warning("U0156", "is never written"))
                }
                (Role::Memory, Some((_, span)), false) if !symbol.has_initial => Some(
                    warning("U0153", "is read and never written")
                        .with_related(span.clone(), "read here")
                        .with_help("give it an initial value if a constant is meant"),
                ),
                _ => None,
            };
            self.diagnostics.extend(found);
            self.diagnostics.extend(double_coil(symbol));
            self.diagnostics.extend(read_before_write(symbol));
        }
    }
}

fn double_coil(symbol: &Symbol) -> Option<Diagnostic> {
    let first = symbol.writes.iter().find(|(_, kind, _)| !kind.is_latch())?;
    let other = symbol.writes.iter().find(|write| *write != first)?;
    let mut pair = [first, other];
    pair.sort_by_key(|(rung, _, span)| (*rung, span.start));
    let message = format!(
        "`{}` has coils in rungs {} and {}; the last of {} wins",
        symbol.name,
        pair[0].0 + 1,
        pair[1].0 + 1,
        symbol.writes.len()
    );
    Some(
        Diagnostic::warning("U0152", message, pair[1].2.clone())
            .with_related(pair[0].2.clone(), "another coil")
            .with_help("join them in one rung with branches, or use set and reset coils only"),
    )
}

fn read_before_write(symbol: &Symbol) -> Option<Diagnostic> {
    let (read, span) = symbol.read.as_ref()?;
    let (write, _, place) = symbol.writes.first()?;
    let latch = symbol.writes.iter().all(|(_, kind, _)| kind.is_latch());
    if symbol.has_initial || latch || read >= write {
        return None;
    }
    let message = format!(
        "`{}` is read in rung {} above rung {} that writes it, and so is one scan old",
        symbol.name,
        read + 1,
        write + 1
    );
    Some(
        Diagnostic::warning("U0154", message, span.clone())
            .with_related(place.clone(), "written here")
            .with_help(format!(
                "move the writing rung up, or declare `{} = 0` if the last scan's value is meant",
                symbol.name
            )),
    )
}
