use super::*;
use crate::unit::{KG, KM_H, SECOND};
use link::settings::SPEED_STEP_MM_S;

fn with_tool_of_100_mm() -> Machine {
    let mut machine = Machine::default();
    machine.intra_row.width = MM.of(100.0);
    machine
}

/// A board whose tool was fitted with these pulses, in and out.
fn board([in_us, out_us]: [u16; 2]) -> Settings {
    let mut settings = Settings::new();
    settings.set(Setting::ServoInUs, in_us).expect("it is in its range");
    settings.set(Setting::ServoOutUs, out_us).expect("it is in its range");
    settings
}

#[test]
fn a_thick_shank_is_slow_and_falls_back_without_a_spring() {
    // By hand: 1.94 kg of rod and 0.4 kg of blade, 0.1283 kg m2 and 47.97 kg cm, 22.1 of them at 27.5 degrees. The time
    // constant is 142.7 ms, and 71.8 ms at the final speed become 171.6 ms from rest. A numerical integration agrees.
    let mut machine = Machine::default();
    machine.intra_row.shank_diameter = MM.of(30.0);
    machine.intra_row.blade_mass = KG.of(0.4);
    machine.intra_row.width = MM.of(130.0);
    (machine.swing.protected, machine.swing.room) = (MM.of(90.0), MM.of(23.0));
    let torque = KG_CM.of(9.85);
    let swing = Swing::of(&machine, torque).expect("it swings");
    let near = |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 0.01, "{value}, not {expected}");
    near(swing.swung_kg, 2.342);
    near(swing.loaded_ms, 171.6);
    near(swing.weight_kg_cm, 22.15);
    // 325 mm up to the axis, less half of (90 + 2 * 23) mm * cos(22.5 degrees) + 30 mm, over the sine.
    assert_eq!(swing.clear_height_mm, 121.0);
    near(swing.edge_lift_mm, 1.77);
    let said = swing.sentences(&machine, torque).join(" ");
    assert!(said.contains("20.0 kg cm: no spring can. Take a lighter arm"), "{said}");
}

#[test]
fn a_stem_zone_needs_a_shorter_stroke_than_the_canopy() {
    let torque = KG_CM.of(10.0);
    let mut machine = with_tool_of_100_mm();
    let canopy = Swing::of(&machine, torque).expect("it swings");
    assert_eq!((canopy.servo_out_us, canopy.set_lines().len()), (1795, 4));
    machine.swing.protected = MM.of(90.0);
    let stem = Swing::of(&machine, torque).expect("it swings");
    // 45 + 10 + 50 mm of an arm of 350 are 17.5 degrees.
    let lines = ["set servo_out_us 1695", "set lead_out_ms 152", "set stem_zone_mm 100"];
    assert!(lines.iter().all(|line| stem.set_lines().iter().any(|set| set == line)), "{:?}", stem.set_lines());
    assert!(
        stem.sentences(&machine, torque)[0].starts_with("The tool clears a stem's protected circle of 90 mm at 17."),
        "{stem:?}"
    );
}

#[test]
fn a_stroke_begins_where_the_tool_was_fitted_and_goes_to_the_same_side() {
    for (board_us, pulses) in [
        ([1500, 2000], [1500, 1795]),
        ([1620, 2000], [1620, 1915]),
        ([1480, 1000], [1480, 1185]),
        ([1500, 2100], [1500, 1795]),
    ] {
        let machine = with_tool_of_100_mm();
        let fitted = Swing::fitted(&machine, KG_CM.of(10.0), &board(board_us)).expect("it swings");
        assert_eq!([fitted.servo_in_us, fitted.servo_out_us], pulses);
        // A narrower tool offers the same stroke for the tool that fills the strip.
        let machine = Machine::default();
        let narrow = Swing::fitted(&machine, KG_CM.of(10.0), &board(board_us)).expect("it swings");
        let sentences = narrow.sentences(&machine, KG_CM.of(10.0)).join(" ");
        assert!(sentences.contains("a tool of 100 mm would fill that, and swing out to 26.6 degrees."), "{sentences}");
    }
}

#[test]
fn fixed_frames_and_a_higher_top_speed_of_the_board_need_safer_leads() {
    let leads = |machine: &Machine, setting: Setting, value: u16| {
        let mut settings = Settings::new();
        settings.set(setting, value).expect("it is in its range");
        let swing = Swing::fitted(machine, KG_CM.of(10.0), &settings).expect("it swings");
        (swing.lead_out_ms, swing.lead_in_ms)
    };
    let mut machine = with_tool_of_100_mm();
    let (out_ms, in_ms) = leads(&machine, Setting::ServoGapMs, 3);
    assert_eq!(leads(&machine, Setting::ServoGapMs, 0), (out_ms + 17, in_ms));
    machine.swing.protected = MM.of(90.0);
    let (out_ms, in_ms) = leads(&machine, Setting::TopSpeedMmS, 1300);
    let (fast_out_ms, fast_in_ms) = leads(&machine, Setting::TopSpeedMmS, 2000);
    assert!(fast_out_ms > out_ms && fast_in_ms < in_ms, "{fast_out_ms} {fast_in_ms}");
}

#[test]
fn the_firmware_accepts_each_line_and_the_speed_for_a_long_lead() {
    // The soil's torque on the paper's blade, and on one of 2.5 mm.
    // The trailing arm's margin is 26 mm wider, too wide for the default lead. A new board's tool is out at the last
    // pulse.
    for (kg_cm, arm_trails, pulse_in, slower_mm_s) in
        [(39.4, 0, 1500.0, Some(1000)), (39.4, 1, 1500.0, Some(900)), (10.0, 1, 1500.0, None), (10.0, 0, 2000.0, None)]
    {
        let mut machine = Machine::default();
        (machine.swing.arm_trails, machine.swing.pulse_in) = (arm_trails, pulse_in);
        let swing = Swing::of(&machine, KG_CM.of(kg_cm)).expect("it swings");
        let mut settings = Settings::new();
        for (name, value) in swing.settings() {
            let setting = Setting::find(name.as_bytes()).expect("it is a setting");
            settings.change(setting, value as u16).expect("it is in its range");
            assert_eq!(settings.contradiction(), None, "{name} {value}");
        }
        assert_eq!(swing.top_speed_mm_s, slower_mm_s, "{swing:?}");
        assert_eq!(
            u32::from(settings.get(Setting::MarginMm)),
            u32::from(Setting::MarginMm.default()) + swing.arm_margin_mm
        );
        let faster_mm_s = settings.get(Setting::TopSpeedMmS) + SPEED_STEP_MM_S;
        settings.set(Setting::TopSpeedMmS, faster_mm_s).expect("it is in its range");
        assert!(slower_mm_s.is_none() || settings.contradiction().is_some(), "{faster_mm_s}");
    }
    let mut near = Settings::new();
    near.set(Setting::BeamToToolMm, 100).expect("it is in its range");
    near.set(Setting::MarginMm, 90).expect("it is in its range");
    let error = Swing::fitted(&Machine::default(), KG_CM.of(39.4), &near).expect_err("it is refused");
    assert!(error.contains("together need a beam_to_tool_mm of "), "{error}");
}

#[test]
fn a_swing_whose_settings_the_firmware_refuses_says_what_to_change() {
    let changed = |change: fn(&mut Machine)| {
        let mut machine = with_tool_of_100_mm();
        change(&mut machine);
        machine
    };
    for (machine, pulses, problem) in [
        (
            changed(|machine| machine.swing.servo_time_60 = SECOND.of(1.5)),
            [1500, 2000],
            "the swing needs lead_out_ms 888, and the firmware takes 0 to 500: take a faster or a stronger servo, or \
             a lighter arm",
        ),
        (
            changed(|machine| machine.swing.pulse_for_90 = 2500.0),
            [1900, 2000],
            "the swing needs servo_out_us 2635, and the firmware takes 500 to 2500: \
             take a longer arm, or fit the tool at another servo_in_us",
        ),
        (
            with_tool_of_100_mm(),
            [700, 600],
            "the swing needs servo_out_us 405, and the firmware takes 500 to 2500: \
             take a longer arm, or fit the tool at another servo_in_us",
        ),
        (
            changed(|machine| {
                machine.swing.arm_trails = 1;
                machine.swing.widest_canopy = MM.of(450.0);
                machine.intra_row.shank_length = MM.of(300.0);
            }),
            [1500, 2000],
            "the swing needs margin_mm 258, and the firmware takes 0 to 200: take a longer arm, or a pendulum",
        ),
    ] {
        let error = Swing::fitted(&machine, KG_CM.of(10.0), &board(pulses)).expect_err("it is refused");
        assert_eq!(error, problem);
    }
    // The file's pulse goes out of the range, but the board's tool swings to the other side.
    let machine = changed(|machine| machine.swing.pulse_in = 2300.0);
    assert!(Swing::of(&machine, KG_CM.of(10.0)).is_err());
    assert!(Swing::fitted(&machine, KG_CM.of(10.0), &board([2300, 1800])).is_ok());
}

#[test]
fn a_trailing_arm_s_wider_margin_is_one_of_its_settings() {
    let mut machine = Machine::default();
    machine.intra_row.shank_length = MM.of(200.0);
    machine.swing.widest_canopy = MM.of(300.0);
    machine.swing.arm_trails = 1;
    let swing = Swing::of(&machine, KG_CM.of(5.6)).expect("it swings");
    assert!(swing.set_lines().ends_with(&["set margin_mm 175".to_owned()]), "{:?}", swing.set_lines());
    // A board whose margin is as wide keeps it.
    let mut board = Settings::new();
    board.set(Setting::MarginMm, 180).expect("it is in its range");
    let swing = Swing::fitted(&machine, KG_CM.of(5.6), &board).expect("it swings");
    assert_eq!((swing.arm_margin_mm, swing.margin_mm), (125, None));
}

#[test]
fn a_machine_that_is_too_fast_and_sweeps_in_the_zone_are_named() {
    let words = |change: fn(&mut Machine)| {
        let (mut machine, torque) = (Machine::default(), KG_CM.of(39.4));
        change(&mut machine);
        Swing::of(&machine, torque).expect("it swings").sentences(&machine, torque).join(" ")
    };
    let slow_servo = words(|machine| machine.swing.servo_time_60 = SECOND.of(0.35));
    assert!(slow_servo.contains("2.5 km/h are 694 mm/s. Above 600 mm/s, alarm 3-1"), "{slow_servo}");
    assert!(words(|machine| machine.weeder.speed = KM_H.of(5.0)).contains("Above 1000 mm/s, alarm 3-1"));
    let inside = words(|machine| {
        (machine.swing.protected, machine.swing.sweep_from) = (MM.of(90.0), MM.of(20.0));
    });
    assert!(inside.contains("The sweeps run 25 mm inside the stem's protected circle:"), "{inside}");
    let beside = words(|machine| {
        (machine.swing.protected, machine.swing.sweep_from) = (MM.of(90.0), MM.of(65.0));
    });
    assert!(beside.contains("The sweeps start 20 mm beside the stem's protected circle."), "{beside}");
    assert!(words(|machine| machine.swing.sweep_from = MM.of(20.0)).contains("30 mm inside the protection zone"));
    let (usual, without) = (words(|_| ()), words(|machine| machine.inter_row.tools = 0));
    assert!(!usual.contains("alarm 3-1") && !usual.contains("The sweeps"), "{usual}");
    assert!(!without.contains("sweeps"), "{without}");
}

#[test]
fn plants_off_the_line_meet_the_arm_lower_the_more_room_is_asked_for_them() {
    let height_mm = |room_mm: f64| {
        let mut machine = with_tool_of_100_mm();
        (machine.swing.protected, machine.swing.room) = (MM.of(90.0), MM.of(room_mm));
        Swing::of(&machine, KG_CM.of(10.0)).expect("it swings").clear_height_mm
    };
    let heights_mm = [0.0, 10.0, 23.0, 60.0].map(height_mm);
    // The shank meets the zone on the arm's side at the same depth below the axis, or lower.
    assert!(heights_mm.is_sorted_by(|wide, wider| wide > wider), "{heights_mm:?}");
}

#[test]
fn the_stroke_clears_the_circle_also_for_stems_off_the_line() {
    for (room_mm, stem_off_mm, beside_mm) in [(10.0, 10.0, 55.0), (10.0, 25.0, 58.5), (23.0, 20.0, 68.0)] {
        let mut machine = with_tool_of_100_mm();
        machine.swing.protected = MM.of(90.0);
        (machine.swing.room, machine.swing.stem_off) = (MM.of(room_mm), MM.of(stem_off_mm));
        let swing = Swing::of(&machine, KG_CM.of(10.0)).expect("it swings");
        let edge_mm = 350.0 * swing.angle_degrees.to_radians().sin() - 50.0;
        // The pulse is rounded outwards, by up to 3 mm.
        assert!((0.0..3.0).contains(&(edge_mm - beside_mm)), "{edge_mm} and {beside_mm}");
        assert!(edge_mm >= f64::from(swing.stem_zone_mm) / 2.0, "{swing:?}");
    }
}

#[test]
fn stems_far_off_the_middle_need_a_wider_margin() {
    // Half of the distance lies beyond the zone, 10 mm of it are in the default margin.
    for (stem_off_mm, excess_mm) in [(10.0, 0), (20.0, 0), (40.0, 10), (50.0, 15)] {
        let mut machine = Machine::default();
        (machine.swing.protected, machine.swing.stem_off) = (MM.of(90.0), MM.of(stem_off_mm));
        let swing = Swing::of(&machine, KG_CM.of(10.0)).expect("it swings");
        assert_eq!((swing.stem_margin_mm, swing.margin_mm), (excess_mm, (excess_mm > 0).then_some(50 + excess_mm)));
        let said = swing.sentences(&machine, KG_CM.of(10.0)).join(" ");
        assert_eq!(said.contains(&format!("canopies need {excess_mm} mm more")), excess_mm > 0, "{said}");
    }
}

#[test]
fn a_blade_that_is_long_along_the_row_needs_a_wider_margin() {
    let of = |length_mm: f64, arm_trails: u32| {
        let mut machine = Machine::default();
        machine.intra_row.blade_base = MM.of(length_mm);
        machine.swing.arm_trails = arm_trails;
        let swing = Swing::of(&machine, KG_CM.of(10.0)).expect("it swings");
        let said = swing.sentences(&machine, KG_CM.of(10.0)).join(" ");
        (swing, said)
    };
    for (length_mm, excess_mm) in [(20.0, 0), (45.0, 0), (46.0, 0), (47.0, 1), (90.0, 22)] {
        let (swing, said) = of(length_mm, 0);
        assert_eq!(swing.blade_margin_mm, excess_mm, "{length_mm} mm");
        assert_eq!(swing.margin_mm, (excess_mm > 0).then_some(50 + excess_mm), "{length_mm} mm");
        let half = format!("Half of the blade's {length_mm:.0} mm along the row is a part of the measured margin");
        assert!(said.contains(&half), "{said}");
        assert_eq!(said.contains(&format!("{excess_mm} mm more than the default margin")), excess_mm > 0, "{said}");
        let (trailing, _) = of(length_mm, 1);
        assert_eq!(trailing.margin_mm, Some(50 + trailing.arm_margin_mm + excess_mm), "{length_mm} mm");
    }
    let mut machine = Machine::default();
    machine.intra_row.blade_base = MM.of(400.0);
    let error = Swing::of(&machine, KG_CM.of(10.0)).expect_err("it is refused");
    assert_eq!(
        error,
        "the swing needs margin_mm 227, and the firmware takes 0 to 200: take a blade that is shorter along the row"
    );
}
