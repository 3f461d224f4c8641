//! Whether the words about a machine fit the machine.

use mechanics::design::Design;
use mechanics::figure::Figure;
use mechanics::machine::Machine;
use mechanics::unit::{COUNT, DEGREE, FACTOR, HP, KG_CM, KM_H, KPA, MM, NEWTON};

fn figure_with(key: &str, change: impl FnOnce(&mut Machine)) -> Figure {
    let mut machine = Machine::default();
    change(&mut machine);
    let figures = Design::of(&machine).unwrap().figures(&machine);
    figures.into_iter().find(|figure| figure.key == key).unwrap()
}

#[track_caller]
fn assert_sense(figure: &Figure, concern: bool, words: &str) {
    assert!(figure.concern == concern && figure.sense.contains(words), "{figure:?}");
}

#[test]
fn an_engine_is_too_small_large_enough_or_too_large() {
    let engine = |hp: f64| figure_with("engine_power", |machine| machine.engine.power = HP.of(hp));
    assert_sense(&engine(1.0), true, "too small");
    assert_sense(&engine(1.5), false, "large enough");
    assert_sense(&engine(2.5), true, "2.25 times that: too large");
}

#[test]
fn a_servo_is_too_weak_or_strong_enough() {
    let servo = |kg_cm: f64| figure_with("servo_torque", |machine| machine.intra_row.servo_torque = KG_CM.of(kg_cm));
    assert_sense(&servo(35.0), true, "too weak");
    assert_sense(&servo(60.0), false, "1.52 times that: strong enough");
}

#[test]
fn a_blade_as_high_as_the_weeding_depth_gives_a_remark() {
    let force = |mm: f64| figure_with("soil_force", |machine| machine.soil.depth = MM.of(mm));
    assert_sense(&force(25.0), true, "98.47 kg cm: too much for the servo");
    assert_sense(&force(15.0), false, "the servo bears that too");
}

#[test]
fn a_wheel_is_safe_or_fails() {
    let wheel = |kpa: f64| figure_with("shear_stress", |machine| machine.wheel.shear_strength = KPA.of(kpa));
    assert_sense(&wheel(80_000.0), false, "549.5 times that: the wheel is safe");
    let weak = figure_with("shear_stress", |machine| {
        machine.wheel.shear_strength = KPA.of(1000.0);
        machine.wheel.diameter = MM.of(50.0);
    });
    assert_sense(&weak, true, "the wheel fails");
}

#[test]
fn a_shank_bends_or_bears_its_load() {
    let shank =
        |mm: f64| figure_with("inter_row_shank_diameter", |machine| machine.inter_row.shank_diameter = MM.of(mm));
    assert_sense(&shank(16.0), true, "427 MPa, 7.626 times the allowed stress: it bends");
    assert_sense(&shank(32.0), false, "95 % of the allowed stress");
}

#[test]
fn sweeps_are_too_wide_or_too_blunt_or_right() {
    let width = |mm: f64| figure_with("sweep_width", |machine| machine.inter_row.width = MM.of(mm));
    // Two run between the machine's row and the next one.
    assert_sense(&width(80.0), false, "2 sweeps side by side, 160 mm wide: off the crop, and 11.13 mm are left");
    assert_sense(&width(86.0), true, "172 mm wide, would break soil in a protection zone");
    let one_a_side = figure_with("sweep_width", |machine| {
        (machine.inter_row.tools, machine.inter_row.width) = (2, MM.of(170.0));
    });
    assert_sense(&one_a_side, false, "one sweep, 170 mm wide: off the crop");
    let apex = |degrees: f64| figure_with("apex_angle", |machine| machine.inter_row.apex_angle = DEGREE.of(degrees));
    assert_sense(&apex(120.0), true, "right for a friction of 30 degrees");
    assert_sense(&apex(80.0), false, "weeds slide along");
}

#[test]
fn tools_fit_into_the_working_width_or_do_not() {
    let tools = |number: f64| figure_with("tools", |machine| machine.inter_row.tools = COUNT.of(number));
    assert_sense(&tools(4.0), false, "the machine has 5: they fit");
    assert_sense(&tools(5.0), true, "the machine has 6: they do not fit");
    let wide = |mm: f64| figure_with("tools", |machine| machine.intra_row.width = MM.of(mm));
    assert_sense(&wide(80.0), false, "the machine has 5: they fit");
    assert_sense(&wide(130.0), true, "they do not fit into its working width, and need 450 mm");
    for key in ["sweep_width", "apex_angle", "inter_row_bending_moment", "inter_row_shank_diameter"] {
        let without_sweeps = figure_with(key, |machine| machine.inter_row.tools = 0);
        assert_sense(&without_sweeps, false, "no tools between the rows");
    }
}

#[test]
fn wheels_sink_in_on_soft_soil() {
    let ground = |kpa: f64| figure_with("wheel_numeric", |machine| machine.soil.cone_index = KPA.of(kpa));
    assert_sense(&ground(300.0), true, "soft soil");
    assert_sense(&ground(500.0), false, "tilled soil");
    assert_sense(&ground(900.0), false, "firm soil");
}

#[test]
fn a_tractive_force_beyond_a_tyres_grip_gives_a_remark() {
    let pull = |mm: f64| figure_with("tractive_force", |machine| machine.soil.depth = MM.of(mm));
    assert_sense(&pull(25.0), true, "84 % of the weight");
    assert_sense(&pull(15.0), false, "wheels can pull that");
}

#[test]
fn a_sprocket_has_too_few_or_too_many_teeth_or_misses_the_speed() {
    let teeth = |ratio: f64| figure_with("driven_teeth", |machine| machine.engine.gear_box_ratio = FACTOR.of(ratio));
    assert_sense(&teeth(40.0), false, "38 teeth give 2.5 km/h");
    assert_sense(&teeth(300.0), true, "5 teeth are too few for a chain: take a smaller gear box ratio");
    assert_sense(&teeth(10.0), true, "152 teeth are too many for a chain: take a larger gear box ratio");
    assert_sense(&teeth(160.0), false, "10 teeth give 2.375 km/h");
    let drive = figure_with("driven_teeth", |machine| machine.chain.drive_teeth = 8);
    assert_sense(&drive, true, "the drive sprocket's 8 teeth are too few");
    // 61 teeth: radii of 2.2 and 9.7 pitches, and half a pitch for the teeth of each.
    let shafts = |pitches: f64| {
        figure_with("chain_links", |machine| {
            machine.engine.gear_box_ratio = FACTOR.of(25.0);
            machine.chain.centre_distance_pitches = FACTOR.of(pitches);
        })
    };
    assert_sense(&shafts(13.0), true, "the sprockets need shafts 164.3 mm apart: take more pitches");
    assert_sense(&shafts(13.2), false, "rounded up to an even number");
    let off = figure_with("driven_teeth", |machine| {
        machine.engine.gear_box_ratio = FACTOR.of(160.0);
        machine.weeder.speed = KM_H.of(2.51);
    });
    assert_sense(&off, true, "take more drive teeth");
}

#[test]
fn the_parts_of_the_tractive_force_add_up() {
    let design = Design::of(&Machine::default()).unwrap();
    let sum = design.rolling_resistance + design.draft + design.acceleration_force;
    approx::assert_relative_eq!(NEWTON.value(sum), NEWTON.value(design.tractive_force));
}
