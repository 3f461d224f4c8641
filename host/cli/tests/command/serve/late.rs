//! Commands that come late, or after a later HOLD: from a phone at the edge of the network, to a computer that slept, and
//! through a port that stalled. The machine must not start by any of them.
//!
//! The network is the kernel's own, in two namespaces whose packets vanish for a while. Without the rights for
//! namespaces, that test prints so and tries nothing.

use super::attacks::{Client, answer};
use super::*;
use crate::common::{printed, typed};

/// The computer's and the phone's address, and the addresses of their network cards.
const COMPUTER: &str = "10.77.0.1";
const PHONE: &str = "10.77.0.2";
const CARDS: [&str; 2] = ["02:00:00:00:77:01", "02:00:00:00:77:02"];
/// A card that does not exist: packets to it vanish.
const NO_CARD: &str = "02:00:00:00:77:99";

/// The variable with the names of the namespaces, for the test that runs in the phone's.
const NAMES: &str = "WEEDER_TEST_NAMESPACES";

/// Sends a command of a phone that has seen this message. Does not wait for the answer.
fn send(phone: &mut Client, line: &str, seen: &str) {
    phone.send("POST", "/machines/0/command", &format!("Weeder-Seen: {seen}\r\n"), line);
}

/// The state of the machine, by a status that is sent after now.
fn state(host: &str, cookie: &str) -> String {
    let mut events = Events::open(host, cookie, 0);
    let mut statuses = std::iter::from_fn(|| events.next()).filter(|message| message["is"] == "status");
    let status = statuses.nth(1).expect("the machine tells its status")["said"].as_str().unwrap_or_default().to_owned();
    status.split(' ').next().unwrap_or_default().to_owned()
}

fn is_late(answer: &(u16, String)) -> bool {
    answer.0 == 412 && answer.1.contains("more than a second late, so it was not sent")
}

#[track_caller]
fn assert_is_late(answer: &(u16, String)) {
    assert!(is_late(answer), "{answer:?}");
}

#[track_caller]
fn assert_came_after_hold(answer: &(u16, String)) {
    assert!(answer.0 == 412 && answer.1.contains("hold came first, so this was not sent"), "{answer:?}");
}

#[test]
fn every_command_but_hold_states_what_its_sender_has_seen() {
    let (served, _uno) = serve_uno(&[], &["--allow-start"]);
    let phone = served.pair();
    let command = |seen: &str, line: &str| served.post_after(seen, &served.lan, "/machines/0/command", &phone, line);
    for seen in ["", "x", "-1"] {
        let (status, said) = command(seen, "start");
        assert!(status == 428 && said.contains("as the header Weeder-Seen"), "{status} {said}");
        assert_eq!(command(seen, "hold"), (200, "ok\n".to_owned()));
    }
    for tries in 1.. {
        assert!(tries < 50, "it is always late");
        let seen = served.seen(&served.lan, &phone);
        assert_eq!(command(&seen, "HOLD!"), (200, "ok\n".to_owned()));
        let answer = command(&seen, "start");
        // A busy computer may be more than a second late.
        if !is_late(&answer) {
            assert_came_after_hold(&answer);
            break;
        }
    }
    for seen in ["0", &"9".repeat(19)] {
        assert_is_late(&command(seen, "start"));
    }
    assert_eq!(state(&served.lan, &phone), "state=hold");
    assert_eq!(served.command(&served.lan, &phone, "start"), (200, "ok\n".to_owned()));
    assert_eq!(state(&served.lan, &phone), "state=work");
}

#[test]
fn a_start_that_waited_while_the_computer_slept_is_refused() {
    let (served, _uno) = serve_uno(&["--no-reset"], &["--allow-start"]);
    let cookie = served.pair();
    let mut phone = Client::open(&served.lan, &cookie);
    let seen = served.seen(&served.lan, &cookie);
    served.process.signal("-STOP");
    send(&mut phone, "start", &seen);
    thread::sleep(Duration::from_millis(1500));
    served.process.signal("-CONT");
    assert_is_late(&answer(&mut phone.stream));
    assert_eq!(state(&served.lan, &cookie), "state=hold");
}

#[test]
fn a_sleep_of_the_computer_is_no_silence_of_the_machine() {
    // A second connection would reset it, and its answers wait while the computer sleeps.
    let (served, _uno) = serve_uno(&[], &["--allow-start"]);
    assert_eq!(served.command(&served.here, "", "start"), (200, "ok\n".to_owned()));
    let mut events = Events::open(&served.here, "", 0);
    for _ in 0..3 {
        served.process.signal("-STOP");
        thread::sleep(Duration::from_millis(4000));
        served.process.signal("-CONT");
        for _ in 0..20 {
            let message = events.next().expect("it goes on");
            assert_ne!(message["is"], "lost", "{message}");
        }
    }
    assert_eq!(state(&served.here, ""), "state=work");
}

#[test]
fn a_start_through_a_port_that_stalls_is_done_only_if_the_answer_says_so() {
    let (served, (uno, _folder)) = serve_uno(&["--no-reset"], &["--allow-start"]);
    let mut events = Events::open(&served.here, "", 0);
    uno.signal("-STOP");
    // Mostly a poll is typed meanwhile. The command then waits behind it.
    thread::sleep(Duration::from_millis(300));
    let (status, said) = served.command(&served.here, "", "start");
    assert!(matches!(status, 503 | 504), "{status} {said}");
    // Typed before the poll, it is still in the port, which a pseudo terminal does not empty.
    let may_be_done = said.contains("may still do it");
    assert_eq!(status == 504, may_be_done, "{status} {said}");
    uno.signal("-CONT");
    events.wait_for(|message| {
        assert!(may_be_done || !has(message, "said", "work"), "{message}");
        message["is"] == "there"
    });
    assert!(may_be_done || state(&served.here, "") == "state=hold");
}

/// Runs `ip`. Returns whether it has succeeded, and why not.
fn ip(words: &str) -> Result<(), String> {
    let output = Command::new("ip").args(words.split(' ')).output().map_err(|error| format!("ip: {error}"))?;
    match output.status.success() {
        true => Ok(()),
        false => Err(format!("ip {words}: {}", String::from_utf8_lossy(&output.stderr).trim())),
    }
}

/// Two namespaces with a cable between them, deleted at the end.
struct Namespaces([String; 2]);

impl Namespaces {
    fn new() -> Result<Self, String> {
        let id = std::process::id();
        let names = Self([format!("weeder-c-{id}"), format!("weeder-p-{id}")]);
        let [computer, phone] = &names.0;
        ip(&format!("netns add {computer}"))?;
        ip(&format!("netns add {phone}"))?;
        ip(&format!("-n {computer} link add cable type veth peer name cable netns {phone}"))?;
        for ((name, address), card) in names.0.iter().zip([COMPUTER, PHONE]).zip(CARDS) {
            ip(&format!("-n {name} link set cable address {card}"))?;
            ip(&format!("-n {name} address add {address}/24 dev cable"))?;
            ip(&format!("-n {name} link set lo up"))?;
            ip(&format!("-n {name} link set cable up"))?;
        }
        Ok(names)
    }
}

impl Drop for Namespaces {
    fn drop(&mut self) {
        for name in &self.0 {
            // It may not exist.
            let _ = ip(&format!("netns delete {name}"));
        }
    }
}

/// Lets all packets through, or lets all vanish.
fn connect_cable(names: [&str; 2], is_whole: bool) {
    for (name, (other, card)) in names.into_iter().zip([(PHONE, CARDS[1]), (COMPUTER, CARDS[0])]) {
        let card = if is_whole { card } else { NO_CARD };
        ip(&format!("-n {name} neigh replace {other} lladdr {card} dev cable nud permanent")).expect("it is ours");
    }
}

#[test]
fn no_packets_for_a_while_neither_start_a_machine_late_nor_after_a_hold() {
    let names = match Namespaces::new() {
        Ok(names) => names,
        Err(why) => return println!("skipped, because this computer allows no namespace: {why}"),
    };
    let own = std::env::current_exe().expect("it runs");
    let mut inside = Command::new("ip");
    inside.args(["netns", "exec", &names.0[1]]).arg(own).args(["--exact", INSIDE, "--ignored", "--nocapture"]);
    let output = inside.env(NAMES, names.0.join(" ")).output().expect("ip is there");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("1 passed"), "{said}{}", String::from_utf8_lossy(&output.stderr));
}

/// The name of the test in the phone's namespace.
const INSIDE: &str = "serve::late::inside_the_namespace_of_the_phone";

#[test]
#[ignore = "runs in the namespaces that another test makes"]
fn inside_the_namespace_of_the_phone() {
    let names = std::env::var(NAMES).expect("the other test runs it");
    let names: [&str; 2] = names.split(' ').collect::<Vec<_>>().try_into().expect("they are two");
    let folder = folder();
    let (_uno, port) = uno(&folder, "uno", &["--stand", "--no-reset"]);
    printed(&typed(command(&["monitor", "--plain", "--port"]).arg(&port), "save\nclear\n"), 0);
    let mut command = Command::new("ip");
    command.args(["netns", "exec", names[0], env!("CARGO_BIN_EXE_weeder"), "serve"]);
    let served = serve_with(command, &folder, &[&port], &["--lan", COMPUTER, "--allow-start"]);
    connect_cable(names, true);
    let cookie = served.pair();
    let host = served.lan.as_str();
    assert_eq!(state(host, &cookie), "state=hold");

    // A start that comes seconds late, on a connection that its phone has given up or not.
    for gives_up in [false, true] {
        let mut phone = Client::open(host, &cookie);
        let seen = served.seen(host, &cookie);
        connect_cable(names, false);
        send(&mut phone, "start", &seen);
        if gives_up {
            phone.stream.get_mut().shutdown(std::net::Shutdown::Write).expect("it is open");
        }
        thread::sleep(Duration::from_millis(2500));
        connect_cable(names, true);
        if !gives_up {
            assert_is_late(&answer(&mut phone.stream));
        }
        assert_eq!(state(host, &cookie), "state=hold", "{gives_up}");
    }

    // A start, then HOLD on another connection. The start is sent again by the kernel, behind HOLD.
    for after_ms in [0, 100, 300, 600] {
        let mut phones = [(); 2].map(|()| Client::open(host, &cookie));
        let seen = served.seen(host, &cookie);
        connect_cable(names, false);
        send(&mut phones[0], "start", &seen);
        thread::sleep(Duration::from_millis(after_ms));
        connect_cable(names, true);
        send(&mut phones[1], "hold", "");
        assert_eq!(answer(&mut phones[1].stream), (200, "ok\n".to_owned()));
        let (status, said) = answer(&mut phones[0].stream);
        // Before HOLD, or not at all.
        assert!(matches!(status, 200 | 412), "{status} {said}");
        assert_eq!(state(host, &cookie), "state=hold", "{after_ms} ms: {status} {said}");
    }

    // The network forgets connections, and HOLD comes through on a new one.
    assert_eq!(served.command(host, &cookie, "start"), (200, "ok\n".to_owned()));
    connect_cable(names, false);
    thread::sleep(Duration::from_millis(300));
    connect_cable(names, true);
    assert_eq!(served.command(host, &cookie, "hold"), (200, "ok\n".to_owned()));
    assert_eq!(state(host, &cookie), "state=hold");
    served.process.interrupt();
}
