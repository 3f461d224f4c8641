use super::*;
use rig::settings;

/// The measurements of a session, for a blade without length.
fn heard(lines: &[&[&str]]) -> SetUp {
    let arm = Arm { blade_length_mm: 0.0, ..Arm::default() };
    SetUp { arm, ..SetUp::of_lines(lines.concat()) }
}

const TIMED: &[&str] =
    &["calibrated lead_out_ms=150 lead_in_ms=52 set=yes", "calibrated lead_out_ms=158 lead_in_ms=56 set=yes"];

const BY_EYE: &str = "calibrated by=eye, set lead_out_ms and lead_in_ms to what you saw";

/// Two measurements of the wheel.
const MEASURED: &[&str] = &[
    "> calibrate 10000",
    "ticks_per_m=1910 from 0 to 20000, default 0, not saved",
    "> get ticks_per_m",
    "ticks_per_m=1910 from 0 to 20000, default 0, not saved",
    "> calibrate 10000 force",
    "ticks_per_m=1930 from 0 to 20000, default 0, not saved",
    "ok",
];

/// A third one.
const THIRD: &[&str] = &["> calibrate 10000", "ticks_per_m=1920 from 0 to 20000, default 0, not saved"];

/// The worst leads of those that were timed, with a value for another setting.
fn worst_leads(other: Setting, value: u16) -> Vec<(Setting, u16)> {
    vec![(Setting::LeadOutMs, 158), (Setting::LeadInMs, 52), (other, value)]
}

#[test]
fn a_machine_without_measurements_is_left_alone() {
    assert_eq!(heard(&[&["> get", MEASURED[1], "slip permille=12"]]).next(&Settings::new()), None);
}

#[test]
fn servo_wheel_and_margin_come_one_after_the_other() {
    let next = |lines: &[&[&str]], changes: &[_]| heard(lines).next(&settings(changes)).expect("there is a step");
    let leads = |out_ms| [(Setting::LeadOutMs, out_ms), (Setting::LeadInMs, 56)];
    assert_eq!(next(&[&TIMED[..1]], &leads(150)), Step::TimeServo(1));
    assert_eq!(next(&[TIMED], &leads(150)), Step::SetLead(Setting::LeadOutMs, 158));
    assert_eq!(next(&[TIMED], &leads(158)), Step::SetLead(Setting::LeadInMs, 52));
    let mut changes = worst_leads(Setting::TicksPerM, 0);
    assert_eq!(next(&[TIMED], &changes), Step::MeasureWheel(0));
    changes[2].1 = 1920;
    assert_eq!(next(&[TIMED, MEASURED], &changes), Step::MeasureWheel(2));
    // 10 of 1920 ticks and 3 % over 400 mm, 15 ms at 0.694 m/s, and the firmware's 5 mm.
    let step = next(&[TIMED, MEASURED, THIRD], &changes);
    let Step::SetMargin(margin) = step else { panic!("{step:?}") };
    assert!((margin.slip_mm - 400.0 * (10.0 / 1920.0 + 0.03)).abs() < 1e-9);
    assert!((margin.servo_mm - 15.0 * SPEED_M_S).abs() < 1e-9);
    for (in_use_mm, told) in [
        (50, "lower the margin: `set margin_mm 30`: slip 14 + servo 10 + 5 mm at 2.5 km/h"),
        (30, "the margin pays for slip 14 + servo 10 + 5 mm at 2.5 km/h: `save`"),
        (29, "raise the margin: `set margin_mm 30`: slip 14 + servo 10 + 5 mm at 2.5 km/h"),
    ] {
        let changes = [&changes[..], &[(Setting::MarginMm, in_use_mm)]].concat();
        assert_eq!(next(&[TIMED, MEASURED, THIRD], &changes).to_string(), told);
    }
}

#[test]
fn a_wheel_whose_value_in_use_was_not_measured_is_to_be_measured_again() {
    let set_up = heard(&[TIMED, MEASURED, THIRD]);
    for (ticks_per_m, missing) in [(1909, Some(0)), (1910, None), (1915, None), (1930, None), (1931, Some(0))] {
        let missing: Vec<Step> = missing.map(Step::MeasureWheel).into_iter().collect();
        assert_eq!(set_up.missing(&settings(&worst_leads(Setting::TicksPerM, ticks_per_m))), missing, "{ticks_per_m}");
    }
    for (typed, kept) in [("> set ticks_per_m 1915", 3), ("> set ticks_per_m 1500", 0)] {
        assert_eq!(heard(&[MEASURED, THIRD, &[typed]]).ticks_per_m.len(), kept, "{typed}");
    }
    // Pushed from a file, or back at 0 because of another wheel.
    for (shown, kept) in [("ticks_per_m=1915", 3), ("ticks_per_m=1500", 0), ("ticks_per_m=0", 0)] {
        let set_up = heard(&[MEASURED, THIRD, &["> get", shown, "> calibrate 10000", "ticks_per_m=1528"]]);
        assert_eq!(set_up.ticks_per_m.len(), kept + 1, "{shown}");
    }
}

#[test]
fn with_a_second_beam_plants_show_the_remaining_slip() {
    let mut changes = worst_leads(Setting::SecondBeamMm, 200);
    assert_eq!(
        heard(&[TIMED, MEASURED, MEASURED]).missing(&settings(&changes)),
        [Step::MeasureWheel(0), Step::PassPlants(0)],
        "the wheel as it is set was not measured"
    );
    changes.push((Setting::TicksPerM, 1930));
    let few = heard(&[TIMED, MEASURED, MEASURED, &["slip permille=40"; 5]]);
    assert_eq!(few.next(&settings(&changes)), Some(Step::PassPlants(5)));
    // Old values do not count.
    let plants = ["slip permille=50", "slip permille=90"].repeat(PLANTS / 2);
    let enough = heard(&[TIMED, MEASURED, MEASURED, &["slip permille=40"; 5], &plants]);
    let margin = enough.margin(&settings(&changes)).expect("all was measured");
    assert!((margin.slip_mm - 8.0).abs() < 1e-9, "a twenty-fifth of 200 mm: {margin:?}");
}

#[test]
fn beside_a_stem_s_zone_leads_and_margin_go_up_to_its_circle() {
    let set_up = heard(&[TIMED, MEASURED, THIRD, &["slip permille=12"; PLANTS]]);
    // 3 % of 200 mm, 15 ms at 2.5 km/h and the firmware's 5 mm: 21.4.
    // Beside a zone of 100 mm, 6, 4.2, 8.8 and 2 mm. A trailing arm with a tool of 130 mm needs some millimetres more,
    // and around canopies the 102.5 mm by which 45 degrees carry it.
    let trailing = SetUp { trailing_tool_mm: Some(130), ..set_up.clone() };
    // A longer arm swings farther aside, so its circle saves less.
    let longer = SetUp { arm: Arm { length_mm: 500.0, ..set_up.arm }, ..set_up.clone() };
    for (set_up, zone_mm, least_mm, leads) in [
        (&set_up, 0, 22, (158, 52)),
        (&set_up, 100, 21, (127, 72)),
        (&longer, 100, 21, (130, 69)),
        (&trailing, 100, 32, (127, 72)),
        (&trailing, 0, 124, (158, 52)),
    ] {
        let mut changes = worst_leads(Setting::TicksPerM, 1930);
        (changes[0].1, changes[1].1) = leads;
        changes.extend([(Setting::SecondBeamMm, 200), (Setting::StemZoneMm, zone_mm)]);
        let margin = set_up.margin(&settings(&changes)).expect("all was measured");
        assert_eq!(margin.least_mm(), least_mm, "{margin:?}");
    }
}

#[test]
fn the_way_back_may_have_no_load_so_its_lead_is_that_of_an_unloaded_servo() {
    let set_up = heard(&[&["servo_out_us=1750"], &["calibrated lead_out_ms=240 lead_in_ms=52 set=yes"; 2]]);
    let quick = SetUp { arm: Arm { ms_for_90: 120.0, ..set_up.arm }, ..set_up.clone() };
    let settings = settings(&[(Setting::ServoOutUs, 1750), (Setting::StemZoneMm, 110)]);
    for (set_up, in_ms) in [(set_up, 78), (quick, 67)] {
        let leads = [Step::SetLead(Setting::LeadOutMs, 191), Step::SetLead(Setting::LeadInMs, in_ms)];
        assert_eq!(set_up.missing(&settings)[..2], leads);
    }
}

#[test]
fn a_servo_that_was_timed_by_eye_scatters_by_the_error_of_the_eye() {
    let failed = "calibrated by=none, the end switch did not follow";
    let set_up = heard(&[&[BY_EYE, failed, BY_EYE], MEASURED, MEASURED]);
    let margin = set_up.margin(&settings(&[(Setting::TicksPerM, 1930)])).expect("all was measured");
    assert!((margin.servo_mm - f64::from(SERVO_MS) * SPEED_M_S).abs() < 1e-9);
}

#[test]
fn of_times_seen_by_eye_the_safest_count() {
    let seen = [
        BY_EYE,
        "> set lead_out_ms 190",
        "> set lead_in_ms 50",
        BY_EYE,
        "> set lead_out_ms 140",
        "> set lead_in_ms 80",
    ];
    // The last line follows the advice.
    let set_up = heard(&[&seen, &["> set lead_out_ms 190"], MEASURED, THIRD]);
    let again = SetUp::of_lines(set_up.lines().iter().map(String::as_str));
    for (out_ms, in_ms, missing) in [
        (140, 80, vec![Step::SetLead(Setting::LeadOutMs, 190), Step::SetLead(Setting::LeadInMs, 50)]),
        (190, 50, vec![]),
        (200, 40, vec![]),
    ] {
        let changes = [(Setting::LeadOutMs, out_ms), (Setting::LeadInMs, in_ms), (Setting::StemZoneMm, 110)];
        let settings = settings(&[&changes[..], &[(Setting::TicksPerM, 1920)]].concat());
        assert_eq!([&set_up, &again].map(|set_up| set_up.missing(&settings)), [missing.clone(), missing.clone()]);
        if missing.is_empty() {
            let margin = set_up.margin(&settings).expect("all was measured");
            assert!((margin.servo_mm - 50.0 * SLOW_M_S).abs() < 1e-9, "{margin:?}");
        }
    }
}

#[test]
fn a_servo_that_was_timed_over_another_stroke_or_gap_is_to_be_timed_again() {
    let set_up = heard(&[&["servo_out_us=1795"], TIMED, MEASURED, MEASURED]);
    for (out_us, missing) in [(1795, vec![]), (1800, vec![Step::TimeServo(0)]), (1700, vec![Step::TimeServo(0)])] {
        let changes = [worst_leads(Setting::TicksPerM, 1930), vec![(Setting::ServoOutUs, out_us)]].concat();
        assert_eq!(set_up.missing(&settings(&changes)), missing, "{out_us}");
        let slower = [changes, vec![(Setting::ServoGapMs, 0)]].concat();
        assert_eq!(set_up.missing(&settings(&slower)), [Step::TimeServo(0)], "{out_us}");
    }
}

#[test]
fn a_margin_below_the_measured_one_gives_a_warning() {
    let typed = &["> set margin_mm 13"][..];
    let all = heard(&[TIMED, MEASURED, THIRD, typed]);
    let (in_part, nothing) = (heard(&[TIMED, typed]), heard(&[typed]));
    // A machine that was set up earlier gets no warning.
    let earlier = heard(&[&["> get"]]);
    let (servo, wheel) = ("time the servo and ", "measure the wheel first; 50 is safe");
    for (set_up, margin_mm, warning) in [
        (&all, 30, None),
        (&all, 29, Some("margin_mm 29 is too small: the measurements need 30".to_owned())),
        (&in_part, 50, None),
        (&in_part, 49, Some(format!("margin_mm 49 is not measured: {wheel}"))),
        (&nothing, 13, Some(format!("margin_mm 13 is not measured: {servo}{wheel}"))),
        (&earlier, 13, None),
    ] {
        let changes = [worst_leads(Setting::TicksPerM, 1920), vec![(Setting::MarginMm, margin_mm)]].concat();
        assert_eq!(set_up.warning(&settings(&changes)), warning);
    }
    // A blade of 65 mm needs 10 mm more than the default margin, and stems 40 mm off the middle need as much again.
    let mut long = heard(&[typed]);
    (long.arm.blade_length_mm, long.stem_off_mm) = (65.0, 40.0);
    for (zone_mm, safe_mm) in [(0, 60), (110, 70)] {
        let warning = long.margin_warning(&settings(&[(Setting::StemZoneMm, zone_mm), (Setting::MarginMm, 59)]));
        assert!(warning.as_ref().is_some_and(|said| said.ends_with(&format!("{safe_mm} is safe"))), "{warning:?}");
    }
    assert_eq!(heard(&[]).margin_warning(&settings(&[(Setting::MarginMm, 50)])), None);
}

#[test]
fn capital_letters_are_taken_as_by_the_firmware() {
    let capitals: Vec<String> =
        MEASURED.iter().chain(THIRD).map(|line| line.replace("calibrate", "Calibrate")).collect();
    let set_up = SetUp::of_lines(capitals.iter().map(String::as_str));
    assert_eq!(set_up.ticks_per_m, [1910, 1930, 1920]);
    for (line, sets_margin) in [("> SET  margin_mm 5", true), ("> SET MARGIN_MM 5", true), ("> set margin", false)] {
        assert_eq!(heard(&[&[line]]).warning(&settings(&[(Setting::MarginMm, 5)])).is_some(), sets_margin, "{line}");
    }
}

#[test]
fn a_margin_that_cannot_be_set_is_a_measurement_to_repeat() {
    const MISMEASURED: &[&str] = &["> calibrate 10000 force", "ticks_per_m=2400 from 0 to 20000, default 0, not saved"];
    let typed = &["> set margin_mm 200"][..];
    let far = |other, value| {
        let far = [(Setting::BeamToToolMm, 1000), (Setting::MarginMm, 200), (Setting::TicksPerM, 1920)];
        settings(&[worst_leads(other, value), far.to_vec()].concat())
    };
    let alone = far(Setting::SecondBeamMm, 0);
    let plants: Vec<&str> = ["slip permille=-150", "slip permille=150"].repeat(PLANTS / 2);
    let uneven = &["calibrated lead_out_ms=500 lead_in_ms=52 set=yes"][..];
    let late = far(Setting::LeadOutMs, 500);
    for (lines, settings, told) in [
        (
            vec![TIMED, MEASURED, MISMEASURED, typed],
            &alone,
            "the measurements need 296 mm: `set ticks_per_m 0`, and measure the wheel again",
        ),
        (
            vec![TIMED, MEASURED, THIRD, &plants, typed],
            &far(Setting::SecondBeamMm, 200),
            "the measurements need 256 mm: roll past more plants",
        ),
        (
            vec![TIMED, uneven, MEASURED, THIRD, typed],
            &late,
            "the measurements need 284 mm: see to the servo, its times differ too much",
        ),
    ] {
        let set_up = heard(&lines);
        assert_eq!(set_up.next(settings).map(|step| step.to_string()).as_deref(), Some(told));
        assert_eq!(set_up.open(&[Task::SetMargin], settings).as_deref(), Some(told));
        let warning = format!("margin_mm 200 is too small: {told}");
        assert_eq!(set_up.warning(settings), Some(warning));
    }
    let trailing = SetUp { trailing_tool_mm: Some(130), ..heard(&[&["servo_out_us=2200"], TIMED, MEASURED, THIRD]) };
    let wide = [worst_leads(Setting::TicksPerM, 1920), vec![(Setting::ServoOutUs, 2200)]].concat();
    let next = trailing.next(&settings(&wide)).expect("there is a step");
    assert_eq!(next.to_string(), "the measurements need 221 mm: shorten the trailing arm's stroke");
    // The wheel is measured again.
    let again = heard(&[TIMED, MEASURED, MISMEASURED, &["> set ticks_per_m 0", "ok"], MEASURED, THIRD]);
    assert!(again.margin(&alone).is_ok_and(|margin| margin.least_mm() < 60), "{again:?}");
}

#[test]
fn measurements_are_the_same_after_writing_and_reading() {
    let set_up = heard(&[&["servo_out_us=1795"], TIMED, MEASURED, &[BY_EYE, "slip permille=-4"]]);
    let settings = settings(&[(Setting::ServoOutUs, 1795)]);
    let lines = set_up.lines();
    let again = SetUp::of_lines(lines.iter().map(String::as_str));
    assert_eq!((again.lines(), again.missing(&settings)), (lines, set_up.missing(&settings)));
    assert_eq!(again.missing(&settings), [Step::MeasureWheel(0)]);
}

/// A margin without parts of arm and blade.
const NO_ARM: Margin =
    Margin { slip_mm: 0.0, servo_mm: 0.0, firmware_mm: 0.0, stems_mm: None, arm_mm: 0.0, blade_mm: 0.0, in_use_mm: 50 };

#[test]
fn half_of_the_blade_s_length_along_the_row_is_a_part_of_the_margin() {
    let of = |blade_length_mm: f64, zone_mm: u16| {
        let mut set_up = heard(&[TIMED, MEASURED, THIRD]);
        set_up.arm.blade_length_mm = blade_length_mm;
        let mut changes = worst_leads(Setting::TicksPerM, 1920);
        if zone_mm > 0 {
            (changes[0].1, changes[1].1) = (127, 72);
        }
        changes.push((Setting::StemZoneMm, zone_mm));
        set_up.margin(&settings(&changes)).expect("all was measured")
    };
    for zone_mm in [0, 100] {
        let without = of(0.0, zone_mm);
        assert!(!without.to_string().contains("blade"), "{without}");
        for (length_mm, half_mm) in [(20.0, 10), (30.0, 15), (44.0, 22)] {
            let margin = of(length_mm, zone_mm);
            assert_eq!(margin.least_mm(), without.least_mm() + half_mm);
            assert!(margin.to_string().contains(&format!(" + blade {half_mm} + ")), "{margin}");
        }
    }
    let mut long = heard(&[TIMED, MEASURED, THIRD]);
    long.arm.blade_length_mm = 400.0;
    let next = long.next(&settings(&worst_leads(Setting::TicksPerM, 1920))).expect("there is a step");
    assert_eq!(next.to_string(), "the measurements need 230 mm: take a blade that is shorter along the row");
}

#[test]
fn the_stroke_s_time_is_known_after_a_timing_by_the_end_switch() {
    let present = settings(&[]);
    assert_eq!(heard(&[]).stroke_ms(&present), None);
    assert_eq!(heard(&[&[BY_EYE, "> set lead_out_ms 190", "> set lead_in_ms 50"]]).stroke_ms(&present), None);
    // 158 ms at most, 52 ms at least, and 40 ms beside the stroke.
    assert_eq!(heard(&[TIMED]).stroke_ms(&present), Some(66.0));
    assert_eq!(heard(&[TIMED]).stroke_ms(&settings(&[(Setting::ServoOutUs, 1800)])), None);
}

#[test]
fn every_step_fits_on_a_line_of_80_characters() {
    let mm = 123.0;
    let margin = Margin { slip_mm: mm, servo_mm: mm, firmware_mm: mm, stems_mm: Some(mm), in_use_mm: 50, ..NO_ARM };
    for step in [
        Step::TimeServo(1),
        Step::SetLead(Setting::LeadOutMs, 158),
        Step::MeasureWheel(2),
        Step::PassPlants(11),
        Step::SetMargin(margin),
        Step::MeasureAgain(u16::MAX, "`set ticks_per_m 0`, and measure the wheel again"),
        Step::Ready(margin),
    ] {
        assert!(step.to_string().len() <= 80, "{} in {step}", step.to_string().len());
    }
}
