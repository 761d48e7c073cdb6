//! When each member is woken next.

use understudy_wire::{Member, ProgramId, StationId, Time};

/// The wake-ups of all members, and the first of them.
#[derive(Debug, Clone)]
pub(crate) struct Wakeups {
    stations: usize,
    remote_ios: usize,
    /// Stations by rank, then remote I/Os by program, then twins by program.
    due: Vec<Time>,
    /// The place of the earliest one, the first of equal ones.
    first: usize,
}

impl Wakeups {
    /// The wake-ups of `stations` stations, and after them of the remote I/Os and of the twins, with one place for each program.
    pub(crate) fn new(stations: usize, remote_ios: usize, due: Vec<Time>) -> Self {
        let mut wakeups = Self { stations, remote_ios, due, first: 0 };
        wakeups.find_first();
        wakeups
    }

    /// A member is woken at `at` instead.
    pub(crate) fn set(&mut self, member: Member, at: Time) {
        let place = match member {
            Member::Station(station) => station.index(),
            Member::RemoteIo(program) => self.stations + program.index(),
            Member::Twin(program) => self.stations + self.remote_ios + program.index(),
            Member::Plant(_) => return,
        };
        if self.due[place] == at {
            return;
        }
        self.due[place] = at;
        if place == self.first {
            self.find_first();
        } else if (at, place) < (self.due[self.first], self.first) {
            self.first = place;
        }
    }

    /// The first one: when, and who.
    pub(crate) fn next(&self) -> (Time, Member) {
        let member = match self.first.checked_sub(self.stations) {
            None => Member::Station(StationId(self.first as u8)),
            Some(place) if place < self.remote_ios => Member::RemoteIo(ProgramId(place as u8)),
            Some(place) => Member::Twin(ProgramId((place - self.remote_ios) as u8)),
        };
        (self.due[self.first], member)
    }

    fn find_first(&mut self) {
        let places = self.due.iter().enumerate();
        self.first = places.min_by_key(|(_, at)| **at).map_or(0, |(place, _)| place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every sequence of four changes of three members, against a search of all of them.
    #[test]
    fn the_first_one_is_known() {
        for mut changes in 0..9_usize.pow(4) {
            let mut due = vec![Time(1); 3];
            let mut wakeups = Wakeups::new(1, 1, due.clone());
            for _ in 0..4 {
                let (place, at) = (changes % 3, Time((changes / 3 % 3) as u64));
                changes /= 9;
                let member = [
                    Member::Station(StationId(0)),
                    Member::RemoteIo(ProgramId(0)),
                    Member::Twin(ProgramId(0)),
                ];
                due[place] = at;
                wakeups.set(member[place], at);
                let earliest = *due.iter().min().expect("three members");
                let first = due.iter().position(|at| *at == earliest).expect("one of them");
                assert_eq!(wakeups.next(), (earliest, member[first]));
            }
        }
    }
}
