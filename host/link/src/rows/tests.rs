//! Rows whose firmware stops answering, or is unplugged.

use super::*;
use crate::Wire;
use rig::ScriptedBoard;
use std::assert_matches;

/// Reads events of the rows until `is_so` returns true.
fn until(rows: &Rows, mut is_so: impl FnMut(&Heard) -> bool) {
    for _ in 0..60_000 {
        if rows.next(Duration::from_millis(1)).is_some_and(|heard| is_so(&heard)) {
            return;
        }
    }
    panic!("it does not come to be so");
}

/// Whether this is the end of the answer to a command.
fn answers(heard: &Heard, row: usize, line: &str) -> bool {
    matches!(&heard.what, What::Happened(Happening::Answered { command, .. }) if heard.row == row && command == line)
}

fn types(heard: &Heard, line: &str) -> bool {
    matches!(&heard.what, What::Happened(Happening::Command(typed)) if typed == line)
}

/// Opens the rows, and waits until each was tried. Returns why rows are missing.
fn open(boards: &[ScriptedBoard]) -> (Rows, Vec<(usize, LinkError)>) {
    let opener = |board: &ScriptedBoard| -> Opener {
        let board = board.clone();
        Box::new(move || Ok(Wire::over(board.open().ok_or(LinkError::Absent("it".to_owned()))?, false)))
    };
    let (rows, first_tries) = Rows::open(boards.iter().map(opener).collect());
    (rows, first_tries.into_iter().filter_map(|(row, why)| Some((row, why?))).collect())
}

#[test]
fn missing_rows_are_reported_and_the_others_work() {
    let boards = [ScriptedBoard::plugged_in(), ScriptedBoard::default(), ScriptedBoard::plugged_in()];
    let (rows, missing) = open(&boards);
    assert_matches!(&missing[..], [(1, why)] if why.to_string().contains("there is no port it"));
    rows.command(1, "clear");
    until(&rows, |heard| matches!(&heard.what, What::NotTyped { .. } if heard.row == 1));
    rows.command(2, "hepl");
    until(
        &rows,
        |heard| matches!(&heard.what, What::Happened(Happening::Answered { refusal: Some(why), .. }) if heard.row == 2 && why.contains("no such")),
    );
    boards[1].plug(true);
    until(&rows, |heard| matches!(&heard.what, What::Happened(Happening::Connected { .. }) if heard.row == 1));
    let typed = boards.each_ref().map(ScriptedBoard::typed);
    assert_eq!(typed, [&["events on"][..], &["events on"], &["events on", "hepl"]]);
}

#[test]
fn a_row_that_is_not_open_yet_delays_no_other_row_s_hold() {
    let port = ScriptedBoard::plugged_in();
    let (gate, closed) = mpsc::channel::<()>();
    let absent: Opener = Box::new(move || {
        // An error too: the gate is open.
        let _ = closed.recv();
        Err(LinkError::Absent("it".to_owned()))
    });
    let there: Opener = Box::new(move || Ok(Wire::over(port.open().expect("it is plugged in"), false)));
    let (rows, first_tries) = Rows::open(vec![absent, there]);
    assert_matches!(first_tries.recv(), Ok((1, None)));
    rows.hold(0);
    rows.hold(1);
    until(&rows, |heard| answers(heard, 1, "hold"));
    drop(gate);
    assert_matches!(first_tries.recv(), Ok((0, Some(_))));
}

#[test]
fn a_silent_or_lost_row_delays_no_other_row_s_hold() {
    let boards = [(); 3].map(|()| ScriptedBoard::plugged_in());
    let (rows, _) = open(&boards);
    rows.command(0, "silence");
    until(&rows, |heard| types(heard, "silence"));
    boards[1].plug(false);
    until(&rows, |heard| matches!(&heard.what, What::Happened(Happening::Lost(_)) if heard.row == 1));
    for row in 0..3 {
        rows.command(row, "label plant");
        rows.hold(row);
    }
    let mut hold = Hold::new(Instant::now(), [true, false, true]);
    until(&rows, |heard| {
        hold.take(heard);
        answers(heard, 2, "hold")
    });
    let names = ["left", "middle", "right"].map(str::to_owned);
    assert!(!hold.is_over());
    let summary = hold.summary(&names);
    assert!(summary.starts_with("HOLD 1 of 3 in "), "{summary}");
    assert!(summary.ends_with(" ms; NOT THERE: middle; no answer yet: left"), "{summary}");
    assert!(boards[2].typed().contains(&"hold".to_owned()));
}

#[test]
fn a_row_lost_with_a_pending_hold_only_holds_when_it_returns() {
    let board = ScriptedBoard::plugged_in();
    let (rows, _) = open(std::slice::from_ref(&board));
    rows.command(0, "silence");
    until(&rows, |heard| types(heard, "silence"));
    // The answer to it is taken for the one to the command before.
    rows.hold(0);
    until(&rows, |heard| types(heard, "hold"));
    rows.command(0, "label plant");
    board.plug(false);
    until(&rows, |heard| matches!(&heard.what, What::Happened(Happening::Lost(_))));
    rows.hold(0);
    rows.command(0, "clear");
    until(&rows, |heard| matches!(&heard.what, What::NotTyped { command, .. } if command == "clear"));
    board.plug(true);
    until(&rows, |heard| answers(heard, 0, "hold"));
    until(&rows, |heard| matches!(&heard.what, What::Happened(Happening::Connected { .. })));
    assert_eq!(board.typed(), ["events on", "silence", "hold", "hold", "events on"]);
}

#[test]
fn a_hold_to_all_reports_the_slowest_and_the_missing_rows() {
    let names = ["1", "2", "3"].map(str::to_owned);
    let since = Instant::now();
    let answered = |row, ms, refusal| Heard {
        row,
        at: since + Duration::from_millis(ms),
        what: What::Happened(Happening::Answered { number: 1, command: "hold".to_owned(), refusal }),
    };
    let obeyed = |row, ms| answered(row, ms, None);
    let mut hold = Hold::new(since, [true; 3]);
    assert_eq!(hold.summary(&names), "HOLD 0 of 3; no answer yet: 1, 2, 3");
    hold.take(&obeyed(1, 12));
    hold.take(&obeyed(0, 31));
    assert_eq!((hold.is_over(), hold.is_obeyed()), (false, false));
    assert_eq!(hold.summary(&names), "HOLD 2 of 3 in 31 ms; no answer yet: 3; 1 last");
    let mut lost = hold.clone();
    lost.take(&Heard { row: 2, at: since, what: What::Happened(Happening::Lost("pulled".to_owned())) });
    assert_eq!((lost.is_over(), lost.is_obeyed()), (true, false));
    assert_eq!(lost.summary(&names), "HOLD 2 of 3 in 31 ms; NOT THERE: 3; 1 last");
    // It is back, and holds.
    lost.take(&obeyed(2, 4000));
    assert_eq!((lost.is_obeyed(), lost.summary(&names)), (true, "HOLD 3 of 3 in 4000 ms; 3 last".to_owned()));
    hold.take(&obeyed(2, 30));
    assert_eq!(hold.summary(&names), "HOLD 3 of 3 in 31 ms; 1 last");
    let mut refused = Hold::new(since, [true]);
    refused.take(&answered(0, 0, Some("error: no".to_owned())));
    assert_eq!((refused.is_over(), refused.summary(&names)), (true, "HOLD 0 of 1; REFUSED: 1".to_owned()));
}
