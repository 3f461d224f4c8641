//! Loop bounds of loops that count by themselves.
//!
//! A loop is counted under three conditions. A branch leaves the loop, and it depends on registers that only arithmetic
//! in the loop changes. Each of these instructions runs exactly once a turn. The registers hold constants at every
//! entry to the loop. The analysis then executes those instructions, turn after turn, until the branch leaves. Another
//! exit can only make the loop shorter. All other loops are not counted.

use crate::concrete::Concrete;
use crate::decode::Instruction;
use crate::decode::Operation::*;
use crate::effects::Registers;
use crate::paths::{circles, entering, loops, runs_once};
use crate::routine::{Edge, Node};
use std::collections::BTreeSet;

/// Turns after which a loop counts as endless.
const MOST_TURNS: u64 = 1 << 22;

/// The most returns to `head` for each entry to its loop. `circle` is a strongly connected part of a routine.
pub(crate) fn turns(nodes: &[Node], circle: &BTreeSet<usize>, head: usize) -> Option<u64> {
    let edges = |node: usize| -> Vec<usize> { nodes[node].edges.iter().map(|edge| edge.to).collect() };
    let entries: Vec<&Edge> = entering(nodes, circle).collect();
    let first = entries.first()?.to;
    if circle.contains(&0) || entries.iter().any(|edge| edge.to != first) {
        return None;
    }
    let runs_once = runs_once(circle, first, &edges);
    let without_first = circle.iter().copied().filter(|&node| node != first).collect();
    if head != first && loops(&without_first, &edges).iter().any(|inner| inner.contains(&head)) {
        return None;
    }
    let rest = circles(&without_first, &edges);
    let ordered: Vec<usize> = [first].into_iter().chain(rest.into_iter().flatten()).collect();
    let leaves = |node: usize| {
        let edges = &nodes[node].edges;
        edges.len() == 2 && edges.iter().filter(|edge| !circle.contains(&edge.to)).count() == 1
    };
    let exits = ordered.iter().copied().filter(|&node| leaves(node) && runs_once(node));
    let counted = Loop { nodes, circle, ordered: &ordered, entries: &entries, runs_once: &runs_once };
    exits.filter_map(|exit| Some(counted.by(exit)?.0)).min()
}

/// The edges out of a loop that counts with this register down to zero. `circle` may have several entries.
pub(crate) fn exits_with_zero(nodes: &[Node], circle: &BTreeSet<usize>, register: usize) -> Vec<(usize, usize)> {
    let edges = |node: usize| -> Vec<usize> { nodes[node].edges.iter().map(|edge| edge.to).collect() };
    let entries: Vec<&Edge> = entering(nodes, circle).collect();
    let of_exit = |&exit: &usize| {
        let out = edges(exit).into_iter().find(|to| !circle.contains(to))?;
        let back = edges(exit).into_iter().find(|to| circle.contains(to))?;
        let others: BTreeSet<usize> = circle.iter().copied().filter(|&node| node != exit).collect();
        if circle.contains(&0) || edges(exit).len() != 2 || !loops(&others, &edges).is_empty() {
            return None;
        }
        // Every path from a beginning of a turn to the exit passes the place.
        let passes = |place: usize| {
            let mut to_do: Vec<usize> = entries.iter().map(|edge| edge.to).chain([back]).collect();
            let mut seen = BTreeSet::from([place]);
            while let Some(node) = to_do.pop() {
                if node == exit && place != exit {
                    return false;
                }
                if circle.contains(&node) && seen.insert(node) {
                    to_do.extend(edges(node));
                }
            }
            true
        };
        let ordered: Vec<usize> = circles(&others, &edges).into_iter().flatten().chain([exit]).collect();
        let counted = Loop { nodes, circle, ordered: &ordered, entries: &entries, runs_once: &passes };
        let (_, needed, ends) = counted.by(exit)?;
        let is_zero = needed.has(register) && ends.iter().all(|end| end.registers[register] == 0);
        is_zero.then_some((exit, out))
    };
    circle.iter().filter_map(of_exit).collect()
}

struct Loop<'a> {
    nodes: &'a [Node],
    circle: &'a BTreeSet<usize>,
    /// Its places, each after those that lead to it from the entry.
    ordered: &'a [usize],
    /// The edges that lead to its first place.
    entries: &'a [&'a Edge],
    runs_once: &'a dyn Fn(usize) -> bool,
}

impl Loop<'_> {
    /// The place from which a path comes to this one, if there is only one and no path enters the loop here.
    fn only_before(&self, node: usize) -> Option<usize> {
        let leads = |other: &usize| self.nodes[*other].edges.iter().any(|edge| edge.to == node);
        let mut before = self.circle.iter().copied().filter(leads);
        let only = before.next()?;
        let is_entry = self.entries.iter().any(|edge| edge.to == node);
        (!is_entry && before.next().is_none()).then_some(only)
    }

    /// The returns to the loop's head by the branch at `exit`, the registers that decide it, and how each entry ends.
    fn by(&self, exit: usize) -> Option<(u64, Registers, Vec<Concrete>)> {
        let branch = self.nodes[exit].instruction;
        if !matches!(branch.operation, Brbs | Brbc | Cpse | Sbrc | Sbrs) {
            return None;
        }
        let mut slice = BTreeSet::new();
        // Flags are set directly before the instruction that reads them.
        let mut flags_of = vec![(exit, branch.effects().reads & Registers::FLAGS)];
        let mut needed = branch.effects().reads - Registers::FLAGS;
        loop {
            while let Some((mut node, mut flags)) = flags_of.pop() {
                while !flags.is_empty() {
                    node = self.only_before(node)?;
                    if self.nodes[node].edges.iter().any(|edge| edge.through.is_some()) {
                        return None;
                    }
                    let effects = self.nodes[node].instruction.effects();
                    if !(effects.changes & flags).is_empty() {
                        flags -= effects.changes;
                        slice.insert(node);
                        needed |= effects.reads - Registers::FLAGS;
                        flags_of.push((node, effects.reads & Registers::FLAGS));
                    }
                }
            }
            // All instructions in the loop that change a needed register.
            let before = (needed, slice.len());
            for &node in self.circle {
                let effects = self.nodes[node].instruction.effects();
                let mut called = self.nodes[node].edges.iter().filter_map(|edge| edge.through.as_ref());
                if called.any(|called| !(needed - called.keeps).is_empty()) {
                    return None;
                }
                if !(effects.changes & needed).is_empty() && slice.insert(node) {
                    needed |= effects.reads - Registers::FLAGS;
                    flags_of.push((node, effects.reads & Registers::FLAGS));
                }
            }
            if flags_of.is_empty() && before == (needed, slice.len()) {
                break;
            }
        }
        if !slice.iter().all(|&node| (self.runs_once)(node)) {
            return None;
        }
        let steps = self.ordered.iter().filter(|node| slice.contains(node) || **node == exit);
        let steps: Vec<Instruction> = steps.map(|&node| self.nodes[node].instruction).collect();
        let stays = self.nodes[exit].edges.iter().find(|edge| self.circle.contains(&edge.to))?;
        let stays_when_next = self.nodes[stays.to].place.address == branch.next();
        let (mut most, mut ends) = (0, Vec::new());
        for Edge { constants, .. } in self.entries {
            if !needed.numbers().all(|register| constants[register].is_some()) {
                return None;
            }
            let registers = constants.map(Option::unwrap_or_default);
            let start = Concrete { registers, status: 0 };
            let (turns, end) = run(&steps, branch.address, stays_when_next, start, needed)?;
            most = most.max(turns);
            ends.push(end);
        }
        Some((most, needed, ends))
    }
}

/// Carries the steps of a turn out until the branch leaves; how many turns went on, and the registers then.
fn run(
    steps: &[Instruction],
    exit: u32,
    stays_when_next: bool,
    mut held: Concrete,
    needed: Registers,
) -> Option<(u64, Concrete)> {
    let mut before = held.clone();
    for turn in 0..MOST_TURNS {
        // If a state repeats, the loop never ends.
        if turn > 0 && needed.numbers().all(|register| held.registers[register] == before.registers[register]) {
            return None;
        }
        if turn.is_power_of_two() {
            before = held.clone();
        }
        for step in steps {
            if step.address == exit {
                let source = held.registers[step.source];
                let goes_next = match step.operation {
                    Cpse => held.registers[step.destination] != source,
                    Sbrc | Sbrs => (source >> step.operand('b') & 1 == 1) != (step.operation == Sbrs),
                    _ => (held.status >> step.operand('s') & 1 == 1) != (step.operation == Brbs),
                };
                if goes_next != stays_when_next {
                    return Some((turn, held));
                }
            } else if !held.carry_out(step) && !moves_pointer(step, &mut held, needed) {
                return None;
            }
        }
    }
    None
}

/// Moves the pointer of a load or store, which changes no other needed register.
fn moves_pointer(step: &Instruction, held: &mut Concrete, needed: Registers) -> bool {
    let Some((pointer, by)) = step.pointer() else { return false };
    let is_load = matches!(step.operation, Ld | Lpm | Elpm);
    if by == 0 || is_load && needed.has(step.destination) {
        return false;
    }
    let address = u16::from_le_bytes([held.registers[pointer], held.registers[pointer + 1]]);
    let moved = address.wrapping_add_signed(by.into()).to_le_bytes();
    held.registers[pointer..pointer + 2].copy_from_slice(&moved);
    true
}
