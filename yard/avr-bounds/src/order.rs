//! An order of functions in flash that makes most calls short.
//!
//! `rcall` and `rjmp` take one word, `call` and `jmp` two. A linker that relaxes (`--relax`) uses the short form within
//! its reach of 4 KiB either way. It leaves the functions in the compiler's order. [`order`] starts with that order and
//! moves functions towards their callers and callees. At first it also accepts moves that cost something (simulated
//! annealing). Its random numbers come from a fixed seed, so the same program gives the same order.
//!
//! A linker script takes the order as patterns of section names. So the compiler must give each function its own
//! section. A pattern without a section costs nothing, and functions without a pattern follow at the end. Assembly and
//! libraries are not moved.

use crate::decode::Instruction;
use crate::decode::Operation::*;
use crate::elf::Program;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Reach of the short forms from their own end (instruction set manual, RCALL and RJMP).
const REACH: std::ops::RangeInclusive<i64> = -4096..=4094;

/// Moves that are tried for each function.
const TRIES: u32 = 2000;

/// Long calls that an early move may cost, about.
const HEAT: f64 = 3.0;

/// A place in the program: the function and the offset in it, or no movable function and the address.
type Spot = (Option<usize>, i64);

/// The functions that can be moved, and the calls and jumps between functions.
struct Graph {
    names: Vec<String>,
    sizes: Vec<i64>,
    start: i64,
    calls: Vec<(Spot, Spot)>,
}

impl Graph {
    fn of(elf: &Program) -> Self {
        let mut names: BTreeMap<u32, &String> = BTreeMap::new();
        for (name, address) in &elf.labels {
            let is_compiled = name.starts_with("_R") || name.starts_with("_ZN");
            if is_compiled && elf.functions.get(address).is_some_and(|symbol| symbol.bytes > 0) {
                names.insert(*address, name);
            }
        }
        let sizes: Vec<_> = names.keys().map(|address| i64::from(elf.functions[address].bytes)).collect();
        let spot = |address: u32| -> Spot {
            let place = names.range(..=address).count();
            match names.range(..=address).next_back() {
                Some((&first, _)) if i64::from(address - first) < sizes[place - 1] => {
                    (Some(place - 1), i64::from(address - first))
                }
                _ => (None, address.into()),
            }
        };
        let mut calls = Vec::new();
        for (&first, function) in &elf.functions {
            let mut address = first;
            while address < first + function.bytes
                && let Some(found) = Instruction::at(&elf.flash, address)
            {
                if matches!(found.operation, Call | Jmp | Rcall | Rjmp)
                    && let Some(target) = found.target(elf.flash.len() as u32)
                    && !(first..first + function.bytes).contains(&target)
                {
                    calls.push((spot(address), spot(target)));
                }
                address = found.next();
            }
        }
        let start = names.keys().next().copied().unwrap_or(0).into();
        Self { names: names.into_values().cloned().collect(), sizes, start, calls }
    }

    /// The calls that are long in an order of the functions.
    fn long(&self, order: &[usize], addresses: &mut [i64]) -> usize {
        let mut address = self.start;
        for &function in order {
            addresses[function] = address;
            address += self.sizes[function];
        }
        let at = |(function, offset): Spot| function.map_or(0, |function| addresses[function]) + offset;
        self.calls.iter().filter(|&&(from, to)| !REACH.contains(&(at(to) - at(from) - 2))).count()
    }
}

/// Pseudo-random numbers (xorshift).
struct Dice(u64);

impl Dice {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 16) % limit as u64) as usize
    }
}

/// A linker script's lines for an order with few long calls, and the number of long calls before and after.
///
/// The crates' numbers are left out of the names, since they differ between compilers.
pub fn order(elf: &Program) -> (String, usize, usize) {
    let graph = Graph::of(elf);
    let functions = graph.names.len();
    let mut addresses = vec![0; functions];
    let mut now: Vec<usize> = (0..functions).collect();
    let before = graph.long(&now, &mut addresses);
    let (mut cost, mut best) = (before, (before, now.clone()));
    let mut partners = vec![Vec::new(); functions];
    for &((from, _), (to, _)) in &graph.calls {
        if let (Some(from), Some(to)) = (from, to) {
            partners[from].push(to);
            partners[to].push(from);
        }
    }
    let mut dice = Dice(0x9E37_79B9_7F4A_7C15);
    let tries = TRIES * functions as u32;
    for tried in 0..tries {
        let heat = HEAT * f64::from(tries - tried) / f64::from(tries);
        let mut next = now.clone();
        let moved = next.remove(dice.below(functions));
        let to = match partners[moved].as_slice() {
            // Most often a function moves next to a caller or a callee.
            [_, ..] if dice.below(5) < 3 => {
                let partner = partners[moved][dice.below(partners[moved].len())];
                next.iter().position(|&function| function == partner).map_or(0, |place| place + dice.below(2))
            }
            _ => dice.below(functions),
        };
        next.insert(to, moved);
        let of_next = graph.long(&next, &mut addresses);
        let worse = of_next as f64 - cost as f64;
        if worse <= 0.0 || dice.below(1 << 20) as f64 / f64::from(1 << 20) < (-worse / heat).exp() {
            (now, cost) = (next, of_next);
        }
        if cost < best.0 {
            best = (cost, now.clone());
        }
    }
    let mut lines = String::new();
    for &function in &best.1 {
        writeln!(lines, "*(.text.{})", without_numbers(&graph.names[function])).expect("a string takes everything");
    }
    (lines, before, best.0)
}

/// A mangled name (Rust's v0) with wildcards for what another machine may have otherwise: each crate's number, `Cs` with letters and digits up
/// to `_`, and so each reference back into the name, `B` likewise, since it counts the characters in front.
fn without_numbers(name: &str) -> String {
    let Some(mut rest) = name.strip_prefix("_R") else { return name.to_owned() };
    let mut pattern = "_R".to_owned();
    while let Some(first) = rest.chars().next() {
        let to_underscore = rest.find('_').map_or(rest.len(), |at| at + 1);
        let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
        let length = match first {
            // Of a constant: its type, and its value.
            'B' | 's' | 'K' => to_underscore,
            // An identifier behind its length.
            _ if digits > 0 => {
                let separator = usize::from(rest[digits..].starts_with('_'));
                (digits + separator + rest[..digits].parse().unwrap_or(0)).min(rest.len())
            }
            _ => first.len_utf8(),
        };
        let (part, behind) = rest.split_at(length);
        pattern += match first {
            'B' => "B*_",
            's' if pattern.ends_with('C') => "s*_",
            _ => part,
        };
        rest = behind;
    }
    pattern
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_differ_between_machines_are_left_out_of_a_name() {
        assert_eq!(without_numbers("_RNvMs_NtCsfdqj_7control6ground4look"), "_RNvMs_NtCs*_7control6ground4look");
        assert_eq!(without_numbers("_RNvCs1_1aCs2_1b"), "_RNvCs*_1aCs*_1b");
        let long = "_RINvXs_NtCs1a_3abc8examplesNtB5_7BuiltInINtNtCs2_3knn4Kj5_8ExamplesKj5_E4keepKtc8_EB1f_";
        let short = "_RINvXs_NtCs*_3abc8examplesNtB*_7BuiltInINtNtCs*_3knn4Kj5_8ExamplesKj5_E4keepKtc8_EB*_";
        assert_eq!(without_numbers(long), short);
        assert_eq!(without_numbers("_ZN4testCs"), "_ZN4testCs");
    }

    #[test]
    fn functions_that_call_each_other_come_together() {
        // Two that call each other eight times, and between them one that is larger than a short call reaches.
        let calls = (0..8).map(|call| ((Some(0), 2 * call), (Some(2), 0))).collect();
        let names = ["a", "large", "b"].map(str::to_owned).into();
        let graph = Graph { names, sizes: vec![100, 5000, 100], start: 0, calls };
        let mut addresses = vec![0; 3];
        assert_eq!(graph.long(&[0, 1, 2], &mut addresses), 8);
        assert_eq!(graph.long(&[1, 0, 2], &mut addresses), 0);
    }
}
