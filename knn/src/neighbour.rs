//! The nearest examples of a search, and how one more finds its place among them.
//!
//! They are sorted, farthest first, in as many places as examples are to vote. A neighbour is one number, its distance above
//! its label, so that comparing two compares distances first and labels next.

use crate::distance::DISTANCE_LIMIT;

/// An example as a search meets it: its squared distance, and its label.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Neighbour(u32);

impl Neighbour {
    /// Farther than every example: a place that nothing has taken yet.
    pub const FARTHEST: Self = Self::new(DISTANCE_LIMIT - 1, 0);

    /// An example at a squared distance, of which 24 bits are kept.
    #[inline]
    #[must_use]
    pub const fn new(distance: u32, label: u8) -> Self {
        Self(distance << 8 | label as u32)
    }

    /// A neighbour of another class that is as far.
    #[inline]
    #[must_use]
    pub const fn with_label(self, label: u8) -> Self {
        Self(self.0 & !0xFF | label as u32)
    }

    /// The distance in the upper 24 bits, the label in the lower 8.
    #[inline]
    #[must_use]
    pub const fn key(self) -> u32 {
        self.0
    }

    /// The squared distance.
    #[inline]
    #[must_use]
    pub const fn distance(self) -> u32 {
        self.0 >> 8
    }

    /// The class.
    #[inline]
    #[must_use]
    pub const fn label(self) -> u8 {
        self.0 as u8
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
        let mut places = nearest.iter_mut();
        let Some(mut place) = places.next() else { return };
        let farthest = *place;
        let out = if self >= farthest {
            self
        } else {
            for nearer in places {
                if self >= *nearer {
                    break;
                }
                *place = *nearer;
                place = nearer;
            }
            *place = self;
            farthest
        };
        if nearest.first().is_some_and(|farthest| farthest.distance() == out.distance()) && out != Self::FARTHEST {
            level(out);
        }
    }
}
