//! Serves the page over http: from the computer with the serial ports of one or more machines to a phone in the cab.
//!
//! [`Server::open`] binds the addresses and starts the machines. [`Server::run`] serves until it is stopped. The
//! decisions are in modules without sockets and clocks. `door` decides which requests come in. `pairing` decides
//! which phones may use the network. `rules` decides which commands may be typed from where. `machine` talks to one
//! machine in its own thread. `hub` sends the machines' output to all pages. `knowledge` refuses commands that come too
//! late. `routes` and this file connect these modules to the network.
//!
//! http is not encrypted: use it only in a network in which others may read. The server flashes nothing, and serves no
//! files except the page's own.

mod door;
mod hub;
mod knowledge;
mod machine;
pub mod page;
mod pairing;
mod places;
mod routes;
mod rules;

use self::door::Door;
use self::hub::Hub;
use self::machine::Machine;
use self::page::Page;
use self::pairing::{Code, Pairing};
use self::places::Places;
use self::routes::{Served, Visitor, routes};
use axum::Extension;
use axum::Router;
use futures_util::future::{Either, select};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use link::moment::Moment;
use parking_lot::Mutex;
#[cfg(any(target_os = "linux", target_os = "android"))]
use socket2::SockRef;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use thiserror::Error;
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::runtime::{self, Runtime};
use tokio::task::yield_now;
use tokio::time::sleep;
use tokio_io_timeout::TimeoutStream;

pub use self::machine::Tell;
pub use link::connection::Opener;

/// Time limit for a request's head, including the wait before it.
const HEAD_TIME: Duration = Duration::from_secs(10);

/// Greatest size of a request's head, and of a buffered answer, in bytes, besides the system's buffer.
const HEAD_BYTES: usize = 8 * 1024;

/// Size of the system's send buffer, as the system counts it.
const UNREAD_BYTES: u32 = 16 * 1024;

/// Time in which a client must read at least one byte of a waiting answer.
const READER_TIME: Duration = Duration::from_secs(5);

/// Greatest number of connections that wait to be accepted. A client whose first packet is dropped sends it again only
/// after a second.
const BACKLOG: u32 = 1024;

/// Turns of a connection's task in which it reads what has come. Its head, its body and the door take some.
const TURNS_TO_READ: usize = 16;

/// Time between two checks whether to stop.
const LOOK: Duration = Duration::from_millis(100);

/// The machines and the addresses to serve.
pub struct Setup {
    /// The machines: a name, and a function that opens its link.
    pub machines: Vec<(String, Opener)>,
    /// The page.
    pub page: Page,
    /// The TCP port; 0 takes a free one.
    pub port: u16,
    /// This computer's address in the network, to serve there as well.
    pub lan: Option<Ipv4Addr>,
    /// Whether paired phones may start the machines.
    pub may_start: bool,
    /// Prints a message for the operator.
    pub tell: Tell,
}

/// The errors of starting the server.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum ServeError {
    #[error("this computer is in no network: join one, or name its address in one, as in `--lan 192.168.4.1`")]
    NoNetwork,
    #[error("this computer has several addresses: choose the one of the phone's network, as in `--lan {}`, of {}",
        .0[0], .0.iter().map(Ipv4Addr::to_string).collect::<Vec<_>>().join(", "))]
    SeveralNetworks(Vec<Ipv4Addr>),
    /// It means all networks, or only this computer.
    #[error("{0} cannot be opened by a phone: name this computer's address in the phone's network, or use --lan alone")]
    NoAddress(Ipv4Addr),
    #[error("port {} of {} is in use: end the other program, or choose another port by --http-port", .0.port(), .0.ip())]
    InUse(SocketAddr),
    #[error("{0} is no address of this computer: use --lan alone, or name one of its addresses")]
    NotMine(Ipv4Addr),
    #[error("no connection can be taken at {address}")]
    NotBound { address: SocketAddr, source: io::Error },
    #[error("the system gives no {0}")]
    System(&'static str, #[source] io::Error),
}

/// Served machines.
pub struct Server {
    runtime: Runtime,
    /// This computer's door, and the network's.
    doors: Vec<(TcpListener, SocketAddr, Door)>,
    routes: Router,
    code: Code,
}

impl Server {
    /// Takes the addresses, and starts to talk to the machines. A machine that is not there is waited for.
    ///
    /// # Errors
    /// If an address cannot be had.
    pub fn open(setup: Setup) -> Result<Self, ServeError> {
        let runtime = runtime::Builder::new_current_thread().enable_io().enable_time().build();
        let runtime = runtime.map_err(|error| ServeError::System("way to wait for sockets", error))?;
        let code = Code::new(random()?);

        let doors = {
            let _inside = runtime.enter();
            listen(setup.lan, setup.port, setup.may_start)?
        };
        // A page keeps these numbers as text, so they may have any size.
        let first = u64::from(u32::from_ne_bytes(random()?)) << 20;
        let hub = Arc::new(Hub::new(setup.machines.len(), first, Box::new(Moment::now)));
        let start =
            |(number, (name, open))| Machine::start(number, name, open, Arc::clone(&hub), Arc::clone(&setup.tell));
        let machines = setup.machines.into_iter().enumerate().map(start).collect();
        let pairing = Mutex::new(Pairing::new(code.clone()));
        let routes = routes(Arc::new(Served { page: setup.page, machines, hub, pairing, tell: setup.tell }));
        Ok(Self { runtime, doors, routes, code })
    }

    /// The page's address on this computer.
    pub fn here(&self) -> SocketAddr {
        self.doors[0].1
    }

    /// The page's address for a phone, and the code for pairing.
    pub fn lan(&self) -> Option<(SocketAddr, &Code)> {
        self.doors.get(1).map(|&(_, address, _)| (address, &self.code))
    }

    /// Serves until `stop` is set.
    pub fn run(self, stop: &AtomicBool) {
        for (listener, _, door) in self.doors {
            self.runtime.spawn(attend(listener, Arc::new(door), Places::default(), self.routes.clone()));
        }
        self.runtime.block_on(async {
            while !stop.load(Ordering::Relaxed) {
                sleep(LOOK).await;
            }
        });
        // Open connections are closed without waiting for their clients.
        self.runtime.shutdown_background();
    }
}

/// Bytes from the system's random source.
fn random<const LENGTH: usize>() -> Result<[u8; LENGTH], ServeError> {
    let mut bytes = [0; LENGTH];
    getrandom::fill(&mut bytes).map_err(|error| ServeError::System("randomness", error.into()))?;
    Ok(bytes)
}

/// This computer's address in its network, where it is in one.
///
/// # Errors
/// If it is in none, or in several.
pub fn find_lan() -> Result<Ipv4Addr, ServeError> {
    let addresses = if_addrs::get_if_addrs().map_err(|error| ServeError::System("list of its addresses", error))?;
    // The list of Windows also has adapters that are down.
    let up = addresses.into_iter().filter(|interface| !cfg!(windows) || interface.is_oper_up());
    only_lan(up.filter_map(|interface| match interface.ip() {
        std::net::IpAddr::V4(address) => Some(address),
        std::net::IpAddr::V6(_) => None,
    }))
}

fn only_lan(addresses: impl Iterator<Item = Ipv4Addr>) -> Result<Ipv4Addr, ServeError> {
    // Other addresses are visible from everywhere, or to this computer alone. The operator must name one of them
    // explicitly.
    let mut networks: Vec<Ipv4Addr> =
        addresses.filter(|address| address.is_private() || address.is_link_local()).collect();
    // The system makes up a link-local address where it finds no network.
    if networks.iter().any(Ipv4Addr::is_private) {
        networks.retain(Ipv4Addr::is_private);
    }
    networks.dedup();
    match networks.as_slice() {
        [] => Err(ServeError::NoNetwork),
        [only] => Ok(*only),
        _ => Err(ServeError::SeveralNetworks(networks)),
    }
}

/// Takes the addresses of this computer and of the network.
fn listen(
    lan: Option<Ipv4Addr>,
    port: u16,
    may_start: bool,
) -> Result<Vec<(TcpListener, SocketAddr, Door)>, ServeError> {
    let (listener, here) = bind(Ipv4Addr::LOCALHOST, port)?;
    let mut doors = vec![(listener, here, Door::here(here.port()))];
    let Some(address) = lan else { return Ok(doors) };
    if address.is_unspecified() || address.is_broadcast() || address.is_multicast() || address == Ipv4Addr::LOCALHOST {
        return Err(ServeError::NoAddress(address));
    }
    let (listener, bound) = bind(address, here.port())?;
    doors.push((listener, bound, Door::lan(address, bound.port(), may_start)));
    Ok(doors)
}

/// Listens at an address. Returns also the port.
fn bind(address: Ipv4Addr, port: u16) -> Result<(TcpListener, SocketAddr), ServeError> {
    let asked = SocketAddr::from((address, port));
    let bind = || {
        let socket = TcpSocket::new_v4()?;
        // The address may be reused while old connections of an earlier server linger. On Windows this option would
        // share the port.
        #[cfg(unix)]
        socket.set_reuseaddr(true)?;
        // Accepted connections inherit it.
        socket.set_send_buffer_size(UNREAD_BYTES)?;
        socket.bind(asked)?;
        let listener = socket.listen(BACKLOG)?;
        let bound = listener.local_addr()?;
        Ok((listener, bound))
    };
    bind().map_err(|error: io::Error| match error.kind() {
        io::ErrorKind::AddrInUse => ServeError::InUse(asked),
        io::ErrorKind::AddrNotAvailable => ServeError::NotMine(address),
        _ => ServeError::NotBound { address: asked, source: error },
    })
}

/// Accepts connections at a door. Each gets a place. If there is none, another connection loses its place.
async fn attend(listener: TcpListener, door: Arc<Door>, places: Places, routes: Router) {
    loop {
        // A connection that has closed again is no reason to stop. If the process is out of file handles, some
        // connections end soon.
        let Ok((stream, peer)) = listener.accept().await else {
            sleep(LOOK).await;
            continue;
        };
        let place = Arc::new(places.take(peer.ip()));
        let visitor = Visitor { address: peer.ip(), door: Arc::clone(&door), place: Arc::clone(&place), known: None };
        let routes = routes.clone().layer(Extension(visitor));
        tokio::spawn(async move {
            let mut served = pin!(serve(stream, routes));
            // Closes the connection at its end, or when it loses its place. Before that, what has come is read.
            while matches!(select(&mut served, pin!(place.lost())).await, Either::Right(_)) {
                for _ in 0..TURNS_TO_READ {
                    if matches!(select(&mut served, pin!(yield_now())).await, Either::Left(_)) {
                        return;
                    }
                }
                if place.is_over() {
                    return;
                }
            }
        });
    }
}

/// Serves a connection to its end. Closes it if the client sends too slowly or does not read.
async fn serve(stream: TcpStream, routes: Router) {
    // Without this option the connection is only slower.
    let _ = stream.set_nodelay(true);
    // Without this option the time limit begins only when the system's buffer is full.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    let _ = SockRef::from(&stream).set_tcp_user_timeout(Some(READER_TIME));
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(READER_TIME));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIME)
        .max_buf_size(HEAD_BYTES)
        // A HOLD whose client ends with it is obeyed all the same.
        .half_close(true)
        .serve_connection(TokioIo::new(Box::pin(stream)), TowerToHyperService::new(routes));
    // Errors are ignored: the page connects again.
    let _ = connection.await;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_unique_network_address_is_chosen_automatically() {
        let found = |addresses: &[[u8; 4]]| {
            only_lan(addresses.iter().map(|&address| address.into())).map_err(|error| error.to_string())
        };
        assert_eq!(found(&[[127, 0, 0, 1], [192, 168, 4, 1], [8, 8, 8, 8]]), Ok([192, 168, 4, 1].into()));
        assert_eq!(found(&[[169, 254, 9, 9], [192, 168, 4, 1]]), Ok([192, 168, 4, 1].into()));
        assert_eq!(found(&[[127, 0, 0, 1], [169, 254, 9, 9]]), Ok([169, 254, 9, 9].into()));
        let error = found(&[[192, 168, 4, 1], [172, 17, 0, 1]]).unwrap_err();
        assert!(error.ends_with("as in `--lan 192.168.4.1`, of 192.168.4.1, 172.17.0.1"), "{error}");
        let error = found(&[[127, 0, 0, 1]]).unwrap_err();
        assert!(error.contains("is in no network: join one"), "{error}");
    }
}
