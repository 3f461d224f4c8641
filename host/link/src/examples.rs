//! The taught examples of a machine: reads them all, and teaches them to another machine.
//!
//! The firmware lists an example as bytes, on the scale of its built-in table. [`features_of`] converts them to
//! millimetres, and [`example_of`] converts back. Both are valid only if this program and the firmware have the same
//! table. So the firmware's built-in examples are compared first. Nothing is sent unless everything can be taught.

use super::{Class, ConsoleLine, Link, LinkError, Mode, settings};
use control::ground::class::{Classifier, label};
use control::ground::examples::{EXAMPLES, SCALE, SCALE_BYTES};
use control::ground::features::{COUNT, Features};
pub use control::ground::field_examples::CAPACITY;
use control::ground::nearest::Nearest;
use control::memory::Volatile;
use knn::Example;
use std::collections::HashMap;
use std::sync::LazyLock;
use thiserror::Error;

/// An example: five features as bytes, and a [`label`].
pub type Taught = Example<COUNT>;

/// Why examples could not be read or taught.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum ExamplesError {
    #[error(transparent)]
    Link(#[from] LinkError),
    #[error(
        "the firmware has other built-in examples than this program, so its taught examples cannot be converted to millimetres: use its own `weeder` (after `weeder train`: `cargo install --locked --path host/cli`). `weeder flash` would make its examples invalid"
    )]
    OtherTable,
    #[error(
        "the machine was taught an example by hand that no detection can have: have it forget that one, by `forget {0}`"
    )]
    NoObject(u16),
    #[error("the machine is at work and takes no examples: hold it first, by its switch or `hold`; nothing was sent")]
    AtWork,
    #[error(
        "{new} examples are new to the machine, which has room for {free} of its {CAPACITY}: leave some out, or use --replace to forget all that are not in the file; nothing was sent"
    )]
    NoRoom { new: usize, free: usize },
    #[error(
        "{missing} of the examples are not on the machine afterwards{}: try again, and see to the supply if it stays so",
        surplus_of(.surplus)
    )]
    NotTaken {
        missing: usize,
        /// The numbers of those that should not be there.
        surplus: Vec<u16>,
    },
}

fn surplus_of(numbers: &[u16]) -> String {
    let forget: Vec<String> = numbers.iter().map(|number| format!("`forget {number}`")).collect();
    if forget.is_empty() {
        String::new()
    } else {
        format!(", and others are: have it forget them, by {}", forget.join(", "))
    }
}

/// The examples that a machine was taught.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OnMachine {
    /// The valid ones, with their numbers.
    pub taught: Vec<(u16, Taught)>,
    /// Invalid ones, which do not vote: taught for another built-in table, or damaged.
    pub spoiled: u8,
}

/// The changes to a machine's examples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pushed {
    /// Examples that it was taught.
    pub taught: usize,
    /// Examples that it forgot.
    pub forgotten: usize,
}

/// The heading of the columns in the answer to `examples`.
pub const HEAD: &str = "source number class, and five features of 0 to 255: speed spacing delay hold actuation";

/// Puts [`HEAD`] before each list of examples. The firmware has no flash left for it.
#[derive(Clone, Debug, Default)]
pub struct Heading {
    is_in_list: bool,
}

impl Heading {
    /// The heading, if it belongs before this line of an answer.
    pub fn before(&mut self, line: &str) -> Option<&'static str> {
        let is_example = matches!(ConsoleLine::parse(line), ConsoleLine::Example { .. });
        let begins = is_example && !self.is_in_list;
        self.is_in_list = is_example;
        begins.then_some(HEAD)
    }
}

/// Reads the examples that the machine was taught.
///
/// # Errors
/// If the console fails, [`ExamplesError::NoObject`] and [`ExamplesError::OtherTable`].
pub fn read(link: &mut Link) -> Result<OnMachine, ExamplesError> {
    let lines = link.ask_surely("examples")?;
    let (mut built_in, mut taught) = (Vec::new(), Vec::new());
    for (from_field, number, example) in lines.iter().filter_map(|line| self::taught(line)) {
        if from_field {
            features_of(&example).ok_or(ExamplesError::NoObject(number))?;
            taught.push((number, example));
        } else {
            built_in.push(example);
        }
    }
    let spoiled = lines.iter().find_map(|line| line.strip_prefix("spoiled=")?.parse().ok()).unwrap_or(0);
    if built_in == EXAMPLES { Ok(OnMachine { taught, spoiled }) } else { Err(ExamplesError::OtherTable) }
}

/// The wanted examples that are not among those found, and those found beyond the wanted. Each of equal examples votes,
/// so each counts.
pub fn compare(wanted: &[Taught], found: &[(u16, Taught)]) -> (Vec<Taught>, Vec<(u16, Taught)>) {
    let (mut missing, mut surplus) = (wanted.to_vec(), found.to_vec());
    surplus.retain(|(_, example)| {
        let place = missing.iter().position(|wanted| wanted == example);
        place.map(|place| missing.remove(place)).is_none()
    });
    (missing, surplus)
}

/// The example in a line of the answer to `examples`: whether it is from the field, and its number.
pub fn taught(line: &str) -> Option<(bool, u16, Taught)> {
    let ConsoleLine::Example { from_field, number, label, features } = ConsoleLine::parse(line) else { return None };
    let label = if label == Class::Plant { label::PLANT } else { label::WEED };
    Some((from_field, number, Example::new(features, label)))
}

/// Teaches the machine these examples. With `replace` it first forgets all others. Known examples are not taught again.
///
/// # Errors
/// [`ExamplesError::AtWork`] and [`ExamplesError::NoRoom`] before anything is sent; [`ExamplesError::NotTaken`]; and
/// errors of the link.
pub fn push(link: &mut Link, wanted: &[Taught], replace: bool) -> Result<Pushed, ExamplesError> {
    let before = read(link)?.taught;
    let (new, mut stale) = compare(wanted, &before);
    if !replace {
        stale.clear();
    }
    // A newer firmware may have room for more.
    let free = usize::from(CAPACITY).saturating_sub(before.len() - stale.len());
    if new.len() > free {
        return Err(ExamplesError::NoRoom { new: new.len(), free });
    }
    if settings::status(link)?.mode == Mode::Work {
        return Err(ExamplesError::AtWork);
    }
    for (number, _) in &stale {
        link.ask(&format!("forget {number}"))?;
    }
    for example in &new {
        // Features from an earlier command may be left in the buffer. Then these are too many, and the firmware refuses
        // them and clears the buffer. The second try starts with an empty buffer. Without an answer it may be taught.
        teach(link, example).or_else(|error| match error {
            LinkError::Refused { .. } => teach(link, example),
            error => Err(error),
        })?;
    }
    let kept = before.iter().filter(|one| !stale.contains(one)).map(|(_, example)| example);
    let expected: Vec<Taught> = kept.chain(&new).cloned().collect();
    let (missing, surplus) = compare(&expected, &read(link)?.taught);
    if !missing.is_empty() || !surplus.is_empty() {
        return Err(ExamplesError::NotTaken {
            missing: missing.len(),
            surplus: surplus.iter().map(|(number, _)| *number).collect(),
        });
    }
    Ok(Pushed { taught: new.len(), forgotten: stale.len() })
}

fn teach(link: &mut Link, example: &Taught) -> Result<(), LinkError> {
    lines(example).try_for_each(|line| link.ask(&line).map(drop))
}

/// The lines of the console that teach an example.
pub fn lines(example: &Taught) -> impl Iterator<Item = String> + use<> {
    let label = if example.label == label::PLANT { "plant" } else { "weed" };
    let features = example.features.map(|feature| format!("teach {feature}"));
    features.into_iter().chain([format!("teach {label}")])
}

/// Converts a detection to an example, as the firmware's `label` does.
pub fn example_of(features: &Features, label: u8) -> Taught {
    Example::new(SCALE.quantise(features.values()), label)
}

/// The features of an example in millimetres and millimetres a second. Each feature is the middle of the values that
/// have its byte; for an open-ended range it is the nearest value. A table with one value of a feature gives that value.
/// Converting back gives the same bytes. `None` if no value has one of the bytes: no detection gives such an example.
pub fn features_of(example: &Taught) -> Option<Features> {
    let mut values = [0; COUNT];
    for (feature, value) in values.iter_mut().enumerate() {
        *value = *VALUES[feature].get(&example.features[feature])?;
    }
    Some(Features(values))
}

/// For each feature, the value that represents a byte.
static VALUES: LazyLock<[HashMap<u8, i16>; COUNT]> = LazyLock::new(|| {
    std::array::from_fn(|feature| {
        let mut spans: HashMap<u8, (i16, i16)> = HashMap::new();
        for value in i16::MIN..=i16::MAX {
            let byte = SCALE.quantise(&[value; COUNT])[feature];
            spans.entry(byte).or_insert((value, value)).1 = value;
        }
        let lowest = i16::from_le_bytes([SCALE_BYTES[8 * feature], SCALE_BYTES[8 * feature + 1]]);
        spans.into_iter().map(|(byte, (first, last))| (byte, representative(first, last, lowest))).collect()
    })
});

/// The value for the values from `first` to `last`, which have one byte. `lowest` is the lowest of the scale's range.
fn representative(first: i16, last: i16, lowest: i16) -> i16 {
    match (first, last) {
        // All values have this byte: a table of one speed has a range of one value.
        (i16::MIN, i16::MAX) => lowest,
        (i16::MIN, _) => last,
        (_, i16::MAX) => first,
        _ => i16::midpoint(first, last),
    }
}

/// The class that the built-in examples clearly give, if the label is another. The machine refuses that unless forced.
pub fn contradiction(example: &Taught) -> Option<Class> {
    let built_in = Nearest::new(EXAMPLES, Volatile::new()).built_in_class(&features_of(example)?);
    let other = if example.label == label::PLANT { Class::Weed } else { Class::Plant };
    (built_in == other).then_some(other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bytes_of_every_detection_come_back_from_its_millimetres() {
        for value in i16::MIN..=i16::MAX {
            let example = Example::new(SCALE.quantise(&[value; COUNT]), label::WEED);
            let features = features_of(&example).expect("it is an object's");
            assert_eq!(example_of(&features, label::WEED), example);
        }
    }

    #[test]
    fn features_that_no_object_has_are_none() {
        let strange = (0..=u8::MAX).map(|byte| Example::new([64, 64, byte, 64, 64], label::WEED));
        assert!(strange.filter(|example| features_of(example).is_none()).count() > 0);
    }

    #[test]
    fn a_feature_with_one_value_in_the_table_keeps_it() {
        assert_eq!(representative(i16::MIN, i16::MAX, 278), 278);
        for (first, last, value) in [(i16::MIN, 69, 69), (902, i16::MAX, 902), (70, 74, 72)] {
            assert_eq!(representative(first, last, 70), value);
        }
    }

    #[test]
    fn features_are_recovered_within_a_byte_s_resolution() {
        for (spacing_mm, width_mm) in [(60, 12), (500, 100), (600, 150), (700, 180)] {
            let features = Features::describe(417, spacing_mm, width_mm);
            let told = features_of(&example_of(&features, label::PLANT)).expect("it is an object's");
            for (told, true_one) in told.values().iter().zip(features.values()) {
                assert!((told - true_one).abs() <= 10, "{told} for {true_one}");
            }
        }
    }

    #[test]
    fn a_label_against_the_built_in_examples_is_a_contradiction() {
        let plant = Features::describe(417, 500, 150);
        let stalk = Features::describe(417, 250, 20);
        assert_eq!(contradiction(&example_of(&plant, label::PLANT)), None);
        assert_eq!(contradiction(&example_of(&plant, label::WEED)), Some(Class::Plant));
        assert_eq!(contradiction(&example_of(&stalk, label::PLANT)), Some(Class::Weed));
    }
}
