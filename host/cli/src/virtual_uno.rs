//! `weeder virtual-uno`: an Uno without an Uno, at a pseudo terminal that any serial program opens.

use crate::ctrl_c;
use crate::flash;
use crate::input;
use anyhow::{Result, anyhow, ensure};
use clap::Args;
use field::machine::Machine;
use field::motion::mm_s;
use frame::{CourseArguments, Messages, Results, number_within, whole_within};
use gps::simulated::{ReceiverSetup, SimulatedReceiver, Trouble};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use uno::bootloader::Bootloader;
use uno_run::firmware;
use uno_run::live::rows::{LiveRows, Ran};
use uno_run::live::{Course, Run, Sender, Setup};

#[derive(Args)]
#[command(after_help = "\
The firmware runs as on a real Uno, with a simulated machine that rolls along the row repeatedly.
Opening the port resets it, as on a real Uno. In another terminal:

  weeder virtual-uno --link /tmp/uno --eeprom uno.eeprom
  picocom --echo -b 115200 /tmp/uno    (type `help`, `clear`, `start`, `status`)

An Uno with an empty flash and a bootloader, for avrdude:

  weeder virtual-uno --link /tmp/uno --bootloader optiboot
  weeder flash --port /tmp/uno

With a satellite receiver half a metre behind the beam, at its own port:

  weeder virtual-uno --no-reset --link /tmp/uno --gps-link /tmp/gps --gps-trouble
  weeder record --port /tmp/uno --gps /tmp/gps --beam-ahead 500 --out field.csv

With the old bootloader, from Debian's arduino-core-avr:

  weeder virtual-uno --link /tmp/uno --bootloader ATmegaBOOT_168_atmega328.hex
  weeder flash --port /tmp/uno --old-bootloader

A machine to rehearse the set-up: it rolls when you press Enter here. The other terminal has the questions:

  weeder virtual-uno --roll --link /tmp/uno
  weeder set-up --port /tmp/uno

A machine with six rows, with one wheel and encoder for all, at the ports row1 to row6.
The second command prints what that costs this computer:

  weeder virtual-uno --rows 6 --link row
  weeder virtual-uno --rows 6 --fast --for 10

Ignore avrdude's TIOCMGET warning: a pseudo terminal has no modem lines.")]
pub struct Arguments {
    #[command(flatten)]
    course: CourseArguments,
    /// Number of rows, 1 to 64: an Uno and plants for each, one wheel for all. Files and links get the row's number
    /// at their end.
    #[arg(long, value_name = "NUMBER", default_value = "1", value_parser = whole_within(1..=64_usize))]
    rows: usize,
    /// End after this many seconds of the Unos' own time, 1 to 86400, and print how long that took.
    #[arg(long = "for", value_name = "SECONDS", value_parser = whole_within(1..=86_400_u64))]
    seconds: Option<u64>,
    /// The machine stands still.
    #[arg(long)]
    stand: bool,
    /// The machine stands until you type in this terminal: Enter rolls it along the row once, and a number from 1000 to
    /// 60000 rolls it so many millimetres over bare ground. For one row.
    #[arg(long, conflicts_with = "stand")]
    roll: bool,
    /// Start this bootloader at every reset: a file, or `optiboot`, the Uno's own. The flash is empty unless --elf is
    /// given.
    #[arg(long, value_name = "optiboot|FILE.hex")]
    bootloader: Option<PathBuf>,
    /// Run this ELF, or HEX file, instead of this weeder's own firmware.
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    /// Keep the EEPROM in this file from one run to the next.
    #[arg(long, value_name = "FILE")]
    eeprom: Option<PathBuf>,
    /// Make a symbolic link to the port, and remove it at the end.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Add a satellite receiver (NMEA 0183) at its own serial port, with this symbolic link.
    #[arg(long, value_name = "PATH", conflicts_with = "bootloader")]
    gps_link: Option<PathBuf>,
    /// The receiver's fixes a second, 1 to 10.
    #[arg(long, value_name = "HZ", default_value = "5", value_parser = number_within(1.0..=10.0), requires = "gps_link")]
    gps_rate: f64,
    /// Standard deviation of the fixes in mm, 0 to 10000.
    #[arg(long, value_name = "MM", default_value = "15", value_parser = number_within(0.0..=10_000.0), requires = "gps_link")]
    gps_error: f64,
    /// The receiver loses its fix, jumps, and sends damaged lines each minute.
    #[arg(long, requires = "gps_link")]
    gps_trouble: bool,
    /// Opening the port does not reset the chip, as on an Uno with a cut RESET-EN trace.
    #[arg(long)]
    no_reset: bool,
    /// Run at full speed, not in real time. A bootloader would not wait for avrdude then.
    #[arg(long, conflicts_with = "bootloader")]
    fast: bool,
}

/// The bootloader of that name, or in that file.
fn bootloader(name: &Path) -> Result<Bootloader> {
    if name != Path::new("optiboot") {
        return Ok(Bootloader::read(name)?);
    }
    Ok(firmware::optiboot()?.map_or_else(Bootloader::optiboot, |hex| Bootloader::read(&hex))?)
}

/// Runs until Ctrl-C, or until it is asked to end by SIGTERM or SIGHUP.
pub fn run(arguments: &Arguments) -> Result<()> {
    let bootloader = arguments.bootloader.as_deref().map(bootloader).transpose()?;
    let count = arguments.rows;
    let row = |number| arguments.course.nth_row(number);
    let rows = match arguments.course.row {
        // Standard input can be read once.
        Some(_) => vec![row(0)?; count],
        None => (0..count as u64).map(row).collect::<Result<_>>()?,
    };
    let conditions = arguments.course.conditions_of(&arguments.course.field)?;
    let (machine, speed_mm_s) = (conditions.machine(arguments.course.seed), mm_s(arguments.course.speed));
    let courses = Course::of_rows(rows, machine, speed_mm_s, conditions.ground.slip_percent / 100.0);
    ensure!(!arguments.roll || count == 1, "--roll is for one row: leave out --rows");
    if arguments.roll {
        let Machine { wheel_mm, beam_to_tool_mm, second_beam_mm, tool_width_mm, .. } = conditions.machine(0);
        writeln!(
            Messages,
            "By tape: wheel {wheel_mm} mm, from the beam to the tool {beam_to_tool_mm} mm and to the second beam \
             {second_beam_mm} mm, tool {tool_width_mm} mm wide. An end switch is on D5."
        );
        writeln!(
            Messages,
            "Here Enter rolls along the row once, and a number rolls that many millimetres over bare ground."
        );
    } else if !arguments.stand {
        writeln!(Messages, "The machine rolls {:.0} mm each time.", courses[0].rolls_mm());
    }
    let elf = match (&arguments.elf, &bootloader) {
        (Some(elf), _) => Some(elf.clone()),
        (None, Some(_)) => None,
        (None, None) => Some(firmware::build()?),
    };
    let mut receiver = arguments.gps_link.clone().map(|link| {
        let trouble = arguments.gps_trouble.then(Trouble::default);
        let began_ms = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as i64);
        let (rate_hz, error_mm) = (arguments.gps_rate, arguments.gps_error);
        let setup = ReceiverSetup { rate_hz, error_mm, began_ms, trouble, ..ReceiverSetup::default() };
        let mut receiver = SimulatedReceiver::new(setup);
        let sends: Sender = Box::new(move |time_s, distance_m| receiver.bytes_until(time_s, distance_m));
        (sends, link)
    });
    let stop = ctrl_c()?;

    let of_row = |path: &Option<PathBuf>, row| path.as_deref().map(|path| of_row(path, row, count));
    let setup = |(row, course)| Setup {
        elf: elf.clone(),
        bootloader: bootloader.clone(),
        eeprom: of_row(&arguments.eeprom, row),
        link: of_row(&arguments.link, row),
        // The machine has one receiver, on its first row.
        receiver: receiver.take(),
        course: (!arguments.stand).then_some(course),
        runs: arguments.roll.then(typed_runs),
        fast: arguments.fast,
        keeps_running_when_opened: arguments.no_reset,
    };
    let mut unos = LiveRows::start(courses.into_iter().enumerate().map(setup).collect())?;
    for path in unos.paths() {
        writeln!(Results, "{}", path.display())?;
    }
    let ports = if count == 1 { "Uno's port stands" } else { "Unos' ports stand" };
    writeln!(Messages, "The virtual {ports} above: 115200 baud. Ctrl-C ends it.");
    let bootloader_alone = bootloader.as_ref().filter(|_| arguments.elf.is_none());
    writeln!(Messages, "Next, in another terminal: {}", next_command(&unos.paths(), bootloader_alone)?);
    let ran = unos.run(&stop, arguments.seconds.map(Duration::from_secs)).map_err(|(row, error)| match count {
        1 => anyhow!(error),
        _ => anyhow!(error).context(format!("row {}", row + 1)),
    })?;
    if arguments.seconds.is_some() {
        writeln!(Results, "{}", cost(ran, count))?;
    }
    Ok(())
}

/// The distances that a person may ask for, in millimetres.
const RUN_MM: RangeInclusive<u16> = 1000..=60_000;

/// The runs that are typed into this terminal.
fn typed_runs() -> Receiver<Run> {
    let (asked, runs) = mpsc::channel();
    thread::spawn(move || {
        for line in input::typed() {
            let run = match line.text.trim() {
                "" => Some(Run::AlongRow),
                typed => typed.parse().ok().filter(|mm| RUN_MM.contains(mm)).map(|mm| Run::OverGround(mm.into())),
            };
            match run.map(|run| asked.send(run)) {
                Some(Ok(())) => {}
                Some(Err(_)) => return,
                None => {
                    writeln!(Messages, "error: type Enter, or millimetres from {} to {}", RUN_MM.start(), RUN_MM.end())
                }
            }
        }
    });
    runs
}

/// The next command to type. An Uno with only a bootloader needs a firmware.
fn next_command(ports: &[&Path], bootloader: Option<&Bootloader>) -> Result<String> {
    let is_old = |bootloader: &Bootloader| usize::from(bootloader.start()) == flash::OLD.available;
    let (begin, ports): (&[&str], _) = match bootloader {
        None => (&["weeder", "monitor"], ports),
        // One at a time.
        Some(bootloader) if is_old(bootloader) => (&["weeder", "flash", "--old-bootloader"], &ports[..1]),
        Some(_) => (&["weeder", "flash"], &ports[..1]),
    };
    // Without a separator it could be a row's name.
    let path = |port: &&Path| match port.parent() {
        Some(folder) if folder.as_os_str().is_empty() => format!("./{}", port.display()),
        _ => port.display().to_string(),
    };
    let ports: Vec<String> = ports.iter().map(path).collect();
    let ports = ports.iter().flat_map(|port| ["--port", port]);
    Ok(shlex::try_join(begin.iter().copied().chain(ports))?)
}

/// A row's own file or link. Its name ends with the row's number if there are several rows.
fn of_row(path: &Path, row: usize, count: usize) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    if count > 1 {
        name.push((row + 1).to_string());
    }
    name.into()
}

/// The computing time of the rows.
fn cost(ran: Ran, count: usize) -> String {
    let rows = if count == 1 { "a row".to_owned() } else { format!("{count} rows") };
    let threads = if ran.threads == 1 { "one thread".to_owned() } else { format!("{} threads", ran.threads) };
    let [simulated_s, took_s, cores_s] = [ran.simulated, ran.took, ran.cores].map(|time| time.as_secs_f64());
    format!(
        "{rows} in {threads}: {simulated_s:.1} s of their own time took {took_s:.1} s, which is {:.2} times real time; in real time a row takes {:.2} of a core",
        simulated_s / took_s.max(f64::EPSILON),
        cores_s / simulated_s.max(f64::EPSILON) / count as f64
    )
}
