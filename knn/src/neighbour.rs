//! The nearest examples of a search, and how one more finds its place among them.
//!
//! They are sorted, farthest first, in as many places as examples are to vote. A neighbour is one number, its distance above
//! its label, so that comparing two compares distances first and labels next.

use crate::distance::DISTANCE_LIMIT;

/// An example as a search meets it: its squared distance, and its label.
///
/// Kept as the bytes of its [`key`](Self::key), the label first: an 8-bit processor looks at one of them faster than at a number of which
/// it would be a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Neighbour([u8; 4]);

impl Neighbour {
    /// Farther than every example: a place that nothing has taken yet.
    pub const FARTHEST: Self = Self::new(DISTANCE_LIMIT - 1, 0);

    /// An example at a squared distance, of which 24 bits are kept.
    #[inline]
    #[must_use]
    pub const fn new(distance: u32, label: u8) -> Self {
        let [low, middle, high, _] = distance.to_le_bytes();
        Self([label, low, middle, high])
    }

    /// A neighbour of another class that is as far.
    #[inline]
    #[must_use]
    pub const fn with_label(self, label: u8) -> Self {
        let Self([_, low, middle, high]) = self;
        Self([label, low, middle, high])
    }

    /// The distance in the upper 24 bits, the label in the lower 8.
    #[inline]
    #[must_use]
    pub const fn key(self) -> u32 {
        u32::from_le_bytes(self.0)
    }

    /// The squared distance.
    #[inline]
    #[must_use]
    pub const fn distance(self) -> u32 {
        self.key() >> 8
    }

    /// The class.
    #[inline]
    #[must_use]
    pub const fn label(self) -> u8 {
        self.0[0]
    }

    /// Whether it is no example, but [`FARTHEST`](Self::FARTHEST).
    #[inline]
    #[must_use]
    pub const fn is_none(&self) -> bool {
        // No example is so far that the distance's upper two bytes are all ones.
        u16::from_le_bytes([self.0[2], self.0[3]]) == u16::MAX
    }

    /// Whether both are at the same distance.
    #[inline]
    pub(crate) const fn is_as_far_as(&self, other: &Self) -> bool {
        self.0[1] == other.0[1] && self.0[2] == other.0[2] && self.0[3] == other.0[3]
    }

    /// Takes its place among the `nearest`, farthest first, where it is not too far for that.
    ///
    /// One has to make room: the farthest, or this one where it is no nearer. It goes to `level` if it is as far as the one that is
    /// the farthest then.
    ///
    /// ```
    /// use knn::Neighbour;
    ///
    /// let [near, far, farther] = [1, 4, 9].map(|distance| Neighbour::new(distance, 0));
    /// let mut nearest = [Neighbour::FARTHEST; 2];
    /// for neighbour in [farther, near, far] {
    ///     neighbour.join(&mut nearest, &mut |_| unreachable!("all have distances of their own"));
    /// }
    /// assert_eq!(nearest, [far, near]);
    ///
    /// let mut level = None;
    /// let as_far = Neighbour::new(4, 1);
    /// as_far.join(&mut nearest, &mut |neighbour| level = Some(neighbour));
    /// assert_eq!((nearest, level), ([far, near], Some(as_far)));
    /// ```
    #[inline]
    pub fn join(self, nearest: &mut [Self], level: &mut impl FnMut(Self)) {
        let out = self.displace(nearest);
        if !out.is_none() {
            level(out);
        }
    }

    /// [`join`](Self::join), but returns the one that is level; [`FARTHEST`](Self::FARTHEST) where none is.
    ///
    /// Out of line, as it takes more code than a call of it.
    #[inline(never)]
    fn displace(self, nearest: &mut [Self]) -> Self {
        let mut places = nearest.iter_mut();
        let Some(mut place) = places.next() else { return Self::FARTHEST };
        let mut out = self;
        if self.key() < place.key() {
            out = *place;
            for nearer in places {
                if self.key() >= nearer.key() {
                    break;
                }
                *place = *nearer;
                place = nearer;
            }
            *place = self;
        }
        match nearest.first() {
            Some(farthest) if farthest.is_as_far_as(&out) => out,
            _ => Self::FARTHEST,
        }
    }
}
