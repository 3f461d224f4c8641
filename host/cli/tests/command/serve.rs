//! `weeder serve` from a phone's side: the real process with a real `weeder virtual-uno`, and good and bad http
//! clients.
//!
//! 127.0.0.2 stands for the computer's address in the network: every request to it counts as a request from the
//! network. The tests wait for results, not for fixed times.

use serde_json::Value;
use socket2::{Domain, Socket, Type};
use std::fs;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use uno_run::firmware;
use ureq::Agent;

mod attacks;
mod late;

/// Timeout of an answer: a hundred times the time on a busy PC.
const PATIENCE: Duration = Duration::from_secs(120);

/// Time between two looks.
const LOOK: Duration = Duration::from_millis(50);

/// Bytes of the page's script here: more than the buffers for a client that does not read.
const SCRIPT_BYTES: usize = 8 << 20;

/// The address in the network, and the options that serve there.
const LAN: [&str; 2] = ["--lan", "127.0.0.2"];

fn weeder() -> Command {
    Command::new(env!("CARGO_BIN_EXE_weeder"))
}

/// A process that is ended with its test.
struct Running(Child);

impl Running {
    /// Ends it by Ctrl-C.
    fn interrupt(mut self) {
        let id = self.0.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill is there").success());
        assert!(self.0.wait().expect("it ends").success());
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A folder with a page and a file of the ports' names.
fn folder() -> TempDir {
    let folder = TempDir::new().expect("there is room for a folder");
    fs::create_dir(folder.path().join("page")).expect("it can be written to");
    for (name, content) in
        [("index.html", "<title>the page</title>"), ("page.css", "p{}"), ("page.js", &"/".repeat(SCRIPT_BYTES))]
    {
        fs::write(folder.path().join("page").join(name), content).expect("it can be written to");
    }
    folder
}

/// A virtual Uno at a port of this name.
fn uno(folder: &TempDir, name: &str, options: &[&str]) -> (Running, PathBuf) {
    let elf = firmware::build().expect("the firmware builds");
    let link = folder.path().join(name);
    let mut uno = weeder();
    uno.arg("virtual-uno").arg("--elf").arg(elf).arg("--link").arg(&link).args(options).stdout(Stdio::piped());
    let mut process = uno.spawn().expect("cargo has built it");
    let mut line = String::new();
    BufReader::new(process.stdout.take().expect("it is piped")).read_line(&mut line).expect("it says where it is");
    assert!(!line.is_empty(), "the virtual Uno has ended");
    (Running(process), link)
}

/// `weeder serve`.
struct Served {
    process: Running,
    /// Its two hosts, and the code.
    here: String,
    lan: String,
    code: String,
    /// The output for the operator.
    told: Arc<Mutex<String>>,
    agent: Agent,
}

/// Serves these ports, also in the network.
fn serve(folder: &TempDir, ports: &[&Path], options: &[&str]) -> Served {
    let mut command = weeder();
    command.arg("serve");
    serve_with(command, folder, ports, &[&LAN, options].concat())
}

/// The same by a command that ends with `serve`.
fn serve_with(mut serve: Command, folder: &TempDir, ports: &[&Path], options: &[&str]) -> Served {
    serve.args(["--http-port", "0", "--page"]).arg(folder.path().join("page")).args(options);
    for port in ports {
        serve.arg("--port").arg(port);
    }
    let mut process = serve.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("cargo has built it");
    let mut lines = BufReader::new(process.stdout.take().expect("it is piped")).lines().map_while(Result::ok);
    let mut next = || lines.next().expect("it says where the page is");
    let (here, lan) = (next(), next());
    let host = |line: &str| line["http://".len()..].split('/').next().expect("it is an address").to_owned();
    let code = lan.split('#').nth(1).expect("it has the code").split(' ').next().expect("it has an end").to_owned();
    let spelled = format!("{}-{}", &code[..4], &code[4..]);
    assert!(next().ends_with(&spelled), "{code}");
    let told = Arc::new(Mutex::new(String::new()));
    let (heard, stderr) = (Arc::clone(&told), process.stderr.take().expect("it is piped"));
    thread::spawn(move || {
        for line in BufReader::new(stderr).lines().map_while(Result::ok) {
            heard.lock().expect("no thread has panicked").push_str(&(line + "\n"));
        }
    });
    let agent = Agent::config_builder().http_status_as_error(false).max_redirects(0).timeout_global(Some(PATIENCE));
    Served { process: Running(process), here: host(&here), lan: host(&lan), code, told, agent: agent.build().into() }
}

impl Served {
    /// Whether the output for the operator contains these words.
    fn has_reported(&self, words: &str) -> bool {
        self.told.lock().expect("no thread has panicked").contains(words)
    }

    #[track_caller]
    fn wait_until_told(&self, words: &str) {
        for _ in 0..PATIENCE.as_millis() / LOOK.as_millis() {
            if self.has_reported(words) {
                return;
            }
            thread::sleep(LOOK);
        }
        panic!("{words:?} is not told, but {:?}", self.told.lock().expect("no thread has panicked"));
    }

    /// Sends a GET request. Returns the status and the body.
    fn get(&self, host: &str, path: &str, cookie: &str) -> (u16, String) {
        let answer = self.agent.get(format!("http://{host}{path}")).header("Cookie", cookie).call();
        let mut answer = answer.expect("it answers");
        (answer.status().as_u16(), answer.body_mut().read_to_string().expect("it is text"))
    }

    /// Sends a POST request as the host's own page does. A busy computer is too late at times, so it tries again.
    fn post(&self, host: &str, path: &str, cookie: &str, body: &str) -> (u16, String) {
        loop {
            let answer = self.post_after(&self.seen(host, cookie), host, path, cookie, body);
            if answer.0 != 412 {
                return answer;
            }
        }
    }

    /// The number of a message that is sent now; empty if this client gets none.
    fn seen(&self, host: &str, cookie: &str) -> String {
        let mut events = Events::open(host, cookie, 0);
        events.next().map(|_| events.number).unwrap_or_default()
    }

    /// Sends a POST request of a client that has seen this message last.
    fn post_after(&self, seen: &str, host: &str, path: &str, cookie: &str, body: &str) -> (u16, String) {
        let request = self.agent.post(format!("http://{host}{path}")).header("Weeder-Seen", seen);
        let request = request.header("Origin", format!("http://{host}")).header("Cookie", cookie);
        let mut answer = request.send(body).expect("it answers");
        (answer.status().as_u16(), answer.body_mut().read_to_string().expect("it is text"))
    }

    /// Types a line to the first machine.
    fn command(&self, host: &str, cookie: &str, line: &str) -> (u16, String) {
        self.post(host, "/machines/0/command", cookie, line)
    }

    /// Sends a code. Returns also the cookie, if it was right.
    fn try_code(&self, code: &str) -> (u16, String, Option<String>) {
        let request =
            self.agent.post(format!("http://{}/pair", self.lan)).header("Origin", format!("http://{}", self.lan));
        let mut answer = request.send(code).expect("it answers");
        let cookie = answer.headers().get("Set-Cookie").map(|value| value.to_str().expect("it is text").to_owned());
        (answer.status().as_u16(), answer.body_mut().read_to_string().expect("it is text"), cookie)
    }

    /// Pairs a phone: its cookie.
    fn pair(&self) -> String {
        let (status, said, cookie) = self.try_code(&self.code);
        assert_eq!(status, 204, "{said}");
        let cookie = cookie.expect("it is paired");
        let (token, rules) = cookie.split_once("; ").expect("it has rules");
        assert_eq!(rules, "HttpOnly; SameSite=Strict; Path=/");
        token.to_owned()
    }

    /// Prepares a connected machine in HOLD: saves its settings, which clears a new board's alarm.
    fn make_ready(&self, machine: usize) {
        let mut events = Events::open(&self.here, "", 0);
        events.wait_for(|message| message["machine"] == machine && message["is"] == "status");
        for line in ["save", "clear"] {
            let (status, said) = self.post(&self.here, &format!("/machines/{machine}/command"), "", line);
            assert_eq!((status, said.as_str()), (200, "ok\n"), "{line}");
        }
        events.wait_for(|message| message["machine"] == machine && has(message, "said", "state=hold"));
    }
}

/// Whether a message has this in a field.
fn has(message: &Value, field: &str, words: &str) -> bool {
    message[field].as_str().is_some_and(|text| text.contains(words))
}

/// Server-sent events, over a socket of their own.
struct Events {
    stream: BufReader<TcpStream>,
    /// The number of the last message.
    number: String,
}

impl Events {
    /// Opens the event stream. `room` is the size of the receive buffer; 0 is the system's default.
    fn open(host: &str, cookie: &str, room: usize) -> Self {
        let mut stream = connect(host, room);
        write!(stream, "GET /events HTTP/1.1\r\nHost: {host}\r\nCookie: {cookie}\r\n\r\n").expect("it listens");
        Self { stream: BufReader::new(stream), number: String::new() }
    }

    /// The next message. `None` at the end.
    fn next(&mut self) -> Option<Value> {
        loop {
            let mut line = String::new();
            if self.stream.read_line(&mut line).expect("something comes") == 0 || line.starts_with("HTTP/1.1 4") {
                return None;
            }
            if let Some(number) = line.strip_prefix("id: ") {
                number.trim_end().clone_into(&mut self.number);
            }
            if let Some(message) = line.strip_prefix("data: ") {
                return Some(serde_json::from_str(message).expect("it is JSON"));
            }
        }
    }

    #[track_caller]
    fn wait_for(&mut self, is_it: impl Fn(&Value) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while let Some(message) = self.next() {
            if is_it(&message) {
                return;
            }
            assert!(Instant::now() < deadline, "that does not come, but {message}");
        }
        panic!("the events have ended before that came");
    }
}

fn connect(host: &str, room: usize) -> TcpStream {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None).expect("there are sockets");
    if room > 0 {
        socket.set_recv_buffer_size(room).expect("it may be small");
    }
    let address: SocketAddr = host.parse().expect("it is an address");
    socket.connect(&address.into()).expect("it listens");
    socket.set_read_timeout(Some(PATIENCE)).expect("it may be given up");
    socket.into()
}

/// Sends a request unchanged. Returns the status.
fn raw(address: &str, head: &str) -> u16 {
    let mut stream = connect(address, 0);
    stream.write_all(head.as_bytes()).expect("it listens");
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line).expect("it answers");
    line.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or_else(|| panic!("{line:?} is no answer"))
}

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
    let folder = folder();
    let (_uno, port) = uno(&folder, "uno", &["--stand"]);
    let served = serve(&folder, &[&port], &[]);
    served.make_ready(0);
    assert_eq!(served.command(&served.here, "", "start").0, 200);

    for cookie in
        ["", "weeder=", &format!("weeder={}", "0".repeat(64)), "weeder=; weeder=1", &format!("weeder={}", served.code)]
    {
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
    let folder = folder();
    let (_uno, port) = uno(&folder, "uno", &["--stand"]);
    let served = serve(&folder, &[&port], &[]);
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
    let folder = folder();
    let (_uno, port) = uno(&folder, "uno", &["--stand"]);
    let served = serve(&folder, &[&port], &[]);
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
fn a_paired_phone_watches_and_holds_and_nothing_else_unless_the_operator_allowed_it() {
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
fn clients_that_never_read_are_let_go_of_and_hold_up_neither_the_machine_nor_the_others() {
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
fn a_pulled_port_is_reported_and_opened_again_and_the_other_machine_works_on() {
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
        let obeyed: Vec<bool> = said["machines"]
            .as_array()
            .expect("it has them")
            .iter()
            .map(|machine| machine["error"].is_null())
            .collect();
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
    let mut serve = weeder();
    serve.arg("serve").args(["--http-port", "0", "--open", "--page"]).arg(folder.path().join("page"));
    serve
        .env("PATH", format!("{}:/usr/bin:/bin", folder.path().display()))
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    let mut process = serve.spawn().expect("cargo has built it");
    let mut line = String::new();
    BufReader::new(process.stdout.take().expect("it is piped")).read_line(&mut line).expect("it says where it is");
    let _running = Running(process);
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
        let output = weeder().arg("serve").arg("--page").arg(page).args(words).output().expect("cargo has built it");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(reason), "{words:?}: {said}");
    }
}
