//! The objects that were judged last, so that they can be looked at and labelled.

use crate::ground::{class::Vote, features::Features};
use heapless::Vec;

/// Objects remembered.
const CAPACITY: usize = 16;

/// An object as it was judged: what its features follow from, in less room than they take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judged {
    pub(crate) speed_class_mm_s: i16,
    pub(crate) spacing_mm: i16,
    pub(crate) width_mm: i16,
    /// What it was taken for.
    pub vote: Vote,
    /// What the operator said that it is, one of [`label`](crate::ground::class::label).
    pub label: Option<u8>,
}

impl Judged {
    /// Its features.
    pub fn features(&self) -> Features {
        Features::describe(self.speed_class_mm_s, self.spacing_mm, self.width_mm)
    }
}

/// The last objects.
#[derive(Clone, Debug)]
pub struct Objects(Vec<Judged, CAPACITY, u8>);

impl Objects {
    /// None.
    pub const NONE: Self = Self(Vec::new());

    /// Remembers an object, and drops the oldest one where there is no room.
    pub fn remember(&mut self, object: Judged) {
        if self.0.is_full() {
            self.0.remove(0);
        }
        // There is room, as was just seen to.
        let _ = self.0.push(object);
    }

    /// The last one, unless it has its label.
    pub fn unlabelled(&mut self) -> Option<&mut Judged> {
        self.0.last_mut().filter(|object| object.label.is_none())
    }

    /// All of them, the oldest first.
    pub fn all(&self) -> &[Judged] {
        &self.0
    }
}
