//! What a cell takes: its boxes by role and their price, next to other ways to build it.

use std::fmt::Write as _;

use serde::Serialize;

use crate::allocate::{BoxOnPlan, Placed};
use crate::figures::{Quantity, Statement};
use crate::requirement::Role;

/// One way to build the cell.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BillRow {
    /// What is redundant.
    pub name: String,
    /// Controllers, understudies and the slots of spares; or the controllers of pairs.
    pub stations: usize,
    /// Remote I/Os with their twins.
    pub remote_ios: usize,
    /// One for each network.
    pub switches: usize,
    /// All of these.
    pub boxes: usize,
    /// Price of stations and remote I/Os; nothing where one of them is not known.
    pub price: Option<Price>,
}

/// A price.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Price {
    /// The price in hundredths of the currency.
    pub hundredths: u64,
    /// The currency.
    pub currency: String,
}

/// Boxes of one role.
#[derive(Debug, Clone, Default)]
struct Part {
    boxes: usize,
    /// Nothing where a price is not known.
    hundredths: Option<u64>,
}

impl Part {
    fn add(&mut self, price: Option<u64>) {
        let before = if self.boxes == 0 { Some(0) } else { self.hundredths };
        self.boxes += 1;
        self.hundredths = before.zip(price).map(|(sum, price)| sum.saturating_add(price));
    }

    fn times(&self, count: usize) -> Self {
        let factor = count as u64;
        let hundredths = self.hundredths.map(|price| price.saturating_mul(factor));
        Self { boxes: self.boxes * count, hundredths }
    }

    fn and(&self, other: &Self) -> Self {
        let all = [self, other].into_iter().filter(|part| part.boxes > 0);
        let hundredths = all
            .map(|part| part.hundredths)
            .try_fold(0_u64, |sum, price| Some(sum.saturating_add(price?)));
        Self { boxes: self.boxes + other.boxes, hundredths }
    }
}

/// The boxes of a plan with `networks` networks; the same with a twin for each remote I/O, those that are added with terminals of their own, and two networks;
/// and hot-standby pairs with redundant remote I/Os and two networks. Nothing without networks, and for programs whose terminals are on their own controllers.
pub(crate) fn bill(items: &[Placed], boxes: &[BoxOnPlan], networks: usize) -> Vec<BillRow> {
    let role = |name: &String| items.iter().find(|item| item.name == *name).map(|item| item.role);
    let (mut controllers, mut understudies) = (Part::default(), Part::default());
    // Remote I/Os with their twins, and those without one once more.
    let (mut firsts, mut twins, mut single) = (Part::default(), Part::default(), Part::default());
    for taken in boxes {
        let price = taken.controller.number(Quantity::Price);
        let roles: Vec<Role> = taken.items.iter().filter_map(role).collect();
        let is_twin =
            items.iter().any(|item| item.twin_of.is_some() && taken.items.contains(&item.name));
        let has_twin = |name: &String| items.iter().any(|item| item.twin_of.as_ref() == Some(name));
        if roles.contains(&Role::RemoteIo) {
            if is_twin { &mut twins } else { &mut firsts }.add(price);
            if !is_twin && !taken.items.iter().any(has_twin) {
                single.add(price);
            }
        } else if roles.contains(&Role::Controller) {
            controllers.add(price);
        } else {
            understudies.add(price);
        }
    }
    let is_complete = items.iter().all(|item| item.left_over.is_none());
    if firsts.boxes == 0 || networks == 0 || !is_complete {
        return Vec::new();
    }
    let currencies = boxes.iter().filter_map(|taken| taken.controller.text(Statement::Currency));
    let currency =
        currencies.clone().next().filter(|first| currencies.clone().all(|it| it == *first));
    let row = |name: &str, stations: &Part, remote_ios: &Part, switches: usize| {
        let priced = stations.and(remote_ios);
        BillRow {
            name: name.to_owned(),
            stations: stations.boxes,
            remote_ios: remote_ios.boxes,
            switches,
            boxes: priced.boxes + switches,
            price: priced
                .hundredths
                .zip(currency)
                .map(|(hundredths, currency)| Price { hundredths, currency: currency.to_owned() }),
        }
    };
    let stations = controllers.and(&understudies);
    vec![
        row("this cell", &stations, &firsts.and(&twins), networks),
        row("this cell, twins, two networks", &stations, &firsts.and(&twins).and(&single), 2),
        row(
            "hot-standby pairs, redundant I/O, two networks",
            &controllers.times(2),
            &firsts.times(2),
            2,
        ),
    ]
}

/// The rows for people; nothing where there are none.
pub(crate) fn bill_text(rows: &[BillRow]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let has_prices = rows.iter().any(|row| row.price.is_some());
    let mut text = format!(
        "\n{:<46} {:>8} {:>11} {:>8} {:>6}",
        "boxes of the cell", "stations", "remote I/Os", "switches", "boxes"
    );
    text.push_str(if has_prices { "  price without switches\n" } else { "\n" });
    for row in rows {
        let _ = write!(
            text,
            "{:<46} {:>8} {:>11} {:>8} {:>6}",
            row.name, row.stations, row.remote_ios, row.switches, row.boxes
        );
        let price = row.price.as_ref().map(|price| {
            format!("  {} {}", Quantity::Price.text(price.hundredths), price.currency)
        });
        let _ = writeln!(text, "{}", price.unwrap_or_default());
    }
    text
}
