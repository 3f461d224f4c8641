use super::*;
use link::connection::Opener;
use link::row_names::{Board, Row};
use link::{LinkError, Wire};
use rig::ScriptedBoard;
use std::io::{ErrorKind, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;

/// A board whose status has a word that this program does not know, while the flag is set.
struct Newer<P>(P, Arc<AtomicBool>);

impl<P: Read> Read for Newer<P> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.0.read(buffer)?;
        if self.1.load(Ordering::Relaxed) {
            let text = String::from_utf8_lossy(&buffer[..count]).replace("state=hold", "state=park");
            buffer[..count].copy_from_slice(text.as_bytes());
        }
        Ok(count)
    }
}

impl<P: Write> Write for Newer<P> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// The only row, whose port is at this board.
fn only_row(open: Opener) -> (Rows, Chosen) {
    let (rows, first_tries) = Rows::open(vec![open]);
    assert!(first_tries.recv().unwrap().1.is_none());
    let row = Row { name: "Uno".to_owned(), board: Board::Only { beside: None } };
    (rows, Chosen { rows: vec![row], are_several: false })
}

#[test]
fn a_session_ends_without_a_status_that_it_knows() {
    let (ended, end) = mpsc::channel();
    thread::spawn(move || {
        let port = ScriptedBoard::plugged_in();
        let is_parked = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&is_parked);
        let (rows, chosen) = only_row(Box::new(move || {
            let port = port.open().ok_or(LinkError::Absent("it".to_owned()))?;
            Ok(Wire::over(Newer(port, Arc::clone(&flag)), false))
        }));
        is_parked.store(true, Ordering::Relaxed);
        let (sender, commands) = mpsc::sync_channel(1);
        sender.send(Line { number: 1, text: "status".to_owned() }).unwrap();
        drop(sender);
        let mut output = Vec::new();
        let work = |lines| Talk::new(&rows, 0, &chosen, None, lines).run(&commands);
        let finding = printing_aside(&mut output, work).unwrap();
        ended.send((finding, String::from_utf8(output).unwrap())).unwrap();
    });
    let (finding, output) = end.recv_timeout(Duration::from_secs(30)).expect("it ends");
    assert_eq!(finding, Finding::Good);
    assert!(output.contains("state=park"), "{output}");
}

struct Failing(ErrorKind);

impl Write for Failing {
    fn write(&mut self, _: &[u8]) -> io::Result<usize> {
        Err(self.0.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn opener(board: &ScriptedBoard) -> Opener {
    let port = board.clone();
    Box::new(move || Ok(Wire::over(port.open().ok_or(LinkError::Absent("it".to_owned()))?, false)))
}

fn talk(board: &ScriptedBoard, input: &[&str], output: &mut (impl Write + Send)) -> Result<Finding> {
    let (rows, chosen) = only_row(opener(board));
    let (sender, commands) = mpsc::sync_channel(9);
    for (number, text) in (1..).zip(input) {
        sender.send(Line { number, text: (*text).to_owned() }).unwrap();
    }
    drop(sender);
    printing_aside(output, |lines| Talk::new(&rows, 0, &chosen, None, lines).run(&commands))
}

#[track_caller]
fn until_held(board: &ScriptedBoard) {
    let has_held = (0..30_000).any(|_| {
        thread::sleep(Duration::from_millis(1));
        board.typed().contains(&"hold".to_owned())
    });
    assert!(has_held, "{:?}", board.typed());
}

/// An output that takes nothing until the sender is dropped.
struct Stopped(mpsc::Receiver<()>, Vec<u8>);

impl Write for Stopped {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // An error: the sender is dropped.
        let _ = self.0.recv();
        self.1.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_hold_is_typed_while_the_output_is_stopped_and_no_line_is_lost() {
    let board = ScriptedBoard::plugged_in();
    let (stopped, until) = mpsc::channel();
    let port = board.clone();
    let talk = thread::spawn(move || {
        let mut output = Stopped(until, Vec::new());
        let ended = talk(&port, &["get k", "hold"], &mut output);
        (ended, String::from_utf8(output.1).unwrap())
    });
    until_held(&board);
    drop(stopped);
    let (ended, output) = talk.join().unwrap();
    assert_eq!(ended.unwrap(), Finding::Good);
    assert!(output.contains("k=3 ") && output.matches("ok\n").count() == 2, "{output}");
}

#[test]
fn a_hold_is_typed_though_nothing_can_be_printed() {
    // A reader that has closed the pipe has read enough.
    for (kind, finding) in [(ErrorKind::BrokenPipe, Some(Finding::Good)), (ErrorKind::StorageFull, None)] {
        let board = ScriptedBoard::plugged_in();
        let ended = talk(&board, &["get k", "hold"], &mut Failing(kind));
        assert_eq!(ended.ok(), finding, "{kind}");
        assert_eq!(board.typed()[..3], ["events on", "get k", "hold"]);
    }
}

#[test]
fn a_command_that_a_shell_splits_from_its_row_is_not_sent() {
    let board = ScriptedBoard::plugged_in();
    let ended = talk(&board, &["Uno:", "", "test", "start", "Uno: clear", "Uno:", "hold"], &mut Vec::new());
    assert_eq!(ended.unwrap_err().to_string(), "not sent: lines 1, 3, 4, 6");
    assert_eq!(board.typed()[..3], ["events on", "clear", "hold"]);
}

#[test]
fn one_answer_ends_every_hold_before_it() {
    let (rows, chosen) = only_row(opener(&ScriptedBoard::plugged_in()));
    let mut talk = Talk::new(&rows, 0, &chosen, None, mpsc::channel().0);
    for (number, text) in [(1, "hold"), (2, "Hold!")] {
        talk.command(&Line { number, text: text.to_owned() });
    }
    assert!(!talk.is_idle());
    let what = What::Happened(Happening::Answered { number: 1, command: "hold".to_owned(), refusal: None });
    talk.take(&Heard { row: 0, at: Instant::now(), what }, false).unwrap();
    assert!(talk.is_idle());
}

#[test]
fn a_hold_reaches_the_rows_that_are_there_while_another_is_not_open_yet() {
    let (gate, closed) = mpsc::channel::<()>();
    let absent: Opener = Box::new(move || {
        // An error too: the gate is open.
        let _ = closed.recv();
        Err(LinkError::Absent("it".to_owned()))
    });
    let board = ScriptedBoard::plugged_in();
    let (rows, first_tries) = Rows::open(vec![opener(&board), absent]);
    assert_eq!(first_tries.recv().unwrap().0, 0);
    let row = |name: &str| Row { name: name.to_owned(), board: Board::Only { beside: None } };
    let chosen = Chosen { rows: vec![row("left"), row("s\u{fc}d")], are_several: true };
    let (sender, commands) = mpsc::sync_channel(2);
    for (number, text) in [(1, "hold"), (2, "left: clear")] {
        sender.send(Line { number, text: text.to_owned() }).unwrap();
    }
    drop(sender);
    let talk = thread::spawn(move || {
        let mut output = Vec::new();
        let ended = printing_aside(&mut output, |lines| Talk::new(&rows, 0, &chosen, None, lines).run(&commands));
        (ended.unwrap_err().to_string(), String::from_utf8(output).unwrap())
    });
    until_held(&board);
    assert!(!board.typed().contains(&"clear".to_owned()), "{:?}", board.typed());
    drop(gate);
    let (error, output) = talk.join().unwrap();
    assert_eq!(error, "not all was answered by s\u{fc}d");
    assert!(output.contains("HOLD 1 of 2 in ") && output.contains("NOT THERE: s\u{fc}d"), "{output}");
    assert!(board.typed().contains(&"clear".to_owned()), "{:?}", board.typed());
}

#[test]
fn a_hold_goes_before_an_answer_that_does_not_come() {
    let board = ScriptedBoard::plugged_in();
    assert!(talk(&board, &["clear", "silence", "clear", "Hold!"], &mut Vec::new()).is_err());
    assert_eq!(board.typed()[..4], ["events on", "clear", "silence", "hold"]);
    assert!(!board.typed()[4..].contains(&"clear".to_owned()));
}
