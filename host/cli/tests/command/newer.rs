//! The tools at a machine whose firmware is newer than they are: it has an event, an alarm, settings and words that they do
//! not know.

use crate::common::{assert_has, command, printed, typed};
use control::settings::Setting;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use uno::pty::Pty;

/// The answer to `get`: `wheel_mm` has a wider range, `k` is gone, and two settings are new.
fn settings([lamp, wheel, margin]: [&str; 3]) -> String {
    let line = |setting: Setting| {
        let name = setting.text();
        let unit = setting.unit();
        match name.to_string().as_str() {
            "wheel_mm" => format!("wheel_mm={wheel} mm from 200 to 1200, default 400\r\n"),
            "margin_mm" => format!("margin_mm={margin} mm from 0 to 200, default 50\r\n"),
            "k" => String::new(),
            _ if setting.is_switched() => format!("{name}=off on or off, default off\r\n"),
            _ => {
                let (value, least, greatest) = (setting.default(), setting.least(), setting.greatest());
                format!("{name}={value}{unit} from {least} to {greatest}, default {value}\r\n")
            }
        }
    };
    let known: String = Setting::all().map(line).collect();
    format!("{known}tilt_mm=7 mm from 0 to 99, default 5, saved 5\r\nlamp={lamp} on or off, default off\r\n")
}

/// The machine at a port, until it is dropped.
struct Newer {
    port: PathBuf,
    is_over: Arc<AtomicBool>,
    machine: Option<thread::JoinHandle<()>>,
}

impl Newer {
    fn start() -> Self {
        let mut pty = Pty::open().expect("there is a pseudo terminal");
        let (port, is_over) = (pty.path().to_owned(), Arc::new(AtomicBool::new(false)));
        let over = Arc::clone(&is_over);
        let machine = thread::spawn(move || {
            let (mut line, mut bytes, mut own) = (String::new(), [0; 64], ["off", "900", "50"]);
            while !over.load(Ordering::Relaxed) {
                let count = pty.read(&mut bytes).expect("the terminal works");
                for &byte in &bytes[..count] {
                    match byte {
                        b'\n' => {
                            match line.as_str() {
                                "set lamp on" => own[0] = "on",
                                "set wheel_mm 1100" => own[1] = "1100",
                                "set wheel_mm 500" => own[1] = "500",
                                "set margin_mm 60" => own[2] = "60",
                                _ => {}
                            }
                            let said = answer(&line, own);
                            let mut said = said.as_bytes();
                            while !said.is_empty() {
                                said = &said[pty.write(said).expect("the terminal works")..];
                            }
                            line.clear();
                        }
                        b' '..=b'~' => line.push(char::from(byte)),
                        _ => {}
                    }
                }
                thread::sleep(Duration::from_millis(2));
            }
        });
        Self { port, is_over, machine: Some(machine) }
    }

    fn weeder(&self, words: &[&str], input: &str) -> std::process::Output {
        typed(command(words).arg("--port").arg(&self.port), input)
    }
}

impl Drop for Newer {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        let ended = self.machine.take().map(thread::JoinHandle::join);
        assert!(thread::panicking() || ended.is_none_or(|ended| ended.is_ok()));
    }
}

fn answer(line: &str, own: [&str; 3]) -> String {
    let answer = match line {
        "" => return String::new(),
        "version" => "weeder 99.1.0 (abc)\r\n".to_owned(),
        "get" => settings(own),
        "examples" => "tilt deg=4 pos=9\r\nbuilt_in 0 plant 1 2 3 4 5\r\n".to_owned(),
        "status" => "state=hold tool=out pos=0 speed_mm_s=0 windows=0 unseen_mm=450 mood=good\r\nlost=0 moon=full\r\n"
            .to_owned(),
        "hold" => "alarm code=9-1 name=boredom pos=9 why=rain\r\n".to_owned(),
        _ => String::new(),
    };
    format!("{answer}ok\r\n")
}

#[test]
fn hold_status_and_log_work_with_a_newer_firmware() {
    let machine = Newer::start();
    let folder = tempfile::tempdir().expect("there is room for files");
    let log = folder.path().join("log.csv");
    let log_name = log.to_str().expect("it is text");
    let said = printed(&machine.weeder(&["monitor", "--plain", "--log", log_name], "status\nhold\n"), 0);
    let parts = [
        "state=hold tool=out",
        "mood=good",
        "tilt deg=4 pos=9",
        "alarm code=9-1 name=boredom pos=9 why=rain",
        "the firmware 99.1.0 (abc) is newer than this program",
        "only the firmware knows wheel_mm, tilt_mm, lamp; the firmware lacks k",
    ];
    assert_has(&said, parts);
    let text = fs::read_to_string(&log).expect("it was written");
    let lines = [
        ",setting,wheel_mm=900\n",
        ",setting,tilt_mm=7\n",
        ",event,tilt deg=4 pos=9\n",
        ",event,alarm code=9-1 name=boredom pos=9 why=rain\n",
        ",example,built_in 0 plant 1 2 3 4 5\n",
    ];
    assert_has(&text, lines);
    assert!(!text.contains(",setting,k="), "{text}");
}

#[test]
fn settings_of_a_newer_firmware_are_pulled_compared_and_pushed() {
    let machine = Newer::start();
    let folder = tempfile::tempdir().expect("there is room for a file");
    let file = folder.path().join("machine.toml");
    let name = file.to_str().expect("it is text");
    let pulled = printed(&machine.weeder(&["settings", "pull", name], ""), 0);
    assert_has(&pulled, ["is newer than this program", "the firmware lacks k"]);
    let text = fs::read_to_string(&file).expect("it was written");
    assert_has(&text, ["wheel_mm = 900\n", "tilt_mm = 7\n", "lamp = false\n"]);
    assert!(!text.contains("\nk = "), "{text}");
    let same = printed(&machine.weeder(&["settings", "diff", name], ""), 0);
    assert!(same.starts_with("The machine has the settings of "), "{same}");
    fs::write(&file, "lamp = true\n").expect("it can be written");
    let differs = printed(&machine.weeder(&["settings", "diff", name, "--json"], ""), 1);
    assert!(differs.contains("\"setting\": \"lamp\""), "{differs}");
    // A value in this program's range goes out, although the machine's present one is outside of it.
    for (wheel, set) in [(1100, "margin_mm, wheel_mm, lamp"), (500, "wheel_mm")] {
        let text = format!("margin_mm = 60\nwheel_mm = {wheel}\nlamp = true\n");
        fs::write(&file, text).expect("it can be written");
        let pushed = printed(&machine.weeder(&["settings", "push", name], ""), 0);
        assert!(pushed.starts_with(&format!("Set: {set}\n")), "{pushed}");
        let same = printed(&machine.weeder(&["settings", "diff", name], ""), 0);
        assert!(same.starts_with("The machine has the settings of "), "{same}");
    }
    fs::write(&file, "k = 5\n").expect("it can be written");
    let gone = printed(&machine.weeder(&["settings", "push", name], ""), 2);
    assert!(gone.contains("k 5 is wanted") && gone.contains("nothing was sent"), "{gone}");
    fs::write(&file, "lmap = true\n").expect("it can be written");
    let unknown = printed(&machine.weeder(&["settings", "push", name], ""), 2);
    assert_has(&unknown, ["line 1: there is no setting `lmap`", "nothing was sent"]);
}
