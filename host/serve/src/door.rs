//! The first check of a request: decides whether it is let in, before its path is read.
//!
//! The request's `Host` must be exactly an address of this server. A foreign page whose name was made to lead here (DNS
//! rebinding) sends its own name. Requests from a page of another origin are refused. So are requests that want to
//! change something and name no origin. Over the network, unpaired clients get only the form for the code.

use super::rules::Reach;
use axum::http::header::{HOST, HeaderName, ORIGIN};
use axum::http::{HeaderValue, Method, Request, StatusCode};
use std::net::Ipv4Addr;
use thiserror::Error;

/// Paths that are open to unpaired clients: the form for the code.
const FORM: [&str; 4] = ["/", "/pair", "/pair.css", "/pair.js"];

/// An address at which requests come in.
#[derive(Clone, Debug)]
pub struct Door {
    pub reach: Reach,
    /// The name of a paired phone's cookie. The ports of an address share cookies, so it has the port. Empty at the door
    /// for this computer, which pairs no phone.
    pub cookie: String,
    /// The valid values of a request's `Host`.
    names: Vec<String>,
}

/// Why a request does not come in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Denial {
    #[error("this is not the address that `weeder serve` printed: type that one, with its number")]
    ForeignHost,
    #[error("this request comes from another page: open the address that `weeder serve` printed")]
    ForeignOrigin,
    #[error("this request names no origin: send the header `Origin` with `http://` and the address in `Host`")]
    NoOrigin,
    #[error("this phone is not paired: open the address that `weeder serve` printed, and type its code")]
    NotPaired,
}

impl Denial {
    pub fn status(self) -> StatusCode {
        match self {
            Denial::ForeignHost => StatusCode::MISDIRECTED_REQUEST,
            Denial::ForeignOrigin | Denial::NoOrigin => StatusCode::FORBIDDEN,
            Denial::NotPaired => StatusCode::UNAUTHORIZED,
        }
    }
}

impl Door {
    /// The door for this computer alone.
    pub fn here(port: u16) -> Self {
        let localhost = ["127.0.0.1", "localhost"].map(|name| named(name, port)).concat();
        Self { reach: Reach::Here, cookie: String::new(), names: localhost }
    }

    /// The door for the network.
    pub fn lan(address: Ipv4Addr, port: u16, may_start: bool) -> Self {
        let (cookie, names) = (format!("weeder-{port}"), named(&address.to_string(), port));
        Self { reach: Reach::Lan { may_start }, cookie, names }
    }

    /// Lets a request in. `is_paired` says whether its cookie belongs to a paired browser.
    ///
    /// # Errors
    /// The reason for refusing it.
    pub fn admit<B>(&self, request: &Request<B>, is_paired: bool) -> Result<(), Denial> {
        // A header that occurs twice has both of its values here.
        let all = |name: HeaderName| -> Vec<&[u8]> {
            request.headers().get_all(name).iter().map(HeaderValue::as_bytes).collect()
        };
        // In a request to a proxy, the target names a host as well.
        let is_for_proxy = request.uri().authority().is_some();
        let is_name = |host: &[u8]| self.names.iter().any(|name| name.as_bytes() == host);
        let host = match all(HOST)[..] {
            [host] if !is_for_proxy && is_name(host) => host,
            _ => return Err(Denial::ForeignHost),
        };
        match all(ORIGIN)[..] {
            // A browser omits the origin when a page reads from its own server.
            [] if matches!(*request.method(), Method::GET | Method::HEAD) => {}
            [] => return Err(Denial::NoOrigin),
            [origin] if origin.strip_prefix(b"http://") == Some(host) => {}
            _ => return Err(Denial::ForeignOrigin),
        }
        // A foreign page can embed a path of this server as a picture, and such a request has no origin. A link to the
        // front page is followed all the same.
        let path = request.uri().path();
        let is_own = |site: &&[u8]| matches!(*site, b"same-origin" | b"none");
        if path != "/" && !all(HeaderName::from_static("sec-fetch-site")).iter().all(is_own) {
            return Err(Denial::ForeignOrigin);
        }
        match self.reach {
            Reach::Here => Ok(()),
            Reach::Lan { .. } if is_paired || FORM.contains(&path) => Ok(()),
            Reach::Lan { .. } => Err(Denial::NotPaired),
        }
    }
}

/// The names of a host at a port. Browsers omit http's default port.
fn named(host: &str, port: u16) -> Vec<String> {
    let with_port = format!("{host}:{port}");
    if port == 80 { vec![with_port, host.to_owned()] } else { vec![with_port] }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ADDRESS: &str = "192.168.1.5:8866";
    const OWN: &str = "http://192.168.1.5:8866";
    const METHODS: [Method; 2] = [Method::GET, Method::POST];

    fn lan() -> Door {
        Door::lan(Ipv4Addr::new(192, 168, 1, 5), 8866, false)
    }

    fn request(method: Method, uri: &str, hosts: &[&str], origins: &[&str]) -> Request<()> {
        let mut request = Request::builder().method(method).uri(uri);
        for (name, values) in [(HOST, hosts), (ORIGIN, origins)] {
            request = values.iter().fold(request, |request, &value| request.header(&name, value));
        }
        request.body(()).unwrap()
    }

    #[test]
    fn a_paired_client_comes_in_if_it_names_the_address_and_no_other_origin() {
        let (foreign_host, foreign_origin) = (Err(Denial::ForeignHost), Err(Denial::ForeignOrigin));
        let check = |hosts: &[&str], origins: &[&str], admitted: [Result<(), Denial>; 2]| {
            for path in ["/", "/pair", "/pair.js", "/page.js", "/machines", "/events"] {
                let requests = METHODS.map(|method| request(method, path, hosts, origins));
                assert_eq!(requests.each_ref().map(|request| lan().admit(request, true)), admitted, "{requests:?}");
            }
        };
        check(&[ADDRESS], &[OWN], [Ok(()); 2]);
        check(&[ADDRESS], &[], [Ok(()), Err(Denial::NoOrigin)]);
        for host in
            ["", "weeder.example:8866", "192.168.1.5", "192.168.1.5:8867", "192.168.1.50:8866", "localhost:8866"]
        {
            check(&[host], &[OWN], [foreign_host; 2]);
            check(&[host], &[], [foreign_host; 2]);
        }
        for hosts in [&[][..], &[ADDRESS, ADDRESS], &[ADDRESS, "weeder.example"]] {
            check(hosts, &[OWN], [foreign_host; 2]);
            check(hosts, &[], [foreign_host; 2]);
        }
        for origin in
            ["", "null", "http://weeder.example:8866", "http://192.168.1.5", "http://192.168.1.5:8866.example"]
        {
            check(&[ADDRESS], &[origin], [foreign_origin; 2]);
        }
        for origins in [&["https://192.168.1.5:8866"][..], &[OWN, OWN]] {
            check(&[ADDRESS], origins, [foreign_origin; 2]);
        }
        let for_proxy = request(Method::GET, "http://192.168.1.5:8866/events", &[ADDRESS], &[]);
        assert_eq!(lan().admit(&for_proxy, true), foreign_host);
    }

    #[test]
    fn embedding_in_another_page_is_refused_but_not_a_link() {
        for (site, comes_in) in [("same-origin", true), ("none", true), ("same-site", false), ("cross-site", false)] {
            for (path, comes_in) in [("/events", comes_in), ("/", true)] {
                let mut request = request(Method::GET, path, &[ADDRESS], &[]);
                request.headers_mut().insert("sec-fetch-site", HeaderValue::from_static(site));
                assert_eq!(lan().admit(&request, true).is_ok(), comes_in, "{site} {path}");
            }
        }
    }

    #[test]
    fn an_unpaired_client_finds_the_form_and_nothing_else() {
        let form = ["/", "/pair", "/pair.css", "/pair.js"].map(|path| (path, Ok(())));
        let others = ["//", "/pair/", "/page.js", "/page.css", "/machines", "/events", "/machines/0/command"];
        for (path, admitted) in form.into_iter().chain(others.map(|path| (path, Err(Denial::NotPaired)))) {
            for method in METHODS {
                assert_eq!(lan().admit(&request(method, path, &[ADDRESS], &[OWN]), false), admitted, "{path}");
            }
        }
    }

    #[test]
    fn at_the_computer_itself_the_name_and_the_origin_suffice_without_a_code() {
        let admit = |host, origins: &[&str]| {
            let method = if origins.is_empty() { Method::GET } else { Method::POST };
            Door::here(8866).admit(&request(method, "/events", &[host], origins), false)
        };
        for host in ["127.0.0.1:8866", "localhost:8866"] {
            assert_eq!(admit(host, &[]), Ok(()));
            assert_eq!(admit(host, &[&format!("http://{host}")]), Ok(()));
        }
        // Both names are its own, and yet two origins.
        assert_eq!(admit("127.0.0.1:8866", &["http://localhost:8866"]), Err(Denial::ForeignOrigin));
        assert_eq!(admit(ADDRESS, &[]), Err(Denial::ForeignHost));
    }

    #[test]
    fn at_the_port_of_http_a_browser_leaves_its_number_out() {
        let door = Door::lan(Ipv4Addr::new(192, 168, 1, 5), 80, false);
        let request = request(Method::POST, "/machines/0/command", &["192.168.1.5"], &["http://192.168.1.5"]);
        assert_eq!(door.admit(&request, true), Ok(()));
    }
}
