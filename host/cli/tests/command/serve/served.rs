//! The processes of the tests, and their clients.

use crate::common::{Running, command};
use serde_json::Value;
use socket2::{Domain, Socket, Type};
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use uno_run::firmware;
use ureq::Agent;

/// Timeout of an answer: a hundred times the time on a busy PC.
pub(super) const PATIENCE: Duration = Duration::from_secs(120);

/// Time between two looks.
pub(super) const LOOK: Duration = Duration::from_millis(50);

/// Bytes of the page's script here: more than the buffers for a client that does not read.
pub(super) const SCRIPT_BYTES: usize = 8 << 20;

/// The address in the network, and the options that serve there.
pub(super) const LAN: [&str; 2] = ["--lan", "127.0.0.2"];

/// A folder with a page and a file of the ports' names.
pub(super) fn folder() -> TempDir {
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
pub(super) fn uno(folder: &TempDir, name: &str, options: &[&str]) -> (Running, PathBuf) {
    let elf = firmware::build().expect("the firmware builds");
    let link = folder.path().join(name);
    let mut uno = command(&["virtual-uno", "--elf"]);
    let (uno, _) = Running::with_first_line(uno.arg(elf).arg("--link").arg(&link).args(options));
    (uno, link)
}

pub(super) struct Served {
    pub(super) process: Running,
    /// Its two hosts, and the code.
    pub(super) here: String,
    pub(super) lan: String,
    pub(super) code: String,
    /// The output for the operator.
    pub(super) told: Arc<Mutex<String>>,
    pub(super) agent: Agent,
}

/// Serves these ports, also in the network.
pub(super) fn serve(folder: &TempDir, ports: &[&Path], options: &[&str]) -> Served {
    serve_with(command(&["serve"]), folder, ports, &[&LAN, options].concat())
}

/// Serves a standing virtual Uno that is ready. Returns also the Uno, and its folder.
pub(super) fn serve_uno(uno_options: &[&str], options: &[&str]) -> (Served, (Running, TempDir)) {
    let folder = folder();
    let (uno, port) = uno(&folder, "uno", &[&["--stand"], uno_options].concat());
    let served = serve(&folder, &[&port], options);
    served.make_ready(0);
    (served, (uno, folder))
}

/// The same by a command that ends with `serve`.
pub(super) fn serve_with(serve: Command, folder: &TempDir, ports: &[&Path], options: &[&str]) -> Served {
    serve_telling(Stdio::piped(), serve, folder, ports, options)
}

/// The same, with this output for the operator. One that is not piped is not read.
pub(super) fn serve_telling(
    operator: Stdio,
    mut serve: Command,
    folder: &TempDir,
    ports: &[&Path],
    options: &[&str],
) -> Served {
    serve.args(["--http-port", "0", "--page"]).arg(folder.path().join("page")).args(options);
    for port in ports {
        serve.arg("--port").arg(port);
    }
    let mut process = Running::start(serve.stdout(Stdio::piped()).stderr(operator));
    let mut lines = BufReader::new(process.0.stdout.take().expect("it is piped")).lines().map_while(Result::ok);
    let mut next = || lines.next().expect("it says where the page is");
    let (here, lan) = (next(), next());
    let host = |line: &str| line["http://".len()..].split('/').next().expect("it is an address").to_owned();
    let code = lan.split('#').nth(1).expect("it has the code").split(' ').next().expect("it has an end").to_owned();
    let spelled = format!("{}-{}", &code[..4], &code[4..]);
    assert!(next().ends_with(&spelled), "{code}");
    let told = Arc::new(Mutex::new(String::new()));
    let (heard, stderr) = (Arc::clone(&told), process.0.stderr.take());
    thread::spawn(move || {
        for line in stderr.into_iter().flat_map(|stderr| BufReader::new(stderr).lines().map_while(Result::ok)) {
            heard.lock().expect("no thread has panicked").push_str(&(line + "\n"));
        }
    });
    let agent = Agent::config_builder().http_status_as_error(false).max_redirects(0).timeout_global(Some(PATIENCE));
    Served { process, here: host(&here), lan: host(&lan), code, told, agent: agent.build().into() }
}

impl Served {
    #[track_caller]
    pub(super) fn wait_until_told(&self, words: &str) {
        for _ in 0..PATIENCE.as_millis() / LOOK.as_millis() {
            if self.told.lock().expect("no thread has panicked").contains(words) {
                return;
            }
            thread::sleep(LOOK);
        }
        panic!("{words:?} is not told, but {:?}", self.told.lock().expect("no thread has panicked"));
    }

    /// Sends a GET request. Returns the status and the body.
    pub(super) fn get(&self, host: &str, path: &str, cookie: &str) -> (u16, String) {
        let answer = self.agent.get(format!("http://{host}{path}")).header("Cookie", cookie).call();
        let mut answer = answer.expect("it answers");
        (answer.status().as_u16(), answer.body_mut().read_to_string().expect("it is text"))
    }

    /// Sends a POST request as the host's own page does. A busy computer is too late at times, so it tries again.
    pub(super) fn post(&self, host: &str, path: &str, cookie: &str, body: &str) -> (u16, String) {
        loop {
            let answer = self.post_after(&self.seen(host, cookie), host, path, cookie, body);
            if answer.0 != 412 {
                return answer;
            }
        }
    }

    /// The number of a message that is sent now; empty if this client gets none.
    pub(super) fn seen(&self, host: &str, cookie: &str) -> String {
        let mut events = Events::open(host, cookie, 0);
        events.next().map(|_| events.number).unwrap_or_default()
    }

    /// Sends a POST request of a client that has seen this message last.
    pub(super) fn post_after(&self, seen: &str, host: &str, path: &str, cookie: &str, body: &str) -> (u16, String) {
        let request = self.agent.post(format!("http://{host}{path}")).header("Weeder-Seen", seen);
        let request = request.header("Origin", format!("http://{host}")).header("Cookie", cookie);
        let mut answer = request.send(body).expect("it answers");
        (answer.status().as_u16(), answer.body_mut().read_to_string().expect("it is text"))
    }

    /// Types a line to the first machine.
    pub(super) fn command(&self, host: &str, cookie: &str, line: &str) -> (u16, String) {
        self.post(host, "/machines/0/command", cookie, line)
    }

    /// Sends a code. Returns also the cookie, if it was right.
    pub(super) fn try_code(&self, code: &str) -> (u16, String, Option<String>) {
        let request =
            self.agent.post(format!("http://{}/pair", self.lan)).header("Origin", format!("http://{}", self.lan));
        let mut answer = request.send(code).expect("it answers");
        let cookie = answer.headers().get("Set-Cookie").map(|value| value.to_str().expect("it is text").to_owned());
        (answer.status().as_u16(), answer.body_mut().read_to_string().expect("it is text"), cookie)
    }

    pub(super) fn pair(&self) -> String {
        let (status, said, cookie) = self.try_code(&self.code);
        assert_eq!(status, 204, "{said}");
        let cookie = cookie.expect("it is paired");
        let (token, rules) = cookie.split_once("; ").expect("it has rules");
        assert_eq!(rules, "HttpOnly; SameSite=Strict; Path=/; Max-Age=31536000");
        token.to_owned()
    }

    /// Prepares a connected machine in HOLD: saves its settings, which clears a new board's alarm.
    pub(super) fn make_ready(&self, machine: usize) {
        let mut events = Events::open(&self.here, "", 0);
        events.wait_for(|message| message["machine"] == machine && message["is"] == "status");
        for line in ["save", "clear"] {
            let (status, said) = self.post(&self.here, &format!("/machines/{machine}/command"), "", line);
            assert_eq!((status, said.as_str()), (200, "ok\n"), "{line}");
        }
        events.wait_for(|message| message["machine"] == machine && has(message, "said", "state=hold"));
    }
}

pub(super) fn has(message: &Value, field: &str, words: &str) -> bool {
    message[field].as_str().is_some_and(|text| text.contains(words))
}

/// Server-sent events, over a socket of their own.
pub(super) struct Events {
    pub(super) stream: BufReader<TcpStream>,
    /// The number of the last message.
    pub(super) number: String,
}

impl Events {
    /// Opens the event stream. `room` is the size of the receive buffer; 0 is the system's default.
    pub(super) fn open(host: &str, cookie: &str, room: usize) -> Self {
        let mut stream = connect(host, room);
        write!(stream, "GET /events HTTP/1.1\r\nHost: {host}\r\nCookie: {cookie}\r\n\r\n").expect("it listens");
        Self { stream: BufReader::new(stream), number: String::new() }
    }

    /// The next message. `None` at the end.
    pub(super) fn next(&mut self) -> Option<Value> {
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
    pub(super) fn wait_for(&mut self, is_it: impl Fn(&Value) -> bool) {
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

pub(super) fn connect(host: &str, room: usize) -> TcpStream {
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
pub(super) fn raw(address: &str, head: &str) -> u16 {
    let mut stream = connect(address, 0);
    stream.write_all(head.as_bytes()).expect("it listens");
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line).expect("it answers");
    line.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or_else(|| panic!("{line:?} is no answer"))
}
