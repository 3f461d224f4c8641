//! The count of votes.

use crate::Neighbour;

/// The votes of `CLASSES` classes.
#[derive(Clone, Debug)]
pub(crate) struct Ballot<const CLASSES: usize> {
    votes: [usize; CLASSES],
    /// Whether a voter's label is not a class.
    unknown: bool,
}

impl<const CLASSES: usize> Ballot<CLASSES> {
    /// No votes.
    pub(crate) const EMPTY: Self = Self { votes: [0; CLASSES], unknown: false };

    /// Adds `voters` votes for a class.
    #[inline]
    pub(crate) fn vote(&mut self, label: u8, voters: u8) {
        match self.votes.get_mut(usize::from(label)) {
            Some(votes) => *votes = votes.wrapping_add(voters.into()),
            None => self.unknown |= voters > 0,
        }
    }

    /// Adds a vote for each of these neighbours, at most 255.
    #[inline(always)]
    pub(crate) fn count(&mut self, voters: &[Neighbour]) {
        let [zeros, ones] = self.votes.as_mut_slice() else {
            return voters.iter().for_each(|voter| self.vote(voter.label(), 1));
        };
        // With two classes, the sum of the labels is the second one's votes: an 8-bit processor adds a label in fewer cycles than
        // it finds the votes of its class.
        let (mut sum, mut labels) = (0_u8, 0);
        for voter in voters {
            sum = sum.wrapping_add(voter.label());
            labels |= voter.label();
        }
        self.unknown |= labels > 1;
        *ones = ones.wrapping_add(sum.into());
        *zeros = zeros.wrapping_add(voters.len()).wrapping_sub(sum.into());
    }

    /// The votes of each class; `None` if a voter's label is not a class.
    #[inline(always)]
    pub(crate) const fn votes(&self) -> Option<[usize; CLASSES]> {
        if self.unknown { None } else { Some(self.votes) }
    }
}
