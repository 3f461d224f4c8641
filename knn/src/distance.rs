//! The squared Euclidean distance between two quantised feature vectors.
//!
//! A difference of two bytes is squared by one 8 x 8 bit multiplication, whose result fits 16 bits. The squares are
//! summed in 16 bits and the carries counted in a byte beside them: 24 bits in all, enough for [`MAX_FEATURES`]
//! features at their farthest apart. No square root is taken, as it would not change which example is nearer.

/// The most features that an example can have: 258 differences of 255 squared still fit 24 bits.
pub const MAX_FEATURES: usize = 258;

/// One more than the largest number of 24 bits. Every distance is below `DISTANCE_LIMIT - 1`.
pub(crate) const DISTANCE_LIMIT: u32 = 1 << 24;

const _: () = assert!(
    MAX_FEATURES as u64 * 255 * 255 < DISTANCE_LIMIT as u64 - 1,
    "the largest distance must stay below 24 bits of ones, which stands for `no neighbour`"
);

/// Squared Euclidean distance, from 0 to `FEATURES * 65_025`.
///
/// More than [`MAX_FEATURES`] features do not compile.
///
/// ```
/// assert_eq!(knn::squared_distance(&[10, 250], &[13, 254]), 3 * 3 + 4 * 4);
/// assert_eq!(knn::squared_distance(&[0; 5], &[255; 5]), 5 * 255 * 255);
/// ```
#[inline(always)]
#[must_use]
pub fn squared_distance<const FEATURES: usize>(
    left: &[u8; FEATURES],
    right: &[u8; FEATURES],
) -> u32 {
    const {
        assert!(
            FEATURES <= MAX_FEATURES,
            "an example has at most 258 features"
        )
    };
    let mut low: u16 = 0;
    let mut carries: u8 = 0;
    for (&left, &right) in left.iter().zip(right) {
        let difference = u16::from(left.abs_diff(right));
        let (sum, carry) = low.overflowing_add(difference * difference);
        low = sum;
        carries = carries.wrapping_add(u8::from(carry));
    }
    (u32::from(carries) << 16) | u32::from(low)
}
