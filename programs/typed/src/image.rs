//! Where each point of a process image stands.
//!
//! An image is a row of bits. A point takes as many as its type is wide, at a multiple of its width, in order of declaration; so one of BOOLs alone
//! is the image of a circuit, and no point crosses a word of 64 bits.

use crate::types::Elementary;

/// An input or output of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Point {
    /// Its name, as declared.
    pub name: String,
    /// Its type.
    pub of: Elementary,
    /// Its first bit in the image.
    pub bit: u32,
    /// Where it stands in the program's state, as a slot.
    pub slot: u32,
}

impl Point {
    /// Its value in a packed image, zero-extended.
    ///
    /// # Panics
    /// If the image is shorter than the point needs.
    #[inline]
    pub fn get(&self, image: &[u64]) -> u64 {
        image[self.bit as usize / 64] >> (self.bit % 64) & self.of.mask()
    }

    /// Writes its value into a packed image.
    ///
    /// # Panics
    /// If the image is shorter than the point needs.
    #[inline]
    pub fn set(&self, image: &mut [u64], value: u64) {
        let word = &mut image[self.bit as usize / 64];
        let shift = self.bit % 64;
        *word = *word & !(self.of.mask() << shift) | (value & self.of.mask()) << shift;
    }
}

/// The points of an image, in order of declaration.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Points {
    points: Vec<Point>,
    width: u32,
}

impl Points {
    /// Appends a point at the next multiple of its width.
    pub fn push(&mut self, name: impl Into<String>, of: Elementary, slot: u32) {
        let bit = self.width.next_multiple_of(of.bits());
        self.width = bit + of.bits();
        self.points.push(Point { name: name.into(), of, bit, slot });
    }

    /// The point of a name.
    pub fn find(&self, name: &str) -> Option<&Point> {
        self.points.iter().find(|point| point.name == name)
    }

    /// The names of all points, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.points.iter().map(|point| point.name.as_str())
    }

    /// A name for each bit of the image: that of its point where it is a BOOL, else `NAME.0` for its lowest bit and so on; empty for a bit of no
    /// point.
    pub fn bit_names(&self) -> Vec<String> {
        let mut names = vec![String::new(); self.width()];
        for point in &self.points {
            let first = point.bit as usize;
            for (place, name) in names[first..][..point.of.bits() as usize].iter_mut().enumerate() {
                *name = match point.of {
                    Elementary::Bool => point.name.clone(),
                    _ => format!("{}.{place}", point.name),
                };
            }
        }
        names
    }

    /// Bits of the image.
    pub fn width(&self) -> usize {
        self.width as usize
    }

    /// The points, in order.
    pub fn iter(&self) -> std::slice::Iter<'_, Point> {
        self.points.iter()
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}

impl<'a> IntoIterator for &'a Points {
    type Item = &'a Point;
    type IntoIter = std::slice::Iter<'a, Point>;

    fn into_iter(self) -> Self::IntoIter {
        self.points.iter()
    }
}
