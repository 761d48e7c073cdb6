//! Positions of labels on their arrows.

use super::layout::Point;
use super::picture::text_size;

/// A rectangle by its centre and half of its width and height, in pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Area {
    pub(crate) centre: Point,
    pub(crate) half: Point,
}

impl Area {
    /// The area that both cover, in square pixels.
    fn shared_with(self, other: Self) -> f64 {
        let along = |one: f64, half: f64, two: f64, other_half: f64| {
            let end = (one + half).min(two + other_half);
            (end - (one - half).max(two - other_half)).max(0.0)
        };
        along(self.centre.0, self.half.0, other.centre.0, other.half.0)
            * along(self.centre.1, self.half.1, other.centre.1, other.half.1)
    }
}

/// Lines of text with their possible positions, the best first.
pub(crate) struct Label {
    pub(crate) places: Vec<Point>,
    pub(crate) lines: Vec<String>,
    /// The number of its arrow, which may pass below it.
    pub(crate) arrow: Option<usize>,
}

/// A point of an arrow that a label should not cover.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    pub(crate) place: Point,
    pub(crate) arrow: usize,
    /// The head of an arrow is not covered by its own label either.
    pub(crate) is_head: bool,
}

/// How many square pixels of other labels a covered point and a covered head are worth.
const POINT: f64 = 30.0;
const HEAD: f64 = 200.0;

/// Half of what a head takes, in pixels.
const HEAD_SIZE: f64 = 6.0;

/// How far a label beside its arrow is from it, in pixels, and the share of the way in which the direction is taken.
const BESIDE: f64 = 4.0;
const STEP: f64 = 0.02;

/// Half the width and half the height of lines of text.
fn half_of(lines: &[String]) -> Point {
    let (width, height) = text_size(lines);
    (width / 2.0, height / 2.0)
}

/// Relative positions of labels along an arrow.
const SHARES: [f64; 13] =
    [0.5, 0.46, 0.54, 0.42, 0.58, 0.37, 0.63, 0.32, 0.68, 0.26, 0.74, 0.18, 0.82];

impl Label {
    pub(crate) fn at(places: &[Point], lines: &[String]) -> Self {
        Self { places: places.to_vec(), lines: lines.to_vec(), arrow: None }
    }

    /// What it would cover at one of its places.
    fn cost(&self, area: Area, taken: &[Area], spots: &[Spot]) -> f64 {
        let covered: f64 = taken.iter().map(|other| area.shared_with(*other)).sum();
        let crossed = spots.iter().filter(|spot| spot.is_head || self.arrow != Some(spot.arrow));
        let crossed = crossed.map(|spot| {
            let size = if spot.is_head { HEAD_SIZE } else { 0.0 };
            let (dx, dy) = (spot.place.0 - area.centre.0, spot.place.1 - area.centre.1);
            let is_covered = dx.abs() < area.half.0 + size && dy.abs() < area.half.1 + size;
            match (is_covered, spot.is_head) {
                (false, _) => 0.0,
                (true, false) => POINT,
                (true, true) => HEAD,
            }
        });
        covered + crossed.sum::<f64>()
    }

    /// The first place where nothing is covered, or else the one where the least is.
    pub(crate) fn free_place(&self, half: Point, taken: &[Area], spots: &[Spot]) -> Point {
        let mut best = (f64::INFINITY, Point::default());
        for &centre in &self.places {
            let cost = self.cost(Area { centre, half }, taken, spots);
            if cost < best.0 {
                best = (cost, centre);
            }
        }
        best.1
    }

    /// On quadratic curves, each by its start, its control point and its end, or else beside them.
    pub(crate) fn along(arrow: usize, pieces: &[(Point, Point, Point)], lines: &[String]) -> Self {
        let half = half_of(lines);
        let on = SHARES.into_iter().map(|share| on_curves(pieces, share));
        let sides = SHARES.into_iter().flat_map(|share| [(share, 1.0), (share, -1.0)]);
        let beside = sides.map(|(share, side)| {
            let (x, y) = on_curves(pieces, share);
            let (before, behind) =
                (on_curves(pieces, share - STEP), on_curves(pieces, share + STEP));
            let (dx, dy) = (behind.0 - before.0, behind.1 - before.1);
            let length = dx.hypot(dy).max(1e-6);
            let (across, down) = (side * dy / length, side * -dx / length);
            let distance = across.abs() * half.0 + down.abs() * half.1 + BESIDE;
            (x + across * distance, y + down * distance)
        });
        Self { places: on.chain(beside).collect(), lines: lines.to_vec(), arrow: Some(arrow) }
    }
}

/// The point at a share of the way along quadratic curves.
pub(crate) fn on_curves(pieces: &[(Point, Point, Point)], share: f64) -> Point {
    let way = share * pieces.len() as f64;
    let number = (way as usize).min(pieces.len() - 1);
    let (start, control, end) = pieces[number];
    let t = way - number as f64;
    let (a, b, c) = ((1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t);
    (a * start.0 + b * control.0 + c * end.0, a * start.1 + b * control.1 + c * end.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_gives_way_to_what_stands_there() {
        let line = [((0.0, 0.0), (50.0, 0.0), (100.0, 0.0))];
        let label = Label::along(0, &line, &["go".to_owned()]);
        let half = (7.0, 7.0);
        assert_eq!(label.free_place(half, &[], &[]), (50.0, 0.0));
        let other = Area { centre: (50.0, 0.0), half };
        let place = label.free_place(half, &[other], &[]);
        assert!((place.0 - 50.0).abs() >= 14.0, "{place:?}");
        let fixed = Label::at(&[(50.0, 0.0)], &["go".to_owned()]);
        assert_eq!(fixed.free_place(half, &[other], &[]), (50.0, 0.0));
        // It covers its own arrow, but neither another one nor a head.
        let spot = |arrow: usize, is_head: bool| Spot { place: (50.0, 0.0), arrow, is_head };
        assert_eq!(label.free_place(half, &[], &[spot(0, false)]), (50.0, 0.0));
        for spot in [spot(1, false), spot(1, true), spot(0, true)] {
            assert_ne!(label.free_place(half, &[], &[spot]), (50.0, 0.0), "{spot:?}");
        }
    }
}
