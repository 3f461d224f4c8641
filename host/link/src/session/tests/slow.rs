//! Sessions on a slow computer: their turns are far apart.

use super::*;

#[test]
fn in_turns_of_any_length_all_that_waits_is_typed_beside_the_status() {
    for turn_ms in [1, 20, 99, 100, 150, 400, 1000, 2500] {
        let mut talk = Talk::connected();
        let turn = |talk: &mut Talk| {
            let happened = talk.connection.turn(|| talk.now);
            talk.now = talk.now.after(Duration::from_millis(turn_ms));
            happened
        };
        assert!(talk.command("set wheel_mm 405") && talk.command("forget 1") && talk.command("get k"));
        let happened: Vec<_> = (0..40 + 1000 / turn_ms).flat_map(|_| turn(&mut talk)).collect();
        let count = |is: fn(&Happening) -> bool| happened.iter().filter(|happening| is(happening)).count();
        let ends = count(|happening| matches!(happening, Happening::Answered { refusal: None, .. }));
        let settings = count(|happening| matches!(happening, Happening::Settings(..)));
        let statuses = count(|happening| matches!(happening, Happening::Status(..)));
        assert!(ends == 3 && settings == 1 && statuses >= 5, "turns of {turn_ms} ms: {happened:?}");
    }
}

#[test]
fn nothing_is_typed_behind_its_deadline_though_the_computer_has_slept_in_a_read() {
    let mut talk = Talk::connected();
    let (before, after) = (talk.now, talk.now.after(Duration::from_secs(4)));
    assert!(talk.session().command("start", before.after(Duration::from_secs(3))).is_some());
    // The first look at the clock is before the read, and the others are behind it.
    let has_read = Cell::new(false);
    let happened = talk.connection.turn(|| if has_read.replace(true) { after } else { before });
    let is_late = |happening: &Happening| matches!(happening, Happening::Unanswered { command, why: Unanswered::Late, .. } if command == "start");
    assert!(happened.iter().any(is_late) && !happened.contains(&typed("start")), "{happened:?}");
}
