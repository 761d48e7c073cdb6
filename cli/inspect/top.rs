//! `understudy top`: a live view of a run on the terminal.

use std::io::{self, IsTerminal};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use clap::Args;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{self, KeyCode, KeyEventKind, KeyModifiers};
use ratatui::widgets::{Paragraph, Wrap};
use understudy_attach::Attached;
use understudy_journal::{Commander, JOURNAL_LIMIT_BYTES, RunDirectory};
use understudy_view::{Alarm, Bounds, Following, Key, Model, Run, Screen, Zone};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::inspect::attach::AttachArguments;
use crate::inspect::plant::{self, OpenedPlant};
use crate::inspect::view::{RunArgument, ZoneArgument};

/// Show a live view of a run on the terminal
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy top
  understudy top runs/latest --once
  understudy top examples/press-cell/cluster.toml
  understudy top cell/cluster.toml --keys keys/members/engineer
  understudy top plant.toml --once

For a cluster file the newest run below --out is shown, for a plant file the remaining redundancy of all groups and where each spare is
(docs/how-to/spares.md). Keys: q quit, space pause, tab events, alarms and remaining redundancy,
a acknowledge, arrows scroll, h help. With --once or --json the current state is printed.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    run: RunArgument,
    /// Print the current state and exit
    #[arg(long)]
    once: bool,
    #[command(flatten)]
    zone: ZoneArgument,
    #[command(flatten)]
    elsewhere: AttachArguments,
}

/// Refresh interval without key strokes.
const LOOK: Duration = Duration::from_millis(200);

/// Size of the printed screen.
const WIDTH: u16 = 100;
const HEIGHT: u16 = 30;

/// Maximum wait for the first cycle of a remote cluster.
const HEARD_FOR: Duration = Duration::from_secs(20);

/// Time in which all members of a remote cluster have reported.
const ALL_SAY: Duration = Duration::from_secs(1);

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    if plant::is_plant(&arguments.run.run) {
        return of_plant(arguments, console);
    }
    let (run, attached) = open(arguments, console)?;
    if console.is_json() || arguments.once {
        if attached.is_some() {
            wait_for_a_cycle(&run);
        }
        let model = run.read(Bounds::default())?;
        let mut screen = Screen::in_zone(arguments.zone.zone());
        let snapshot = model.snapshot();
        return Ok(Answer::done(printed(&mut screen, &model)?, &snapshot));
    }
    let mut terminal = terminal()?;
    let (commander, owner) = match &attached {
        Some((_, attached, person)) => (attached.commander(), person.clone()),
        None => (run.commander(), owner()),
    };
    let shown = show(&mut terminal, &run, &commander, &owner, arguments.zone.zone());
    ratatui::restore();
    shown.map_err(failed)?;
    Ok(Answer::done("", ()))
}

fn terminal() -> Result<ratatui::DefaultTerminal, Answer> {
    if !io::stdout().is_terminal() || !io::stdin().is_terminal() {
        let message = "not a terminal: use --once to print the current state";
        return Err(Answer::failed(Status::BadInput, "U0578", message));
    }
    ratatui::try_init().map_err(failed)
}

/// All groups of a plant file.
fn of_plant(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let RunArgument { run: path, out } = &arguments.run;
    let mut plant = plant::open(path, out, &arguments.elsewhere, JOURNAL_LIMIT_BYTES, console)?;
    if console.is_json() || arguments.once {
        let overview = plant.settled();
        return Ok(Answer::done(overview.text(), &overview));
    }
    let mut terminal = terminal()?;
    let shown = show_plant(&mut terminal, &mut plant);
    ratatui::restore();
    shown.map_err(failed)?;
    Ok(Answer::done("", ()))
}

/// Shows a plant until the user quits.
fn show_plant(terminal: &mut ratatui::DefaultTerminal, plant: &mut OpenedPlant) -> io::Result<()> {
    loop {
        let text = plant.look().text();
        terminal.draw(|frame| {
            let shown = Paragraph::new(text).wrap(Wrap { trim: false });
            frame.render_widget(shown, frame.area());
        })?;
        if event::poll(LOOK)?
            && let event::Event::Key(pressed) = event::read()?
        {
            let control = pressed.modifiers.contains(KeyModifiers::CONTROL);
            match pressed.code {
                KeyCode::Char('q') | KeyCode::Esc => return Ok(()),
                KeyCode::Char('c') if control => return Ok(()),
                _ => {}
            }
        }
    }
}

/// Waits until remote members have reported cycles.
fn wait_for_a_cycle(run: &Run) {
    let mut source = run.follow();
    let mut model = run.model(Bounds::default());
    let started = Instant::now();
    while model.cycle().is_none() && started.elapsed() < HEARD_FOR {
        source.poll(&mut |found| {
            if let Ok(record) = found {
                model.note(&record);
            }
        });
        std::thread::sleep(LOOK);
    }
    std::thread::sleep(ALL_SAY);
}

/// A run, and of one elsewhere how it is attached, with the person of the keys.
type Opened = (Run, Option<(RunDirectory, Attached, String)>);

fn open(arguments: &Arguments, console: &mut Console) -> Result<Opened, Answer> {
    if !arguments.elsewhere.is_wanted() {
        return Ok((arguments.run.open()?, None));
    }
    let path = arguments.run.run.as_path();
    let (cluster, _) = files::cluster(path, Default::default())?;
    let (out, limit) = (&arguments.run.out, JOURNAL_LIMIT_BYTES);
    let attached = arguments.elsewhere.attach(path, &cluster, out, limit, console)?;
    Ok((Run::open(attached.0.path())?, Some(attached)))
}

/// Records the acknowledgement of these alarms in the journal. They are shown as acknowledged once they are read there.
fn acknowledge(seen: &[Alarm], commander: &Commander, owner: &str) {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let now = since.map_or(0, |since| since.as_secs());
    for alarm in seen {
        let seen = alarm.acknowledgement(owner.to_owned(), now);
        // An acknowledgement that cannot be written leaves the alarm unacknowledged.
        let _ = commander.acknowledge_and_wait(seen);
    }
}

/// User of this terminal, where no keys name the person.
pub(crate) fn owner() -> String {
    std::env::var("USER").unwrap_or_else(|_| "terminal".to_owned())
}

fn failed(error: io::Error) -> Answer {
    let message = format!("cannot write to the terminal: {error}");
    Answer::failed(Status::Failed, "U0602", message)
}

fn printed(screen: &mut Screen, model: &Model) -> Result<String, Answer> {
    let mut terminal = Terminal::new(TestBackend::new(WIDTH, HEIGHT))
        .map_err(|never| -> Answer { match never {} })?;
    terminal
        .draw(|frame| screen.draw(frame, model))
        .map_err(|never| -> Answer { match never {} })?;
    let buffer = terminal.backend().buffer();
    let rows = buffer.content.chunks(usize::from(WIDTH));
    let lines = rows.map(|row| {
        let line: String = row.iter().map(|cell| cell.symbol()).collect();
        line.trim_end().to_owned() + "\n"
    });
    let text: String = lines.collect();
    Ok(text.trim_end().to_owned() + "\n")
}

/// Shows the run until the user quits.
fn show(
    terminal: &mut ratatui::DefaultTerminal,
    run: &Run,
    commander: &Commander,
    owner: &str,
    zone: Zone,
) -> io::Result<()> {
    let (mut model, mut following) = Following::of(run, Bounds::default());
    let mut screen = Screen::in_zone(zone);
    loop {
        let drawn = Instant::now();
        while !screen.is_paused() {
            let taken = following.poll(&mut |found| model.take_found(found));
            if let Some(whole) = following.read_past() {
                model = whole;
            }
            if taken == 0 && run.is_finished() {
                model.end(run.has_results());
            }
            // Draws the progress of reading a long journal.
            if taken == 0 || drawn.elapsed() >= LOOK || event::poll(Duration::ZERO)? {
                break;
            }
        }
        let progress = following.progress().of_ended(model.is_finished());
        let past = following.past_percent();
        terminal.draw(|frame| screen.draw_live(frame, &model, progress, past, Instant::now()))?;
        let is_idle = progress.is_at_end() && past.is_none();
        let wait = if is_idle || screen.is_paused() { LOOK } else { Duration::ZERO };
        if !event::poll(wait)? {
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
        let seen = screen.press(key, &model);
        // Those of a past that is not read yet have other numbers and times.
        if !seen.is_empty() && following.past_percent().is_none() {
            acknowledge(&seen, commander, owner);
        }
    }
}
