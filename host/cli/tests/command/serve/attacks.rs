//! HOLD while other connections attack the server. The attackers use this computer's loopback addresses, and 1,000
//! connections at most. The time of HOLD is printed, not asserted: `cargo test -p weeder-cli --test command attack --
//! --nocapture`.

use super::*;
use std::collections::VecDeque;
use std::net::{Ipv4Addr, Shutdown};
use std::sync::atomic::{AtomicBool, Ordering};

const ATTACKERS: [[u8; 4]; 4] = [[127, 0, 0, 3], [127, 0, 0, 4], [127, 0, 0, 5], [127, 0, 0, 6]];

/// Simultaneous connections of an attack.
const AT_ONCE: usize = 200;

/// Total connections of an attack.
const IN_ALL: usize = 1000;

/// A connection from an address.
fn connect_from(source: [u8; 4], host: &str) -> TcpStream {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None).expect("there are sockets");
    socket.bind(&SocketAddr::from((Ipv4Addr::from(source), 0)).into()).expect("it is an address of loopback");
    let address: SocketAddr = host.parse().expect("it is an address");
    socket.connect(&address.into()).expect("it listens");
    socket.set_read_timeout(Some(PATIENCE)).expect("it may be given up");
    socket.into()
}

/// Whether the server has left it open.
fn is_open(stream: &TcpStream) -> bool {
    stream.set_nonblocking(true).expect("it may not wait");
    let mut buffer = [0; 4096];
    loop {
        match (&*stream).read(&mut buffer) {
            Ok(0) => return false,
            Ok(_) => {}
            Err(error) => return error.kind() == ErrorKind::WouldBlock,
        }
    }
}

pub(super) struct Client<'a> {
    pub(super) stream: BufReader<TcpStream>,
    host: &'a str,
    cookie: &'a str,
}

impl<'a> Client<'a> {
    pub(super) fn open(host: &'a str, cookie: &'a str) -> Self {
        Self { stream: BufReader::new(connect(host, 0)), host, cookie }
    }

    /// Sends a request with these further lines in its head. Does not wait for the answer.
    pub(super) fn send(&mut self, method: &str, path: &str, head: &str, body: &str) {
        let rest = format!("{head}Content-Length: {}\r\n\r\n{body}", body.len());
        let text = request(self.host, self.cookie, method, path, &rest);
        self.stream.get_mut().write_all(text.as_bytes()).expect("it is open");
    }

    /// Sends a request. Returns the status and the body.
    fn ask(&mut self, method: &str, path: &str, body: &str) -> (u16, String) {
        self.send(method, path, "", body);
        answer(&mut self.stream)
    }

    fn command(&mut self, line: &str) -> (u16, String) {
        self.ask("POST", "/machines/0/command", line)
    }
}

/// A request's head up to `rest`.
pub(super) fn request(host: &str, cookie: &str, method: &str, path: &str, rest: &str) -> String {
    format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nCookie: {cookie}\r\n{rest}")
}

/// An answer's status and body.
pub(super) fn answer(stream: &mut impl BufRead) -> (u16, String) {
    let (mut status, mut length) = (0, 0);
    loop {
        let mut line = String::new();
        stream.read_line(&mut line).expect("it answers");
        let line = line.trim_end().to_ascii_lowercase();
        if let Some(words) = line.strip_prefix("http/1.1 ") {
            status = words[..3].parse().expect("it is a number");
        } else if let Some(number) = line.strip_prefix("content-length: ") {
            length = number.parse().expect("it is a number");
        } else if line.is_empty() {
            break;
        }
    }
    let mut body = vec![0; length];
    stream.read_exact(&mut body).expect("it is whole");
    (status, String::from_utf8(body).expect("it is text"))
}

/// A continuous attack: it replaces each connection that the server closes.
fn attack<'a, T>(host: &'a str, text: &'a str, meanwhile: impl FnOnce() -> T) -> T {
    let is_over = AtomicBool::new(false);
    let (stands, has_begun) = std::sync::mpsc::channel();
    let is_over = &is_over;
    thread::scope(|scope| {
        let attackers = scope.spawn(move || {
            let mut open = VecDeque::new();
            for number in 0..IN_ALL {
                if open.len() == AT_ONCE {
                    open.pop_front();
                }
                let stream = connect_from(ATTACKERS[number % 4], host);
                // The server may close it at once.
                let _ = (&stream).write_all(text.as_bytes());
                open.push_back(stream);
                if number + 1 == AT_ONCE {
                    stands.send(()).expect("it is waited for");
                }
                if is_over.load(Ordering::Relaxed) {
                    break;
                }
                if number + 1 >= AT_ONCE {
                    thread::sleep(Duration::from_millis(2));
                }
            }
            let count = || open.iter().filter(|stream| is_open(stream)).count();
            assert!(count() > 0, "the attack is over");
            // Once the server has accepted all connections, the attacker must have no more than its share.
            for _ in 0..PATIENCE.as_millis() / LOOK.as_millis() {
                if count() <= 64 {
                    return;
                }
                thread::sleep(LOOK);
            }
            panic!("{} are open", count());
        });
        has_begun.recv().expect("the attack stands");
        let came = meanwhile();
        is_over.store(true, Ordering::Relaxed);
        attackers.join().expect("no thread has panicked");
        came
    })
}

/// Holds the machine while many connections send a text to each door. HOLD comes from a phone and from the computer,
/// over open and new connections. The text is made for a host, with the cookie of another paired phone. An attacker at
/// the computer itself takes the places of its own open connections, unless `keeps_open`.
fn hold_is_obeyed_under(name: &str, keeps_open: bool, text: impl Fn(&str, &str) -> String) {
    let (served, _uno) = serve_uno(&[], &["--allow-start"]);
    let (phone, other) = (served.pair(), served.pair());
    for attacked in [&served.lan, &served.here] {
        let mut watching = Events::open(&served.lan, &phone, 0);
        watching.wait_for(|message| message["is"] == "status");
        let askers = [("a phone", &served.lan, phone.as_str()), ("the computer", &served.here, "")];
        let open = askers.map(|(who, host, cookie)| {
            let mut client = Client::open(host, cookie);
            assert_eq!(client.ask("GET", "/machines", "").0, 200);
            (format!("{who}, over its open connection"), client)
        });
        let starts = if attacked == &served.lan { (&served.here, "") } else { (&served.lan, phone.as_str()) };
        let times = attack(attacked, &text(attacked, &other), || {
            let mut hold = |(who, mut client): (String, Client)| {
                assert_eq!(served.command(starts.0, starts.1, "start"), (200, "ok\n".to_owned()), "{name}: {who}");
                let begun = Instant::now();
                assert_eq!(client.command("hold"), (200, "ok\n".to_owned()), "{name}: {who}");
                let time = begun.elapsed();
                watching.wait_for(|message| message["is"] == "event" && has(message, "said", "state is=hold"));
                (who, time)
            };
            let open = open.into_iter().filter(|(_, client)| keeps_open || client.host != attacked);
            let new = askers.into_iter().map(|(who, host, cookie)| {
                // Opened only now: it must get through during the attack.
                (format!("{who}, over a new one"), Client::open(host, cookie))
            });
            open.chain(new).map(&mut hold).collect::<Vec<_>>()
        });
        for (who, time) in times {
            eprintln!("{name} at {attacked}: HOLD from {who} after {} ms", time.as_millis());
        }
    }
}

#[test]
fn hold_is_obeyed_under_an_attack_of_half_open_connections() {
    hold_is_obeyed_under("half open", true, |host, _| format!("GET / HTTP/1.1\r\nHost: {host}"));
}

/// The server accepts all of them before it reads from any, so that each place is taken and lost at once.
#[test]
fn a_hold_is_read_despite_a_crowd_of_half_open_connections() {
    let (served, _uno) = serve_uno(&[], &["--allow-start"]);
    let phone = served.pair();
    for (host, cookie) in [(&served.lan, phone.as_str()), (&served.here, "")] {
        assert_eq!(served.command(&served.here, "", "start").0, 200);
        served.process.signal("-STOP");
        let half_open = |number: u8| {
            let stream = connect_from([127, 0, 1, number], host);
            (&stream).write_all(b"GET / HTTP/1.1\r\n").expect("it is connected");
            stream
        };
        let mut crowd: Vec<TcpStream> = (1..100).map(half_open).collect();
        let mut client = BufReader::new(connect(host, 0));
        let hold = request(host, cookie, "POST", "/machines/0/command", "Content-Length: 4\r\n\r\nhold");
        client.get_mut().write_all(hold.as_bytes()).expect("it is connected");
        // Its client sends nothing more, as one that gives up or ends.
        client.get_mut().shutdown(Shutdown::Write).expect("it is connected");
        crowd.extend((100..250).map(half_open));
        served.process.signal("-CONT");
        assert_eq!(answer(&mut client), (200, "ok\n".to_owned()));
    }
}

#[test]
fn hold_is_obeyed_under_an_attack_of_event_streams() {
    hold_is_obeyed_under("streams", true, |host, cookie| request(host, cookie, "GET", "/events", "\r\n"));
}

#[test]
fn hold_is_obeyed_under_an_attack_of_slow_bodies() {
    hold_is_obeyed_under("slow bodies of a paired phone", true, |host, cookie| {
        request(host, cookie, "POST", "/machines/0/command", "Content-Length: 4\r\n\r\nh")
    });
}

#[test]
fn hold_is_obeyed_under_an_attack_of_slow_codes() {
    hold_is_obeyed_under("slow codes", true, |host, _| {
        request(host, "", "POST", "/pair", "Content-Length: 8\r\n\r\n0")
    });
}

#[test]
fn hold_is_obeyed_under_an_attack_of_clients_that_ask_and_stay() {
    hold_is_obeyed_under("questions", false, |host, cookie| {
        request(host, cookie, "GET", "/machines", "\r\n").repeat(10)
    });
}

#[test]
fn hold_is_obeyed_under_an_attack_of_files_that_are_not_read() {
    hold_is_obeyed_under("files", false, |host, cookie| request(host, cookie, "GET", "/page.js", "\r\n"));
}

#[test]
fn a_request_in_chunks_or_with_two_lengths_is_refused() {
    let (served, _uno) = serve_uno(&[], &[]);
    let phone = served.pair();
    let send =
        |host: &str, cookie: &str, rest: &str| raw(host, &request(host, cookie, "POST", "/machines/0/command", rest));
    const CHUNKED: &str = "Transfer-Encoding: chunked\r\n\r\n";
    for (host, cookie) in [(&served.lan, phone.as_str()), (&served.here, "")] {
        assert_eq!(served.command(&served.here, "", "start").0, 200);
        for chunk in [
            "4\r\nhold\r\n0\r\n\r\n",
            "hold\r\n0\r\n\r\n",
            "-4\r\nhold\r\n0\r\n\r\n",
            "4hold\r\n0\r\n\r\n",
            "4\r\nholdhold\r\n0\r\n\r\n",
            "4\r\nhold\r\nz\r\n\r\n",
            "10000000000000004\r\nhold\r\n0\r\n\r\n",
            "fffffffffffffffffffff\r\nhold\r\n0\r\n\r\n",
            "\r\n\r\n",
            // The longest possible chunk, which has not ended.
            "ffffffffffffffff\r\nhold\r\n0\r\n\r\n",
        ] {
            assert_eq!(send(host, cookie, &format!("{CHUNKED}{chunk}")), 400, "{chunk:?}");
        }
        for lengths in [
            "Content-Length: 4\r\nTransfer-Encoding: chunked",
            "Transfer-Encoding: chunked\r\nContent-Length: 4",
            "CONTENT-LENGTH:4\r\ntransfer-encoding:chunked",
            "Content-Length: 14\r\nContent-Length: 14\r\nTransfer-Encoding: chunked",
            "Transfer-Encoding: chunked\r\nContent-Length: nothing",
            "Transfer-Encoding: identity\r\nContent-Length: 4",
            "Transfer-Encoding: chunked, identity",
            "Content-Length: 4\r\nContent-Length: 5",
            "Content-Length: 4, 5",
            "Content-Length: +4",
            "Content-Length: 18446744073709551620",
        ] {
            let head = format!("{lengths}\r\n\r\n4\r\nhold\r\n0\r\n\r\n");
            assert_eq!(send(host, cookie, &head), 400, "{lengths}");
            // After another request on the same connection, and sent together with it.
            let mut client = Client::open(host, cookie);
            let twice = request(host, cookie, "GET", "/machines", "\r\n")
                + &request(host, cookie, "POST", "/machines/0/command", &head);
            client.stream.get_mut().write_all(twice.as_bytes()).expect("it is open");
            assert_eq!([answer(&mut client.stream).0, answer(&mut client.stream).0], [200, 400], "{lengths}");
        }
        let (status, said) = served.command(&served.here, "", "status");
        assert!(status == 200 && said.starts_with("state=work "), "{status} {said}");
        assert_eq!(served.command(host, cookie, "hold").0, 200);
    }
}

/// Connections and other files that a process has open.
fn files(process: &Running) -> usize {
    fs::read_dir(format!("/proc/{}/fd", process.0.id())).expect("it runs").count()
}

#[test]
fn a_stream_that_hardly_reads_is_closed_before_buffers_fill() {
    let (served, _uno) = serve_uno(&[], &[]);
    let phone = served.pair();
    // Long enough for the timeouts of all previous requests.
    let mut watching = Events::open(&served.lan, &phone, 0);
    let mut least = files(&served.process);
    for _ in 0..150 {
        watching.next().expect("it goes on");
        least = least.min(files(&served.process));
    }
    for reads in [false, true] {
        let mut stream = connect(&served.lan, 4096);
        stream.write_all(request(&served.lan, &phone, "GET", "/events", "\r\n").as_bytes()).expect("it listens");
        while files(&served.process) == least {
            thread::sleep(LOOK);
        }
        let (begun, mut heard) = (Instant::now(), 0);
        while files(&served.process) > least {
            heard += watching.next().expect("it goes on").to_string().len();
            if reads {
                let _ = stream.read(&mut [0]);
            }
        }
        eprintln!("closed after {} ms, when others had {heard} bytes; reads: {reads}", begun.elapsed().as_millis());
        assert!(heard < 32 << 10, "{heard}");
    }
}
