//! Which spare wakes where.
//!
//! A spare without a post takes the group with the least remaining redundancy among those that lack some, the first one in
//! the plant file where several have equally little. It stays there until the group has been complete without it for
//! `retire_after`: a spare that left for another group would take protection from one to give it to the other. Of several
//! spares of a group the ranks of their slots decide ([`super::Attention`]).

use super::attention::Standing;

/// What a spare does next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Nothing.
    Stay,
    /// It starts the station of its slot in this group.
    Wake(usize),
    /// It ends the station of its slot in this group.
    Retire(usize),
}

/// The rule of one spare.
#[derive(Debug, Clone, Hash)]
pub struct Rule {
    /// By group: whether it fits the capacity of the spare.
    pub fits: Vec<bool>,
    /// By group: cycles for which it must be complete before the spare retires.
    pub retire_after: Vec<u32>,
}

impl Rule {
    /// The next order of a spare that is awake in `post`, or nowhere.
    pub fn order(&self, post: Option<usize>, standings: &[Standing]) -> Order {
        match post {
            None => {
                let fits = |(group, _): &(usize, &Standing)| self.fits[*group];
                let groups = standings.iter().enumerate().filter(fits);
                let lacking = groups.filter(|(_, standing)| wanted(standing));
                let first = lacking.min_by_key(|(group, standing)| (standing.redundancy, *group));
                first.map_or(Order::Stay, |(group, _)| Order::Wake(group))
            }
            Some(group) => {
                let standing = &standings[group];
                if standing.seen && standing.complete >= self.retire_after[group] {
                    Order::Retire(group)
                } else {
                    Order::Stay
                }
            }
        }
    }
}

/// Whether a group lacks redundancy that a spare gives back.
pub fn wanted(standing: &Standing) -> bool {
    standing.seen && standing.served && standing.redundancy < standing.full
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn standing(redundancy: u32) -> Standing {
        Standing { seen: true, served: true, full: 1, redundancy, complete: 0, publishes: false }
    }

    fn rule(groups: usize) -> Rule {
        Rule { fits: vec![true; groups], retire_after: vec![300; groups] }
    }

    #[test]
    fn the_group_with_the_least_remaining_redundancy_is_served_first() {
        let whole = standing(1);
        let lost = standing(0);
        let two = Standing { full: 2, redundancy: 1, ..whole };
        let rows: [(&[Standing], Order); 8] = [
            (&[], Order::Stay),
            (&[whole, whole], Order::Stay),
            (&[whole, lost], Order::Wake(1)),
            (&[lost, lost], Order::Wake(0)),
            (&[two, lost], Order::Wake(1)),
            (&[whole, two], Order::Wake(1)),
            (&[Standing { seen: false, ..lost }, two], Order::Wake(1)),
            (&[Standing { served: false, ..lost }], Order::Stay),
        ];
        for (standings, wanted) in rows {
            assert_eq!(rule(standings.len()).order(None, standings), wanted, "{standings:?}");
        }
    }

    /// A group whose programs the machine cannot execute in time is never served, also where it is the only one.
    #[test]
    fn a_group_beyond_the_capacity_wakes_nobody() {
        let rule = Rule { fits: vec![false, true], ..rule(2) };
        assert_eq!(rule.order(None, &[standing(0), standing(1)]), Order::Stay);
        assert_eq!(rule.order(None, &[standing(0), standing(0)]), Order::Wake(1));
    }

    #[test]
    fn a_spare_stays_until_its_group_is_complete_for_long_enough() {
        let of = |complete| Standing { complete, ..standing(1) };
        let rows = [
            (standing(0), Order::Stay),
            (of(299), Order::Stay),
            (Standing { seen: false, ..of(300) }, Order::Stay),
            (of(300), Order::Retire(1)),
        ];
        for (own, wanted) in rows {
            // A worse group elsewhere does not call it away.
            assert_eq!(rule(2).order(Some(1), &[standing(0), own]), wanted, "{own:?}");
        }
    }

    fn standings() -> impl Strategy<Value = Vec<(bool, Standing)>> {
        let one = (any::<bool>(), any::<bool>(), any::<bool>(), 0..3_u32, 0..4_u32, 0..500_u32);
        let one = one.prop_map(|(fits, seen, served, full, redundancy, complete)| {
            (fits, Standing { seen, served, full, redundancy, complete, publishes: false })
        });
        prop::collection::vec(one, 0..6)
    }

    proptest! {
        #[test]
        fn no_order_is_without_its_reason(groups in standings(), post in any::<prop::sample::Index>(), idle: bool) {
            let (fits, standings): (Vec<bool>, Vec<Standing>) = groups.into_iter().unzip();
            let rule = Rule { retire_after: vec![300; fits.len()], fits };
            let post = (!idle && !standings.is_empty()).then(|| post.index(standings.len()));
            match rule.order(post, &standings) {
                Order::Wake(group) => {
                    prop_assert!(post.is_none() && rule.fits[group] && wanted(&standings[group]));
                    for (other, standing) in standings.iter().enumerate() {
                        let better = rule.fits[other] && wanted(standing);
                        prop_assert!(!better || standing.redundancy >= standings[group].redundancy);
                    }
                }
                Order::Retire(group) => {
                    prop_assert_eq!(post, Some(group));
                    prop_assert!(standings[group].complete >= 300);
                }
                Order::Stay if post.is_none() => {
                    let called = standings.iter().zip(&rule.fits).any(|(it, fits)| *fits && wanted(it));
                    prop_assert!(!called);
                }
                Order::Stay => {}
            }
        }
    }
}
