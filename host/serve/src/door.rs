//! The first check of a request: decides whether it is let in, before its path is read.
//!
//! The request's `Host` must be exactly an address of this server. A foreign page whose name was made to lead here (DNS
//! rebinding) sends its own name. Requests from a page of another origin are refused. So are requests that want to
//! change something and name no origin. Over the network, unpaired clients get only the form for the code.

use super::rules::Reach;
use std::net::Ipv4Addr;
use thiserror::Error;

/// Paths that are open to unpaired clients: the form for the code.
const FORM: [&str; 4] = ["/", "/pair", "/pair.css", "/pair.js"];

/// An address at which requests come in.
#[derive(Clone, Debug)]
pub struct Door {
    /// From where they come.
    pub reach: Reach,
    /// The valid values of a request's `Host`.
    names: Vec<String>,
}

/// The parts of a request that the door checks. A header that occurs twice has both of its values here.
#[derive(Clone, Copy, Debug)]
pub struct Knock<'a> {
    /// Whether it changes nothing: GET and HEAD.
    pub only_looks: bool,
    /// Its path.
    pub path: &'a str,
    /// Whether its target also names a host, as in a request to a proxy.
    pub is_for_proxy: bool,
    /// `Host`.
    pub hosts: &'a [&'a [u8]],
    /// `Origin`.
    pub origins: &'a [&'a [u8]],
    /// `Sec-Fetch-Site`: the origin of the request, if the browser sends it.
    pub sites: &'a [&'a [u8]],
    /// Whether its cookie belongs to a paired browser.
    pub is_paired: bool,
}

/// Why a request does not come in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Denial {
    /// Its `Host` is not an address of this server.
    #[error("this is not the address that `weeder serve` printed: type that one, with its number")]
    ForeignHost,
    /// It comes from a page of another origin, or names no origin.
    #[error("this request comes from another page: open the address that `weeder serve` printed")]
    ForeignOrigin,
    /// It has no valid token.
    #[error("this phone is not paired: open the address that `weeder serve` printed, and type its code")]
    NotPaired,
}

impl Denial {
    /// HTTP's number for it.
    pub fn status(self) -> u16 {
        match self {
            Denial::ForeignHost => 421,
            Denial::ForeignOrigin => 403,
            Denial::NotPaired => 401,
        }
    }
}

impl Door {
    /// The door for this computer alone.
    pub fn here(port: u16) -> Self {
        let localhost = ["127.0.0.1", "localhost"].map(|name| named(name, port)).concat();
        Self { reach: Reach::Here, names: localhost }
    }

    /// The door for the network.
    pub fn lan(address: Ipv4Addr, port: u16, may_start: bool) -> Self {
        Self { reach: Reach::Lan { may_start }, names: named(&address.to_string(), port) }
    }

    /// Lets a request in.
    ///
    /// # Errors
    /// The reason for refusing it.
    pub fn admit(&self, knock: &Knock) -> Result<(), Denial> {
        let is_name = |host: &[u8]| self.names.iter().any(|name| name.as_bytes() == host);
        let host = match knock.hosts {
            [host] if !knock.is_for_proxy && is_name(host) => host,
            _ => return Err(Denial::ForeignHost),
        };
        match knock.origins {
            // A browser omits the origin when a page reads from its own server.
            [] if knock.only_looks => {}
            [origin] if origin.strip_prefix(b"http://") == Some(host) => {}
            _ => return Err(Denial::ForeignOrigin),
        }
        // A foreign page can embed a path of this server as a picture, and such a request has no origin. A link to the
        // front page is followed all the same.
        let is_own = |site: &&[u8]| matches!(*site, b"same-origin" | b"none");
        if knock.path != "/" && !knock.sites.iter().all(is_own) {
            return Err(Denial::ForeignOrigin);
        }
        match self.reach {
            Reach::Here => Ok(()),
            Reach::Lan { .. } if knock.is_paired || FORM.contains(&knock.path) => Ok(()),
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

    const LOOK: Knock = Knock {
        only_looks: true,
        path: "/events",
        is_for_proxy: false,
        hosts: &[b"192.168.1.5:8866"],
        origins: &[],
        sites: &[],
        is_paired: true,
    };
    const POST: Knock =
        Knock { only_looks: false, path: "/machines/0/command", origins: &[b"http://192.168.1.5:8866"], ..LOOK };

    fn lan() -> Door {
        Door::lan(Ipv4Addr::new(192, 168, 1, 5), 8866, false)
    }

    #[test]
    fn a_paired_client_that_names_the_address_comes_in() {
        assert_eq!(lan().admit(&LOOK), Ok(()));
        assert_eq!(lan().admit(&POST), Ok(()));
    }

    #[test]
    fn another_host_is_refused_everywhere_even_if_all_else_is_right() {
        let hosts: [&[&[u8]]; 9] = [
            &[],
            &[b""],
            &[b"weeder.example:8866"],
            &[b"192.168.1.5"],
            &[b"192.168.1.5:8867"],
            &[b"192.168.1.50:8866"],
            &[b"localhost:8866"],
            &[b"192.168.1.5:8866", b"192.168.1.5:8866"],
            &[b"192.168.1.5:8866", b"weeder.example"],
        ];
        for hosts in hosts {
            for path in ["/", "/pair", "/pair.js", "/page.js", "/machines", "/events"] {
                for knock in [Knock { hosts, path, ..LOOK }, Knock { hosts, path, ..POST }] {
                    assert_eq!(lan().admit(&knock), Err(Denial::ForeignHost), "{knock:?}");
                }
            }
        }
        assert_eq!(lan().admit(&Knock { is_for_proxy: true, ..LOOK }), Err(Denial::ForeignHost));
    }

    #[test]
    fn another_origin_stays_out_everywhere_and_so_does_a_post_without_an_origin() {
        let origins: [&[&[u8]]; 7] = [
            &[b"null"],
            &[b"http://weeder.example:8866"],
            &[b"https://192.168.1.5:8866"],
            &[b"http://192.168.1.5"],
            &[b"http://192.168.1.5:8866.example"],
            &[b"http://192.168.1.5:8866", b"http://192.168.1.5:8866"],
            &[b""],
        ];
        for origins in origins {
            for path in ["/", "/pair", "/pair.js", "/page.js", "/machines", "/events"] {
                for knock in [Knock { origins, path, ..LOOK }, Knock { origins, path, ..POST }] {
                    assert_eq!(lan().admit(&knock), Err(Denial::ForeignOrigin), "{knock:?}");
                }
            }
        }
        assert_eq!(lan().admit(&Knock { origins: &[], ..POST }), Err(Denial::ForeignOrigin));
    }

    #[test]
    fn embedding_in_another_page_stays_out_and_a_link_to_the_front_is_followed() {
        for (site, comes_in) in [("same-origin", true), ("none", true), ("same-site", false), ("cross-site", false)] {
            let knock = Knock { sites: &[site.as_bytes()], ..LOOK };
            assert_eq!(lan().admit(&knock).is_ok(), comes_in, "{site}");
            assert_eq!(lan().admit(&Knock { path: "/", ..knock }), Ok(()), "{site}");
        }
    }

    #[test]
    fn an_unpaired_client_finds_the_form_and_nothing_else() {
        for path in ["/", "/pair", "/pair.css", "/pair.js"] {
            assert_eq!(lan().admit(&Knock { path, is_paired: false, ..LOOK }), Ok(()), "{path}");
            assert_eq!(lan().admit(&Knock { path, is_paired: false, ..POST }), Ok(()), "{path}");
        }
        for path in ["", "//", "/?", "/pair/", "/page.js", "/page.css", "/machines", "/events", "/machines/0/command"] {
            for knock in [Knock { path, is_paired: false, ..LOOK }, Knock { path, is_paired: false, ..POST }] {
                assert_eq!(lan().admit(&knock), Err(Denial::NotPaired), "{knock:?}");
            }
        }
    }

    #[test]
    fn at_the_computer_itself_the_name_and_the_origin_suffice_without_a_code() {
        let door = Door::here(8866);
        for host in ["127.0.0.1:8866", "localhost:8866"] {
            let origin = format!("http://{host}");
            let knock = Knock { hosts: &[host.as_bytes()], is_paired: false, ..LOOK };
            assert_eq!(door.admit(&knock), Ok(()));
            let knock = Knock { hosts: &[host.as_bytes()], origins: &[origin.as_bytes()], ..POST };
            assert_eq!(door.admit(&knock), Ok(()));
        }
        // Both names are its own, and yet two origins.
        let mixed = Knock { hosts: &[b"127.0.0.1:8866"], origins: &[b"http://localhost:8866"], ..POST };
        assert_eq!(door.admit(&mixed), Err(Denial::ForeignOrigin));
        assert_eq!(door.admit(&Knock { hosts: &[b"192.168.1.5:8866"], ..LOOK }), Err(Denial::ForeignHost));
    }

    #[test]
    fn at_the_port_of_http_a_browser_leaves_its_number_out() {
        let door = Door::lan(Ipv4Addr::new(192, 168, 1, 5), 80, false);
        let knock = Knock { hosts: &[b"192.168.1.5"], origins: &[b"http://192.168.1.5"], ..POST };
        assert_eq!(door.admit(&knock), Ok(()));
    }
}
