//! Reduces many detections to the few examples that decide alike.
//!
//! 1. **Wilson's editing** (D. L. Wilson, 1972): a detection whose three nearest others vote for the other class is
//!    noise, or has the wrong label. It is removed. If that were true of more than a tenth of the plants, they are not
//!    noise, and all plants stay. So a few plants among many weeds stay plants.
//! 2. **Hart's condensing** (P. E. Hart, 1968): while the chosen examples mistreat some detections, one of these is
//!    added. A weed must be recognised within half the squared radius, so that slightly different weeds are recognised
//!    later. A plant must not be classified as a weed. Hart adds such detections in their order. Here the next one is
//!    the detection with the most others of its class around it that are mistreated too and have no example near.
//! 3. **Filling up**: plants without an example near are unknown, which spares them. While there is room they are added
//!    in the same order, and in any case until `k` examples can vote. Hart's rule is checked last. While that needs
//!    more examples than there is room for, the last plant is left out. A table that is too large without these plants,
//!    or has no plant at all, is refused.
//!
//! Among equals the first in the list is chosen.

use super::MOST_EXAMPLES;
use super::model::{answer_of_others, class_of};
use anyhow::{Result, ensure};
use control::ground::{
    class::{Class, label},
    features::COUNT,
};
use knn::{Example, Kind, classify, squared_distance};
use std::collections::HashSet;

/// Checks that there is room for this number of examples. `other` is another way out.
fn check_room(needed: usize, most: usize, other: &str) -> Result<()> {
    ensure!(
        needed <= most,
        "too many examples: these detections need {needed}, and there is room for {most}: remove detections with a wrong label, or unlike all others{other}"
    );
    Ok(())
}

/// Neighbours that vote whether a detection is noise, as in Wilson's paper.
const EDITORS: u8 = 3;

/// At most one plant in so many can be noise.
const PLANTS_FOR_NOISE: usize = 10;

/// The indices of the examples that are not noise.
pub fn edit(examples: &[Example<COUNT>]) -> Vec<usize> {
    let is_noise = |index: usize| {
        answer_of_others(examples, index, EDITORS, u32::MAX)
            .is_ok_and(|answer| answer.kind == Kind::Known && answer.label != examples[index].label)
    };
    let (noise, mut edited): (Vec<usize>, Vec<usize>) = (0..examples.len()).partition(|&index| is_noise(index));
    let is_plant = |index: &usize| examples[*index].label == label::PLANT;
    let noisy: Vec<usize> = noise.into_iter().filter(is_plant).collect();
    if noisy.len() * PLANTS_FOR_NOISE > (0..examples.len()).filter(is_plant).count() {
        edited.extend(noisy);
        edited.sort_unstable();
    }
    edited
}

/// Chooses at most `most` of the `examples` with indices in `edited`, for a vote of `k` within `radius`. Returns their
/// indices, in the order of choice.
///
/// # Errors
/// If more are needed, or if the weeds leave no room for a plant.
pub fn condense(examples: &[Example<COUNT>], edited: &[usize], k: u8, radius: u32, most: usize) -> Result<Vec<usize>> {
    let half = radius / 2;
    let other = if most < MOST_EXAMPLES { ", or choose a larger --max" } else { "" };
    let is_mistreated = |index: usize, kept: &[Example<COUNT>]| {
        let is_weed = examples[index].label == label::WEED;
        let reach = if is_weed { half } else { radius };
        let answer = classify::<COUNT, { label::COUNT }>(kept, &examples[index].features, k, reach);
        is_weed != (answer.map_or(Class::Unknown, |answer| class_of(&answer)) == Class::Weed)
    };
    let mut kept = Vec::new();
    keep_most_needed(examples, edited, &mut kept, usize::MAX, half, is_mistreated);
    check_room(kept.len().max(usize::from(k)), most, other)?;
    let is_stranger = |index: usize, kept: &[Example<COUNT>]| {
        kept.iter().all(|example| !are_fellows(example, &examples[index], radius))
    };
    let fewest = kept.len();
    keep_most_needed(examples, edited, &mut kept, most, radius, is_stranger);
    loop {
        let mut table = kept.clone();
        let others = edited.iter().filter(|index| !kept.contains(index));
        table.extend(others.take(usize::from(k).saturating_sub(kept.len())));
        // A plant that is no longer a stranger can be outvoted by the weeds around it, and so can a weed.
        keep_most_needed(examples, edited, &mut table, usize::MAX, half, is_mistreated);
        // A machine without an example of a plant knows no crop.
        let has_plant = table.iter().any(|&index| examples[index].label == label::PLANT);
        let needed = if has_plant { table.len().max(usize::from(k)) } else { most + 1 };
        let checked = check_room(needed, most, other);
        if checked.is_ok() || kept.len() == fewest {
            return checked.map(|()| table);
        }
        kept.pop();
    }
}

/// Chooses at most `most` of `examples` to add to those that are `given`. All plants must be spared. As many weeds as
/// possible are recognised, without losing a plant. Returns their indices, in the order of choice. No two chosen
/// examples are equal.
///
/// # Errors
/// If `most` examples still classify a plant as a weed.
pub fn beside(
    given: &[Example<COUNT>],
    examples: &[Example<COUNT>],
    k: u8,
    radius: u32,
    most: usize,
) -> Result<Vec<usize>> {
    let all = [given, examples].concat();
    let mut seen = HashSet::new();
    let mut of = |wanted: u8| -> Vec<usize> {
        (given.len()..all.len()).filter(|&index| all[index].label == wanted && seen.insert(all[index])).collect()
    };
    let (plants, weeds) = (of(label::PLANT), of(label::WEED));
    let is_taken_for_a_weed = |index: usize, kept: &[Example<COUNT>]| {
        let answer = classify::<COUNT, { label::COUNT }>(kept, &all[index].features, k, radius);
        answer.is_ok_and(|answer| class_of(&answer) == Class::Weed)
    };
    let room = given.len() + most;
    let mut kept: Vec<usize> = (0..given.len()).collect();
    keep_most_needed(&all, &plants, &mut kept, usize::MAX, radius / 2, is_taken_for_a_weed);
    let lost = |kept: &[Example<COUNT>]| plants.iter().filter(|&&plant| is_taken_for_a_weed(plant, kept)).count();
    let table: Vec<Example<COUNT>> = kept.iter().map(|&index| all[index]).collect();
    // An example itself may be outvoted by those around it.
    let lost_already = lost(&table);
    let costs_no_plant = |index: usize, kept: &[Example<COUNT>]| lost(&[kept, &[all[index]]].concat()) <= lost_already;
    keep_most_needed(&all, &weeds, &mut kept, room, radius / 2, |index, kept| {
        !is_taken_for_a_weed(index, kept) && costs_no_plant(index, kept)
    });
    let chosen: Vec<usize> = kept.drain(given.len()..).map(|index| index - given.len()).collect();
    check_room(chosen.len(), most, "")?;
    Ok(chosen)
}

/// Repeats while fewer than `most` are chosen and some of `candidates` need more examples, as `needs` decides. Each
/// time it adds the candidate with the most others within `reach` that have no example of their class there.
fn keep_most_needed(
    examples: &[Example<COUNT>],
    candidates: &[usize],
    kept: &mut Vec<usize>,
    most: usize,
    reach: u32,
    needs: impl Fn(usize, &[Example<COUNT>]) -> bool,
) {
    let mut table: Vec<Example<COUNT>> = kept.iter().map(|&index| examples[index]).collect();
    while kept.len() < most {
        let needy: Vec<usize> =
            candidates.iter().copied().filter(|index| !kept.contains(index) && needs(*index, &table)).collect();
        // Candidates near an example may need another one, but those without any come first.
        let is_alone = |index: &usize| !table.iter().any(|example| are_fellows(example, &examples[*index], reach));
        let alone: Vec<usize> = needy.iter().copied().filter(is_alone).collect();
        let serves =
            |&one: &usize| alone.iter().filter(|&&other| are_fellows(&examples[one], &examples[other], reach)).count();
        // `max_by_key` keeps the last among equals.
        let Some(next) = needy.iter().copied().rev().max_by_key(serves) else {
            return;
        };
        kept.push(next);
        table.push(examples[next]);
    }
}

/// Whether two examples are of one class and within `reach` of each other.
fn are_fellows(one: &Example<COUNT>, other: &Example<COUNT>, reach: u32) -> bool {
    one.label == other.label && squared_distance(&one.features, &other.features) <= reach
}
