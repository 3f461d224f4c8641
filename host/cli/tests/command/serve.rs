//! `weeder serve` from a phone's side: the real process with a real `weeder virtual-uno`, and good and bad http
//! clients.
//!
//! 127.0.0.2 stands for the computer's address in the network: every request to it counts as a request from the
//! network. The tests wait for results, not for fixed times.

use crate::common::{Running, assert_fails, command, full_pipe};
use serde_json::Value;
use socket2::{Domain, Socket, Type};
use std::fs;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

mod attacks;
mod late;
mod served;

use self::served::*;

/// Every path, with its method.
const PATHS: [(&str, &str); 10] = [
    ("GET", "/"),
    ("GET", "/page.css"),
    ("GET", "/page.js"),
    ("GET", "/pair.css"),
    ("GET", "/pair.js"),
    ("POST", "/pair"),
    ("GET", "/machines"),
    ("GET", "/events"),
    ("POST", "/machines/hold"),
    ("POST", "/machines/0/command"),
];

#[test]
fn without_the_code_a_phone_sees_nothing_and_does_nothing() {
    let (served, _uno) = serve_uno(&[], &[]);
    assert_eq!(served.command(&served.here, "", "start").0, 200);

    let (_, http_port) = served.lan.split_once(':').expect("it has a port");
    let named = |cookie: &str| cookie.replace('=', &format!("-{http_port}="));
    for cookie in
        ["", "weeder=", &format!("weeder={}", "0".repeat(64)), "weeder=; weeder=1", &format!("weeder={}", served.code)]
    {
        let cookie = &named(cookie);
        for path in ["/?served", "/"] {
            let (status, said) = served.get(&served.lan, path, cookie);
            assert!(status == 200 && said.contains("The code on the computer") && !said.contains("the page"), "{said}");
        }
        for path in ["/page.css", "/page.js", "/machines", "/events", "/events/", "/nothing", "/../page.js"] {
            let (status, said) = served.get(&served.lan, path, cookie);
            assert!(status == 401 && said.contains("is not paired"), "{path}: {status} {said}");
        }
        for line in ["hold", "status", "start"] {
            assert_eq!(served.command(&served.lan, cookie, line).0, 401, "{line}");
        }
    }
    for code in ["", "00000000", "what?", &served.code[1..]] {
        let (status, said, cookie) = served.try_code(code);
        assert!(status == 403 && said.contains("Tries left: ") && cookie.is_none(), "{code}: {status} {said}");
    }
    let mut events = Events::open(&served.here, "", 0);
    events.wait_for(|message| message["is"] == "status" && has(message, "said", "state=work"));

    let phone = served.pair();
    assert!(served.get(&served.lan, "/?served", &phone).1.contains("the page"));
    assert_eq!(served.get(&served.lan, "/page.css", &format!("other=1; {phone}")).1, "p{}");
    assert_eq!(served.command(&served.lan, &phone, "hold"), (200, "ok\n".to_owned()));
    events.wait_for(|message| has(message, "said", "state=hold"));
}

#[test]
fn of_a_hundred_wrong_codes_five_are_looked_at_and_the_operator_knows() {
    let (served, _uno) = serve_uno(&[], &[]);
    let phone = served.pair();
    let statuses: Vec<u16> = (0..100).map(|number| served.try_code(&format!("{number:08}")).0).collect();
    // On a slow PC the minute may end, and five more tries follow.
    assert_eq!(statuses[..5], [403; 5]);
    let looked_at = statuses.iter().filter(|&&status| status == 403).count();
    assert!(looked_at % 5 == 0 && looked_at < 20 && statuses[5] == 429, "{statuses:?}");
    let (status, said, cookie) = served.try_code(&served.code);
    assert!(status == 429 && said.contains("Too many wrong codes") && cookie.is_none(), "{status} {said}");
    served.wait_until_told("127.0.0.1 has sent the fifth wrong code: no code is accepted for a minute");
    // A phone that was paired before is not locked out.
    assert_eq!(served.get(&served.lan, "/machines", &phone).0, 200);
}

#[test]
fn a_foreign_host_or_origin_is_refused_on_every_path_the_events_included() {
    let (served, _uno) = serve_uno(&[], &[]);
    let phone = served.pair();
    for (door, own) in [(&served.here, ""), (&served.lan, phone.as_str())] {
        let other = if door == &served.here { &served.lan } else { &served.here };
        for (method, path) in PATHS {
            let head = |host: &str, origin: &str| {
                format!(
                    "{method} {path} HTTP/1.1\r\nHost: {host}\r\n{origin}Cookie: {own}\r\nContent-Length: 0\r\n\r\n"
                )
            };
            // A name that was made to lead here, and the other door's own.
            for host in ["weeder.example", &format!("weeder.example:{}", &door[10..]), other] {
                assert_eq!(
                    raw(door, &head(host, &format!("Origin: http://{host}\r\n"))),
                    421,
                    "{method} {path} of {host}"
                );
            }
            for origin in ["http://weeder.example", "null", &format!("http://{other}"), &format!("https://{door}")] {
                let head = head(door, &format!("Origin: {origin}\r\n"));
                assert_eq!(raw(door, &head), 403, "{method} {path} from {origin}");
            }
            let proxied = head(door, "").replacen(path, &format!("http://weeder.example{path}"), 1);
            assert_eq!(raw(door, &proxied), 421, "{proxied}");
            if method == "POST" {
                assert_eq!(raw(door, &head(door, "")), 403, "{path} from nowhere");
            }
        }
    }
}

#[test]
fn a_paired_phone_only_watches_and_holds_unless_allowed_more() {
    let folder = folder();
    let (_uno, port) = uno(&folder, "uno", &["--stand"]);
    for options in [&[][..], &["--allow-start"]] {
        let served = serve(&folder, &[&port], options);
        let (one, other) = (served.pair(), served.pair());
        served.make_ready(0);
        let mut events = Events::open(&served.lan, &other, 0);
        events.wait_for(|message| message["is"] == "there" && has(message, "version", "0."));

        let may_start = !options.is_empty();
        let expected = serde_json::json!({ "machines": ["uno"], "mayStart": may_start, "mayChange": false });
        let (_, machines) = served.get(&served.lan, "/machines", &one);
        assert_eq!(serde_json::from_str::<Value>(&machines).expect("it is JSON"), expected);

        for line in [
            "set k 5",
            "save",
            "defaults",
            "servo in",
            "servo 1500",
            "test row",
            "calibrate servo",
            "label plant",
            "calibrate start",
            "forget all",
            "start now",
            "events off",
            "plot on",
            "launch",
        ] {
            let (status, said) = served.command(&served.lan, &one, line);
            assert!(status == 403 && said.starts_with("error: "), "{line}: {status} {said}");
        }
        for line in ["status\nstart", "", &"x".repeat(81), &"x".repeat(10_000)] {
            let (status, said) = served.command(&served.lan, &one, line);
            assert!(matches!(status, 400 | 413) && said.starts_with("error: that is no command"), "{status} {said}");
        }
        let (status, said) = served.command(&served.lan, &one, "get k");
        assert!(status == 200 && said.starts_with("k=3 ") && said.ends_with("\nok\n"), "{said}");

        let (status, said) = served.command(&served.lan, &one, "start");
        if may_start {
            assert_eq!((status, said.as_str()), (200, "ok\n"));
        } else {
            assert!(status == 403 && said.contains("have `weeder serve` started with --allow-start"), "{said}");
            assert_eq!(served.command(&served.here, "", "start"), (200, "ok\n".to_owned()));
        }
        events.wait_for(|message| message["is"] == "event" && has(message, "said", "state is=work"));
        // A client that did not start it may hold it.
        assert_eq!(served.command(&served.lan, &other, "hold"), (200, "ok\n".to_owned()));
        events.wait_for(|message| message["is"] == "event" && has(message, "said", "state is=hold"));
        served.process.interrupt();
    }
}

/// Kilobytes of a process's memory that are in use.
fn memory_kb(process: &Running) -> usize {
    let status = fs::read_to_string(format!("/proc/{}/status", process.0.id())).expect("it runs");
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).expect("it has memory");
    line.split_whitespace().nth(1).and_then(|number| number.parse().ok()).expect("it is a number")
}

/// All bytes until the other side closes.
fn bytes_to_the_end(mut stream: impl Read) -> usize {
    let mut buffer = vec![0; 1 << 16];
    let mut count = 0;
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return count,
            Ok(read) => count += read,
            Err(error) if error.kind() == ErrorKind::ConnectionReset => return count,
            Err(error) => panic!("it was not let go of: {error}"),
        }
    }
}

#[test]
fn clients_that_never_read_are_disconnected_and_delay_no_other() {
    const LITTLE: usize = 4096;
    let folder = folder();
    let (_uno, port) = uno(&folder, "uno", &["--fast"]);
    let served = serve(&folder, &[&port], &[]);
    served.make_ready(0);
    let phone = served.pair();
    let mut watching = Events::open(&served.lan, &phone, 0);
    watching.wait_for(|message| message["is"] == "status");

    let before_kb = memory_kb(&served.process);
    // Of the events, and of a file.
    let listeners: Vec<Events> = (0..4).map(|_| Events::open(&served.lan, &phone, LITTLE)).collect();
    let mut asking = connect(&served.lan, LITTLE);
    write!(asking, "GET /page.js HTTP/1.1\r\nHost: {}\r\nCookie: {phone}\r\n\r\n", served.lan).expect("it listens");

    // And one that never ends its request.
    let mut beginning = connect(&served.lan, LITTLE);
    write!(beginning, "GET /pair.js HTTP/1.1\r\nHost: ").expect("it listens");

    assert_eq!(served.command(&served.here, "", "plot on").0, 200);
    // Several times the buffers for a client that does not read.
    let (mut heard, mut turns) = (0, 0);
    while heard < 200_000 {
        heard += watching.next().expect("it goes on").to_string().len();
        turns += 1;
        if turns % 500 == 0 {
            assert_eq!(served.command(&served.lan, &phone, "hold"), (200, "ok\n".to_owned()));
        }
    }
    let more_kb = memory_kb(&served.process).saturating_sub(before_kb);
    assert!(more_kb < 8 << 10, "{more_kb} KB more");
    for listener in listeners {
        let bytes = bytes_to_the_end(listener.stream);
        assert!(bytes < heard / 2, "{bytes} bytes came late");
    }
    let bytes = bytes_to_the_end(asking);
    assert!(bytes < SCRIPT_BYTES / 2, "{bytes} bytes came late");
    assert!(bytes_to_the_end(beginning) < 1000);
    // And it may connect again.
    Events::open(&served.lan, &phone, 0).wait_for(|message| message["is"] == "there");
}

#[test]
fn a_pulled_port_is_opened_again_while_the_other_machine_works() {
    let folder = folder();
    let (left, left_port) = uno(&folder, "left", &["--stand"]);
    let (_right, right_port) = uno(&folder, "right", &["--stand"]);
    let named = PathBuf::from(format!("the right one={}", right_port.display()));
    let served = serve(&folder, &[&left_port, &named], &["--allow-start"]);
    let phone = served.pair();
    let (_, machines) = served.get(&served.lan, "/machines", &phone);
    assert!(machines.contains(r#"["left","the right one"]"#), "{machines}");
    for machine in [0, 1] {
        served.make_ready(machine);
    }
    let mut events = Events::open(&served.lan, &phone, 0);
    assert_eq!(served.post(&served.lan, "/machines/1/command", &phone, "start"), (200, "ok\n".to_owned()));

    let held = |machines: &[bool]| {
        let (status, said) = served.post(&served.lan, "/machines/hold", &phone, "");
        let said: Value = serde_json::from_str(&said).expect("it is JSON");
        let answers = said["machines"].as_array().expect("it has them").iter();
        let obeyed: Vec<bool> = answers.map(|machine| machine["error"].is_null()).collect();
        assert!(status == 200 && obeyed == machines && said["lastMs"].is_u64(), "{status} {said}");
    };
    held(&[true, true]);
    events.wait_for(|message| message["machine"] == 1 && has(message, "said", "state=hold"));
    assert_eq!(served.post(&served.lan, "/machines/1/command", &phone, "start"), (200, "ok\n".to_owned()));

    left.interrupt();
    events.wait_for(|message| {
        message["machine"] == 0 && message["is"] == "lost" && has(message, "why", "the port is gone")
    });
    served.wait_until_told("left: the port is gone: plug the Uno in again.");
    let (status, said) = served.command(&served.lan, &phone, "hold");
    assert!(status == 503 && said.starts_with("error: the port is gone"), "{status} {said}");
    let (status, said) = served.post(&served.lan, "/machines/1/command", &phone, "status");
    assert!(status == 200 && said.starts_with("state=work "), "{status} {said}");
    held(&[false, true]);
    served.wait_until_told("left has not obeyed HOLD: the port is gone");
    assert_eq!(served.post(&served.lan, "/machines/1/command", &phone, "start"), (200, "ok\n".to_owned()));

    let (_left, _) = uno(&folder, "left", &["--stand"]);
    events.wait_for(|message| message["machine"] == 0 && message["is"] == "there");
    events
        .wait_for(|message| message["machine"] == 0 && has(message, "said", "state=alarm code=5-1 name=settings_lost"));
    assert_eq!(served.command(&served.lan, &phone, "hold"), (200, "ok\n".to_owned()));
    events.wait_for(|message| message["machine"] == 1 && has(message, "said", "state=work"));
    assert_eq!(served.post(&served.lan, "/machines/2/command", &phone, "hold").0, 404);
}

#[test]
#[cfg(target_os = "linux")]
fn an_output_that_takes_nothing_delays_neither_hold_nor_the_end() {
    let folder = folder();
    let (_uno, port) = uno(&folder, "uno", &["--stand"]);
    let (_unread, full) = full_pipe();
    let served = serve_telling(full.into(), command(&["serve"]), &folder, &[&port], &LAN);
    // The machine's thread has told that it is there.
    served.make_ready(0);
    // The server's thread tells of both.
    assert_eq!(served.try_code("00000000").0, 403);
    let phone = served.pair();
    assert_eq!(served.command(&served.here, "", "start").0, 200);
    assert_eq!(served.command(&served.lan, &phone, "hold"), (200, "ok\n".to_owned()));
    Events::open(&served.lan, &phone, 0).wait_for(|message| has(message, "said", "state=hold"));
    served.process.interrupt();
}

#[test]
fn a_machine_that_is_not_there_is_waited_for() {
    let folder = folder();
    let port = folder.path().join("uno");
    let served = serve(&folder, &[&port], &[]);
    served.wait_until_told("uno: there is no port ");
    let (_uno, _) = uno(&folder, "uno", &["--stand"]);
    served.wait_until_told("uno: weeder ");
}

#[test]
#[cfg(target_os = "linux")]
fn it_opens_its_page_in_the_browser_where_that_is_asked_for() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let (browser, opened) = (folder.path().join("xdg-open"), folder.path().join("opened"));
    fs::write(&browser, format!("#!/bin/sh\necho $1 >{}\n", opened.display())).expect("it can be written to");
    fs::set_permissions(&browser, fs::Permissions::from_mode(0o755)).expect("it is ours");
    let mut serve = command(&["serve", "--http-port", "0", "--open", "--page"]);
    serve.arg(folder.path().join("page")).stderr(Stdio::null());
    serve.env("PATH", format!("{}:/usr/bin:/bin", folder.path().display()));
    let (_running, line) = Running::with_first_line(&mut serve);
    let address = line.split(' ').next().expect("it begins with it");
    let is_opened = || fs::read_to_string(&opened).is_ok_and(|said| said.trim_end() == address);
    let since = Instant::now();
    while !is_opened() {
        assert!(since.elapsed() < PATIENCE, "{address} is not opened");
        thread::sleep(LOOK);
    }
}

#[test]
fn a_failure_to_serve_is_explained_with_a_remedy() {
    let folder = folder();
    let page = folder.path().join("page");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("there is a free port");
    let taken = taken.local_addr().expect("it is bound").port().to_string();
    let nowhere = folder.path().join("nowhere");
    for (page, words, reason) in [
        (
            &nowhere,
            &["--http-port", "0"][..],
            "index.html of the page cannot be read: name a release's folder `page` by --page",
        ),
        (&page, &["--http-port", "0", "--allow-start"], "--lan"),
        (&page, &["--http-port", "0", "--lan", "0.0.0.0"], "cannot be opened by a phone"),
        (&page, &["--http-port", "0", "--lan", "127.0.0.1"], "cannot be opened by a phone"),
        (&page, &["--http-port", "0", "--lan", "192.0.2.1"], "192.0.2.1 is no address of this computer"),
        (&page, &["--http-port", &taken], "is in use: end the other program, or choose another port by --http-port"),
        (&page, &["--port", "a/uno", "--port", "b/uno"], "two machines are called uno: name them"),
    ] {
        assert_fails(&command(&["serve", "--page"]).arg(page).args(words).output().expect("it ends"), reason);
    }
}
