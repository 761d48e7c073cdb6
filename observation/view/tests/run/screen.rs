//! What a terminal shows, as letters.

use std::time::{Duration, Instant};

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use understudy_journal::{Record, RunEvent};
use understudy_view::{Key, Screen, Source};

use crate::support::{KILL_EACH, cell, line, model, scenario};

fn shown(screen: &mut Screen, model: &understudy_view::Model, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a terminal");
    terminal.draw(|frame| screen.draw(frame, model)).expect("drawn");
    terminal.backend().to_string()
}

#[test]
fn a_run_fits_a_terminal_of_eighty_columns() {
    let cell = cell();
    let model = model(&cell, &scenario(&cell, KILL_EACH).shortened(Some(140)), 1);
    let mut screen = Screen::default();
    insta::assert_snapshot!("events", shown(&mut screen, &model, 80, 24));
    screen.press(Key::Next, &model);
    screen.press(Key::Next, &model);
    insta::assert_snapshot!("failures", shown(&mut screen, &model, 80, 24));
    screen.press(Key::Help, &model);
    screen.press(Key::Pause, &model);
    assert!(screen.is_paused());
    let help = shown(&mut screen, &model, 80, 24);
    assert!(help.contains("paused") && help.contains("acknowledge all alarms"), "{help}");
}

/// While the journal is being read no value is shown, only how much of it was; a run that was not written lately says so.
#[test]
fn a_journal_that_is_being_read_shows_no_values() {
    let cell = cell();
    let model = model(&cell, &scenario(&cell, KILL_EACH).shortened(Some(140)), 1);
    let mut screen = Screen::default();
    let drawn = |screen: &mut Screen, progress, now| {
        let mut terminal = Terminal::new(TestBackend::new(80, 24)).expect("a terminal");
        terminal.draw(|frame| screen.draw_live(frame, &model, progress, None, now)).expect("drawn");
        terminal.backend().to_string()
    };
    let (feed, mut source) = Source::channel(10);
    let now = Instant::now();
    let reading = drawn(&mut screen, source.progress(), now);
    assert!(reading.contains("reading the journal: 0 %"), "{reading}");
    assert!(!reading.contains("robot"), "{reading}");
    assert!(feed.give(Record::of_run(0, RunEvent::Interrupted)));
    source.poll(&mut |_| ());
    let now = Instant::now();
    let present = drawn(&mut screen, source.progress(), now);
    assert!(present.contains("robot") && !present.contains("NO RECORD"), "{present}");
    let later = now + Duration::from_secs(60);
    let suspended = drawn(&mut screen, source.progress(), later);
    assert!(!suspended.contains("robot"), "{suspended}");
    source.poll(&mut |_| ());
    let silent = drawn(&mut screen, source.progress(), now + Duration::from_millis(2_500));
    // The reader was at the end a moment ago, or on a busy machine a little longer.
    assert!(silent.contains("NO RECORD FOR 2 s") || silent.contains("reading"), "{silent}");
}

/// Any size, any key, nothing panics; also before the first record and with many stations.
#[test]
fn no_size_is_too_small() {
    let large = line(12, 3, understudy_cycle::Mode::Full);
    let quiet =
        understudy_scenarios::Scenario { title: "quiet".into(), cycles: 20, ..Default::default() };
    let mut large = model(&large, &quiet, 1);
    let mut empty = understudy_view::Model::new(std::sync::Arc::new(cell()), Default::default());
    let keys = [
        Key::Up,
        Key::PageUp,
        Key::Right,
        Key::Next,
        Key::PageUp,
        Key::Next,
        Key::PageDown,
        Key::Left,
        Key::Acknowledge,
        Key::Down,
        Key::Help,
    ];
    for (width, height) in [(1, 1), (10, 3), (40, 8), (80, 24), (200, 60)] {
        for model in [&mut large, &mut empty] {
            let mut screen = Screen::default();
            for key in keys {
                screen.press(key, model);
                shown(&mut screen, model, width, height);
            }
        }
    }
}
