//! From packed images of 64 runs to lanes, and back.

/// Exchanges bit j of word k for bit k of word j: words that are images of runs become words that are elements, with a run in each bit; and the other way
/// round. Halves, then quarters, down to single bits.
pub fn transpose(block: &mut [u64; 64]) {
    let mut width = 32;
    let mut mask = u64::MAX >> 32;
    while width != 0 {
        let mut row = 0;
        while row < 64 {
            let moved = (block[row] >> width ^ block[row | width]) & mask;
            block[row] ^= moved << width;
            block[row | width] ^= moved;
            row = ((row | width) + 1) & !width;
        }
        width >>= 1;
        mask ^= mask << width;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_transposed_bit_by_bit() {
        let mut seed = 1_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            seed ^ seed >> 29
        };
        let block: [u64; 64] = std::array::from_fn(|_| next());
        let mut turned = block;
        transpose(&mut turned);
        for (row, word) in block.iter().enumerate() {
            for (column, other) in turned.iter().enumerate() {
                assert_eq!(word >> column & 1, other >> row & 1);
            }
        }
    }
}
