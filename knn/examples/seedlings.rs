//! Tells beet seedlings from two weeds by the size of their leaves: `cargo run -p knn --example seedlings`.
//!
//! The measurements are invented, with plausible sizes. The compiler calculates scale and examples, as for a microcontroller. One
//! more example is added at run time.

use knn::{Answer, ClassifyError, Example, Kind, Range, Scale, Table, classify};

const CLASSES: usize = 3;
const NAMES: [&str; CLASSES] = ["beet", "fat hen", "chickweed"];

/// Leaf length (mm), leaf width (mm), leaf stalk (mm), and the class.
const MEASURED: [([i16; 3], u8); 12] = [
    ([48, 27, 22], 0),
    ([55, 30, 27], 0),
    ([61, 33, 31], 0),
    ([52, 26, 25], 0),
    ([31, 22, 14], 1),
    ([35, 26, 17], 1),
    ([28, 19, 12], 1),
    ([38, 27, 19], 1),
    ([12, 8, 6], 2),
    ([15, 10, 9], 2),
    ([10, 7, 5], 2),
    ([17, 11, 8], 2),
];

const SCALE: Scale<3> =
    Scale::new([Range { lowest: 0, highest: 90 }, Range { lowest: 0, highest: 50 }, Range { lowest: 0, highest: 50 }]);

/// Squared distance from all examples beyond which a plant is none of the three.
const RADIUS: u32 = 1_000;

fn main() -> Result<(), ClassifyError> {
    let built_in = MEASURED.map(|(features, label)| Example::new(SCALE.quantise(&features), label));
    let mut from_the_field: Table<3, 4> = Table::new();

    println!("Twelve built-in examples:");
    for plant in [[50, 28, 24], [16, 9, 7], [33, 23, 16], [22, 15, 40]] {
        report(plant, &classify(&(&built_in, &from_the_field), &SCALE.quantise(&plant), 3, RADIUS)?);
    }

    println!("The last is labelled by hand as fat hen that grew in the shade; k = 1:");
    if from_the_field.add_example(Example::new(SCALE.quantise(&[22, 15, 40]), 1)).is_err() {
        println!("the table is full");
    }
    let plant = [23, 15, 38];
    report(plant, &classify(&(&built_in, &from_the_field), &SCALE.quantise(&plant), 1, RADIUS)?);
    Ok(())
}

fn report([length, width, stalk]: [i16; 3], answer: &Answer<CLASSES>) {
    let name = NAMES[usize::from(answer.label)];
    let verdict = match answer.kind {
        Kind::Known => format!("a {name}"),
        Kind::Tie => format!("a tie, perhaps a {name}"),
        Kind::Stranger => format!("a stranger, nearest to a {name}"),
    };
    println!(
        "  leaf {length} x {width} mm, stalk {stalk} mm: {verdict} (votes {:?}, squared distance {})",
        answer.votes, answer.nearest
    );
}
