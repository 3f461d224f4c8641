//! Properties of a scale for each `i16`: it saturates, keeps order, and makes features comparable.

use knn::{Range, Scale};
use proptest::prelude::*;

fn value() -> impl Strategy<Value = i16> {
    prop_oneof![-600_i16..600, any::<i16>(), Just(i16::MIN), Just(i16::MAX)]
}

/// How far a byte lies above the exact one, for the value at this part of a range.
///
/// The two steps that round down, of the value and of the byte, each take less than 1. The factor is rounded up by less than 1/256,
/// for up to 511 steps, so it adds less than 2. The width's rounding down adds less than 1.
fn off_the_exact_byte(range: Range, part: f64) -> f64 {
    let (lowest, width) = (f64::from(range.lowest), f64::from(range.highest) - f64::from(range.lowest));
    let value = (lowest + part * width) as i16;
    let [byte] = Scale::new([range]).quantise(&[value]);
    f64::from(byte) - (f64::from(value) - lowest) / width * 255.0
}

proptest! {
    #[test]
    fn a_larger_value_is_never_a_smaller_byte(lowest in value(), highest in value(), left in value(), right in value()) {
        let scale = Scale::new([Range { lowest, highest }]);
        let [smaller] = scale.quantise(&[left.min(right)]);
        let [larger] = scale.quantise(&[left.max(right)]);
        prop_assert!(smaller <= larger);
    }

    #[test]
    fn outside_its_range_a_value_saturates(lowest in value(), highest in value(), value in value()) {
        prop_assume!(lowest < highest);
        let [byte] = Scale::new([Range { lowest, highest }]).quantise(&[value]);
        if value <= lowest {
            prop_assert_eq!(byte, 0);
        }
        if value >= highest {
            prop_assert_eq!(byte, 255);
        }
    }

    #[test]
    fn inside_its_range_a_value_is_near_the_exact_byte(lowest in value(), highest in value(), part in 0.0..1.0) {
        prop_assume!(lowest < highest);
        let off = off_the_exact_byte(Range { lowest, highest }, part);
        prop_assert!(-2.0 < off && off < 3.0, "{off}");
    }

    #[test]
    fn a_learned_scale_gives_every_feature_the_same_weight(
        rows in proptest::collection::vec([-15_000..15_000, -1000..1000, 0..100_i16], 2..40),
    ) {
        let scale = Scale::learn(&rows).expect("there are rows");
        for feature in 0..3 {
            let smallest = *rows.iter().min_by_key(|row| row[feature]).expect("there are rows");
            let largest = *rows.iter().max_by_key(|row| row[feature]).expect("there are rows");
            prop_assume!(largest[feature] - smallest[feature] >= 50);
            let spread = scale.quantise(&largest)[feature] - scale.quantise(&smallest)[feature];
            prop_assert!((124..=130).contains(&spread), "feature {feature} spreads over {spread}");
        }
    }
}

#[test]
fn a_byte_may_be_more_than_two_above_the_exact_one() {
    let off = off_the_exact_byte(Range { lowest: -32768, highest: -321 }, 0.9057229233859989);
    assert!(2.0 < off && off < 2.1, "{off}");
}

#[test]
fn a_constant_feature_does_not_count() {
    let scale = Scale::learn(&[[7, 1], [7, 2]]).unwrap();
    assert_eq!([-1000, 7, 1000].map(|value| scale.quantise(&[value, 1])[0]), [0; 3]);
}

#[test]
fn even_two_neighbouring_values_keep_room_for_strangers() {
    let scale = Scale::learn(&[[0], [1]]).unwrap();
    assert_eq!([-1, 0, 1, 2].map(|value| scale.quantise(&[value])[0]), [0, 85, 170, 255]);
}

#[test]
fn without_rows_there_is_no_scale() {
    assert_eq!(Scale::<2>::learn(&[]), None);
}
