//! Everything that a database holds; what no file may say, no database may either.

use std::path::PathBuf;

use understudy_allocation::{
    Catalogue, Controller, Family, FamilyQuantity, Figure, Kind, Quantity, Statement,
};

use crate::{Store, StoreError};

const CONTROLLERS: &str = "SELECT controllers.vendor, controllers.model, families.name, controllers.kind, controllers.notes
    FROM controllers JOIN families ON families.id = controllers.family_id ORDER BY controllers.vendor, controllers.model";

const FIGURES: &str = "SELECT controllers.vendor, controllers.model, figures.name, figures.number, figures.text, sources.text
    FROM figures JOIN controllers ON controllers.id = figures.controller_id JOIN sources ON sources.id = figures.source_id";

const FAMILY_FIGURES: &str = "SELECT family, figure, value, source, notes FROM family_provenance";

impl Store {
    /// All controllers and families.
    ///
    /// # Errors
    /// SQLite failed, or a row holds what this program would not have written.
    pub fn read(&self) -> Result<Catalogue, StoreError> {
        let mut catalogue = Catalogue::default();
        let mut statement = self.connection.prepare(CONTROLLERS)?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let (vendor, model): (String, String) = (row.get(0)?, row.get(1)?);
            let (family, kind): (String, String) = (row.get(2)?, row.get(3)?);
            let kind = Kind::of(&kind)
                .ok_or_else(|| damaged(format!("{vendor} {model} is of the kind `{kind}`")))?;
            let mut controller = Controller::new(&vendor, &model, &family, kind);
            controller.notes = row.get(4)?;
            catalogue.put(controller);
        }
        self.read_figures(&mut catalogue)?;
        self.read_family_figures(&mut catalogue)?;
        Ok(catalogue)
    }

    fn read_figures(&self, catalogue: &mut Catalogue) -> Result<(), StoreError> {
        let mut statement = self.connection.prepare(FIGURES)?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let (vendor, model): (String, String) = (row.get(0)?, row.get(1)?);
            let name: String = row.get(2)?;
            let (number, text): (Option<i64>, Option<String>) = (row.get(3)?, row.get(4)?);
            let source: String = row.get(5)?;
            let wrong = || damaged(format!("the figure {name} of {vendor} {model} is none"));
            let Some(known) = catalogue.get(&vendor, &model) else {
                return Err(wrong());
            };
            let mut figure = Controller::new(&vendor, &model, &known.family, known.kind);
            let quantity = Quantity::ALL.into_iter().find(|known| known.name() == name);
            let statement = Statement::ALL
                .into_iter()
                .find(|known| known.name() == name);
            match (quantity, statement, number, text) {
                (Some(quantity), _, Some(number), None) => {
                    let value = u64::try_from(number).map_err(|_| wrong())?;
                    if value > quantity.most() {
                        return Err(wrong());
                    }
                    figure.numbers.insert(quantity, Figure { value, source });
                }
                (_, Some(statement), None, Some(value)) => {
                    figure.texts.insert(statement, Figure { value, source });
                }
                _ => return Err(wrong()),
            }
            catalogue.put(figure);
        }
        Ok(())
    }

    fn read_family_figures(&self, catalogue: &mut Catalogue) -> Result<(), StoreError> {
        let mut statement = self.connection.prepare(FAMILY_FIGURES)?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let (family, name): (String, String) = (row.get(0)?, row.get(1)?);
            let number: i64 = row.get(2)?;
            let wrong = || damaged(format!("the figure {name} of the family {family} is none"));
            let quantity = FamilyQuantity::ALL.into_iter();
            let quantity = quantity.into_iter().find(|known| known.name() == name);
            let value = u64::try_from(number).map_err(|_| wrong())?;
            let source: String = row.get(3)?;
            let mut figures = Family {
                notes: row.get(4)?,
                ..Family::default()
            };
            let quantity = quantity.filter(|_| value <= FamilyQuantity::MOST);
            figures
                .numbers
                .insert(quantity.ok_or_else(wrong)?, Figure { value, source });
            catalogue.put_family(&family, figures);
        }
        Ok(())
    }
}

fn damaged(what: String) -> StoreError {
    StoreError::Damaged {
        path: PathBuf::from("the database"),
        what,
    }
}
