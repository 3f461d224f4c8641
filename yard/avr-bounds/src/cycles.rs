//! The longest time of a routine, and the longest stretch in which no interrupt is served.
//!
//! A path's length is the sum of its instructions' cycles, with the called functions. For a loop, the longest path of
//! one turn is found first, from the loop's head back to it. It is multiplied by the loop bound. Inner loops are
//! calculated before outer loops. A loop bound comes from the source. Without one it is the larger of the bound in a
//! table ([`crate::loops`]) and the counted one (`counted`). Without any bound the loop is taken once, and its head is
//! kept in the result. Such a result is no bound.
//!
//! Paths that never end are left out, such as a loop that waits for the watchdog's reset.

use crate::counted;
use crate::decode::Operation;
use crate::paths::{circles, entering, loops, reaching, runs_once};
use crate::routine::{Edge, Nested, Node, Routine};
use crate::values::Interrupts;
use std::collections::{BTreeMap, BTreeSet};

/// A longer time counts as unbounded: 19 hours at 16 MHz. So sums of the other times do not overflow.
const MOST_CYCLES: u64 = 1 << 40;

/// A longest time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Time {
    /// Cycles. Every loop without a bound counts one turn.
    pub(crate) cycles: u64,
    /// Addresses of the heads of unbounded loops in it.
    pub(crate) unbounded: BTreeSet<u32>,
}

impl Time {
    pub(crate) fn of(cycles: u64) -> Time {
        Time { cycles, unbounded: BTreeSet::new() }
    }

    pub(crate) fn and(&self, other: &Time) -> Time {
        Time { cycles: self.cycles.saturating_add(other.cycles), unbounded: &self.unbounded | &other.unbounded }
    }

    fn and_cycles(&self, cycles: u32) -> Time {
        self.and(&Time::of(cycles.into()))
    }
}

/// The longer of the known times. Unbounded loops in either make the result unknown.
pub(crate) fn longer(one: Option<Time>, other: Option<Time>) -> Option<Time> {
    match (one, other) {
        (Some(one), Some(other)) => {
            Some(Time { cycles: one.cycles.max(other.cycles), unbounded: &one.unbounded | &other.unbounded })
        }
        (one, other) => one.or(other),
    }
}

/// The stated loop bounds.
#[derive(Clone, Default)]
pub(crate) struct Passes {
    /// By addresses in loops: the most executions of the address for each entry to the loop.
    pub(crate) stated: BTreeMap<u32, u64>,
    /// By addresses where loops may begin: the bounds of the outermost loop and of each depth within it.
    pub(crate) of_heads: BTreeMap<u32, Vec<u64>>,
    /// Addresses in functions with a single loop, which turns once for each byte of a length, and once more.
    pub(crate) by_length: BTreeSet<u32>,
}

/// The two kinds of stretch without interrupts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Stretch {
    /// From the end of the instruction that clears the interrupt flag to the end of the one that sets it.
    FlagClear,
    /// From one moment at which an interrupt can be served to the next, with one instruction before and one after, and
    /// with the wake-up from a sleep.
    Closed,
}

impl Stretch {
    /// Whether a place lies in such a stretch.
    fn has(self, node: &Node) -> bool {
        match self {
            Stretch::FlagClear => node.place.interrupts == Interrupts::Off,
            Stretch::Closed => node.place.interrupts != Interrupts::On,
        }
    }
}

/// What counts of the time of a path.
#[derive(Clone, Copy)]
enum Count {
    /// All of it, with the called functions.
    Whole,
    /// The part in one stretch, with the called functions.
    Stretch(Stretch),
    /// All of it, without the called functions.
    Own,
}

/// The longest stretches of a routine; `None` where it has none.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stretches {
    /// From the entry to a return, completely without interrupts.
    through: Option<Time>,
    /// From the entry to the first moment with interrupts.
    first: Option<Time>,
    /// From the last moment with interrupts to a return.
    last: Option<Time>,
    /// From one moment with interrupts to the next.
    pub(crate) inner: Option<Time>,
}

/// Times routines, each once.
#[derive(Default)]
pub(crate) struct Timer {
    passes: Passes,
    /// Additional cycles of an interrupt that ends a sleep.
    wake_up_cycles: u32,
    longest: BTreeMap<*const Routine, Option<Time>>,
    stretches: BTreeMap<(*const Routine, Stretch), Stretches>,
    /// For functions that are called with a constant length.
    of_lengths: BTreeMap<(*const Routine, u16), Timer>,
}

impl Timer {
    pub(crate) fn new(passes: Passes, wake_up_cycles: u32) -> Timer {
        Timer { passes, wake_up_cycles, ..Timer::default() }
    }

    /// The longest path from a routine's entry to the end of a return; `None` if it never returns.
    pub(crate) fn longest(&mut self, routine: &Routine) -> Option<Time> {
        if let Some(known) = self.longest.get(&std::ptr::from_ref(routine)) {
            return known.clone();
        }
        let nodes = &routine.nodes;
        let returning = reaching(nodes, |node| nodes[node].returns.is_some());
        let times = self.times(routine, &|node| returning[node], vec![(0, Time::default())], Count::Whole);
        let time = ends(nodes, &times);
        self.longest.insert(routine, time.clone());
        time
    }

    /// The longest paths from a routine's entry to the end of some places, and from there to the end of a return.
    pub(crate) fn around(&mut self, routine: &Routine, is_place: impl Fn(&Node) -> bool) -> Option<(Time, Time)> {
        let nodes = &routine.nodes;
        let returning = reaching(nodes, |node| nodes[node].returns.is_some());
        let begin = || vec![(0, Time::default())];
        let before = self.times(routine, &|node| returning[node], begin(), Count::Whole);
        let places: Vec<usize> = (0..nodes.len()).filter(|&node| is_place(&nodes[node])).collect();
        let (mut to, mut behind) = (None, Vec::new());
        for &place in &places {
            for edge in &nodes[place].edges {
                to = longer(to, before[place].as_ref().map(|time| time.and_cycles(edge.cycles)));
                behind.push((edge.to, Time::default()));
            }
        }
        let after = self.times(routine, &|node| returning[node], behind, Count::Whole);
        let is_passed_again = places.iter().any(|&place| after[place].is_some());
        // Every path must pass one of the places.
        let is_other = |node| returning[node] && !places.contains(&node);
        let others = self.times(routine, &is_other, begin(), Count::Whole);
        let is_passed_by = ends(nodes, &others).is_some() && !places.contains(&0);
        if is_passed_again || is_passed_by {
            return None;
        }
        Some((to?, ends(nodes, &after)?))
    }

    /// The stretches in a routine and in the functions that it calls.
    pub(crate) fn stretches(&mut self, routine: &Routine, kind: Stretch) -> Stretches {
        let key = (std::ptr::from_ref(routine), kind);
        if let Some(known) = self.stretches.get(&key) {
            return known.clone();
        }
        let nodes = &routine.nodes;
        let mut found = Stretches::default();
        // The beginnings of stretches: after an instruction outside of stretches, or in a called function.
        let mut begins = Vec::new();
        for node in nodes {
            for (_, length, called) in node.calls() {
                found.inner = longer(found.inner, self.of_call(called, length).stretches(called, kind).inner);
            }
            // An instruction outside lets interrupts in before and after it.
            let alone = |cycles: u32| (kind == Stretch::Closed && !kind.has(node)).then(|| Time::of(cycles.into()));
            for edge in &node.edges {
                let cycles = edge.cycles + self.waking(node);
                let is_inside = kind.has(&nodes[edge.to]);
                if let (Some(called), true) = (&edge.through, is_inside) {
                    let last = self.of_call(called, edge.length).stretches(called, kind).last;
                    begins.extend(last.map(|last| (edge.to, last)));
                }
                if edge.through.is_none() && is_inside && !kind.has(node) {
                    begins.push((edge.to, alone(cycles).unwrap_or_default()));
                } else {
                    found.inner = longer(found.inner, alone(cycles));
                }
            }
            found.inner = longer(found.inner, node.returns.and_then(alone));
        }
        // The stretches that begin here, and the one at the routine's entry.
        (found.last, found.inner) = self.run(routine, kind, begins, found.inner);
        if kind.has(&nodes[0]) {
            (found.through, found.first) = self.run(routine, kind, vec![(0, Time::default())], None);
        }
        self.stretches.insert(key, found.clone());
        found
    }

    /// The cycles that an interrupt waits longer at the end of this instruction: those of the wake-up, if it is `sleep`.
    fn waking(&self, node: &Node) -> u32 {
        if node.instruction.operation == Operation::Sleep { self.wake_up_cycles } else { 0 }
    }

    /// The longest of the stretches with these beginnings: to a return, and to a moment with interrupts.
    fn run(
        &mut self,
        routine: &Routine,
        kind: Stretch,
        begins: Vec<(usize, Time)>,
        longest: Option<Time>,
    ) -> (Option<Time>, Option<Time>) {
        let nodes = &routine.nodes;
        let mut ending = Vec::new();
        for node in nodes {
            let opening = node.edges.iter().filter(|edge| edge.through.is_none() && !kind.has(&nodes[edge.to]));
            let waking = self.waking(node);
            let mut end = opening.map(|edge| Some(Time::of((edge.cycles + waking).into()))).fold(None, longer);
            for (cycles, length, called) in node.calls() {
                // The stretch continues in the called function. It ends at once if interrupts are on there.
                let first = if kind.has(&called.nodes[0]) {
                    self.of_call(called, length).stretches(called, kind).first
                } else {
                    Some(Time::default())
                };
                end = longer(end, first.map(|first| first.and_cycles(cycles)));
            }
            ending.push(end);
        }
        let leading =
            reaching(nodes, |node| kind.has(&nodes[node]) && (nodes[node].returns.is_some() || ending[node].is_some()));
        let times = self.times(routine, &|node| kind.has(&nodes[node]) && leading[node], begins, Count::Stretch(kind));
        let (mut to_return, mut to_open) = (None, longest);
        for ((node, time), end) in nodes.iter().zip(&times).zip(&ending) {
            let Some(time) = time else { continue };
            if let Some(cycles) = node.returns {
                // A return that the flag has been set in front of is the last instruction of its stretch.
                let found = if node.place.interrupts == Interrupts::Off { &mut to_return } else { &mut to_open };
                *found = longer(found.take(), Some(time.and_cycles(cycles)));
            }
            if let Some(end) = end {
                to_open = longer(to_open, Some(time.and(end)));
            }
        }
        (to_return, to_open)
    }

    /// The longest turn of a loop that feeds the watchdog: from one `is_fed` to the next. `None` without such a loop. The
    /// turn of a loop that only a called function does so for is unknown.
    pub(crate) fn turn(&mut self, routine: &Routine, is_fed: impl Fn(&Node) -> bool) -> Option<Time> {
        let nodes = &routine.nodes;
        let mut turn = None;
        let edges = |node: usize| nodes[node].edges.iter().map(|edge| edge.to).collect();
        for circle in loops(&(0..nodes.len()).collect(), &edges) {
            let mut places = circle.iter().map(|&node| &nodes[node]);
            let caller = if places.clone().any(&is_fed) { None } else { places.find(|node| node.feeds()) };
            turn = longer(turn, caller.map(|node| Time { cycles: 0, unbounded: [node.place.address].into() }));
        }
        for fed in (0..nodes.len()).filter(|&node| is_fed(&nodes[node])) {
            let circle = reaching(nodes, |node| node == fed);
            let begins = nodes[fed].edges.iter().map(|edge| (edge.to, Time::of(edge.cycles.into()))).collect();
            let times = self.times(routine, &|node| node != fed && circle[node], begins, Count::Whole);
            for (node, time) in nodes.iter().zip(&times) {
                let Some(time) = time else { continue };
                for edge in node.edges.iter().filter(|edge| edge.to == fed) {
                    turn = longer(turn, self.time_of(node, edge, Count::Whole).map(|own| time.and(&own)));
                }
            }
        }
        turn
    }

    /// The time of an edge.
    fn time_of(&mut self, node: &Node, edge: &Edge, count: Count) -> Option<Time> {
        let called = match (&edge.through, count) {
            (_, Count::Own) => return Some(Time::of(edge.cycles.into())),
            (None, _) => Time::default(),
            (Some(called), Count::Whole) => self.of_call(called, edge.length).longest(called)?,
            (Some(called), Count::Stretch(kind)) => self.of_call(called, edge.length).stretches(called, kind).through?,
        };
        let mut time = called.and_cycles(edge.cycles);
        if node.waits || time.unbounded.is_empty() && time.cycles > MOST_CYCLES {
            time.unbounded.insert(node.place.address);
        }
        Some(time)
    }

    /// The timer for a call: another one if the called function turns by a length, and this length is constant.
    fn of_call(&mut self, called: &Routine, length: Option<u16>) -> &mut Timer {
        let is_by_length = self.passes.by_length.contains(&called.entry.address);
        let Some(length) = length.filter(|_| is_by_length) else { return self };
        let wake_up_cycles = self.wake_up_cycles;
        self.of_lengths.entry((std::ptr::from_ref(called), length)).or_insert_with(|| {
            let passes = vec![u64::from(length) + 1];
            let of_heads = called.nodes.iter().map(|node| (node.place.address, passes.clone())).collect();
            Timer::new(Passes { of_heads, ..Passes::default() }, wake_up_cycles)
        })
    }

    /// The heads of a routine's own unbounded loops, except loops that it never leaves.
    pub(crate) fn loops_without_bound(&mut self, routine: &Routine) -> BTreeSet<u32> {
        let nodes = &routine.nodes;
        let mut found = BTreeSet::new();
        // For a loop that is never left: its inner loops.
        let mut sets = vec![(0..nodes.len()).collect::<BTreeSet<usize>>()];
        while let Some(set) = sets.pop() {
            for circle in loops(&set, &|node| nodes[node].edges.iter().map(|edge| edge.to).collect()) {
                let is_left = circle.iter().any(|&node| {
                    nodes[node].returns.is_some() || nodes[node].edges.iter().any(|edge| !circle.contains(&edge.to))
                });
                let entry = circle.contains(&0).then_some(0);
                let heads: BTreeSet<usize> = entering(nodes, &circle).map(|edge| edge.to).chain(entry).collect();
                let heads = if heads.is_empty() { circle.iter().copied().take(1).collect() } else { heads };
                if is_left {
                    let begins = heads.iter().map(|&head| (head, Time::default())).collect();
                    let times = self.times(routine, &|node| circle.contains(&node), begins, Count::Own);
                    for time in times.iter().flatten() {
                        found.extend(&time.unbounded);
                    }
                } else {
                    sets.push(circle.difference(&heads).copied().collect());
                }
            }
        }
        found
    }

    /// The longest time from the starting places to the beginning of each place, over places that are `within`.
    fn times(
        &mut self,
        routine: &Routine,
        within: &dyn Fn(usize) -> bool,
        begins: Vec<(usize, Time)>,
        count: Count,
    ) -> Vec<Option<Time>> {
        let nodes = &routine.nodes;
        let mut edges: Vec<Vec<(usize, Time)>> = Vec::with_capacity(nodes.len());
        for (number, node) in nodes.iter().enumerate() {
            let mut leading = Vec::new();
            for edge in node.edges.iter().filter(|edge| within(number) && within(edge.to)) {
                leading.extend(self.time_of(node, edge, count).map(|time| (edge.to, time)));
            }
            edges.push(leading);
        }
        let mut times = vec![None; nodes.len()];
        for (node, time) in begins.into_iter().filter(|(node, _)| within(*node)) {
            times[node] = longer(times[node].take(), Some(time));
        }
        let all = (0..nodes.len()).filter(|&node| within(node)).collect();
        Paths { routine, edges: &edges, passes: &self.passes }.fill(all, &BTreeSet::new(), &mut times);
        times
    }
}

/// The longest time to the end of a return.
fn ends(nodes: &[Node], times: &[Option<Time>]) -> Option<Time> {
    let ends = nodes.iter().zip(times).map(|(node, time)| Some(time.as_ref()?.and_cycles(node.returns?)));
    ends.fold(None, longer)
}

/// Longest paths over places and edges.
struct Paths<'a> {
    routine: &'a Routine,
    edges: &'a [Vec<(usize, Time)>],
    passes: &'a Passes,
}

impl Paths<'_> {
    fn address(&self, node: usize) -> u32 {
        self.routine.nodes[node].place.address
    }

    /// Propagates the times of the starting places to all others of a set, but not back to `heads`.
    fn fill(&self, set: BTreeSet<usize>, heads: &BTreeSet<usize>, times: &mut [Option<Time>]) {
        let edges = |node: usize| self.edges[node].iter().filter(|(to, _)| set.contains(to) && !heads.contains(to));
        for circle in circles(&set, &|node| edges(node).map(|(to, _)| *to).collect()) {
            let is_loop = circle.len() > 1 || circle.iter().any(|&node| edges(node).any(|(to, _)| *to == node));
            if is_loop {
                self.turn(&circle, times);
            }
            for &node in &circle {
                let Some(time) = times[node].clone() else { continue };
                for (to, own) in edges(node).filter(|(to, _)| !circle.contains(to)) {
                    times[*to] = longer(times[*to].take(), Some(time.and(own)));
                }
            }
        }
    }

    /// Propagates the times at a loop's entries to all of its places.
    fn turn(&self, circle: &BTreeSet<usize>, times: &mut [Option<Time>]) {
        // In a loop with several entries, a turn is the path from one entry to the next. The loop turns as often as the
        // program passes any entry. A bound stated at one place is not valid for all of them.
        let heads: BTreeSet<usize> = circle.iter().copied().filter(|&node| times[node].is_some()).collect();
        let mut passes = Some(0_u64);
        let mut entered: Option<Time> = None;
        let mut inside = vec![None; times.len()];
        for &head in &heads {
            let stated = if heads.len() == 1 { self.stated(circle, head) } else { None };
            let counted = || if heads.len() == 1 { counted::turns(&self.routine.nodes, circle, head) } else { None };
            // A row of the table never lowers what the loop counts by itself.
            let stated = stated.or_else(|| self.listed(circle, head).max(counted()));
            passes = passes.zip(stated).and_then(|(passes, stated)| passes.checked_add(stated));
            entered = longer(entered, times[head].clone());
            inside[head] = Some(Time::default());
        }
        let Some(entered) = entered else { return };
        self.fill(circle.clone(), &heads, &mut inside);
        let mut turn = None;
        for &node in circle {
            for (_, own) in self.edges[node].iter().filter(|(to, _)| heads.contains(to)) {
                turn = longer(turn, inside[node].as_ref().map(|time| time.and(own)));
            }
        }
        let turn = turn.unwrap_or_default();
        let cycles = turn.cycles.saturating_mul(passes.unwrap_or(1));
        let mut before_last = Time { cycles, unbounded: turn.unbounded };
        if passes.is_none() || cycles > MOST_CYCLES {
            before_last.unbounded.extend(heads.iter().map(|&head| self.address(head)).min());
        }
        let entered = entered.and(&before_last);
        for &node in circle {
            times[node] = inside[node].as_ref().map(|time| entered.and(time));
        }
    }

    /// The loops of the code that have a place in them, the outermost first.
    fn around(&self, node: usize) -> Vec<&Nested> {
        let address = self.address(node) as usize;
        self.routine.nest.iter().filter(|around| around.places.contains(&address)).collect()
    }

    /// Whether a loop of the code has all of these places.
    fn has(&self, around: &Nested, circle: &BTreeSet<usize>) -> bool {
        circle.iter().all(|&node| around.places.contains(&(self.address(node) as usize)))
    }

    /// The bound of a table. A part of a routine can have an outer loop without its inner one, and begin within it. So
    /// the place is passed as often as all loops around it turn, from the one that has the whole of `circle`.
    fn listed(&self, circle: &BTreeSet<usize>, head: usize) -> Option<u64> {
        let by_depth = self.passes.of_heads.get(&self.address(head))?;
        let around = self.around(head);
        let first = around.iter().rposition(|around| self.has(around, circle))?;
        let of_jumps = self.of_jumps(head);
        let passes = (first..around.len()).map(|depth| {
            let passes = of_jumps.max(*by_depth.get(depth).or(by_depth.last())?);
            let Nested { heads, .. } = around[depth];
            let is_head = depth + 1 == around.len() && heads.contains(&(self.address(head) as usize));
            Some(if is_head { passes } else { passes.saturating_mul(heads.len() as u64) })
        });
        passes.reduce(|one, other| Some(one?.saturating_mul(other?)))?
    }

    /// The bound of a loop in a function that turns by a length, for jumps to it with a constant length; 0 without one.
    fn of_jumps(&self, head: usize) -> u64 {
        let nodes = &self.routine.nodes;
        let is_by_length = |node: &usize| self.passes.by_length.contains(&self.address(*node));
        let by_length: BTreeSet<usize> = (0..nodes.len()).filter(is_by_length).collect();
        let jumps = entering(nodes, &by_length).filter(|_| by_length.contains(&head));
        jumps.filter_map(|edge| Some(u64::from(edge.length?) + 1)).max().unwrap_or_default()
    }

    /// The loop bound that a place states, if the place is in no inner loop and every turn passes it. It is valid within
    /// the innermost loop of the code around the place.
    fn stated(&self, circle: &BTreeSet<usize>, head: usize) -> Option<u64> {
        let saying = |node: usize| self.passes.stated.get(&self.address(node)).map(|passes| (node, *passes));
        let edges = |node: usize| -> Vec<usize> { self.edges[node].iter().map(|(to, _)| *to).collect() };
        let runs_once = runs_once(circle, head, &edges);
        let is_innermost = |node: usize| self.around(node).last().is_some_and(|around| self.has(around, circle));
        let stated = circle.iter().filter_map(|&node| saying(node)).filter(|&(node, _)| is_innermost(node));
        stated.filter(|&(node, _)| runs_once(node)).map(|(_, passes)| passes).min()
    }
}
