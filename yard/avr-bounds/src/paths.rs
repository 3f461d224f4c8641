//! The graph of a routine's places: its loops, and which places can be reached from which.

use crate::routine::{Edge, Nested, Node};
use std::collections::{BTreeMap, BTreeSet};

/// The nodes from which a node with `is_end` can be reached, itself included.
pub(crate) fn reaching(nodes: &[Node], is_end: impl Fn(usize) -> bool) -> Vec<bool> {
    // The predecessors of each place.
    let mut from: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
    for (number, node) in nodes.iter().enumerate() {
        node.edges.iter().for_each(|edge| from[edge.to].push(number));
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

/// The edges that lead into a set.
pub(crate) fn entering<'a>(nodes: &'a [Node], set: &'a BTreeSet<usize>) -> impl Iterator<Item = &'a Edge> {
    let outside = nodes.iter().enumerate().filter(|(number, _)| !set.contains(number));
    outside.flat_map(|(_, node)| &node.edges).filter(|edge| set.contains(&edge.to))
}

/// The edges of a graph: the successors of a node.
pub(crate) type Edges<'a> = &'a dyn Fn(usize) -> Vec<usize>;

/// The strongly connected parts of a set, each before the parts that it leads to (Kosaraju's algorithm).
pub(crate) fn circles(set: &BTreeSet<usize>, edges: Edges) -> Vec<BTreeSet<usize>> {
    let edges = |node: usize| edges(node).into_iter().filter(|to| set.contains(to)).collect::<Vec<_>>();
    let mut from: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let (mut seen, mut left) = (BTreeSet::new(), Vec::new());
    for &node in set {
        search(node, &edges, &mut seen, &mut left);
        edges(node).into_iter().for_each(|to| from.entry(to).or_default().push(node));
    }
    seen.clear();
    let part = |&node: &usize| {
        let mut part = Vec::new();
        search(node, &|node| from.get(&node).cloned().unwrap_or_default(), &mut seen, &mut part);
        BTreeSet::from_iter(part)
    };
    left.iter().rev().map(part).filter(|part| !part.is_empty()).collect()
}

/// Visits all nodes that can be reached from one and were not seen. Appends each after those that it leads to.
fn search(start: usize, edges: Edges, seen: &mut BTreeSet<usize>, left: &mut Vec<usize>) {
    let mut path: Vec<_> = seen.insert(start).then(|| (start, edges(start).into_iter())).into_iter().collect();
    while let Some((node, rest)) = path.last_mut() {
        match rest.find(|to| seen.insert(*to)) {
            Some(to) => path.push((to, edges(to).into_iter())),
            None => {
                left.push(*node);
                path.pop();
            }
        }
    }
}

/// The loops of a set: strongly connected parts of several places, or of one that leads to itself.
pub(crate) fn loops(set: &BTreeSet<usize>, edges: Edges) -> Vec<BTreeSet<usize>> {
    let is_loop = |part: &BTreeSet<usize>| part.len() > 1 || part.iter().any(|&node| edges(node).contains(&node));
    circles(set, edges).into_iter().filter(is_loop).collect()
}

/// The loops in a routine's code, each before the loops within it. A place is an address here, with any stack and any
/// state of the interrupts, as in the source.
pub(crate) fn nest(nodes: &[Node]) -> Vec<Nested> {
    let address = |node: &Node| node.place.address as usize;
    let mut edges: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for node in nodes {
        edges.entry(address(node)).or_default().extend(node.edges.iter().map(|edge| address(&nodes[edge.to])));
    }
    let mut nest = Vec::new();
    let mut to_do: Vec<(BTreeSet<usize>, BTreeSet<usize>)> = vec![(edges.keys().copied().collect(), BTreeSet::new())];
    while let Some((set, heads)) = to_do.pop() {
        for places in loops(&set, &|place| edges[&place].difference(&heads).copied().collect()) {
            let entering = edges.iter().filter(|(from, _)| !places.contains(from)).flat_map(|(_, to)| to);
            let heads: BTreeSet<usize> =
                entering.copied().chain([address(&nodes[0])]).filter(|to| places.contains(to)).collect();
            to_do.push((places.clone(), heads.clone()));
            nest.push(Nested { places, heads });
        }
    }
    nest
}

/// Whether a place of a loop runs exactly once a turn: no inner loop has it, and every turn from `head` passes it.
pub(crate) fn runs_once<'a>(circle: &'a BTreeSet<usize>, head: usize, edges: Edges<'a>) -> impl Fn(usize) -> bool + 'a {
    let loops_without = move |left_out: usize| {
        let others = circle.iter().copied().filter(|&node| node != left_out).collect();
        loops(&others, edges).into_iter().flatten().collect::<BTreeSet<usize>>()
    };
    let inner = loops_without(head);
    move |node| !inner.contains(&node) && (node == head || !loops_without(node).contains(&head))
}
