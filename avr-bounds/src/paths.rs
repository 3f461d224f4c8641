//! The graph of a routine's places: its loops, and which places can be reached from which.

use crate::flow::Node;
use std::collections::{BTreeMap, BTreeSet};

/// The nodes from which a node with `is_end` can be reached, itself included.
pub(crate) fn reaching(nodes: &[Node], is_end: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut from: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
    for (number, node) in nodes.iter().enumerate() {
        for edge in &node.edges {
            from[edge.to].push(number);
        }
    }
    let mut reaches = vec![false; nodes.len()];
    let mut to_do: Vec<usize> = (0..nodes.len()).filter(|&node| is_end(node)).collect();
    while let Some(node) = to_do.pop() {
        if !std::mem::replace(&mut reaches[node], true) {
            to_do.extend(&from[node]);
        }
    }
    reaches
}

/// Whether a strongly connected part is a loop: several places, or one that leads to itself.
pub(crate) fn is_circle(part: &BTreeSet<usize>, edges: &dyn Fn(usize) -> Vec<usize>) -> bool {
    part.len() > 1 || part.iter().any(|&node| edges(node).contains(&node))
}

/// The strongly connected parts of a set, each before the parts that it leads to (Tarjan's algorithm, without
/// recursion).
pub(crate) fn circles(set: &BTreeSet<usize>, edges: &dyn Fn(usize) -> Vec<usize>) -> Vec<BTreeSet<usize>> {
    #[derive(Clone, Copy)]
    struct Mark {
        number: usize,
        lowest: usize,
        is_open: bool,
    }
    let mut marks: BTreeMap<usize, Mark> = BTreeMap::new();
    let mut open = Vec::new();
    let mut found = Vec::new();
    for &start in set {
        if marks.contains_key(&start) {
            continue;
        }
        let begin = |node: usize, marks: &mut BTreeMap<usize, Mark>, open: &mut Vec<usize>| {
            let number = marks.len();
            marks.insert(node, Mark { number, lowest: number, is_open: true });
            open.push(node);
            (node, edges(node).into_iter())
        };
        let mut path = vec![begin(start, &mut marks, &mut open)];
        while let Some((node, rest)) = path.last_mut() {
            let node = *node;
            if let Some(to) = rest.next() {
                match marks.get(&to).copied() {
                    None => path.push(begin(to, &mut marks, &mut open)),
                    Some(mark) if mark.is_open => {
                        marks.entry(node).and_modify(|own| own.lowest = own.lowest.min(mark.number));
                    }
                    Some(_) => {}
                }
                continue;
            }
            path.pop();
            let own = marks[&node];
            if let Some((above, _)) = path.last() {
                marks.entry(*above).and_modify(|above| above.lowest = above.lowest.min(own.lowest));
            }
            if own.lowest == own.number {
                let from = open.iter().position(|&other| other == node).unwrap_or_default();
                let circle: BTreeSet<usize> = open.drain(from..).collect();
                for member in &circle {
                    marks.entry(*member).and_modify(|mark| mark.is_open = false);
                }
                found.push(circle);
            }
        }
    }
    // Tarjan's algorithm finds a part after those that it leads to.
    found.reverse();
    found
}
