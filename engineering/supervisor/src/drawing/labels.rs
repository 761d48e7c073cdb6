//! Positions of labels on their arrows.

use super::layout::Point;

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
}

/// Relative positions of labels along an arrow.
const SHARES: [f64; 9] = [0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74, 0.18, 0.82];

impl Label {
    pub(crate) fn at(place: Point, lines: &[String]) -> Self {
        Self { places: vec![place], lines: lines.to_vec() }
    }

    /// Along quadratic curves, each by its start, its control point and its end.
    pub(crate) fn along(pieces: &[(Point, Point, Point)], lines: &[String]) -> Self {
        let place = |share: f64| {
            let way = share * pieces.len() as f64;
            let number = (way as usize).min(pieces.len() - 1);
            let (start, control, end) = pieces[number];
            let t = way - number as f64;
            let (a, b, c) = ((1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t);
            (a * start.0 + b * control.0 + c * end.0, a * start.1 + b * control.1 + c * end.1)
        };
        Self { places: SHARES.into_iter().map(place).collect(), lines: lines.to_vec() }
    }
}

/// The first place where nothing is covered, or else the one where the least is.
pub(crate) fn free_place(places: &[Point], half: Point, taken: &[Area]) -> Point {
    let covered = |centre: Point| -> f64 {
        let label = Area { centre, half };
        taken.iter().map(|other| label.shared_with(*other)).sum()
    };
    let mut best = (f64::INFINITY, Point::default());
    for &place in places {
        let area = covered(place);
        if area < best.0 {
            best = (area, place);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_gives_way_to_what_stands_there() {
        let line = [((0.0, 0.0), (50.0, 0.0), (100.0, 0.0))];
        let label = Label::along(&line, &["go".to_owned()]);
        let half = (7.0, 7.0);
        assert_eq!(free_place(&label.places, half, &[]), (50.0, 0.0));
        let other = Area { centre: (50.0, 0.0), half };
        let place = free_place(&label.places, half, &[other]);
        assert!((place.0 - 50.0).abs() >= 14.0, "{place:?}");
        assert_eq!(free_place(&[(50.0, 0.0)], half, &[other]), (50.0, 0.0));
    }
}
