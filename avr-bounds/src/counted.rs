//! Loop bounds of loops that count by themselves.
//!
//! A loop is counted under three conditions. A branch leaves the loop, and it depends on registers that only arithmetic
//! in the loop changes. Each of these instructions runs exactly once a turn. The registers hold constants at every
//! entry to the loop. The analysis then executes those instructions, turn after turn, until the branch leaves. Another
//! exit can only make the loop shorter. All other loops are not counted.

use crate::concrete::Concrete;
use crate::decode::Operation::*;
use crate::decode::{Instruction, Operation};
use crate::effects::Registers;
use crate::flow::{Code, Node};
use crate::paths::{circles, loops, runs_once};
use crate::values::Constants;
use std::collections::BTreeSet;

/// Turns after which a loop counts as endless.
const MOST_TURNS: u64 = 1 << 22;

/// The most returns to `head` for each entry to its loop. `circle` is a strongly connected part of a routine.
pub(crate) fn turns(code: &Code, nodes: &[Node], circle: &BTreeSet<usize>, head: usize) -> Option<u64> {
    let edges = |node: usize| -> Vec<usize> { nodes[node].edges.iter().map(|edge| edge.to).collect() };
    // Where it is entered.
    let outside = nodes.iter().enumerate().filter(|(number, _)| !circle.contains(number));
    let entering = outside.flat_map(|(_, node)| &node.edges).filter(|edge| circle.contains(&edge.to));
    let entries: Vec<(usize, Constants)> = entering.map(|edge| (edge.to, edge.constants)).collect();
    let first = entries.first()?.0;
    if circle.contains(&0) || entries.iter().any(|(to, _)| *to != first) {
        return None;
    }
    let runs_once = runs_once(circle, first, &edges);
    let without_first = circle.iter().copied().filter(|&node| node != first).collect();
    if head != first && loops(&without_first, &edges).iter().any(|inner| inner.contains(&head)) {
        return None;
    }
    let rest = circles(&without_first, &edges);
    let ordered: Vec<usize> = [first].into_iter().chain(rest.into_iter().flatten()).collect();
    let only_before = |node: usize| {
        let mut before = circle.iter().copied().filter(|&other| nodes[other].edges.iter().any(|edge| edge.to == node));
        let only = before.next()?;
        (node != first && before.next().is_none()).then_some(only)
    };
    let leaving = ordered.iter().copied().filter(|&node| {
        let is_out = |to: usize| !circle.contains(&to);
        let edges = &nodes[node].edges;
        edges.len() == 2 && edges.iter().filter(|edge| is_out(edge.to)).count() == 1
    });
    let loops = Loop { code, nodes, circle, ordered: &ordered };
    leaving
        .filter(|&exit| runs_once(exit))
        .filter_map(|exit| loops.counted_by(exit, &entries, &runs_once, &only_before))
        .min()
}

struct Loop<'a> {
    code: &'a Code<'a>,
    nodes: &'a [Node],
    circle: &'a BTreeSet<usize>,
    /// Its places, each after those that lead to it from the entry.
    ordered: &'a [usize],
}

impl Loop<'_> {
    fn instruction(&self, node: usize) -> Option<Instruction> {
        self.code.instruction(self.nodes[node].place.address).ok()
    }

    /// The number of returns to the loop's head, by the branch at `exit`.
    fn counted_by(
        &self,
        exit: usize,
        entries: &[(usize, Constants)],
        runs_once: &dyn Fn(usize) -> bool,
        only_before: &dyn Fn(usize) -> Option<usize>,
    ) -> Option<u64> {
        let branch = self.instruction(exit)?;
        if !matches!(branch.operation, Brbs | Brbc | Cpse | Sbrc | Sbrs) {
            return None;
        }
        let mut needed = Registers::NONE;
        let mut slice = BTreeSet::new();
        // Flags are set directly before the instruction that reads them.
        let mut flags_of = vec![(exit, branch.effects().reads & Registers::FLAGS)];
        needed |= branch.effects().reads - Registers::FLAGS;
        loop {
            while let Some((mut node, mut flags)) = flags_of.pop() {
                while !flags.is_empty() {
                    node = only_before(node)?;
                    if self.nodes[node].edges.iter().any(|edge| edge.through.is_some()) {
                        return None;
                    }
                    let effects = self.instruction(node)?.effects();
                    if !(effects.changes & flags).is_empty() {
                        flags = flags - effects.changes;
                        slice.insert(node);
                        needed |= effects.reads - Registers::FLAGS;
                        flags_of.push((node, effects.reads & Registers::FLAGS));
                    }
                }
            }
            // All instructions in the loop that change a needed register.
            let before = (needed, slice.len());
            for &node in self.circle {
                let instruction = self.instruction(node)?;
                let effects = instruction.effects();
                let called = self.nodes[node].edges.iter().filter_map(|edge| edge.through.as_ref());
                if { called }.any(|called| !(needed - called.keeps).is_empty()) {
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
        if !slice.iter().all(|&node| runs_once(node)) {
            return None;
        }
        let steps: Vec<Instruction> = (self.ordered.iter())
            .filter(|node| slice.contains(node) || **node == exit)
            .map(|&node| self.instruction(node))
            .collect::<Option<_>>()?;
        let stays = self.nodes[exit].edges.iter().find(|edge| self.circle.contains(&edge.to))?;
        let stays_when_next = self.nodes[stays.to].place.address == branch.next();
        let mut most = 0;
        for (_, constants) in entries {
            if !needed.iter().all(|register| constants[register].is_some()) {
                return None;
            }
            let registers = std::array::from_fn(|register| constants[register].unwrap_or_default());
            most = most.max(run(&steps, branch.address, stays_when_next, Concrete { registers, status: 0 }, needed)?);
        }
        Some(most)
    }
}

/// Carries the steps of a turn out until the branch leaves; how many turns went on.
fn run(steps: &[Instruction], exit: u32, stays_when_next: bool, mut held: Concrete, needed: Registers) -> Option<u64> {
    let mut before = held.clone();
    for turn in 0..MOST_TURNS {
        // If a state repeats, the loop never ends.
        if turn > 0 && needed.iter().all(|register| held.registers[register] == before.registers[register]) {
            return None;
        }
        if turn.is_power_of_two() {
            before = held.clone();
        }
        for step in steps {
            if step.address == exit {
                let goes_next = match step.operation {
                    Brbs | Brbc => {
                        let is_set = held.status >> step.operand('s') & 1 == 1;
                        is_set != (step.operation == Brbs)
                    }
                    Cpse => held.registers[step.destination()] != held.registers[step.source()],
                    _ => {
                        let is_set = held.registers[step.source()] >> step.operand('b') & 1 == 1;
                        is_set != (step.operation == Operation::Sbrs)
                    }
                };
                if goes_next != stays_when_next {
                    return Some(turn);
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
    let Some(pointer) = step.moved_pointer() else { return false };
    let is_load = matches!(step.operation, Ld | Lpm | Elpm);
    if is_load && needed.contains(step.destination()) {
        return false;
    }
    let address = u16::from_le_bytes([held.registers[pointer], held.registers[pointer + 1]]);
    let moved = address.wrapping_add_signed(step.moves_by().into()).to_le_bytes();
    held.registers[pointer..pointer + 2].copy_from_slice(&moved);
    true
}
