//! Controllers that can be bought, in SQLite: every figure with its source.
//!
//! A [`Store`] is a database file, or one in memory that holds the catalogue that comes with the program ([`seed`]). What is written is written
//! whole or not at all, in one transaction; what is read is checked as a file from outside would be. The tables, views and indices are in
//! `schema.sql`, so that any program that reads SQLite can ask its own questions.
//!
//! This is the only crate that names rusqlite.

mod error;
mod read;
mod write;

use std::path::Path;

use rusqlite::{Connection, OpenFlags};
use understudy_allocation::{Catalogue, file};
use understudy_diagnostic::Report;

pub use error::StoreError;
pub use write::{Mode, Written};

/// "Undy": what the file is for, in SQLite's header.
const APPLICATION: i32 = 0x556e_6479;

/// Of the schema.
pub const VERSION: i32 = 1;

const SCHEMA: &str = include_str!("schema.sql");
const CONTROLLERS: &str = include_str!("../data/controllers.csv");
const FAMILIES: &str = include_str!("../data/families.csv");

/// The catalogue that comes with the program: facts from data sheets, manuals and pages, each with its source.
///
/// # Errors
/// The files that it is made from have errors.
pub fn seed() -> Result<Catalogue, Vec<Report>> {
    let files = [
        file::read("controllers.csv", CONTROLLERS),
        file::read("families.csv", FAMILIES),
    ];
    let mut catalogue = Catalogue::default();
    let mut reports = Vec::new();
    for loaded in files {
        match loaded.catalogue {
            Some(part) => merge(&mut catalogue, &part),
            None => reports.push(loaded.report),
        }
    }
    if reports.is_empty() {
        Ok(catalogue)
    } else {
        Err(reports)
    }
}

fn merge(catalogue: &mut Catalogue, part: &Catalogue) {
    for controller in part.controllers() {
        catalogue.put(controller.clone());
    }
    for (name, family) in &part.families {
        catalogue.put_family(name, family.clone());
    }
}

/// A database of controllers.
#[derive(Debug)]
pub struct Store {
    connection: Connection,
}

impl Store {
    /// A new one in memory.
    ///
    /// # Errors
    /// SQLite failed.
    pub fn in_memory() -> Result<Self, StoreError> {
        let mut store = Self {
            connection: Connection::open_in_memory()?,
        };
        store.prepare()?;
        Ok(store)
    }

    /// A new one at `path`, with `catalogue` in it; the file appears whole or not at all.
    ///
    /// # Errors
    /// Something is at `path` already; SQLite failed, or the file cannot be written.
    pub fn create(path: &Path, catalogue: &Catalogue) -> Result<Self, Vec<StoreError>> {
        let one = |error: StoreError| vec![error];
        if path.exists() {
            return Err(one(StoreError::Exists(path.to_owned())));
        }
        let mut staged = path.as_os_str().to_owned();
        staged.push(".new");
        let staged = Path::new(&staged);
        let io = |error: std::io::Error| {
            one(StoreError::File {
                path: path.to_owned(),
                why: error.to_string(),
            })
        };
        // What a run that was stopped has left behind.
        if staged.exists() {
            std::fs::remove_file(staged).map_err(io)?;
        }
        let written = (|| {
            let mut store = Self {
                connection: Connection::open(staged).map_err(|error| one(error.into()))?,
            };
            store.prepare().map_err(one)?;
            store.put(catalogue, Mode::New)?;
            store
                .connection
                .close()
                .map_err(|(_, error)| one(error.into()))?;
            std::fs::rename(staged, path).map_err(io)
        })();
        if let Err(errors) = written {
            let _ = std::fs::remove_file(staged);
            return Err(errors);
        }
        Self::open(path, true).map_err(one)
    }

    /// The one at `path`, checked.
    ///
    /// # Errors
    /// It is no database, none of this program, of another version, or damaged.
    pub fn open(path: &Path, to_write: bool) -> Result<Self, StoreError> {
        let flags = if to_write {
            OpenFlags::SQLITE_OPEN_READ_WRITE
        } else {
            OpenFlags::SQLITE_OPEN_READ_ONLY
        };
        let unread = |error: rusqlite::Error| StoreError::of(error).at(path);
        let connection = Connection::open_with_flags(path, flags).map_err(unread)?;
        let store = Self { connection };
        store.check(path).map_err(|error| error.at(path))?;
        Ok(store)
    }

    fn check(&self, path: &Path) -> Result<(), StoreError> {
        let number = |name: &str| -> Result<i32, StoreError> {
            let value = self
                .connection
                .pragma_query_value(None, name, |row| row.get(0));
            Ok(value?)
        };
        if number("application_id")? != APPLICATION {
            return Err(StoreError::NoCatalogue(path.to_owned()));
        }
        let version = number("user_version")?;
        if version != VERSION {
            return Err(StoreError::OtherVersion {
                path: path.to_owned(),
                version,
            });
        }
        let mut found = Vec::new();
        self.connection
            .pragma_query(None, "integrity_check", |row| {
                found.push(row.get::<_, String>(0)?);
                Ok(())
            })?;
        self.connection
            .pragma_query(None, "foreign_key_check", |row| {
                let table: String = row.get(0)?;
                found.push(format!("a row of {table} refers to one that is not there"));
                Ok(())
            })?;
        found.retain(|line| line != "ok");
        if found.is_empty() {
            self.connection.pragma_update(None, "foreign_keys", true)?;
            return Ok(());
        }
        found.truncate(5);
        Err(StoreError::Damaged {
            path: path.to_owned(),
            what: found.join("; "),
        })
    }

    fn prepare(&mut self) -> Result<(), StoreError> {
        self.connection.pragma_update(None, "foreign_keys", true)?;
        let transaction = self.connection.transaction()?;
        transaction.pragma_update(None, "application_id", APPLICATION)?;
        transaction.pragma_update(None, "user_version", VERSION)?;
        transaction.execute_batch(SCHEMA)?;
        transaction.commit()?;
        Ok(())
    }
}
