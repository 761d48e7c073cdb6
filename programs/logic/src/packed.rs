//! Packed images: a bit for each signal, 64 in a word, the first in the lowest bit; unused high bits are 0.

/// The bit at `place`.
///
/// # Panics
/// If the image is shorter.
pub fn bit(image: &[u64], place: usize) -> bool {
    image[place / 64] >> (place % 64) & 1 == 1
}

/// The places of the ones in a word, ascending.
pub fn ones(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = word.trailing_zeros() as usize;
        (word != 0).then(|| {
            word &= word - 1;
            place
        })
    })
}

/// The places of the ones in an image, ascending.
pub fn ones_in(image: &[u64]) -> impl Iterator<Item = usize> {
    let words = image.iter().enumerate();
    words.flat_map(|(place, &word)| ones(word).map(move |bit| 64 * place + bit))
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
