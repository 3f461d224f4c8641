//! Compares random operations on a table with the same operations on a `Vec`.

use knn::{Example, Examples, Table};
use proptest::prelude::*;

const CAPACITY: usize = 7;

#[derive(Clone, Debug)]
enum Operation {
    Add(Example<3>),
    Remove(usize),
    Clear,
}

fn operation() -> impl Strategy<Value = Operation> {
    prop_oneof![
        6 => (any::<[u8; 3]>(), 0_u8..3).prop_map(|(features, label)| Operation::Add(Example::new(features, label))),
        3 => prop_oneof![0..CAPACITY + 2, Just(usize::MAX)].prop_map(Operation::Remove),
        1 => Just(Operation::Clear),
    ]
}

proptest! {
    #[test]
    fn a_table_behaves_like_a_vec_of_limited_length(operations in proptest::collection::vec(operation(), 0..80)) {
        let mut table: Table<3, CAPACITY> = Table::default();
        let mut model = Vec::new();
        for operation in operations {
            match operation {
                Operation::Add(example) if model.len() == CAPACITY => {
                    prop_assert_eq!(table.add_example(example), Err(example));
                }
                Operation::Add(example) => {
                    prop_assert_eq!(table.add_example(example), Ok(()));
                    model.push(example);
                }
                Operation::Remove(index) => {
                    let removed = (index < model.len()).then(|| model.remove(index));
                    prop_assert_eq!(table.remove(index), removed);
                }
                Operation::Clear => {
                    table.clear();
                    model.clear();
                }
            }
            prop_assert_eq!(table.as_slice(), model.as_slice());
            prop_assert_eq!((table.len(), table.is_empty()), (model.len(), model.is_empty()));
            for index in 0..CAPACITY + 1 {
                prop_assert_eq!(table.example(index), model.get(index).copied());
            }
            for label in 0..3 {
                prop_assert_eq!(table.count(label), model.iter().filter(|example| example.label == label).count());
            }
        }
    }
}
