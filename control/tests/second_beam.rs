//! A second beam: wheel slip, a torn wire, and detections of one beam only.

mod common;
#[path = "common/rolling.rs"]
mod rolling;

use common::{ByWidth, machine};
use control::{
    alarm::{Alarm, Warning},
    operate::{command_error::CommandError, event::Event, state::State},
    settings::{Setting, Settings, TICKS_PER_M_LEAST},
};
use proptest::prelude::*;
use rig::{Beams, Rig};
use rolling::{MARGIN_MM, Rolling, SECOND_BEAM_MM};

/// A machine at work along plants, from and to, seen by both beams.
fn along(plants_mm: &[(f64, f64)]) -> Rolling {
    with_beams(plants_mm.to_vec(), plants_mm.to_vec())
}

fn with_beams(first_mm: Vec<(f64, f64)>, second_mm: Vec<(f64, f64)>) -> Rolling {
    Rolling::along(first_mm, second_mm, &[(Setting::SecondBeamMm, SECOND_BEAM_MM as u16)])
}

impl Rolling {
    /// The wheel slips by this percentage from here on.
    fn slipping(mut self, percent: f64) -> Self {
        self.turns = 1.0 / (1.0 - percent / 100.0);
        self
    }

    /// The alarms, and the first beam's position at each.
    fn alarms(&self) -> Vec<(Alarm, f64)> {
        let alarm = |&(event, place_mm): &(Event, f64)| match event {
            Event::Alarm { alarm, .. } => Some((alarm, place_mm)),
            _ => None,
        };
        self.told.iter().filter_map(alarm).collect()
    }

    /// The reported slips, in thousandths.
    fn slips(&self) -> Vec<i16> {
        self.events_of(|event| match event {
            Event::Slip { permille } => Some(permille),
            _ => None,
        })
    }

    /// The least ground kept clear beside any of these plants.
    fn least_margin_mm(&self, plants_mm: &[(f64, f64)]) -> f64 {
        let off = |place: f64, (from, to): (f64, f64)| if place < from { from - place } else { (place - to).max(0.0) };
        let all = plants_mm.iter().flat_map(|&plant| self.weeded_mm.iter().map(move |&place| off(place, plant)));
        all.fold(f64::INFINITY, f64::min)
    }
}

fn plants(count: usize) -> Vec<(f64, f64)> {
    (1..=count).map(|plant| plant as f64 * 500.0).map(|middle| (middle - 75.0, middle + 75.0)).collect()
}

#[test]
fn a_slipping_wheel_costs_no_margin_after_the_second_plant() {
    for percent in [-30.0, -10.0, 5.0, 10.0, 30.0] {
        let plants = plants(12);
        let mut rolling = along(&plants).slipping(percent);
        rolling.roll_to(7000.0, 500.0);
        assert_eq!((&rolling.alarms()[..], rolling.machine.state()), (&[][..], State::Work), "{percent} %");
        let slip = rolling.machine.slip_permille().expect("plants have given it");
        assert!((f64::from(slip) - 10.0 * percent).abs() < 6.0, "{slip} for {percent} %");
        let before = plants[3..].iter().map(|&(from, _)| {
            let nearest =
                rolling.weeded_mm.iter().filter(|&&place| place < from).fold(f64::MIN, |most, &place| most.max(place));
            from - nearest
        });
        // Leads are times, and the wheel measures the distance rolled in them.
        let expected_mm = MARGIN_MM + 500.0 * 0.231;
        for led_mm in before {
            assert!((led_mm - expected_mm).abs() < 8.0, "{percent} %: out {led_mm} mm before the plant");
        }
    }
}

#[test]
fn without_a_second_beam_nothing_is_measured() {
    let mut rolling = along(&plants(6)).slipping(10.0);
    rolling.machine.hold();
    rolling.machine.set(Setting::SecondBeamMm, 0).unwrap();
    rolling.machine.start(true).unwrap();
    rolling.roll_to(4000.0, 500.0);
    assert_eq!((rolling.slips().len(), rolling.machine.slip_permille(), rolling.alarms().len()), (0, None, 0));
    assert!(!rolling.machine.has_second_beam());
}

#[test]
fn a_torn_wire_of_the_second_beam_is_an_alarm_within_three_plants() {
    let plants = plants(12);
    let mut rolling = with_beams(plants.clone(), plants[..5].to_vec());
    rolling.roll_to(6000.0, 500.0);
    let &[(Alarm::SecondBeamBlind, place_mm)] = &rolling.alarms()[..] else { panic!("{:?}", rolling.told) };
    // The third missed plant has passed the second beam, and the next has not reached the first.
    assert!(plants[7].1 + SECOND_BEAM_MM < place_mm && place_mm < plants[8].0 + SECOND_BEAM_MM, "{place_mm}");
}

#[test]
fn a_torn_first_beam_wire_is_an_alarm_within_three_plants() {
    let plants = plants(12);
    let mut rolling = with_beams(plants[..5].to_vec(), plants.clone());
    rolling.roll_to(6000.0, 500.0);
    let &[(Alarm::BeamBlind, place_mm)] = &rolling.alarms()[..] else { panic!("{:?}", rolling.told) };
    assert!(plants[7].1 + SECOND_BEAM_MM < place_mm && place_mm < plants[8].0 + SECOND_BEAM_MM, "{place_mm}");
    assert!(rolling.least_margin_mm(&plants[..8]) > 0.0, "the second beam's detections keep them");
    assert!(rolling.weeded_mm.iter().any(|&place| place > plants[6].1), "and the tool works in between");
}

#[test]
fn an_insect_in_one_beam_is_no_alarm_and_half_a_plant_moves_nothing() {
    let plants = plants(10);
    let insects = |off: f64| plants.iter().map(move |&(from, _)| (from - off, from - off + 5.0));
    let mut second: Vec<(f64, f64)> = plants.iter().copied().chain(insects(150.0)).collect();
    second[6].0 += 100.0;
    let first = plants.iter().copied().chain(insects(100.0)).collect();
    let mut rolling = with_beams(first, second).slipping(10.0);
    rolling.roll_to(5500.0, 500.0);
    assert_eq!(rolling.alarms(), []);
    let slips = rolling.slips();
    assert!(slips.len() > 3 && slips.iter().all(|slip| (94..=106).contains(slip)), "{slips:?}");
}

#[test]
fn an_alarm_resets_the_slip_and_two_plants_give_it_again() {
    let mut rolling = along(&plants(12)).slipping(10.0);
    rolling.roll_to(2500.0, 500.0);
    assert!(rolling.machine.slip_permille().is_some());
    rolling.lose_edges();
    assert_eq!(rolling.machine.slip_permille(), None);
    rolling.machine.clear();
    rolling.machine.start(false).unwrap();
    rolling.roll_to(4500.0, 500.0);
    assert!(rolling.machine.slip_permille().is_some_and(|slip| (94..=106).contains(&slip)));
    assert_eq!(rolling.alarms().iter().map(|&(alarm, _)| alarm).collect::<Vec<_>>(), [Alarm::BeamEdgesLost]);
}

#[test]
fn an_unknown_slip_after_an_alarm_costs_no_canopy() {
    for percent in [-12.0, 10.0, 15.0] {
        for alarm_mm in (2400..2900).step_by(50) {
            let plants = plants(12);
            let settings =
                [(Setting::SecondBeamMm, SECOND_BEAM_MM as u16), (Setting::MarginMm, 20), (Setting::LeadInMs, 0)];
            let mut rolling = Rolling::along(plants.clone(), plants.clone(), &settings).slipping(percent);
            rolling.roll_to(f64::from(alarm_mm), 500.0);
            rolling.lose_edges();
            rolling.machine.clear();
            rolling.machine.start(false).unwrap();
            rolling.roll_to(6500.0, 500.0);
            let least_mm = rolling.least_margin_mm(&plants[3..]);
            assert!(least_mm > 0.0, "{percent} %, alarm at {alarm_mm} mm: {least_mm} mm");
        }
    }
}

/// X 700, the second beam at 100, margin 50.
const FAR: [(Setting, u16); 4] =
    [(Setting::BeamToToolMm, 700), (Setting::SecondBeamMm, 100), (Setting::MarginMm, 50), (Setting::LeadInMs, 0)];

#[test]
fn a_plant_that_already_stands_in_the_second_beam_is_kept() {
    let plant = (-150.0, 127.0);
    for stands_at_power_on in [true, false] {
        let mut rig = machine();
        if stands_at_power_on {
            rig.see(Beams { broken: false, second_broken: true });
        }
        let mut rolling = Rolling::with(rig, Vec::new(), vec![plant], &FAR);
        rolling.machine.hold();
        if !stands_at_power_on {
            rolling.machine.lose_edges(Beams { broken: false, second_broken: true });
            rolling.machine.turn();
            rolling.machine.clear();
        }
        // At power-on the operator vouches for the ground behind the first beam.
        rolling.machine.start(false).unwrap();
        rolling.weeded_mm.clear();
        rolling.roll_to(1500.0, 300.0);
        assert!(!rolling.weeded_mm.is_empty());
        let least_mm = rolling.least_margin_mm(&[(0.0, plant.1)]);
        assert!(least_mm > 0.0, "{stands_at_power_on}: {least_mm} mm");
    }
}

#[test]
fn a_second_beam_turned_off_over_a_plant_does_not_keep_the_tool_out() {
    let mut rolling = with_beams(Vec::new(), vec![(100.0, 300.0)]);
    rolling.roll_to(400.0, 300.0);
    rolling.machine.hold();
    rolling.machine.set(Setting::SecondBeamMm, 0).unwrap();
    rolling.machine.start(true).unwrap();
    rolling.weeded_mm.clear();
    rolling.roll_to(2000.0, 300.0);
    assert!(rolling.weeded_mm.len() > 100);
}

#[test]
fn a_plant_that_only_the_second_beam_sees_is_not_reached_at_any_speed() {
    let lead_out_ms = 180;
    for speed_mm_s in [400.0, 700.0, 1000.0, 1100.0, 1200.0, 1290.0] {
        let plants = plants(14);
        let settings = [
            (Setting::SecondBeamMm, SECOND_BEAM_MM as u16),
            (Setting::LeadOutMs, lead_out_ms),
            (Setting::LeadInMs, 0),
            (Setting::MarginMm, 20),
        ];
        let mut first = plants.clone();
        first.remove(8);
        let mut rolling = Rolling::along(first, plants.clone(), &settings);
        rolling.roll_to(7500.0, speed_mm_s);
        let lead_mm = speed_mm_s * f64::from(lead_out_ms) / 1000.0;
        // The tool still works while it swings.
        let least_mm = rolling.least_margin_mm(&[(plants[8].0 - lead_mm, plants[8].1)]);
        assert!(least_mm > 0.0, "{speed_mm_s} mm/s: {least_mm} mm");
        assert!(speed_mm_s > 1000.0 || !rolling.weeded_mm.is_empty(), "slower, the tool works");
    }
}

#[test]
fn a_leaf_seen_only_by_the_second_beam_does_not_let_the_tool_in() {
    // As for a plant with leaves that the first beam does not part.
    let second = vec![(1150.0, 1170.0)];
    let slow = Rig::new(ByWidth::new(0, 14));
    let mut rolling = Rolling::with(slow, vec![(1000.0, 1300.0)], second, &[(Setting::SecondBeamMm, 100)]);
    rolling.roll_to(1500.0, 434.0);
    let harm_mm = rolling.weeded_mm.iter().find(|&&mm| (1000.0 - 145.0..1300.0).contains(&mm));
    assert_eq!(harm_mm, None, "the tool is out by the lead before the margin, and stays out");
}

#[test]
fn another_wheel_or_beam_position_set_in_hold_resets_the_slip() {
    for (setting, value) in [(Setting::TicksPerM, 2100), (Setting::SecondBeamMm, 180), (Setting::BeamToToolMm, 420)] {
        let mut rolling = along(&plants(12)).slipping(10.0);
        rolling.roll_to(2500.0, 500.0);
        rolling.machine.hold();
        rolling.machine.set(setting, value).unwrap();
        rolling.roll_to(2505.0, 100.0);
        assert_eq!(rolling.machine.slip_permille(), None, "{setting:?}");
    }
}

#[test]
fn rolling_back_over_plants_measures_no_plant_twice_and_is_no_alarm() {
    let mut rolling = along(&plants(8));
    rolling.roll_to(2600.0, 500.0);
    let told = rolling.slips().len();
    for _ in 0..3 {
        rolling.roll_to(900.0, 400.0);
        rolling.roll_to(2590.0, 400.0);
    }
    assert_eq!((rolling.slips().len(), &rolling.alarms()[..]), (told, &[][..]));
    rolling.roll_to(4500.0, 500.0);
    assert_eq!(rolling.alarms(), []);
    assert!(rolling.slips().len() > told);
}

/// A machine at work, by X, the second beam and the margin in mm, that classifies all as plants; a stand at even distances, with
/// the plants that each beam misses.
fn stand(
    [beam_to_tool_mm, second_beam_mm, margin_mm]: [u16; 3],
    [width_mm, spacing_mm]: [f64; 2],
    missed: [&[usize]; 2],
) -> (Rolling, Vec<(f64, f64)>) {
    let plants: Vec<_> =
        (1..=40).map(|plant| f64::from(plant) * spacing_mm).map(|from| (from, from + width_mm)).collect();
    let [first, second] = missed.map(|missed| {
        let seen = plants.iter().enumerate().filter(|(number, _)| !missed.contains(number));
        seen.map(|(_, &plant)| plant).collect::<Vec<_>>()
    });
    let settings = [
        (Setting::MarginMm, margin_mm),
        (Setting::BeamToToolMm, beam_to_tool_mm),
        (Setting::SecondBeamMm, second_beam_mm),
        (Setting::LeadOutMs, 60),
        (Setting::LeadInMs, 0),
    ];
    (Rolling::with(Rig::new(ByWidth::new(0, 0)), first, second, &settings), plants)
}

#[test]
fn plants_missed_by_one_beam_are_kept_in_a_stand_of_any_density() {
    for (machine, stand_mm, mm_s, missed) in [
        ([400, 300, 13], [12.0, 120.0], 139.0, [&[][..], &[12][..]]),
        ([1000, 700, 50], [40.0, 300.0], 278.0, [&[], &[12]]),
        ([1000, 900, 50], [40.0, 200.0], 278.0, [&[], &[]]),
        ([1000, 700, 50], [40.0, 150.0], 278.0, [&[], &[]]),
        ([400, 200, 13], [12.0, 80.0], 139.0, [&[12], &[]]),
        ([400, 300, 13], [80.0, 250.0], 139.0, [&[12], &[]]),
        // Each beam has its own pattern, repeated.
        ([400, 300, 13], [12.0, 120.0], 278.0, [&[5, 11, 17, 23], &[8, 14, 20, 26]]),
        ([400, 200, 20], [40.0, 400.0], 278.0, [&[5, 11, 17, 23], &[8, 14, 20, 26]]),
        ([1000, 900, 50], [40.0, 90.0], 278.0, [&[7, 22], &[13, 14, 30]]),
    ] {
        let (mut rolling, plants) = stand(machine, stand_mm, missed);
        rolling.roll_to(41.0 * stand_mm[1] + f64::from(machine[0]), mm_s);
        assert_eq!(rolling.alarms(), [], "{machine:?} {stand_mm:?}");
        assert!(rolling.least_margin_mm(&plants) > 0.0, "{machine:?} {stand_mm:?}: {:?}", rolling.slips());
        assert!(rolling.slips().iter().all(|slip| slip.abs() < 15), "{machine:?} {stand_mm:?}: {:?}", rolling.slips());
    }
}

#[test]
fn a_plant_missed_by_the_first_beam_is_not_mixed_up_with_the_next() {
    for behind_mm in [50.0, 70.0, 80.0, 95.0, 120.0, 160.0] {
        let plants: Vec<_> = (1..=12).map(|plant| f64::from(plant) * 400.0).map(|from| (from, from + 40.0)).collect();
        let weed = (plants[8].0 + behind_mm, plants[8].0 + behind_mm + 40.0);
        let mut both = plants.clone();
        both.insert(9, weed);
        let mut first = both.clone();
        first.remove(8);
        let settings = [(Setting::MarginMm, 20), (Setting::SecondBeamMm, 200), (Setting::LeadInMs, 0)];
        let mut rolling = Rolling::with(Rig::new(ByWidth::new(0, 0)), first, both.clone(), &settings);
        rolling.roll_to(6000.0, 500.0);
        assert_eq!(rolling.alarms(), []);
        assert!(rolling.least_margin_mm(&both) > 0.0, "{behind_mm} mm: {}", rolling.least_margin_mm(&both));
    }
}

#[test]
fn a_stalk_missed_by_the_first_beam_is_kept_behind_a_weed_that_both_see() {
    let stalk = (5050.0, 5075.0);
    let both = [
        (1..=5).map(|plant| (700.0 * f64::from(plant), 700.0 * f64::from(plant) + 100.0)).collect(),
        vec![(5000.0, 5015.0)],
    ]
    .concat();
    let second = [&both[..], &[stalk]].concat();
    let settings = [(Setting::BeamToToolMm, 1000), (Setting::SecondBeamMm, 600)];
    // The weed's hold is 115 mm.
    let mut rolling = Rolling::with(Rig::new(ByWidth::new(120, 0)), both, second, &settings);
    rolling.roll_to(7000.0, 500.0);
    assert!(rolling.machine.slip_permille().is_some() && rolling.alarms().is_empty(), "{:?}", rolling.told);
    assert!(rolling.least_margin_mm(&[stalk]) > 0.0, "{:?}", rolling.told);
}

#[test]
fn a_stand_too_dense_for_the_beams_makes_the_slip_unknown_with_a_warning() {
    let sparse = (1..=8).map(|plant| f64::from(plant) * 500.0);
    let dense = (1..=50).map(|plant| 4000.0 + f64::from(plant) * 90.0);
    let plants: Vec<_> = sparse.chain(dense).map(|from| (from, from + 62.0)).collect();
    let mut second = plants.clone();
    second.remove(14);
    let settings = [(Setting::SecondBeamMm, 300)];
    let mut rolling = Rolling::along(plants.clone(), second, &settings).slipping(8.0);
    rolling.roll_to(4300.0, 500.0);
    assert!(rolling.machine.slip_permille().is_some_and(|slip| (75..=85).contains(&slip)));
    rolling.roll_to(8800.0, 500.0);
    assert_eq!((rolling.machine.slip_permille(), &rolling.alarms()[..]), (None, &[][..]));
    let warnings = rolling.events_of(|event| matches!(event, Event::Warning(Warning::SlipUnknown)).then_some(()));
    assert_eq!(warnings.len(), 1);
    assert!(rolling.least_margin_mm(&plants[3..]) > 0.0, "the zones with the last slip and without it are both kept");
    assert!(rolling.slips().iter().all(|slip| (75..=85).contains(slip)), "{:?}", rolling.slips());
}

#[test]
fn weeds_reported_by_both_beams_count_once_toward_an_unknown_crop() {
    let enough = Settings::new().get(Setting::MisfitAfter);
    for count in [enough - 1, enough] {
        // Too dense for the beams, so the second beam reports each of them again.
        let weeds: Vec<_> =
            (0..count).map(|weed| 600.0 + 60.0 * f64::from(weed)).map(|from| (from, from + 20.0)).collect();
        let mut rolling = along(&weeds);
        rolling.roll_to(2000.0, 500.0);
        let told = rolling.events_of(|event| matches!(event, Event::Detection { .. }).then_some(()));
        assert!(told.len() > usize::from(count), "{} of {count}", told.len());
        let alarms: Vec<_> = rolling.alarms().iter().map(|&(alarm, _)| alarm).collect();
        assert_eq!(alarms, if count < enough { vec![] } else { vec![Alarm::CropUnknown] });
    }
}

#[test]
fn an_implausible_jump_of_slip_needs_a_third_plant() {
    for (percent, told_behind) in [(8.0, 2), (20.0, 3), (-25.0, 3)] {
        let plants = plants(12);
        let mut rolling = along(&plants).slipping(percent);
        let told = (0..plants.len()).find(|&plant| {
            rolling.roll_to(plants[plant].1 + SECOND_BEAM_MM + 60.0, 500.0);
            rolling.machine.slip_permille().is_some()
        });
        assert_eq!(told, Some(told_behind - 1), "{percent} %");
    }
}

#[test]
fn plants_of_nine_millimetres_are_compared_with_every_encoder() {
    for (ticks_per_m, is_told) in [(900, true), (1910, true), (8000, true)] {
        let plants: Vec<_> = (1..=10).map(|plant| f64::from(plant) * 400.0).map(|from| (from, from + 10.0)).collect();
        let settings = [(Setting::TicksPerM, ticks_per_m), (Setting::SecondBeamMm, 200)];
        let machine = Rig::new(ByWidth::new(0, 0));
        let mut rolling = Rolling::with(machine, plants.clone(), plants, &settings);
        rolling.turns = f64::from(ticks_per_m) / (1000.0 * rolling::TICKS_A_MM);
        rolling.roll_to(4000.0, 500.0);
        assert_eq!(rolling.machine.slip_permille().is_some(), is_told, "{ticks_per_m} ticks a metre");
    }
}

#[test]
fn beams_closer_than_64_ticks_are_refused() {
    let mut machine = machine();
    machine.set(Setting::TicksPerM, TICKS_PER_M_LEAST).unwrap();
    assert_eq!(machine.set(Setting::SecondBeamMm, 71), Err(CommandError::SecondBeamAstray));
    machine.set(Setting::SecondBeamMm, 72).unwrap();
    assert!(machine.set(Setting::TicksPerM, TICKS_PER_M_LEAST - 1).is_err());
    assert!(72 * u32::from(TICKS_PER_M_LEAST) / 1000 >= 64);
}

#[test]
fn an_impossible_position_of_the_second_beam_is_refused() {
    for (beam_to_tool_mm, second_mm, can_stand) in
        [(400, 71, false), (400, 72, true), (400, 328, true), (400, 329, false), (1000, 900, true), (1001, 500, false)]
    {
        let mut machine = machine();
        machine.set(Setting::BeamToToolMm, beam_to_tool_mm).unwrap();
        assert_eq!(
            machine.set(Setting::SecondBeamMm, second_mm).is_ok(),
            can_stand,
            "{second_mm} of {beam_to_tool_mm}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// With any slip, and any change of it within metres, the tool keeps off each canopy after the second plant.
    #[test]
    fn slip_that_changes_by_five_percent_reaches_no_canopy(
        mean in -12.0..15.0_f64,
        changes in prop::collection::vec((-2.5..2.5_f64, 700.0..2000.0_f64), 12),
        speed_mm_s in 140.0..700.0_f64,
        gaps_mm in prop::collection::vec((280.0..450.0_f64, 110.0..200.0_f64), 24),
    ) {
        let mut place_mm = 300.0;
        let plants: Vec<(f64, f64)> = gaps_mm.iter().map(|&(gap_mm, width_mm)| {
            let from_mm = place_mm + gap_mm;
            place_mm = from_mm + width_mm;
            (from_mm, place_mm)
        }).collect();
        let mut rolling = along(&plants);
        for (change, leg_mm) in changes {
            rolling = rolling.slipping(mean + change);
            rolling.roll_to(rolling.place_mm + leg_mm, speed_mm_s);
        }
        prop_assert_eq!(&rolling.alarms(), &[]);
        prop_assert!(rolling.least_margin_mm(&plants[3..]) > 0.0, "{}", rolling.least_margin_mm(&plants[3..]));
    }
}
