//! `understudy top`: a run on a terminal, live.

use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{self, KeyCode, KeyEventKind, KeyModifiers};
use understudy_view::{Bounds, Key, Model, Run, Screen, Source, find_run_of};

use crate::answer::{Answer, Status};
use crate::files;
use crate::view::{RUN, refused};

/// Show a run on the terminal as a table that lives: who works, what could fail now, what happens
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy top
  understudy top runs/latest --once
  understudy top examples/press-cell/cluster.toml

A cluster file stands for its newest run below runs/. Keys: q quit, space stand still, tab events, alarms, failures to come, a
acknowledge, arrows scroll, h help. With --once or --json it says how the run is now, and ends.")]
pub(crate) struct Arguments {
    /// The directory of a run, or a cluster file
    #[arg(value_name = "RUN|CLUSTER.toml", default_value = RUN)]
    run: PathBuf,
    /// Print how it is now, and end
    #[arg(long)]
    once: bool,
}

/// How often it is drawn where no key is pressed.
const LOOK: Duration = Duration::from_millis(200);

/// What is printed where there is no terminal.
const WIDTH: u16 = 100;
const HEIGHT: u16 = 30;

pub(crate) fn run(arguments: &Arguments, json: bool) -> Answer {
    answered(arguments, json).unwrap_or_else(|answer| answer)
}

fn answered(arguments: &Arguments, json: bool) -> Result<Answer, Answer> {
    let run = open(&arguments.run)?;
    if json || arguments.once {
        let model = run
            .read(Bounds::default())
            .map_err(|error| refused(&error))?;
        let mut screen = Screen::default();
        let snapshot = screen.snapshot(&model);
        return Ok(Answer::done(printed(&mut screen, &model)?, &snapshot));
    }
    if !io::stdout().is_terminal() || !io::stdin().is_terminal() {
        let message = "standard input and output are no terminal; --once prints how the run is now";
        return Err(Answer::failed(Status::BadInput, "U0578", message));
    }
    let mut terminal = ratatui::try_init().map_err(failed)?;
    let shown = show(&mut terminal, &run);
    ratatui::restore();
    shown.map_err(failed)?;
    Ok(Answer::done("", ()))
}

fn open(path: &Path) -> Result<Run, Answer> {
    let is_cluster = path
        .extension()
        .is_some_and(|extension| extension == "toml");
    if !is_cluster {
        return Run::open(path).map_err(|error| refused(&error));
    }
    let (cluster, _) = files::cluster(path, Default::default())?;
    find_run_of(Path::new("runs"), &cluster).map_err(|error| refused(&error))
}

fn failed(error: io::Error) -> Answer {
    let message = format!("the terminal cannot be written to: {error}");
    Answer::failed(Status::Failed, "U0602", message)
}

fn printed(screen: &mut Screen, model: &Model) -> Result<String, Answer> {
    let mut terminal =
        Terminal::new(TestBackend::new(WIDTH, HEIGHT)).map_err(|never| match never {})?;
    terminal
        .draw(|frame| screen.draw(frame, model))
        .map_err(|never| match never {})?;
    let buffer = terminal.backend().buffer();
    let rows = buffer.content.chunks(usize::from(WIDTH));
    let lines = rows.map(|row| {
        let line: String = row.iter().map(|cell| cell.symbol()).collect();
        line.trim_end().to_owned() + "\n"
    });
    let text: String = lines.collect();
    Ok(text.trim_end().to_owned() + "\n")
}

/// Until somebody quits.
fn show(terminal: &mut ratatui::DefaultTerminal, run: &Run) -> io::Result<()> {
    let mut source: Source = run.follow();
    let mut model = run.model(Bounds::default());
    let mut screen = Screen::default();
    loop {
        while !screen.is_paused() {
            let taken = source.poll(&mut |found| match found {
                Ok(record) => model.note(&record),
                Err(trouble) => model.trouble(&trouble),
            });
            if taken == 0 && run.is_finished() {
                model.end();
            }
            // A long journal is shown while it is read.
            if taken == 0 || event::poll(Duration::ZERO)? {
                break;
            }
        }
        terminal.draw(|frame| screen.draw(frame, &model))?;
        if !event::poll(LOOK)? {
            continue;
        }
        let event::Event::Key(pressed) = event::read()? else {
            continue;
        };
        if pressed.kind == KeyEventKind::Release {
            continue;
        }
        let control = pressed.modifiers.contains(KeyModifiers::CONTROL);
        let key = match pressed.code {
            KeyCode::Char('q') | KeyCode::Esc => return Ok(()),
            KeyCode::Char('c') if control => return Ok(()),
            KeyCode::Char('a') => Key::Acknowledge,
            KeyCode::Char('h' | '?') => Key::Help,
            KeyCode::Char(' ') => Key::Pause,
            KeyCode::Tab => Key::Next,
            KeyCode::Up => Key::Up,
            KeyCode::Down => Key::Down,
            KeyCode::PageUp => Key::PageUp,
            KeyCode::PageDown => Key::PageDown,
            KeyCode::Left => Key::Left,
            KeyCode::Right => Key::Right,
            _ => continue,
        };
        screen.press(key, &mut model);
    }
}
