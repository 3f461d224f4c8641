//! Former failures, by name: the console lines and motion that showed each, and similar cases, checked by the model.

use control::{alarm::Alarm, operate::state::State};
use model_test::{
    Failure, cases,
    decisions::Decisions,
    drive,
    machine::Machine,
    run::{Run, Step},
};
use rayon::prelude::*;

type Drive = drive::Drive<Decisions>;

/// Two plants, then bare ground.
const PLANTS: [(u32, u32); 3] = [(300, 150), (350, 150), (9000, 0)];

/// An endless row of plants.
const ROW: [(u32, u32); 1] = [(450, 150)];

/// Faster than 600 mm/s, which raises an alarm, and then to a stop.
const TOO_FAST: &str = "roll 60 mm at 694 mm/s\nstand for 800 ms";

/// A machine that accelerates and brakes as a person pushes it, on a row.
fn run(row: &[(u32, u32)], lines: &str) -> Run {
    Run::written(row, lines)
}

/// Executes the steps, checked after each. Returns the machine.
#[track_caller]
fn go(run: &Run) -> Drive {
    let driven = Drive::new(run, Decisions::boot).and_then(|mut drive| {
        run.steps.iter().try_for_each(|step| drive.execute(step))?;
        Ok(drive)
    });
    driven.unwrap_or_else(|failure: Failure| panic!("{failure}\n{run:?}"))
}

#[test]
fn the_tool_leaves_for_the_canopy_behind_dust() {
    let row = [(1, 2), (1, 2), (1, 2), (1, 2), (442, 16), (134, 6)];
    go(&run(&row, "set min_width_mm 16\nset merge_gap_mm 101\nstart\nroll 3136 mm at 1017 mm/s"));
}

#[test]
fn a_shorter_lead_in_lets_the_tool_out_again_behind_a_plant() {
    for first_mm in (900..1400).step_by(7) {
        go(&run(&ROW, &format!("start\nroll {first_mm} mm at 762 mm/s\nset lead_in_ms 0\nroll 600 mm at 762 mm/s")));
    }
}

#[test]
fn the_rest_of_a_half_seen_plant_is_no_weed_after_an_alarm() {
    for seen_mm in (1..150).step_by(7).chain([132]) {
        for back_mm in [0, 20, 100, 200, 600] {
            let back = if back_mm > 0 { format!("roll back {back_mm} mm at 150 mm/s") } else { String::new() };
            let drive = go(&run(
                &PLANTS,
                &format!(
                    "set top_speed_mm_s 600
                     start
                     roll {} mm at 556 mm/s
                     {back}
                     roll back 100 mm at 694 mm/s
                     stand for 800 ms
                     clear
                     start
                     roll 1400 mm at 556 mm/s",
                    800 + seen_mm
                ),
            ));
            assert_eq!(
                (drive.machine().state(), drive.machine().tool_out()),
                (State::Work, false),
                "the machine continues to work"
            );
        }
    }
}

#[test]
fn after_an_alarm_in_a_gap_between_leaves_the_next_leaf_is_no_weed() {
    // Leaves of 40 mm with gaps of 15 mm: each leaf alone is as narrow as a weed.
    let ragged = [(800, 40), (15, 40), (15, 40), (9000, 0)];
    for seen_mm in 1..=180 {
        let lines = format!(
            "set top_speed_mm_s 600\nstart\nroll {} mm at 556 mm/s\n{TOO_FAST}\nclear\nstart\nroll 900 mm at 556 mm/s",
            740 + seen_mm
        );
        go(&run(&ragged, &lines));
    }
}

#[test]
fn the_margin_behind_a_canopy_is_kept_over_an_alarm() {
    for behind_mm in -60..60 {
        let lines = format!(
            "set top_speed_mm_s 600\nstart\nroll {} mm at 556 mm/s\n{TOO_FAST}\nclear\nstart\nroll 900 mm at 400 mm/s",
            950 + behind_mm
        );
        go(&run(&PLANTS, &lines));
    }
}

#[test]
fn a_line_in_the_last_turn_of_a_dry_run_leaves_real_plants_their_zones() {
    for line in ["servo in", "servo out", "calibrate servo", "test row 1300", "start", "start now", "hold", "status"] {
        for ms in 2672..2712 {
            let lines = format!("test row 1300\nstand for {ms} ms\n{line}\nhold\nstart\nroll 2500 mm at 700 mm/s");
            let drive = go(&run(&ROW, &lines));
            assert_eq!(drive.machine().state(), State::Work);
        }
    }
}

#[test]
fn a_save_is_complete_although_timed_swings_end_during_it() {
    for ms in (17_800..18_020).step_by(4) {
        for turns in [3, 100, 400] {
            let lines = format!("set end_switch on\nset k 5\nstand for 100 ms\ncalibrate servo\nstand for {ms} ms");
            let mut run = run(&ROW, &lines);
            run.steps.push(Step::CutPower { line: "save", turns, byte: 0 });
            go(&run);
        }
        // Answered with `ok`, and then the power fails at once.
        let lines = format!("set end_switch on\nset k 5\nstand for 100 ms\ncalibrate servo\nstand for {ms} ms\nsave");
        let mut run = run(&ROW, &lines);
        run.steps.push(Step::CutPower { line: "status", turns: 0, byte: 0 });
        go(&run);
    }
}

#[test]
fn leads_near_each_other_give_one_swing_each_way_a_zone_at_every_speed() {
    let leads_ms = [0, 40, 100, 150, 180, 230, 300, 500];
    let swings_at = |mm_s: u32| -> u32 {
        let leads = leads_ms.iter().flat_map(|out| leads_ms.map(|back| (out, back)));
        let swings = leads.map(|(lead_out_ms, lead_in_ms)| {
            // If X does not allow the lead at the top speed, it is refused, and the lead does not change.
            let lines = format!(
                "set beam_to_tool_mm 1200
                 set lead_out_ms {lead_out_ms}
                 set lead_in_ms {lead_in_ms}
                 start
                 roll {} mm at {mm_s} mm/s",
                mm_s * 2 + 2500
            );
            go(&run(&[(450, 150), (700, 150), (60, 90)], &lines)).steady_swings()
        });
        swings.sum()
    };
    let speeds = cases(66) as u32;
    let mm_s = |place: u32| 100 + 1300 * place / (speeds - 1);
    let swings: u32 = (0..speeds).into_par_iter().map(|place| swings_at(mm_s(place))).sum();
    assert!(swings > 150 * speeds, "{swings} swings were checked");
}

#[test]
fn a_tool_driven_directly_is_not_reported_as_stuck() {
    for moved in ["servo in", "servo 1750", "test row 500", "calibrate servo"] {
        for ms in [1, 50, 150, 400, 1000, 3000] {
            for back in ["servo out", "hold", "start", "start now", "servo in\nservo out"] {
                let lines = format!(
                    "set end_switch on\nstand for 2000 ms\n{moved}\nstand for {ms} ms\n{back}\nstand for 1500 ms"
                );
                let drive = go(&run(&ROW, &lines));
                assert!(!matches!(drive.machine().state(), State::Alarm(Alarm::ToolStuck)), "{lines}");
            }
            let lines = format!("set end_switch on\nstand for 2000 ms\n{moved}\nstand for {ms} ms");
            let mut run = run(&ROW, &lines);
            for on in [true, false] {
                run.steps.extend([Step::Switch { on }, Step::Stand { ms: 1500 }]);
            }
            assert_eq!(go(&run).machine().state(), State::Hold);
        }
    }
}

#[test]
fn a_dry_run_ends_at_every_accepted_speed() {
    for mm_s in (100..1200).step_by(50).chain(1200..=1300) {
        let ms = 3500 * 1000 / mm_s;
        let played = |ms| go(&run(&ROW, &format!("test row {mm_s}\nstand for {ms} ms")));
        assert!(!played(ms - 20).machine().tool_out(), "{mm_s} mm/s");
        let after = played(ms + 20);
        assert_eq!((after.machine().state(), after.machine().tool_out()), (State::Hold, true), "{mm_s} mm/s");
    }
}

#[test]
fn start_now_keeps_the_margin_of_a_forgotten_canopy() {
    for ahead_mm in (0..120).step_by(5) {
        for speed in [100, 291, 500] {
            let lines = format!(
                "start\nroll 1010 mm at 400 mm/s\n{TOO_FAST}\nclear\nstart\nroll {} mm at 400 mm/s
                 roll back 60 mm at {speed} mm/s\nstart now\nroll back 60 mm at {speed} mm/s\nroll 300 mm at 400 mm/s",
                460 + ahead_mm
            );
            go(&run(&PLANTS, &lines));
        }
    }
}

#[test]
fn edges_lost_behind_the_frontier_keep_the_tool_out_there() {
    // The row goes on behind the first canopy, also to where the machine rolls back.
    let row = [(136, 2), (1, 258)];
    let mut run = run(&row, "clear\nstart\nroll 96 mm at 288 mm/s\nroll back 279 mm at 467 mm/s");
    run.steps.push(Step::LoseEdges { turns: 2 });
    let on = Run::written(
        &row,
        "roll back 209 mm at 380 mm/s\nclear\nstart\nroll 95 mm at 236 mm/s\nroll 101 mm at 572 mm/s\nroll 263 mm at 960 mm/s
         hold\nset stem_zone_mm 40\nclear\nstart now\nroll 3 mm at 100 mm/s\nroll 3 mm at 100 mm/s",
    );
    run.steps.extend(on.steps);
    go(&run);
}

#[test]
fn forgotten_ground_stays_closed_over_any_distance_rolled_back() {
    for back_mm in (500..12_000).step_by(500) {
        for beam_to_tool_mm in [100, 400, 2000] {
            let lines = format!(
                "set top_speed_mm_s 300\nset lead_out_ms 100\nset beam_to_tool_mm {beam_to_tool_mm}
                 roll 12000 mm at 2000 mm/s\nstart\nroll 100 mm at 2000 mm/s\nhold
                 roll back {back_mm} mm at 2000 mm/s\nstand for 1000 ms\nclear\nstart\nroll 1000 mm at 200 mm/s"
            );
            go(&run(&ROW, &lines));
        }
    }
}

#[test]
fn a_stalk_close_behind_unseen_ground_keeps_its_stem_zone() {
    for (gap_mm, width_mm) in [(1, 4), (10, 4), (60, 4), (60, 30), (80, 12)] {
        let row = [(300 + gap_mm, width_mm), (900, 0)];
        let lines = "set top_speed_mm_s 700
            set merge_gap_mm 82
            set stem_zone_mm 90
            roll 300 mm at 556 mm/s
            start
            roll 1200 mm at 300 mm/s";
        go(&run(&row, lines));
    }
}
