//! The events of a run as people read them: chosen, without those of the host, and with repeated ones in one row.

use std::collections::{BTreeMap, BTreeSet};

use crate::event::{Event, Level};
use crate::model::Model;

/// A sequence of events that repeats is folded where it has at most this many.
const MAXIMUM_PERIOD: usize = 4;

/// Events whose text has a measured number: they are repeated also with another number.
const MEASURED: &[&str] = &[
    "journal-lost",
    "link-reopened",
    "refused-bytes",
    "refused-connections",
    "refused-frames",
    "refused-writes",
    "stalled",
    "unsendable-frames",
];

/// Which events are wanted, and how they are shown.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct EventFilter {
    /// A part of the member, the kind, the text or the cause, in any case of letters.
    pub find: String,
    /// The last cycle.
    pub until: Option<i64>,
    /// Severities; all where none is named.
    pub levels: BTreeSet<Level>,
    /// Kinds, such as `flagged`; all where none is named.
    pub kinds: BTreeSet<String>,
    /// Members by name; all where none is named.
    pub members: BTreeSet<String>,
    /// Whether events of the host are shown that no kind asks for.
    pub of_host: bool,
    /// Whether a repeated event has one row.
    pub folds: bool,
}

/// An event, or several that repeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EventRow<'m> {
    /// The newest.
    pub event: &'m Event,
    /// The oldest.
    pub first: &'m Event,
    /// How many events.
    pub count: usize,
}

/// The events of a run that a filter leaves, with what it can choose from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct EventList<'m> {
    /// The newest first.
    pub rows: Vec<EventRow<'m>>,
    /// Events of the host that the filter would leave, and that are not shown.
    pub hidden_of_host: usize,
    /// Events up to the last cycle by severity, whatever else the filter says.
    pub levels: BTreeMap<Level, usize>,
    /// The same by kind.
    pub kinds: BTreeMap<&'static str, usize>,
    /// The same by member.
    pub members: BTreeMap<&'m str, usize>,
}

impl Event {
    /// Whether it is about the host only: a late wake-up. What follows from it, such as a held output, is an event of its own.
    pub fn is_of_host(&self) -> bool {
        self.event == "stalled" && self.level <= Level::Notice
    }

    /// Whether two events differ in their cycle only, and in the number where it is a measured one.
    fn repeats(&self, other: &Self) -> bool {
        let same_kind = self.event == other.event && self.level == other.level;
        let same_text = if MEASURED.contains(&self.event) {
            without_numbers(&self.text).eq(without_numbers(&other.text))
        } else {
            self.text == other.text
        };
        same_kind && same_text && self.name == other.name && self.cause == other.cause
    }
}

fn without_numbers(text: &str) -> impl Iterator<Item = char> + '_ {
    let is_part = |letter: &char| letter.is_ascii_digit() || *letter == '.';
    text.chars().filter(move |letter| !is_part(letter))
}

impl EventFilter {
    fn is_before(&self, event: &Event) -> bool {
        // What is done in a cycle is felt in the next one.
        self.until.is_none_or(|until| event.cycle <= until.saturating_add(1))
    }

    fn names(&self, event: &Event, find: &str) -> bool {
        let has = |text: &str| text.to_lowercase().contains(find);
        let found = find.is_empty()
            || has(&event.name)
            || has(&event.text)
            || event.event.contains(find)
            || event.cause.as_deref().is_some_and(has);
        let level = self.levels.is_empty() || self.levels.contains(&event.level);
        let kind = self.kinds.is_empty() || self.kinds.contains(event.event);
        let member = self.members.is_empty() || self.members.contains(&event.name);
        found && level && kind && member
    }
}

impl Model {
    /// The events that are remembered, as a filter wants them.
    pub fn event_list(&self, filter: &EventFilter) -> EventList<'_> {
        list(self.events().rev(), filter)
    }
}

fn list<'m>(newest_first: impl Iterator<Item = &'m Event>, filter: &EventFilter) -> EventList<'m> {
    let mut list = EventList::default();
    let find = filter.find.to_lowercase();
    let mut chosen = Vec::new();
    for event in newest_first.filter(|event| filter.is_before(event)) {
        *list.levels.entry(event.level).or_default() += 1;
        *list.kinds.entry(event.event).or_default() += 1;
        *list.members.entry(&event.name).or_default() += 1;
        if !filter.names(event, &find) {
            continue;
        }
        if event.is_of_host() && !filter.of_host && !filter.kinds.contains(event.event) {
            list.hidden_of_host += 1;
        } else {
            chosen.push(event);
        }
    }
    list.rows = rows(&chosen, filter.folds);
    list
}

fn rows<'m>(events: &[&'m Event], folds: bool) -> Vec<EventRow<'m>> {
    let mut rows = Vec::new();
    let mut rest = events;
    while !rest.is_empty() {
        let (period, count) = if folds { repetition(rest) } else { (1, 1) };
        let oldest = (count - 1) * period;
        rows.extend((0..period).map(|place| EventRow {
            event: rest[place],
            first: rest[oldest + place],
            count,
        }));
        rest = &rest[count * period..];
    }
    rows
}

/// Length of the sequence at the start that repeats, and how often it is there. A sequence of several events is there three times at least:
/// twice may be two incidents that a reader wants to see one after the other.
fn repetition(events: &[&Event]) -> (usize, usize) {
    let found = (1..=MAXIMUM_PERIOD).rev().map(|period| {
        let later = events.get(period..).unwrap_or_default();
        let pairs = events.iter().zip(later);
        let same = pairs.take_while(|(one, other)| one.repeats(other)).count();
        (period, 1 + same / period)
    });
    let folds = |(period, count): &(usize, usize)| *count >= if *period == 1 { 2 } else { 3 };
    let longest = found.filter(folds).max_by_key(|(period, count)| period * count);
    longest.unwrap_or((1, 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(number: u64, name: &str, kind: &'static str, level: Level, text: &str) -> Event {
        Event {
            number,
            cycle: i64::try_from(number).expect("small"),
            at_ns: 0,
            at: None,
            name: name.to_owned(),
            event: kind,
            level,
            text: text.to_owned(),
            cause: None,
        }
    }

    /// `a` and `b` are warnings, `h` a late wake-up by another time each.
    fn events(letters: &str) -> Vec<Event> {
        let events = (1..).zip(letters.chars()).map(|(number, letter)| {
            let late = format!("host stall: woken {number}.5ms late");
            match letter {
                'h' => event(number, "robot", "stalled", Level::Notice, &late),
                letter => event(number, "press", "flagged", Level::Warning, &letter.to_string()),
            }
        });
        events.collect()
    }

    /// Newest first: what is shown, how often, and since when.
    fn shown(letters: &str, filter: &EventFilter) -> Vec<(String, usize, i64)> {
        let events = events(letters);
        let list = list(events.iter().rev(), filter);
        let rows = list.rows.iter();
        rows.map(|row| (row.event.text.clone(), row.count, row.first.cycle)).collect()
    }

    #[test]
    fn every_event_is_in_one_row_in_any_order() {
        // All sequences of up to nine events of two kinds: each event is counted once, and rows unfold to the sequence.
        for length in 0..=9 {
            for pattern in 0..1u32 << length {
                let letter = |place: u32| if pattern >> place & 1 == 1 { 'a' } else { 'b' };
                let letters: String = (0..length).map(letter).collect();
                let events = events(&letters);
                let newest: Vec<&Event> = events.iter().rev().collect();
                let rows = rows(&newest, true);
                let counted: usize = rows.iter().map(|row| row.count).sum();
                assert_eq!(counted, events.len(), "{letters}");
                let mut unfolded = Vec::new();
                let mut rest = rows.as_slice();
                while let Some(head) = rest.first() {
                    // Rows of one sequence have equal counts and follow each other by number.
                    let follows = |pair: &[EventRow<'_>]| {
                        let [one, other] = pair else { return false };
                        one.event.number == other.event.number + 1
                            && (one.count, other.count) == (head.count, head.count)
                            && head.count > 1
                    };
                    let period = 1 + rest.windows(2).take_while(|pair| follows(pair)).count();
                    for _ in 0..head.count {
                        unfolded.extend(rest[..period].iter().map(|row| row.event.text.as_str()));
                    }
                    rest = &rest[period..];
                }
                let expected: Vec<&str> = newest.iter().map(|event| event.text.as_str()).collect();
                assert_eq!(unfolded, expected, "{letters}");
            }
        }
    }

    #[test]
    fn repeated_events_are_folded_and_others_keep_their_order() {
        let filter = EventFilter { folds: true, of_host: true, ..EventFilter::default() };
        let text = |text: &str, count, first| (text.to_owned(), count, first);
        assert_eq!(shown("aaaa", &filter), [text("a", 4, 1)]);
        assert_eq!(
            shown("ababab", &filter),
            [text("b", 3, 2), text("a", 3, 1)],
            "a pair that repeats"
        );
        assert_eq!(shown("abab", &filter).len(), 4, "two incidents");
        let late = text("host stall: woken 3.5ms late", 3, 1);
        assert_eq!(shown("hhh", &filter), [late], "whatever the time was");
        let each = EventFilter { folds: false, ..filter };
        assert_eq!(shown("hhh", &each).len(), 3);
    }

    #[test]
    fn events_of_the_host_are_hidden_and_counted_unless_asked_for() {
        let events = events("hahbh");
        let of = |filter: &EventFilter| {
            let list = list(events.iter().rev(), filter);
            (list.rows.len(), list.hidden_of_host)
        };
        assert_eq!(of(&EventFilter::default()), (2, 3));
        let kinds = BTreeSet::from(["stalled".to_owned()]);
        let stalled = EventFilter { kinds, ..EventFilter::default() };
        assert_eq!(of(&stalled), (3, 0));
        let members = BTreeSet::from(["press".to_owned()]);
        let press = EventFilter { members, ..EventFilter::default() };
        assert_eq!(of(&press), (2, 0), "none of this member is hidden");
        let alarms =
            EventFilter { levels: BTreeSet::from([Level::Alarm]), ..EventFilter::default() };
        assert_eq!(of(&alarms), (0, 0));
        let early = EventFilter { until: Some(1), find: "A".to_owned(), ..EventFilter::default() };
        assert_eq!(of(&early), (1, 1), "`late` has the letter too");
    }

    #[test]
    fn a_stall_that_is_more_than_a_notice_is_not_hidden() {
        let worse = event(1, "robot", "stalled", Level::Warning, "host stall");
        assert!(!worse.is_of_host());
    }
}
