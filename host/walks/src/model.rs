//! What the beam has shown of the ground, in the plainest form: whole numbers that never wrap, and a memory that never forgets.
//!
//! The ground is counted in the encoder's ticks. For each of them that the beam has come to, the model knows whether the
//! beam was broken there when it first came, and two things only open such ground to the tool again: that it was taken for a
//! weed while it was whole, and the operator's word. `start now` is that word. It counts for the ground of which `status` says
//! that the machine does not know it, never seen or seen and forgotten, and for no other. An alarm opens nothing.
//!
//! What the machine says that it guards is as closed as a canopy from then on, whoever may stand there.
//!
//! Where the encoder's count goes wrong, the row is shifted under it by what was lost or made up: the model then still holds
//! what the beam has shown at each count, which is all that the machine can know.

/// Ground over which the beam was broken without a break.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// The first place at which the beam was broken.
    pub leading: i64,
    /// The last.
    pub trailing: i64,
    /// How far off the machine may have it: by what its sensor's answer takes, as it is set.
    blur: i64,
    /// How far its margin goes at the most: the operator's word ends it.
    margin_to: i64,
    /// Whether the tool may work here: it was taken for a weed, or the operator has said so.
    is_free: bool,
}

/// The ground as the beam has shown it.
#[derive(Debug)]
pub struct Model {
    /// All behind this place is unknown.
    known_from: i64,
    /// The first place that was looked at.
    begin: i64,
    /// The farthest place that the beam has come to.
    frontier: i64,
    /// Whether the beam is broken where it is, and whether the last run goes on at the frontier.
    broken: bool,
    is_growing: bool,
    /// In the order in which they lie.
    runs: Vec<Run>,
    /// Ground where a plant was due and none was seen, in the order in which it was told.
    guarded: Vec<Run>,
    /// Gaps that belong to a canopy, each with the frontier from which on it was set.
    merge_gaps: Vec<(i64, i64)>,
    /// An object no longer than this may have been taken for a weed, and nobody has said so.
    narrow: i64,
    /// What every place may be off by: the steps in which the machine remembers the ground, and the turn of the loop.
    slack: i64,
    /// As much of it as the grain of that memory, and the turn, make.
    grain_slack: i64,
    /// Whether the encoder's count has gone wrong.
    pub is_shifted: bool,
    /// Whether the machine has been so near to the end of its memory that it may have begun anew, or not.
    may_have_begun_anew: bool,
}

impl Model {
    /// Nothing is known but the beam's level.
    pub fn new(place: i64, broken: bool) -> Self {
        let mut model = Self {
            known_from: place,
            begin: place,
            frontier: place,
            broken,
            is_growing: false,
            runs: Vec::new(),
            guarded: Vec::new(),
            merge_gaps: Vec::new(),
            narrow: 0,
            slack: 0,
            grain_slack: 0,
            is_shifted: false,
            may_have_begun_anew: false,
        };
        model.touch(0);
        model
    }

    /// The settings as of now, with the beam at a place: clear ground that belongs to a canopy, and a metre. Rolled back by more
    /// than eight of them, the beam sees anew what it comes to; give or take five centimetres.
    pub fn follow(&mut self, place: i64, merge_gap: i64, metre: i64) {
        if self.frontier - place > 8 * metre - metre / 20 {
            self.known_from = self.known_from.min(place);
            self.may_have_begun_anew = true;
        }
        // The machine has done so by now, at eight metres as near as its turns let it.
        if self.frontier - place > 8 * metre + metre / 64 {
            self.begin_anew(self.frontier - 8 * metre);
        }
        let grain = 1 + metre / 2400;
        let slack = 2 + 2 * grain;
        self.slack += (slack - self.grain_slack).max(0);
        self.grain_slack = self.grain_slack.max(slack);
        if self.merge_gaps.last().is_none_or(|&(_, gap)| gap != merge_gap) {
            self.merge_gaps.push((self.frontier, merge_gap));
        }
    }

    /// Whether what the machine says of the ground may be of other ground than the model holds: nothing is to be held against it.
    pub fn is_in_doubt(&self) -> bool {
        self.is_shifted || self.may_have_begun_anew
    }

    /// The machine's places may be off by so many ticks more.
    pub fn loosen(&mut self, ticks: i64) {
        self.slack += ticks;
    }

    /// Of an object no longer than this the machine may make a weed without anybody being told.
    pub fn leave_narrow(&mut self, ticks: i64) {
        self.narrow = self.narrow.max(ticks);
    }

    /// What lies ahead of a place is seen anew.
    pub fn begin_anew(&mut self, place: i64) {
        self.known_from = self.known_from.min(place);
        self.begin = self.begin.min(place);
        (self.frontier, self.is_growing, self.may_have_begun_anew) = (place, false, false);
        self.runs.retain(|run| run.leading < place);
        self.runs.iter_mut().for_each(|run| run.trailing = run.trailing.min(place - 1));
        self.guarded.retain(|guarded| guarded.trailing < place);
        self.merge_gaps.clear();
    }

    /// The machine says that it guards the ground around a place, where a plant was due.
    ///
    /// # Errors
    /// What the beam has shown, where it has not seen all of that ground, or nothing stands so far behind that the plant was due.
    pub fn guard(&mut self, due: i64, spacing: i64, scatter: i64) -> Result<(), String> {
        if due + scatter > self.frontier + self.slack {
            return Err(format!("ground is guarded around {due}, and the beam has only come to {}", self.frontier));
        }
        // From the middle of a plant, which may have gaps, to that of the first, the second, or the third unseen behind it.
        let is_from = |first: usize| {
            self.runs[first..].iter().any(|last| {
                let middle = (self.runs[first].leading + last.trailing) / 2;
                let off = (1..=3).map(|unseen| (due - middle - unseen * spacing).abs()).min().unwrap_or(i64::MAX);
                off <= 4 * self.slack + 2 * self.runs[first].blur
            })
        };
        if !(0..self.runs.len()).any(is_from) {
            return Err(format!("ground is guarded around {due}, {spacing} behind none of {:?}", self.runs));
        }
        let (leading, trailing) = (due - scatter, due + scatter);
        self.guarded.push(Run { leading, trailing, blur: 0, margin_to: i64::MAX, is_free: false });
        Ok(())
    }

    /// The beam has come to a place, which the machine may have by `blur` elsewhere.
    pub fn roll_to(&mut self, place: i64, blur: i64) {
        if place > self.frontier {
            self.touch(blur);
            self.frontier = place;
            self.touch(blur);
        }
    }

    /// The beam breaks or clears at a place.
    pub fn edge(&mut self, place: i64, broken: bool, blur: i64) {
        self.roll_to(place, blur);
        self.broken = broken;
        if place == self.frontier {
            self.touch(blur);
        }
    }

    /// Something is in the beam at the frontier, or nothing is.
    fn touch(&mut self, blur: i64) {
        if !self.broken {
            self.is_growing = false;
            return;
        }
        let (here, goes_on) = (self.frontier, self.is_growing);
        match self.runs.last_mut() {
            Some(run) if !run.is_free && (goes_on || run.trailing == here) => {
                run.trailing = here;
                run.blur = run.blur.max(blur);
            }
            _ => self.runs.push(Run { leading: here, trailing: here, blur, margin_to: i64::MAX, is_free: false }),
        }
        self.is_growing = true;
    }

    /// The operator says that the tool may work from one place up to another, of which the machine knows nothing.
    pub fn trust(&mut self, from: i64, to: i64) {
        self.known_from = self.known_from.min(from);
        let parts = |run: &Run| {
            let part = |leading: i64, trailing: i64, is_free| {
                let (leading, trailing) = (leading.max(run.leading), trailing.min(run.trailing));
                (leading <= trailing).then_some(Run { leading, trailing, is_free, ..*run })
            };
            [part(i64::MIN, from - 1, run.is_free), part(from, to, true), part(to + 1, i64::MAX, run.is_free)]
        };
        self.runs = self.runs.iter().flat_map(parts).flatten().collect();
        self.guarded.retain(|guarded| guarded.trailing < from || guarded.leading > to);
        for run in self.runs.iter_mut().chain(&mut self.guarded).filter(|run| run.trailing < from) {
            run.margin_to = run.margin_to.min(from - 1);
        }
        // What the beam is still to come to there counts as little.
        if to > self.frontier {
            (self.frontier, self.is_growing) = (to, false);
        }
    }

    /// With the beam at a place, the machine has taken an object for a weed of so many ticks, give or take `tolerance`.
    ///
    /// # Errors
    /// What the beam has shown, where no whole object of this width has come to its end here.
    pub fn weed(&mut self, place: i64, width: i64, tolerance: i64) -> Result<(), String> {
        let last = self.runs.partition_point(|run| run.trailing <= place);
        let nearest = |last: usize| &self.runs[last.saturating_sub(4)..last];
        // What still goes on at the frontier is not over.
        let last = if self.is_growing && last == self.runs.len() { last.saturating_sub(1) } else { last };
        let shown = nearest(last).to_vec();
        for first in (0..last).rev() {
            let (leading, trailing) = (self.runs[first].leading, self.runs[last - 1].trailing);
            let tolerance =
                tolerance + self.slack + 2 * self.runs[first..last].iter().map(|run| run.blur).max().unwrap_or(0);
            let shortest_since = |place| self.merge_gaps_since(place).min().unwrap_or(0);
            let before = first.checked_sub(1).map(|before| self.runs[before].trailing);
            // What lies before it may have come to its end under another setting.
            let begins = before.is_none_or(|end| leading - end >= shortest_since(end) - tolerance);
            let is_whole = begins && place - trailing >= shortest_since(leading) - tolerance;
            if is_whole && (trailing - leading).abs_diff(width) <= tolerance as u64 {
                self.runs[first..last].iter_mut().for_each(|run| run.is_free = true);
                return Ok(());
            }
            let longest = self.merge_gaps_since(leading).max().unwrap_or(0);
            if before.is_none_or(|end| leading - end > longest + tolerance) {
                break;
            }
        }
        if self.runs[..last].is_empty() && place - width < self.begin {
            return Ok(());
        }
        Err(format!("a weed of {width} ticks was told at {place}, where the beam has shown {shown:?}"))
    }

    /// The gaps that were set while the beam came from a place on.
    fn merge_gaps_since(&self, place: i64) -> impl Iterator<Item = i64> {
        let first = self.merge_gaps.partition_point(|&(from, _)| from <= place).saturating_sub(1);
        self.merge_gaps[first..].iter().map(|&(_, gap)| gap)
    }

    /// Whether the tool is behind all that the beam has seen, with `near` the first place that it asks for.
    pub fn is_unseen(&self, near: i64) -> bool {
        near + self.slack < self.known_from
    }

    /// A canopy that the tool has to keep off, with its margin, somewhere from `near` to `far`.
    pub fn canopy_between(&self, near: i64, far: i64, margin: i64) -> Option<Run> {
        let first = self.runs.partition_point(|run| run.trailing + margin < near);
        let mut near_by = self.runs[first..].iter().take_while(|run| run.leading - margin <= far);
        let is_closed = |run: &&Run| self.is_met(run, near, far, margin) && (self.narrow == 0 || self.is_wide(run));
        let guarded = || self.guarded.iter().find(|run| self.is_met(run, near, far, margin));
        near_by.find(is_closed).or_else(guarded).copied()
    }

    /// Whether the ground around a run is closed for sure somewhere from `near` to `far`.
    fn is_met(&self, run: &Run, near: i64, far: i64, margin: i64) -> bool {
        self.bounds(run, margin).is_some_and(|(from, to)| from <= far && to >= near)
    }

    /// As [`canopy_between`](Self::canopy_between), where all of the ground is closed by canopies and their margins.
    pub fn canopies_all_over(&self, mut near: i64, far: i64, margin: i64) -> Option<Run> {
        loop {
            let run = self.canopy_between(near, near, margin)?;
            let (_, to) = self.bounds(&run, margin)?;
            if to >= far {
                return Some(run);
            }
            near = to + 1;
        }
    }

    /// Whether a run belongs to an object that is too wide for a weed: with the runs so near to it that they are of the same one.
    fn is_wide(&self, run: &Run) -> bool {
        let place = self.runs.partition_point(|other| other.leading < run.leading);
        let gap = |first: usize, next: usize| {
            let shortest = self.merge_gaps_since(self.runs[first].leading).min().unwrap_or(0);
            let blur = self.runs[first].blur.max(self.runs[next].blur);
            let is_same = self.runs[next].leading - self.runs[first].trailing < shortest - self.slack - 2 * blur;
            is_same && !self.runs[first].is_free && !self.runs[next].is_free
        };
        let first = (1..=place).rev().find(|&next| !gap(next - 1, next)).unwrap_or(0);
        let last = (place..self.runs.len() - 1).find(|&first| !gap(first, first + 1)).unwrap_or(self.runs.len() - 1);
        let blur = self.runs[first..=last].iter().map(|run| run.blur).max().unwrap_or(0);
        self.runs[last].trailing - self.runs[first].leading > self.narrow + self.slack + 2 * blur
    }

    /// The ground around a run that is closed for sure; none where the tool may work, or the machine may have seen nothing.
    fn bounds(&self, run: &Run, margin: i64) -> Option<(i64, i64)> {
        let slack = self.slack + 2 * run.blur;
        let is_canopy = !run.is_free && run.trailing - run.leading > slack;
        is_canopy.then_some((run.leading - margin + slack, (run.trailing + margin - slack).min(run.margin_to)))
    }

    /// The window that a tool rolling on from a place comes to next: its canopy's first and last place.
    pub fn next_window(&self, place: i64, forward: bool, margin: i64) -> Option<Run> {
        if forward {
            self.runs
                .iter()
                .rev()
                .take_while(|run| run.trailing + margin >= place)
                .filter(|run| !run.is_free)
                .last()
                .copied()
        } else {
            self.runs.iter().take_while(|run| run.leading - margin <= place).filter(|run| !run.is_free).last().copied()
        }
    }
}
