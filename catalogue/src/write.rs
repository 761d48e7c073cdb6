//! Adding to a database: all of it, or nothing.

use rusqlite::{OptionalExtension, Transaction, params};
use understudy_allocation::{Catalogue, Controller, Family};

use crate::{Store, StoreError};

/// What may happen to models that are there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Nothing: they must not be there.
    New,
    /// They get the figures that are said, and keep all others.
    Update,
}

/// What was written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Written {
    /// Models that were not there.
    pub added: usize,
    /// Models that were there.
    pub updated: usize,
    /// Figures of families.
    pub family_figures: usize,
    /// Figures that had another value before, each with its model.
    pub changed: Vec<String>,
}

impl Store {
    /// Writes `part` into the database.
    ///
    /// # Errors
    /// Everything of `part` that is there already, under [`Mode::New`], or that disagrees with what is there; SQLite failed. Then nothing has
    /// been written.
    pub fn put(&mut self, part: &Catalogue, mode: Mode) -> Result<Written, Vec<StoreError>> {
        let one = |error: StoreError| vec![error];
        let known = self.read().map_err(one)?;
        let errors = refused(&known, part, mode);
        if !errors.is_empty() {
            return Err(errors);
        }
        let mut written = Written::default();
        for controller in part.controllers() {
            match known.get(&controller.vendor, &controller.model) {
                None => written.added += 1,
                Some(old) => {
                    written.updated += 1;
                    let changed = old.clone().update(controller.clone());
                    let changed = changed.into_iter();
                    written
                        .changed
                        .extend(changed.map(|figure| format!("{controller}: {figure}")));
                }
            }
        }
        let figures = part.families.values().map(|family| family.numbers.len());
        written.family_figures = figures.sum();
        self.write(part).map_err(|error| one(error.into()))?;
        Ok(written)
    }

    fn write(&mut self, part: &Catalogue) -> rusqlite::Result<()> {
        let transaction = self.connection.transaction()?;
        for (name, family) in &part.families {
            put_family(&transaction, name, family)?;
        }
        for controller in part.controllers() {
            put_controller(&transaction, controller)?;
        }
        transaction.commit()
    }
}

fn refused(known: &Catalogue, part: &Catalogue, mode: Mode) -> Vec<StoreError> {
    let mut errors = Vec::new();
    for controller in part.controllers() {
        let Some(old) = known.get(&controller.vendor, &controller.model) else {
            continue;
        };
        if mode == Mode::New {
            errors.push(StoreError::Present(controller.to_string()));
            continue;
        }
        let said = [
            ("family", &old.family[..], &controller.family[..]),
            ("kind", old.kind.name(), controller.kind.name()),
        ];
        for (what, known, said) in said {
            if known != said {
                errors.push(StoreError::Disagrees {
                    model: controller.to_string(),
                    what,
                    known: known.to_owned(),
                    said: said.to_owned(),
                });
            }
        }
    }
    if mode == Mode::New {
        for (name, family) in &part.families {
            let old = known.families.get(name);
            let figures = family.numbers.keys();
            let present =
                figures.filter(|figure| old.is_some_and(|old| old.number(**figure).is_some()));
            errors.extend(
                present.map(|figure| StoreError::Present(format!("{figure} of the family {name}"))),
            );
        }
    }
    errors
}

fn source(transaction: &Transaction<'_>, text: &str) -> rusqlite::Result<i64> {
    let known = transaction
        .prepare_cached("SELECT id FROM sources WHERE text = ?1")?
        .query_row([text], |row| row.get(0))
        .optional()?;
    match known {
        Some(id) => Ok(id),
        None => {
            transaction.execute("INSERT INTO sources (text) VALUES (?1)", [text])?;
            Ok(transaction.last_insert_rowid())
        }
    }
}

fn family_id(transaction: &Transaction<'_>, name: &str) -> rusqlite::Result<i64> {
    transaction.execute("INSERT OR IGNORE INTO families (name) VALUES (?1)", [name])?;
    transaction.query_row("SELECT id FROM families WHERE name = ?1", [name], |row| {
        row.get(0)
    })
}

fn put_family(transaction: &Transaction<'_>, name: &str, family: &Family) -> rusqlite::Result<()> {
    let id = family_id(transaction, name)?;
    if !family.notes.is_empty() {
        let notes = "UPDATE families SET notes = ?2 WHERE id = ?1";
        transaction.execute(notes, params![id, family.notes])?;
    }
    for (quantity, figure) in &family.numbers {
        let source = source(transaction, &figure.source)?;
        transaction.execute(
            "INSERT OR REPLACE INTO family_figures (family_id, name, number, source_id) VALUES (?1, ?2, ?3, ?4)",
            params![id, quantity.name(), figure.value as i64, source],
        )?;
    }
    Ok(())
}

fn put_controller(transaction: &Transaction<'_>, controller: &Controller) -> rusqlite::Result<()> {
    let family = family_id(transaction, &controller.family)?;
    transaction.execute(
        "INSERT INTO controllers (vendor, model, family_id, kind, notes) VALUES (?1, ?2, ?3, ?4, ?5)
         ON CONFLICT (vendor, model) DO UPDATE SET notes = CASE WHEN excluded.notes = '' THEN notes ELSE excluded.notes END",
        params![
            controller.vendor,
            controller.model,
            family,
            controller.kind.name(),
            controller.notes
        ],
    )?;
    let id: i64 = transaction.query_row(
        "SELECT id FROM controllers WHERE vendor = ?1 AND model = ?2",
        [&controller.vendor, &controller.model],
        |row| row.get(0),
    )?;
    // Numbers are at most 2^40, see `Quantity::most`.
    let numbers = controller.numbers.iter().map(|(quantity, figure)| {
        let number = Some(figure.value as i64);
        (quantity.name(), number, None, &figure.source)
    });
    let texts = controller.texts.iter().map(|(statement, figure)| {
        let text = Some(figure.value.as_str());
        (statement.name(), None, text, &figure.source)
    });
    for (name, number, text, said_by) in numbers.chain(texts) {
        let source = source(transaction, said_by)?;
        transaction
            .prepare_cached(
                "INSERT OR REPLACE INTO figures (controller_id, name, number, text, source_id) VALUES (?1, ?2, ?3, ?4, ?5)",
            )?
            .execute(params![id, name, number, text, source])?;
    }
    Ok(())
}
