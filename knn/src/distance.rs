//! The squared Euclidean distance between two quantised feature vectors.
//!
//! The square of a difference of two bytes is one 8 x 8 bit multiplication, and fits 16 bits. The squares are summed in 32 bits;
//! 24 suffice. There is no square root: it would not change which example is nearer.

/// The most features of an example: 258 differences of 255, squared, still add up within 24 bits.
pub const MAX_FEATURES: usize = 258;

const _: () =
    assert!(MAX_FEATURES as u64 * 255 * 255 < (1 << 24) - 1, "a distance has 24 bits, and never are all of them ones");

/// Squared Euclidean distance, from 0 to `FEATURES * 65_025`.
///
/// More than [`MAX_FEATURES`] features do not compile.
///
/// ```
/// assert_eq!(knn::squared_distance(&[10, 250], &[13, 254]), 3 * 3 + 4 * 4);
/// assert_eq!(knn::squared_distance(&[0; 5], &[255; 5]), 5 * 255 * 255);
/// ```
#[inline]
#[must_use]
pub fn squared_distance<const FEATURES: usize>(left: &[u8; FEATURES], right: &[u8; FEATURES]) -> u32 {
    const { assert!(FEATURES <= MAX_FEATURES, "an example has at most 258 features") };
    let mut sum: u32 = 0;
    for (&left, &right) in left.iter().zip(right) {
        let difference = u16::from(left.abs_diff(right));
        sum += u32::from(difference * difference);
    }
    sum
}
