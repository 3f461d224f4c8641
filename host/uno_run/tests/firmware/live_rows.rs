//! Virtual Unos on one wheel, as the laptop at their ports sees them: a fault of one row disturbs no other row, and all
//! rows hold.

use field::machine::Machine;
use field::planting::Planting;
use field::row::{Canopy, Row};
use link::connection::Opener;
use link::rows::{Heard, Hold, Rows, What};
use link::session::Happening;
use link::{EventLine, Mode, Wire};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use uno::Uno;
use uno_run::console::ask;
use uno_run::firmware;
use uno_run::live::rows::{Background, LiveRows, Mishap};
use uno_run::live::{Course, Setup};

/// Walking pace.
const SPEED_MM_S: f64 = 700.0;

fn row(plants: usize, seed: u64) -> Row {
    let planting = Planting {
        plants,
        spacing_mm: 500.0,
        spacing_scatter_mm: 40.0,
        canopy_mm: 150.0,
        canopy_scatter_mm: 20.0,
        weeds: plants / 8,
        ragged: false,
    };
    planting.grow_with_room(seed).expect("it is a row")
}

fn setups(rows: Vec<Row>, fast: bool) -> Vec<Setup> {
    let elf = firmware::build().expect("the firmware builds");
    let courses = Course::of_rows(rows, Machine::default(), SPEED_MM_S, 0.0).into_iter();
    courses.map(|course| Setup { elf: Some(elf.clone()), course: Some(course), fast, ..Setup::default() }).collect()
}

/// The laptop's view of the rows.
struct Laptop {
    rows: Rows,
    modes: Vec<Option<Mode>>,
    /// How often each row was lost, connected, and in alarm.
    lost: Vec<usize>,
    alarms: Vec<usize>,
}

impl Laptop {
    #[track_caller]
    fn open(machine: &Background) -> Self {
        let opener = |path: &PathBuf| -> Opener {
            let path = path.to_str().expect("it is text").to_owned();
            Box::new(move || Wire::open(Some(&path)))
        };
        let (rows, first_tries) = Rows::open(machine.paths().iter().map(opener).collect());
        for (row, missing) in first_tries {
            assert!(missing.is_none(), "{row}: {missing:?}");
        }
        let count = rows.count();
        Self { rows, modes: vec![None; count], lost: vec![0; count], alarms: vec![0; count] }
    }

    fn all(&self) -> std::ops::Range<usize> {
        0..self.rows.count()
    }

    /// Listens until this is so.
    #[track_caller]
    fn until(&mut self, what: &str, mut is_so: impl FnMut(&Self, &Heard) -> bool) {
        for _ in 0..600_000 {
            let Some(heard) = self.rows.next(Duration::from_millis(1)) else { continue };
            match &heard.what {
                What::Happened(Happening::Status(status, _)) => self.modes[heard.row] = Some(status.mode),
                What::Happened(Happening::Lost(_)) => self.lost[heard.row] += 1,
                What::Happened(Happening::Event(EventLine::Alarm { .. }, _)) => self.alarms[heard.row] += 1,
                _ => {}
            }
            if is_so(self, &heard) {
                return;
            }
        }
        panic!("{what} does not come: {:?}, lost {:?}, alarms {:?}", self.modes, self.lost, self.alarms);
    }

    /// Listens until this is so, or an undisturbed row is lost.
    #[track_caller]
    fn until_or_stalled(&mut self, what: &str, mut is_so: impl FnMut(&Self, &Heard) -> bool) -> Result<(), Stalled> {
        let is_lost = |laptop: &Self| UNDISTURBED.iter().any(|&row| laptop.lost[row] > 0);
        self.until(what, |laptop, heard| is_lost(laptop) || is_so(laptop, heard));
        if is_lost(self) { Err(Stalled) } else { Ok(()) }
    }

    /// Types a command to all rows. Each row executes it.
    #[track_caller]
    fn command(&mut self, command: &str) {
        for row in self.all() {
            self.rows.command(row, command);
        }
        let mut left = self.rows.count();
        self.until(command, |_, heard| {
            if let What::Happened(Happening::Answered { refusal, .. }) = &heard.what {
                assert_eq!(refusal, &None, "row {} refuses {command}", heard.row);
                left -= 1;
            }
            left == 0
        });
    }

    /// Puts all rows to work: settings saved, the alarm of a new board cleared.
    #[track_caller]
    fn set_to_work(&mut self) {
        for command in ["save", "clear", "start"] {
            self.command(command);
        }
        self.until("work", |laptop, _| laptop.modes.iter().all(|mode| *mode == Some(Mode::Work)));
    }

    /// Holds all rows, and waits until no row is left to answer.
    #[track_caller]
    fn hold(&mut self, are_there: &[bool]) -> Hold {
        let mut hold = Hold::new(Instant::now(), are_there.iter().copied());
        for row in self.all() {
            self.rows.hold(row);
        }
        self.until("hold", |_, heard| {
            hold.take(heard);
            hold.is_over()
        });
        hold
    }
}

/// The rows that nothing happens to.
const UNDISTURBED: [usize; 3] = [0, 3, 5];

/// The computer stood still for seconds, so that sessions of undisturbed rows were lost. A run then shows nothing.
#[derive(Debug)]
struct Stalled;

#[test]
fn a_lost_reset_or_alarmed_row_disturbs_no_other_row() {
    assert!((0..3).any(|_| six_rows_in_real_time().is_ok()), "the computer stalls each time, or a row disturbs others");
}

fn six_rows_in_real_time() -> Result<(), Stalled> {
    let folder = tempfile::tempdir().expect("there is room for links");
    let mut rows: Vec<Row> = (1..=6).map(|seed| row(40, seed)).collect();
    // The beam of the third is broken over more ground than a plant has.
    rows[2] = Row::new(vec![Canopy::plant(0.0, 150.0), Canopy::plant(1000.0, 900.0)]).expect("it is a row");
    let link = |number| Some(folder.path().join(format!("row{number}")));
    let setups = setups(rows, false).into_iter().enumerate();
    let setups = setups.map(|(number, setup)| Setup { link: link(number), ..setup }).collect();
    let machine = LiveRows::start(setups).expect("they start").run_in_background();
    let mut laptop = Laptop::open(&machine);
    laptop.set_to_work();

    machine.happen(1, Mishap::Reset);
    laptop.until_or_stalled("a reset that is told", |laptop, _| laptop.lost[1] == 1)?;
    laptop.until_or_stalled("hold after it", |laptop, _| laptop.modes[1] == Some(Mode::Hold))?;
    machine.happen(4, Mishap::Unplugged);
    laptop.until_or_stalled("a loss that is told", |laptop, _| laptop.lost[4] == 1)?;
    laptop.until_or_stalled("an alarm", |laptop, _| laptop.modes[2] == Some(Mode::Alarm))?;
    // The others have not noticed it: each reports its plants.
    let mut seen = [0; 6];
    laptop.until_or_stalled("plants of the others", |laptop, heard| {
        if let What::Happened(Happening::Event(EventLine::Detection { .. }, _)) = heard.what {
            seen[heard.row] += 1;
        }
        assert_eq!(UNDISTURBED.map(|row| laptop.modes[row]), [Some(Mode::Work); 3]);
        UNDISTURBED.iter().all(|&row| seen[row] >= 3)
    })?;
    // The row that was reset may be reported twice, because its pending answer was cut.
    assert_eq!([0, 2, 3, 4, 5].map(|row| laptop.lost[row]), [0, 0, 0, 1, 0]);
    assert_eq!(laptop.alarms, [0, 0, 1, 0, 0, 0]);

    let mut hold = laptop.hold(&[true, true, true, true, false, true]);
    let names: Vec<String> = (1..=6).map(|number| number.to_string()).collect();
    let summary = hold.summary(&names);
    assert!(summary.starts_with("HOLD 5 of 6 in ") && summary.contains("; NOT THERE: 5; "), "{summary}");
    println!("{summary}");
    // The lost row has worked on. It holds as soon as its cable is plugged in again.
    machine.happen(4, Mishap::PluggedIn);
    laptop.until("the last one's hold", |_, heard| {
        hold.take(heard);
        hold.is_obeyed()
    });
    machine.stop().map_err(|(row, error)| format!("row {row}: {error}")).expect("none has stopped");
    Ok(())
}

#[test]
fn twelve_rows_hold_at_once_however_slow_the_computer_is() {
    let machine = LiveRows::start(setups((1..=12).map(|seed| row(40, seed)).collect(), true)).expect("they start");
    let machine = machine.run_in_background();
    let mut laptop = Laptop::open(&machine);
    laptop.set_to_work();
    let hold = laptop.hold(&[true; 12]);
    assert!(hold.is_obeyed());
    let names: Vec<String> = (1..=12).map(|number| number.to_string()).collect();
    println!("{}", hold.summary(&names));
    laptop.until("hold everywhere", |laptop, _| laptop.modes.iter().all(|mode| *mode == Some(Mode::Hold)));
    assert_eq!(laptop.lost, [0; 12]);
}

#[test]
fn all_rows_count_the_shared_wheel_and_see_their_own_plants() {
    let mut machine = LiveRows::start(setups((1..=3).map(|seed| row(12, seed)).collect(), true)).expect("they start");
    let ran = machine.run(&AtomicBool::new(false), Some(Duration::from_secs(8)));
    let ran = ran.map_err(|(row, error)| format!("row {row}: {error}")).expect("they run");
    assert_eq!(ran.simulated, Duration::from_secs(8));
    let mut unos = machine.into_unos();
    let told = |unos: &mut [Uno], command: &str| -> Vec<Vec<String>> {
        unos.iter_mut().map(|uno| ask(uno, command).expect("it answers")).collect()
    };
    let position = |status: &Vec<String>| -> i64 {
        let word = status[0].split(' ').find_map(|word| word.strip_prefix("pos="));
        word.expect("a status has a position").parse().expect("it is a number")
    };
    // The rows answer at different turns, so a rolling machine may be a tick farther. So ask until all of them stand.
    let mut positions: Vec<i64> = Vec::new();
    let stand = (0..60).any(|_| {
        unos.iter_mut().for_each(|uno| uno.run_for_ms(250).expect("it runs"));
        let before = std::mem::take(&mut positions);
        positions = told(&mut unos, "status").iter().map(position).collect();
        positions == before
    });
    assert!(stand, "{positions:?}");
    assert!(positions[0] != 0 && positions.iter().all(|position| *position == positions[0]), "{positions:?}");
    let objects = told(&mut unos, "dump");
    assert!(objects[0] != objects[1] && objects[1] != objects[2], "{objects:?}");
}
