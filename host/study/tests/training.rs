//! Tests of the training: on simulated rows, on noise, and on wrong tables.

use control::ground::examples::{EXAMPLES, K};
use control::ground::features::{Features, SPEED_CLASSES_MM_S};
use control::ground::{
    class::{Class, Classifier},
    nearest::Nearest,
};
use control::memory::Volatile;
use field::row::Kind;
use knn::Example;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::io::Write;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use study::training::synthetic::CROPS;
use study::training::table::{read, read_labelled};
use study::training::{
    DEFAULT_MOST_EXAMPLES, Labelled, Model, beside, held_out, label_of, listing, regions, synthetic, train,
};
use tempfile::TempDir;

/// Allowed shares of plants classified as weeds, and of weeds classified as plants.
const PLANTS_CUT: f64 = 0.001;
const WEEDS_SPARED: f64 = 0.01;

fn labelled(kind: Kind, speed: i16, spacing_mm: i16, width_mm: i16) -> Labelled {
    Labelled { features: Features::describe(speed, spacing_mm, width_mm), kind }
}

/// Sixty plants and sixty weeds, far apart, at one speed.
fn clear_case() -> Vec<Labelled> {
    let plants = (0..60).map(|n| labelled(Kind::Plant, 556, 480 + 2 * n, 120 + n % 30));
    let weeds = (0..60).map(|n| labelled(Kind::Weed, 556, 150 + 5 * n, 12 + n % 9));
    plants.chain(weeds).collect()
}

/// Weeds and plants of nearly the same widths, mixed along the row: every `share`th is a weed.
fn mixed(share: i16, narrowest_plant_mm: i16, step_mm: i16) -> Vec<Labelled> {
    let object = |n: i16| {
        let (kind, narrowest_mm) = if n % share == 0 { (Kind::Weed, 4) } else { (Kind::Plant, narrowest_plant_mm) };
        labelled(kind, 278, 60 + step_mm * n % 160, narrowest_mm + 19 * n % 17)
    };
    (0..24).map(object).collect()
}

#[test]
fn the_other_detections_classify_almost_every_one_correctly() {
    let objects = synthetic::objects(&CROPS[0], 1).unwrap();
    let training = train(&objects, None, DEFAULT_MOST_EXAMPLES).unwrap();
    assert_eq!((training.k, training.forgotten()), (K, None));
    for confusion in [training.leave_one_out, training.by_table] {
        let (plants, weeds) = (confusion.count(Kind::Plant) as f64, confusion.count(Kind::Weed) as f64);
        assert!((confusion.plants_taken_for_weeds() as f64) < PLANTS_CUT * plants, "{confusion}");
        assert!((confusion.weeds_left() as f64) < WEEDS_SPARED * weeds, "{confusion}");
    }
}

#[test]
fn the_built_in_table_holds_on_fields_that_it_was_not_trained_on() {
    for seed in 2..6 {
        let confusion = Model::built_in().classify(&synthetic::objects(&CROPS[0], seed).unwrap());
        let (plants, weeds) = (confusion.count(Kind::Plant) as f64, confusion.count(Kind::Weed) as f64);
        assert!(plants > 1000.0 && weeds > 1000.0, "{confusion}");
        assert!((confusion.plants_taken_for_weeds() as f64) < PLANTS_CUT * plants, "{confusion}");
        assert!((confusion.weeds_left() as f64) < WEEDS_SPARED * weeds, "{confusion}");
    }
}

#[test]
fn the_simulated_field_is_the_same_for_a_seed_and_another_for_another() {
    assert_eq!(synthetic::objects(&CROPS[0], 5).unwrap(), synthetic::objects(&CROPS[0], 5).unwrap());
    assert_ne!(synthetic::objects(&CROPS[0], 5).unwrap(), synthetic::objects(&CROPS[0], 6).unwrap());
}

#[test]
fn the_simulated_field_has_every_speed_slip_and_missing_plant() {
    let objects = synthetic::objects(&CROPS[0], 1).unwrap();
    let is = |kind: Kind, test: &dyn Fn(&Features) -> bool| {
        objects.iter().any(|object| object.kind == kind && test(&object.features))
    };
    for speed in SPEED_CLASSES_MM_S {
        assert!(is(Kind::Plant, &|features| features.speed_mm_s() == speed), "{speed}");
        assert!(is(Kind::Weed, &|features| features.speed_mm_s() == speed && features.spacing_mm() < 120), "{speed}");
        assert!(is(Kind::Weed, &|features| features.speed_mm_s() == speed && features.spacing_mm() > 700), "{speed}");
    }
    // 650 mm is the widest planted spacing, and 180 mm of canopy are 280 mm of hold.
    assert!(is(Kind::Plant, &|features| features.spacing_mm() > 800), "a plant behind one that is missing");
    assert!(is(Kind::Plant, &|features| features.hold_mm() > 281), "a wheel that drags counts more than it rolled");
    let widest_weed = objects.iter().filter(|object| object.kind == Kind::Weed).map(|object| object.features.hold_mm());
    assert!(widest_weed.max().is_some_and(|hold_mm| hold_mm <= 121));
}

#[test]
fn the_model_decides_as_the_firmware_does() {
    let (model, firmware) = (Model::built_in(), Nearest::new(EXAMPLES, Volatile::new()));
    for speed in SPEED_CLASSES_MM_S {
        for spacing_mm in (0..=1500).step_by(25) {
            for width_mm in 0..=200 {
                let features = Features::describe(speed, spacing_mm, width_mm);
                assert_eq!(model.class(&features), firmware.classify(&features, K).class, "{features:?}");
            }
        }
    }
}

#[test]
fn one_plant_labelled_as_a_weed_makes_no_weeds_of_the_plants_around_it() {
    let mut objects = clear_case();
    let plant = objects[30];
    objects[30].kind = Kind::Weed;
    let training = train(&objects, None, DEFAULT_MOST_EXAMPLES).unwrap();
    assert_eq!(training.edited_out, 1);
    assert!(training.k > 1);
    assert_ne!(training.model().class(&plant.features), Class::Weed);
    assert!(!training.kept.contains(&objects[30]));
}

#[test]
fn one_weed_labelled_as_a_plant_makes_no_plants_of_the_weeds_around_it() {
    let mut objects = clear_case();
    objects[90].kind = Kind::Plant;
    let training = train(&objects, None, DEFAULT_MOST_EXAMPLES).unwrap();
    assert_eq!((training.edited_out, training.by_table.weeds_left()), (1, 0));
}

#[test]
fn a_few_plants_among_many_weeds_are_never_taken_for_noise() {
    let mut chance = ChaCha8Rng::seed_from_u64(1);
    let (mut written, mut cut) = (0, 0);
    for number in 0..300 {
        let mut some = |kind, count: usize, widths_mm: RangeInclusive<i16>| -> Vec<Labelled> {
            let mut one = |_| {
                let (speed, spacing_mm) = (chance.random_range(278..695), chance.random_range(100..700));
                labelled(kind, speed, spacing_mm, chance.random_range(widths_mm.clone()))
            };
            (0..count).map(&mut one).collect()
        };
        let (plants, weeds) = (number % 3 + 1, number % 11 + 4);
        let objects = [some(Kind::Plant, plants, 62..=110), some(Kind::Weed, weeds, 8..=60)].concat();
        match train(&objects, None, DEFAULT_MOST_EXAMPLES) {
            Ok(training) => {
                written += 1;
                assert!(training.kept.iter().any(|example| example.kind == Kind::Plant), "{objects:?}");
                cut += usize::from(training.by_table.plants_taken_for_weeds() > 0);
            }
            Err(refused) => assert!(refused.to_string().contains("choose a smaller --k"), "{refused}"),
        }
    }
    assert!(written > 290 && cut < 3, "{written} tables, {cut} cut a plant");
}

#[test]
fn what_was_held_out_tells_what_a_table_does_with_other_detections() {
    const DRAWS: u64 = 12;
    let most = 120;
    let [mut told, mut of_others, mut of_its_own] = [0.0; 3];
    for seed in 0..DRAWS {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut some = |count: usize| -> Vec<Labelled> {
            let mut one = |number: usize| {
                let (kind, widths_mm) =
                    if number.is_multiple_of(2) { (Kind::Plant, 36..=80) } else { (Kind::Weed, 8..=38) };
                labelled(kind, 556, chance.random_range(400..500), chance.random_range(widths_mm))
            };
            (0..count).map(&mut one).collect()
        };
        let (known, others) = (some(200), some(2000));
        let training = train(&known, None, most).unwrap();
        let held_out = held_out(&known, None, most).unwrap();
        assert_eq!([Kind::Plant, Kind::Weed].map(|kind| held_out.count(kind)), [100, 100]);
        let share = |weeds: usize, of: usize| weeds as f64 / of as f64 / DRAWS as f64;
        told += share(held_out.weeds_left(), 100);
        of_others += share(training.model().classify(&others).weeds_left(), 1000);
        of_its_own += share(training.by_table.weeds_left(), 100);
    }
    let shares = format!("{told:.2} of those held out, {of_others:.2} of others, {of_its_own:.2} of its own");
    assert!((told - of_others).abs() < 0.1 && of_others - of_its_own > 0.2, "{shares}");
    println!("{shares}");
}

#[test]
fn few_examples_decide_like_many() {
    let objects = clear_case();
    let training = train(&objects, None, 21).unwrap();
    assert!(training.kept.len() <= 21);
    assert_eq!((training.edited_out, training.by_table.accuracy()), (0, Some(1.0)));
}

#[test]
fn an_object_between_plants_and_weeds_is_unknown() {
    let model = train(&clear_case(), None, DEFAULT_MOST_EXAMPLES).unwrap().model();
    for width_mm in 50..90 {
        assert_eq!(model.class(&Features::describe(556, 400, width_mm)), Class::Unknown, "{width_mm}");
    }
}

#[test]
fn a_few_detections_do_not_make_weeds_of_detections_nearer_to_plants() {
    // So few that each is far from its nearest fellow.
    let plants = (0..4).map(|n| labelled(Kind::Plant, 278 + 139 * n, 500, 140));
    let weeds = (0..4).map(|n| labelled(Kind::Weed, 278 + 139 * n, 300, 16));
    let objects: Vec<Labelled> = plants.chain(weeds).collect();
    let model = train(&objects, Some(1), DEFAULT_MOST_EXAMPLES).unwrap().model();
    for width_mm in 79..140 {
        assert_ne!(model.class(&Features::describe(417, 400, width_mm)), Class::Weed, "{width_mm}");
    }
    assert_eq!(model.class(&objects[5].features), Class::Weed);
}

#[test]
fn a_table_that_cuts_plants_which_all_objects_together_spare_is_refused() {
    let error = train(&mixed(3, 14, 37), Some(11), DEFAULT_MOST_EXAMPLES).unwrap_err();
    assert!(error.to_string().starts_with("with a vote of 11, so few examples cut 1 plant "), "{error}");
}

#[test]
fn as_many_examples_are_kept_as_vote() {
    let training = train(&clear_case(), Some(15), DEFAULT_MOST_EXAMPLES).unwrap();
    assert!(training.kept.len() >= 15);
    assert_eq!(training.by_table.plants_taken_for_weeds(), 0);
}

#[test]
fn more_room_never_refuses_what_less_room_takes() {
    // A table filled up with plants would need more weeds.
    let objects = mixed(2, 12, 41);
    for most in 5..=24 {
        let training = train(&objects, Some(3), most).unwrap();
        assert!(training.kept.len() <= most, "{most}");
        // Few plants have room beside the weeds.
        assert!(training.forgotten().is_some_and(|plants| plants >= 9), "{most}");
    }
}

#[test]
fn a_table_without_a_plant_is_refused() {
    // Four weeds have to be recognised.
    let error = train(&mixed(2, 12, 41), Some(3), 4).unwrap_err().to_string();
    assert!(error.starts_with("too many examples: these detections need 5, and there is room for 4: "), "{error}");
}

#[test]
fn a_k_whose_table_has_no_room_is_passed_over() {
    let plants = (0..3).map(|n| labelled(Kind::Plant, 556, 500 + n, 150));
    let weeds = (0..3).map(|n| labelled(Kind::Weed, 556, 300 + n, 16));
    let objects: Vec<Labelled> = plants.chain(weeds).collect();
    assert_eq!([2, 4].map(|most| train(&objects, None, most).unwrap().k), [1, 3]);
}

#[test]
fn no_objects_and_objects_of_one_class_are_refused() {
    let said = |objects: &[Labelled], k| train(objects, k, 64).unwrap_err().to_string();
    assert!(said(&[], None).starts_with("there are no detections to learn from"));
    let weeds: Vec<Labelled> = clear_case().into_iter().filter(|object| object.kind == Kind::Weed).collect();
    assert!(said(&weeds, None).starts_with("all detections are of the class weed"));
    let few = [labelled(Kind::Plant, 556, 500, 150), labelled(Kind::Weed, 556, 300, 15)];
    assert!(said(&few, Some(3)).starts_with("there are 2 detections, too few for a vote of 3"));
    assert_eq!(said(&few, Some(16)), "k is 16: it has to be 1 to 15");
}

#[test]
fn a_written_table_of_examples_reads_back() {
    let training = train(&clear_case(), None, DEFAULT_MOST_EXAMPLES).unwrap();
    let mut text = Vec::new();
    listing::write_csv(&training.kept, &mut text).unwrap();
    let mut read_back = read_text(&[&String::from_utf8(text).unwrap()]).unwrap();
    let mut kept = training.kept;
    for objects in [&mut read_back, &mut kept] {
        objects.sort_by_key(|object| *object.features.values());
    }
    assert_eq!(read_back, kept);
}

#[test]
fn the_picture_has_a_panel_for_each_speed_and_a_ring_for_each_example() {
    let mut objects = clear_case();
    objects.push(labelled(Kind::Plant, 278, 500, 150));
    let training = train(&objects, None, DEFAULT_MOST_EXAMPLES).unwrap();
    let drawn = regions::draw(&training, &objects).to_string();
    assert_eq!(drawn.matches("km/h").count(), 2);
    // The legend has one more circle.
    assert_eq!(drawn.matches("<circle").count(), objects.len() + training.kept.len() + 1);
}

const HEADER: &str = "speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,label\n";

/// The result of reading files with these texts. Their names are 0.csv, 1.csv and so on.
fn read_text(texts: &[&str]) -> Result<Vec<Labelled>, String> {
    let (folder, paths) = files(texts);
    let read = read_labelled(&paths).map(|read| read.labelled);
    read.map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

fn files(texts: &[&str]) -> (TempDir, Vec<PathBuf>) {
    let folder = TempDir::new().unwrap();
    let path = |index: usize| folder.path().join(format!("{index}.csv"));
    for (index, text) in texts.iter().enumerate() {
        std::fs::File::create(path(index)).unwrap().write_all(text.as_bytes()).unwrap();
    }
    let paths = (0..texts.len()).map(path).collect();
    (folder, paths)
}

#[test]
fn columns_may_come_in_any_order_and_others_among_them() {
    let text = "pos,label,votes,actuation_mm,hold_mm,delay_mm,spacing_mm,speed_mm_s\n\
                # the first bed\n9,plant,3,573,250,226,500,694\n12,weed,3,440,117,226,300,694\n";
    let objects = read_text(&[text]).unwrap();
    assert_eq!(objects, [labelled(Kind::Plant, 694, 500, 150), labelled(Kind::Weed, 694, 300, 17)]);
}

#[test]
fn files_that_have_one_class_each_make_one_table() {
    let plants = format!("{HEADER}694,500,226,250,573,plant\n");
    let weeds = format!("{HEADER}694,300,226,117,440,weed\n");
    assert_eq!(read_text(&[&plants, &weeds]).unwrap().len(), 2);
    let error = read_text(&[&plants, &plants]).unwrap_err();
    assert_eq!(error, "1.csv, line 2: up to here there is no label weed: some detections of either class are needed");
}

#[test]
fn a_bad_line_is_named_with_what_would_be_right() {
    for (lines, message) in [
        (
            "694,500,226,250,573,plant\n694,NaN,226,250,573,plant\n",
            "line 3: spacing_mm is `NaN`: it has to be a whole number from -32768",
        ),
        ("694,500,226,,573,plant\n", "line 2: hold_mm is ``: it has to be a whole number"),
        ("694,500,226,2.5,573,plant\n", "line 2: hold_mm is `2.5`: it has to be a whole number"),
        (
            "694,40000,226,250,573,plant\n",
            "line 2: spacing_mm is `40000`: it has to be a whole number from -32768 to 32767",
        ),
        ("694,500,226,250,573,stone\n", "line 2: label is `stone`: it has to be plant or weed, or empty"),
        ("694,500,226,250,573\n", "line 2: fields: 5, where the header has 6"),
        (
            "694,500,226,250,573,weed\n",
            "line 2: up to here there is no label plant: some detections of either class are needed",
        ),
        ("", "line 1: no line is below the header"),
    ] {
        let error = read_text(&[&format!("{HEADER}{lines}")]).unwrap_err();
        assert!(error.starts_with(&format!("0.csv, {message}")), "{error}");
    }
    for missing in ["hold_mm,", ",label"] {
        let error = read_text(&[&HEADER.replace(missing, "")]).unwrap_err();
        let column = missing.trim_matches(',');
        let right = format!("0.csv, line 1: the column `{column}` is missing: the header has to name ");
        assert!(error.starts_with(&right), "{error}");
    }
}

#[test]
fn dumps_can_be_pasted_with_their_headers_and_the_ok_that_ends_them() {
    let dump = "speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,answer,votes,label\r\n\
                694,500,226,250,573,plant,3,plant\r\n694,300,226,117,440,weed,3,weed\r\nok\r\n";
    for dumps in [dump.to_owned(), dump.repeat(2)] {
        let objects = read_text(&[&dumps]).unwrap();
        assert_eq!(objects, [labelled(Kind::Plant, 694, 500, 150), labelled(Kind::Weed, 694, 300, 17)]);
    }
}

#[test]
fn detections_that_the_machine_answered_as_the_other_class_are_counted() {
    let line = |number: usize, answer, label| format!("694,{}00,226,250,573,{answer},{label}\n", number + 1);
    let plants = ["plant", "unknown", "weed"].map(|answer| (answer, "plant"));
    let weeds = ["weed", "unknown", ""].map(|answer| (answer, "weed"));
    let lines = (0..).zip([plants, weeds].concat()).map(|(number, (answer, label))| line(number, answer, label));
    let lines: String = lines.collect();
    let (_folder, paths) = files(&[&(HEADER.replace("label", "answer,label") + &lines)]);
    assert_eq!(read_labelled(&paths).unwrap().misread, 2);
}

#[test]
fn lines_that_dumps_repeat_are_read_once_and_counted() {
    let [plant, weed] = ["694,500,226,250,573,plant", "694,300,226,117,440,weed"];
    let relabelled = "694,500,226,250,573,weed";
    let (_folder, paths) =
        files(&[&format!("{HEADER}{plant}\n{weed}\n"), &format!("{HEADER}{weed}\n{plant}\n{relabelled}\n")]);
    let read = read_labelled(&paths).unwrap();
    assert_eq!((read.labelled.len(), read.unlabelled, read.repeated), (3, 0, 2));
    let [contradiction] = &read.contradictions[..] else { panic!("{read:?}") };
    assert!(contradiction.ends_with("1.csv, line 4: an earlier line has it as a plant"), "{contradiction}");
    // Their places tell detections with equal features apart.
    let header = HEADER.replace("label", "label,row,position");
    let lines = ["1,200", "1,700", "2,200", "1,200"].map(|place| format!("{plant},{place}\n{weed},{place}\n"));
    let (_folder, paths) = files(&[&(header + &lines.concat())]);
    let read = read_labelled(&paths).unwrap();
    assert_eq!((read.labelled.len(), read.repeated), (6, 2));
}

#[test]
fn objects_without_a_label_are_passed_over_and_counted() {
    let text = format!("{HEADER}694,500,226,250,573,plant\n694,520,226,250,573,\n694,300,226,117,440,weed\n");
    let (_folder, paths) = files(&[&text]);
    let read = read_labelled(&paths).unwrap();
    assert_eq!((read.labelled.len(), read.unlabelled), (2, 1));
}

#[test]
fn objects_to_be_classified_need_no_label() {
    let (_folder, paths) = files(&["speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm\n694,500,226,250,573\n"]);
    let objects = read(&paths[0]).unwrap();
    assert_eq!(objects.len(), 1);
    assert_eq!(objects[0].kind, None);
    let (_folder, paths) = files(&[&format!("{}694,500,226,250,573,plant\n", HEADER.replace("label", "Label"))]);
    let error = read(&paths[0]).unwrap_err().to_string();
    assert!(error.contains("did you mean label by `Label`?"), "{error}");
}

#[test]
fn a_file_that_does_not_exist_is_named() {
    let error = read_labelled(&[PathBuf::from("no/such/objects.csv")]).unwrap_err().to_string();
    assert!(error.starts_with("no/such/objects.csv cannot be read"), "{error}");
}

#[test]
fn taught_examples_spare_the_plants_of_another_field_too() {
    for crop in &CROPS[1..] {
        let chosen = beside(&synthetic::objects(crop, 1).unwrap(), None, 32).unwrap();
        assert!(chosen.chosen.len() <= 32, "{}", crop.name);
        let mut model = Model::built_in();
        let example =
            |object: &Labelled| Example::new(model.scale.quantise(object.features.values()), label_of(object.kind));
        let taught: Vec<_> = chosen.chosen.iter().map(example).collect();
        model.examples.extend(taught);
        let confusion = model.classify(&synthetic::objects(crop, 2).unwrap());
        let (plants, weeds) = (confusion.count(Kind::Plant) as f64, confusion.count(Kind::Weed) as f64);
        assert!((confusion.plants_taken_for_weeds() as f64) < 0.003 * plants, "{}: {confusion}", crop.name);
        assert!((confusion.weeds_left() as f64) < 0.1 * weeds, "{}: {confusion}", crop.name);
    }
}

#[test]
fn plants_that_taught_examples_cannot_spare_are_an_error() {
    let error = beside(&synthetic::objects(&CROPS[2], 1).unwrap(), None, 5).unwrap_err();
    assert!(error.to_string().starts_with("too many examples: "), "{error}");
}
