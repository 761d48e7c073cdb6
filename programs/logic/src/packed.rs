//! Packed images: a bit for each signal, 64 in a word, the first in the lowest bit; unused high bits are 0.

/// The bit at `place`.
///
/// # Panics
/// If the image is shorter.
pub fn bit(image: &[u64], place: usize) -> bool {
    image[place / 64] >> (place % 64) & 1 == 1
}

/// The image of `bits`.
pub fn pack(bits: impl IntoIterator<Item = bool>) -> Vec<u64> {
    let mut image = Vec::new();
    for (place, bit) in bits.into_iter().enumerate() {
        if place % 64 == 0 {
            image.push(0);
        }
        image[place / 64] |= u64::from(bit) << (place % 64);
    }
    image
}

/// The first `width` bits of an image.
///
/// # Panics
/// If the image is shorter.
pub fn unpack(image: &[u64], width: usize) -> Vec<bool> {
    (0..width).map(|place| bit(image, place)).collect()
}
