//! A journal that somebody has changed: nothing panics, whatever is asked of it.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use understudy_journal::Record;
use understudy_view::{Bounds, Filter, Listing, Model, Screen, diff};

use crate::support::{KILL_EACH, cell, records, scenario};

/// Numbers become others, lines change places, are lost or come twice.
#[test]
fn a_changed_journal_is_read_without_a_panic() {
    let cell = cell();
    let lines: Vec<String> = records(&cell, &scenario(&cell, KILL_EACH).shortened(Some(80)), 1)
        .iter()
        .map(|record| serde_json::to_string(record).expect("JSON"))
        .collect();
    let cluster = Arc::new(cell.clone());
    let numbers = ["0", "1", "63", "64", "255", "18446744073709551615", "9223372036854775807"];
    let bounds = Bounds { cycles: 32, events: 50, changes: 20, timings: 10 };
    for seed in 0..40 {
        let mut chance = Pcg64Mcg::seed_from_u64(seed);
        let mut model = Model::new(Arc::clone(&cluster), bounds);
        let mut listing = Listing::new(&cell, Filter::default()).expect("no filter");
        let mut taken = 0;
        for place in 0..lines.len() {
            let line = match chance.random_range(0..20) {
                0 => continue,
                1 => &lines[chance.random_range(0..lines.len())],
                _ => &lines[place],
            };
            let mut line = line.clone();
            if chance.random_range(0..10) == 0 {
                let digits: Vec<usize> = line
                    .char_indices()
                    .filter(|(_, letter)| letter.is_ascii_digit())
                    .map(|(at, _)| at)
                    .collect();
                let at = digits[chance.random_range(0..digits.len())];
                let number = numbers[chance.random_range(0..numbers.len())];
                line.replace_range(at..=at, number);
            }
            if let Ok(record) = serde_json::from_str::<Record>(&line) {
                model.note(&record);
                listing.take(&record).into_iter().for_each(|line| {
                    line.to_text();
                });
                taken += 1;
            }
        }
        assert!(taken > 500);
        model.snapshot();
        for output in ["press.move_down", "grip", "pressing"] {
            for cycle in [None, Some(10), Some(79), Some(i64::MAX), Some(i64::MIN)] {
                if let Ok(why) = model.why(output, cycle) {
                    why.to_text(understudy_view::Zone::UTC);
                }
            }
        }
        diff(&model, &model);
        let mut terminal = Terminal::new(TestBackend::new(80, 24)).expect("a terminal");
        let mut screen = Screen::default();
        terminal.draw(|frame| screen.draw(frame, &model)).expect("drawn");
    }
}
