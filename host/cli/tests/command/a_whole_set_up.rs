//! A whole set-up on the virtual Uno, in real time.
//!
//! Tests begin in the order of their names. This one takes longest, and mostly waits, so it has to begin first.

use crate::common::{assert_has, folder_with, said};
use crate::set_up::{SEED, lead, machine_of_the_page, type_to, uno, weeded};
use field::conditions::Conditions;
use link::settings::{Setting, name};
use std::process::ChildStdin;
use std::thread;
use std::time::Duration;

#[test]
fn a_person_sets_the_virtual_uno_up_from_the_first_question_to_the_last() {
    let folder = folder_with("my.toml", &machine_of_the_page());
    // Fast, for a test.
    let (_uno, mut machine) = uno(folder.path(), &["--roll", "--link", "uno", "--speed", "5"]);
    let words = ["--port", "./uno", "--machine", "my.toml"];
    let (mut detections, mut timings, mut disturbed) = (0, 0, false);
    let mut act = |text: &str, keyboard: &mut ChildStdin| {
        if text.contains("votes=") {
            detections += 1;
            // The lines come while the question waits.
            if detections == 12 {
                type_to(keyboard, "");
            }
        } else if text.contains("Roll past plants: both beams") {
            (0..2).for_each(|_| type_to(&mut machine, ""));
        } else if text.contains("The lines come here") {
            type_to(&mut machine, "");
        } else if text.contains("second_beam_mm in mm") {
            type_to(keyboard, "200");
        } else if text.contains("Roll to the other mark") {
            type_to(&mut machine, "10000");
            type_to(keyboard, "");
        } else if text.contains("An end switch on D5") {
            type_to(keyboard, "on");
        } else if text.contains("Keep clear of the tool [go on]") {
            timings += 1;
            assert!(timings < 10, "{text}");
            type_to(keyboard, "");
            if timings == 1 {
                // The swings have begun by then, and have not ended.
                thread::sleep(Duration::from_secs(8));
                type_to(&mut machine, "1000");
                disturbed = true;
            }
        } else if text.ends_with("]: ") {
            type_to(keyboard, "");
        }
    };
    // Stopped at the fifth step, and continued.
    let first = lead(folder.path(), &words, |text, keyboard| match text.contains("servo_in_us in us") {
        true => type_to(keyboard, "q"),
        false => act(text, keyboard),
    });
    assert!(first.ends_with("Stopped. The same command continues here.\n"), "{first}");
    let second = lead(folder.path(), &words, &mut act);
    // A busy computer may take too long for the swings once.
    assert!(disturbed && (3..=4).contains(&timings), "{timings} timings: {second}");
    let parts = [
        "Step 4 of 8, Fit a second beam: done",
        "servo_out_us in us, now 2000 [1750]",
        "The measurements ask for ",
        " + blade 10 + ",
        "    stem_zone_mm 110 mm\n",
        "Next, read docs/work.md",
    ];
    assert_has(&second, parts);
    assert!(!second.contains("Open: ") && !second.contains("Warning"), "{second}");
    // The summary expects what the field `walked` weeds.
    let expected = second.split("Expected: ").nth(1).and_then(|rest| rest.split(' ').next()).expect("it is printed");
    let walked = Conditions::preset("walked").expect("there is one").expect("it is right");
    let weeded = 100.0 * weeded(&walked, 10, SEED).plots.weeded_share;
    assert!((expected.parse::<f64>().expect("it is a number") - weeded).abs() < 2.0, "{expected}, not {weeded:.1}");

    let json: serde_json::Value =
        serde_json::from_str(&said(folder.path(), &["settings", "pull", "--port", "./uno", "--json"])).expect("JSON");
    let value = |setting: Setting| json[name(setting)].as_u64().expect("it is a number");
    // 1909.86 counts a metre, and 5 % of slip: 2010.4. 50 to 80 ms of dead time, and up to 56 ms for the stroke.
    assert!((2005..=2016).contains(&value(Setting::TicksPerM)), "{json:#}");
    assert!((95..=155).contains(&value(Setting::LeadOutMs)), "{json:#}");
    assert!((60..=100).contains(&value(Setting::LeadInMs)), "{json:#}");
    // The 22 mm of the simulated machine, other measurements, and half of a blade of 20 mm.
    assert!((30..=40).contains(&value(Setting::MarginMm)), "{json:#}");

    // A second board is empty, and the file is another's.
    let (_other, _) = uno(folder.path(), &["--stand", "--link", "other"]);
    let third = lead(folder.path(), &["--port", "./other"], |text, keyboard| {
        let answers = [
            ("Is it the same machine", "yes"),
            ("Set the settings of", "no"),
            ("clear the alarm", ""),
            ("Go on with the board's", ""),
        ];
        if text.ends_with("]: ") {
            let answer = answers.iter().find(|(question, _)| text.contains(question));
            type_to(keyboard, answer.map_or("q", |(_, answer)| answer));
        }
    });
    assert!(third.contains("servo_out_us is 2000, and was 1750"), "{third}");
    assert!(third.contains("Step 3 of 8, Fit a wider tool: done"), "{third}");
    assert!(!third.contains("Fit a second beam: done") && !third.contains("Keep the stem: done"), "{third}");
}
