//! Parts of studies of bare numbers.

use super::*;
use proptest::prelude::*;
use serde_json::json;

fn program() -> Program {
    Program { version: "0.2.0".to_owned(), build: "1234abcd".to_owned() }
}

fn header(shard: &str, all: u64) -> Header {
    let settings = json!({ "experiment": { "seed": u64::MAX, "speeds": [1.0, 2.5] }, "words": "" });
    Header::new(program(), "trial", shard.parse().unwrap(), all, settings)
}

/// A part's text. Its outcomes are the values of `of` for their numbers.
fn written(header: &Header, of: impl Fn(u64) -> f64) -> Vec<u8> {
    let mut text = Vec::new();
    let outcomes = header.shard.numbers(header.all).map(|number| Numbered { number, outcome: of(number) });
    write(header, outcomes, &mut text).unwrap();
    text
}

fn read(name: &str, mut text: &[u8]) -> Result<Vec<Numbered<f64>>> {
    let header = read_header(name, &mut text)?;
    read_outcomes(name, &header, &mut text)
}

/// The error for parts with these headers.
#[track_caller]
fn refusal(headers: &[Header]) -> String {
    let named: Vec<_> = ('a'..).map(String::from).zip(headers.iter().cloned()).collect();
    together(&named, &program()).unwrap_err().to_string()
}

proptest! {
    #[test]
    fn shards_of_any_number_have_each_plot_once_and_differ_by_one_at_most(all in 0..2000_u64, of in 1..300_u64) {
        let shards: Vec<Vec<u64>> =
            (1..=of).map(|number| Shard { number, of }.numbers(all).collect()).collect();
        let mut numbers = shards.concat();
        numbers.sort_unstable();
        prop_assert_eq!(numbers, (0..all).collect::<Vec<_>>());
        let lengths = || shards.iter().map(Vec::len);
        prop_assert!(lengths().max().unwrap() - lengths().min().unwrap() <= 1);
        prop_assert!(shards.iter().all(|shard| shard.is_sorted()));
    }

    #[test]
    fn parts_in_any_order_give_each_outcome_back_to_the_bit(
        bits in prop::collection::vec(any::<u64>(), 0..60),
        of in 1..9_u64,
        first in 0..9_usize,
    ) {
        let values: Vec<f64> = bits.into_iter().map(f64::from_bits).filter(|value| value.is_finite()).collect();
        let all = values.len() as u64;
        let mut headers: Vec<Header> = (1..=of).map(|number| header(&format!("{number}/{of}"), all)).collect();
        headers.rotate_left(first % of as usize);
        let named: Vec<_> = headers.iter().map(|header| ("part".to_owned(), header.clone())).collect();
        prop_assert!(together(&named, &program()).is_ok());
        let read = |header| read("part", &written(header, |number| values[number as usize])).unwrap();
        let back = outcomes(headers.iter().map(read).collect());
        prop_assert!(back.iter().map(|value| value.to_bits()).eq(values.iter().map(|value| value.to_bits())));
    }

    #[test]
    fn a_part_that_is_cut_short_anywhere_is_no_part(keep in 0.0..1.0_f64) {
        let text = written(&header("1/2", 9), |number| number as f64 / 3.0);
        let keep = (keep * (text.len() - 1) as f64) as usize;
        prop_assert!(read("part", &text[..keep]).is_err());
    }
}

#[test]
fn an_invalid_shard_is_refused_with_what_would_be_right() {
    for text in ["", "1", "0/4", "5/4", "1/0", "a/b", "1/2/3", "-1/4", "1/100001"] {
        assert!(text.parse::<Shard>().unwrap_err().to_string().contains("has to be I/N"), "{text}");
    }
    assert_eq!("4/4".parse::<Shard>().unwrap().to_string(), "4/4");
    assert_eq!("1/1".parse::<Shard>().unwrap(), Shard::WHOLE);
}

#[test]
fn parts_that_are_missing_are_named() {
    assert_eq!(
        refusal(&[header("1/3", 5), header("3/3", 5)]),
        "part 2/3 is missing: name all parts of the study, or compute the missing ones by --shard"
    );
    assert!(refusal(&[header("2/4", 5)]).starts_with("parts 1/4, 3/4 and 4/4 are missing"));
    let many = refusal(&[header("1/12", 5)]);
    assert!(many.starts_with("parts 2/12, 3/12, 4/12, 5/12, 6/12, 7/12, 8/12, 9/12 and 3 more are missing"), "{many}");
    assert!(together(&[], &program()).is_err());
}

#[test]
fn a_part_of_another_study_is_named_with_the_difference() {
    let other = |change: &dyn Fn(&mut Header)| {
        let mut changed = header("2/2", 5);
        change(&mut changed);
        refusal(&[header("1/2", 5), changed])
    };
    let speeds = other(&|header| header.settings["experiment"]["speeds"] = json!([1.0]));
    assert!(speeds.ends_with("its experiment.speeds is [1.0], not [1.0,2.5]"), "{speeds}");
    let of = refusal(&[header("1/2", 5), header("2/3", 5)]);
    assert!(of.ends_with("its number of parts is 3, not 2"), "{of}");
    let size = other(&|header| header.all = 6);
    assert!(size.ends_with("its size is 6, not 5"), "{size}");
}

#[test]
fn a_file_that_is_no_part_says_so() {
    for (text, problem) in [
        ("plot,replication\n1,1\n", "line 1 is not the head of a part, or was cut"),
        ("{\"weeder_part\": 1, \"pro", "line 1 is not the head of a part, or was cut"),
        ("{\"seed\": 1}\n", "line 1 has no `weeder_part`"),
        ("{\"weeder_part\": 2}\n", "it has form 2, and this program knows form 1"),
        ("{\"weeder_part\": 1}\n", "line 1: missing field `program`"),
    ] {
        let said = read("table.csv", text.as_bytes()).unwrap_err().to_string();
        assert!(said.starts_with("table.csv is no part of a study") && said.contains(problem), "{said}");
    }
    let mut text = written(&header("1/2", 5), |_| 0.5);
    let at = text.windows(11).position(|window| window == b"\"number\":1,").unwrap();
    text[at + 9] = b'3';
    let said = read("p", &text).unwrap_err().to_string();
    assert!(said.contains("has to be I/N"), "{said}");
}

#[test]
fn an_outcome_that_is_missing_doubled_or_too_many_is_named_with_its_line() {
    let text = String::from_utf8(written(&header("1/2", 5), |_| 0.5)).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    for (lines, problem) in [
        (lines[..3].to_vec(), "line 4: the part ends before number 4"),
        (vec![lines[0], lines[1], lines[1], lines[3]], "line 3: this is number 0, but has to be 2"),
        ([&lines[..], &lines[1..2]].concat(), "line 5: this is one more than the part has"),
        (vec![lines[0], &lines[1][..9]], "line 2: this is not an outcome of this study, or was cut"),
    ] {
        let said = read("p", lines.join("\n").as_bytes()).unwrap_err().to_string();
        assert_eq!(said, format!("p, {problem}; compute part 1/2 again, with --force"));
    }
}
