//! The paths of the server. The [`door`](super::door) decides which requests come in, and the [`rules`](super::rules)
//! decide which commands may be typed.
//!
//! | path | answer |
//! | --- | --- |
//! | `/` | the page, or the form for the code; `/page.css`, `/page.js`, `/pair.css`, `/pair.js` belong to them |
//! | `POST /pair` | a cookie for the code in the body |
//! | `/machines` | the machines' names, and the allowed commands, as JSON |
//! | `/events` | the state and output of all machines, as server-sent events |
//! | `POST /machines/hold` | the result of a HOLD to all machines at once, and the time until the last one had obeyed, as JSON |
//! | `POST /machines/N/command` | the answer to the line in the body, line by line; `Weeder-Seen` has the number of the last message that its sender has seen |
//!
//! No path leads to any other file, and no path flashes a board.

use super::door::Door;
use super::hub::{Hub, Message};
use super::machine::{Machine, Tell};
use super::page::Page;
use super::pairing::{Pairing, Try};
use super::places::{Client, Place, Stage};
use super::random;
use super::rules::{self, Forbidden, Reach};
use axum::Extension;
use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{Path, Request, State};
use axum::http::header::{
    CACHE_CONTROL, CONNECTION, CONTENT_SECURITY_POLICY, CONTENT_TYPE, COOKIE, HeaderName, LOCATION, REFERRER_POLICY,
    RETRY_AFTER, SET_COOKIE, TRANSFER_ENCODING, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::sse::{Event, Sse};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::{get, post};
use futures_util::future::join_all;
use futures_util::stream::{self, Stream, StreamExt};
use link::session::Unanswered;
use parking_lot::Mutex;
use std::convert::Infallible;
use std::error::Error;
use std::fmt::Display;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::broadcast::error::RecvError;
use tokio::task::yield_now;
use tokio::time::timeout;

/// Bytes that a request's body has at the most: a command has 80.
const BODY_BYTES: usize = 256;

const BODY_TIME: Duration = Duration::from_secs(5);

/// Time between heartbeats to a page. The page reports a lost computer after six times as long.
const BEAT: Duration = Duration::from_millis(500);

/// Only this program's own files, and no frame of another page. The page makes its worker and its maps itself
/// (`blob:`).
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src blob:; style-src 'self'; \
    img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The header of a command with the `id` of the last message that its sender has seen.
const SEEN: &str = "weeder-seen";

/// The state that all requests share.
pub struct Served {
    pub page: Page,
    /// The machines, in the order of their numbers.
    pub machines: Vec<Machine>,
    pub hub: Arc<Hub>,
    pub pairing: Mutex<Pairing>,
    pub tell: Tell,
}

/// The client of a connection, and its door.
#[derive(Clone)]
pub struct Visitor {
    pub address: IpAddr,
    pub door: Arc<Door>,
    pub place: Arc<Place>,
    /// Who sent the present request, if it may see the page.
    pub known: Option<Client>,
}

impl Visitor {
    fn enter(&self, stage: Stage) {
        if let Some(client) = self.known {
            self.place.enter(stage, client);
        }
    }
}

/// All paths.
pub fn routes(served: Arc<Served>) -> Router {
    let [_, css, js] = served.page.0.clone();
    let mut routes = Router::new();
    for (path, media, content) in [
        ("/page.css", "text/css; charset=utf-8", css),
        ("/page.js", "text/javascript; charset=utf-8", js),
        ("/pair.css", "text/css; charset=utf-8", include_str!("pair/pair.css").into()),
        ("/pair.js", "text/javascript; charset=utf-8", include_str!("pair/pair.js").into()),
    ] {
        routes = routes.route(path, get(move || async move { ([(CONTENT_TYPE, media)], content) }));
    }
    routes
        .route("/", get(front))
        .route("/pair", post(pair))
        .route("/machines", get(machines))
        .route("/machines/hold", post(hold_all))
        .route("/machines/{number}/command", post(command))
        .route("/events", get(events))
        .fallback(|| async { (StatusCode::NOT_FOUND, "there is no such path\n") })
        .layer(from_fn_with_state(Arc::clone(&served), admit))
        .with_state(served)
}

/// Passes a request to the door. Returns an error page if the door refuses it.
async fn admit(
    State(served): State<Arc<Served>>,
    Extension(mut visitor): Extension<Visitor>,
    request: Request,
    next: Next,
) -> Response {
    // A client that sends many requests ahead must not block other clients.
    yield_now().await;
    let phone = cookies(request.headers(), &visitor.door.cookie).find_map(|token| served.pairing.lock().phone(token));
    let mut response = match visitor.door.admit(&request, phone.is_some()) {
        Ok(()) => match whole(request).await {
            Ok(mut request) => {
                visitor.known = match visitor.door.reach {
                    Reach::Here => Some(Client::Here),
                    Reach::Lan { .. } => phone.map(Client::Phone),
                };
                visitor.enter(Stage::Asking);
                request.extensions_mut().insert(visitor);
                next.run(request).await
            }
            Err(problem) => problem,
        },
        Err(denial) => (denial.status(), format!("{denial}\n")).into_response(),
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (CONTENT_SECURITY_POLICY, POLICY),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (REFERRER_POLICY, "no-referrer"),
        (CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

fn cookies<'request>(headers: &'request HeaderMap, name: &str) -> impl Iterator<Item = &'request str> {
    let lines = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
    let pairs = lines.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
    pairs.filter(move |&(other, _)| other == name).map(|(_, value)| value)
}

/// The page, or the form for the code.
async fn front(State(served): State<Arc<Served>>, Extension(visitor): Extension<Visitor>, uri: Uri) -> Response {
    if visitor.known.is_none() {
        return Html(include_str!("pair/pair.html")).into_response();
    }
    match redirect(uri.query().unwrap_or_default()) {
        None => Html(served.page.0[0].clone()).into_response(),
        Some(address) => (StatusCode::SEE_OTHER, [(LOCATION, address)]).into_response(),
    }
}

/// The page's address, if a query lacks `served`. That word tells the page that it is connected to a machine.
fn redirect(query: &str) -> Option<String> {
    match query {
        "" => Some("/?served#work".to_owned()),
        query => query.split('&').all(|part| part != "served").then(|| format!("/?served&{query}")),
    }
}

/// Pairs the client if it sends the right code.
async fn pair(
    State(served): State<Arc<Served>>,
    Extension(Visitor { address, door, .. }): Extension<Visitor>,
    body: Bytes,
) -> Response {
    if door.reach == Reach::Here {
        return (StatusCode::NOT_FOUND, "this computer needs no code\n").into_response();
    }
    let Ok(typed) = String::from_utf8(body.into()) else { return no_line() };
    let tried = served.pairing.lock().try_code(&typed, Instant::now());
    match tried {
        Try::Right => {
            let Ok(token) = random() else {
                return (StatusCode::INTERNAL_SERVER_ERROR, "the system has no randomness to give\n").into_response();
            };
            let paired = served.pairing.lock().pair(token);
            (served.tell)(&format!("{address} is paired now. Paired in all: {paired}."));
            // A phone's browser that ends drops a cookie without an age. The token ends with this process.
            let rules = "HttpOnly; SameSite=Strict; Path=/; Max-Age=31536000";
            let cookie = format!("{}={}; {rules}", door.cookie, hex::encode(token));
            (StatusCode::NO_CONTENT, [(SET_COOKIE, cookie)]).into_response()
        }
        Try::Wrong { left: 0 } => {
            (served.tell)(&format!(
                "{address} has sent the fifth wrong code: no code is accepted for a minute, not even the right one."
            ));
            (StatusCode::FORBIDDEN, "That is not the code. No code is accepted for a minute now.\n").into_response()
        }
        Try::Wrong { left } => {
            (served.tell)(&format!("{address} has sent a wrong code. Tries left: {left}."));
            let said = format!("That is not the code. The computer's screen shows it. Tries left: {left}.\n");
            (StatusCode::FORBIDDEN, said).into_response()
        }
        Try::Locked(wait) => {
            let seconds = wait.as_secs() + 1;
            let said = format!("Too many wrong codes: no code is accepted for {seconds} s.\n");
            (StatusCode::TOO_MANY_REQUESTS, [(RETRY_AFTER, seconds.to_string())], said).into_response()
        }
    }
}

/// The machines' names and the allowed commands.
async fn machines(
    State(served): State<Arc<Served>>,
    Extension(Visitor { door, .. }): Extension<Visitor>,
) -> impl IntoResponse {
    let names: Vec<&str> = served.machines.iter().map(|machine| machine.name.as_str()).collect();
    let (may_start, may_change) = match door.reach {
        Reach::Here => (true, true),
        Reach::Lan { may_start } => (may_start, false),
    };
    let said = serde_json::json!({ "machines": names, "mayStart": may_start, "mayChange": may_change });
    ([(CONTENT_TYPE, "application/json")], said.to_string())
}

/// Types a line to a machine, if this is allowed, and returns its answer.
async fn command(
    State(served): State<Arc<Served>>,
    Extension(visitor): Extension<Visitor>,
    Path(number): Path<usize>,
    headers: HeaderMap,
    body: Bytes,
) -> Response {
    let Some(machine) = served.machines.get(number) else {
        return refused(StatusCode::NOT_FOUND, "there is no such machine");
    };
    let Ok(line) = String::from_utf8(body.into()) else { return no_line() };
    match rules::allow(&line, visitor.door.reach) {
        Ok(()) => {}
        Err(Forbidden::NoLine) => return no_line(),
        Err(why) => return refused(StatusCode::FORBIDDEN, why),
    }
    let answer = if link::is_hold(&line) {
        visitor.enter(Stage::Holding);
        machine.hold().await
    } else {
        let seen = headers.get(SEEN).and_then(|seen| seen.to_str().ok()?.parse().ok());
        let Some(seen) = seen else {
            let right = "send the `id` of the last message of /events as the header Weeder-Seen, or send `hold`";
            return refused(StatusCode::PRECONDITION_REQUIRED, right);
        };
        machine.command(line, seen).await
    };
    match answer {
        Ok(lines) => (lines.join("\n") + "\n").into_response(),
        Err(why) => {
            let (status, why) = unanswered(why);
            refused(status, why)
        }
    }
}

/// The status and the words for a line without an answer.
fn unanswered(why: Unanswered) -> (StatusCode, String) {
    match why {
        Unanswered::Held => (StatusCode::PRECONDITION_FAILED, "hold came first, so this was not sent".to_owned()),
        Unanswered::Late => (
            StatusCode::PRECONDITION_FAILED,
            "this came more than a second late, so it was not sent: look at the machine, then try again".to_owned(),
        ),
        Unanswered::NotTyped(why) => (StatusCode::SERVICE_UNAVAILABLE, why),
        Unanswered::Unknown(why) => (
            StatusCode::GATEWAY_TIMEOUT,
            format!("{why}. The machine may have done this, or may still do it: look at it"),
        ),
    }
}

/// Holds all machines at once. Every client that is let in may do this. Returns for each machine why it has not obeyed,
/// or nothing, and the time of the last one that has.
async fn hold_all(State(served): State<Arc<Served>>, Extension(visitor): Extension<Visitor>) -> impl IntoResponse {
    visitor.enter(Stage::Holding);
    let since = Instant::now();
    let holds = served.machines.iter().map(|machine| async move { (machine.hold().await, since.elapsed()) });
    let (mut machines, mut last_ms) = (Vec::new(), None);
    for (Machine { name, .. }, (answer, time)) in served.machines.iter().zip(join_all(holds).await) {
        let error = match answer {
            Ok(lines) => lines.into_iter().next_back().filter(|line| line.starts_with("error:")),
            Err(why) => Some(unanswered(why).1),
        };
        match &error {
            Some(why) => (served.tell)(&format!("{name} has not obeyed HOLD: {why}.")),
            None => last_ms = last_ms.max(Some(time.as_millis() as u64)),
        }
        machines.push(serde_json::json!({ "name": name, "error": error }));
    }
    let said = serde_json::json!({ "machines": machines, "lastMs": last_ms });
    ([(CONTENT_TYPE, "application/json")], said.to_string())
}

/// The answer to a line that was not typed, in the machine's own form of an error.
fn refused(status: StatusCode, why: impl Display) -> Response {
    (status, format!("error: {why}\n")).into_response()
}

/// Reads a request with its short body. Otherwise returns the error, which closes the connection: its next bytes may be
/// no request.
async fn whole(request: Request) -> Result<Request, Response> {
    // With `Content-Length` as well, it may be an attempt at request smuggling (RFC 9112, section 6.1). hyper drops one of
    // the two before any other code sees the request. Browsers send `Content-Length` alone.
    if request.headers().contains_key(TRANSFER_ENCODING) {
        return Err(unread(StatusCode::BAD_REQUEST, "send Content-Length, not Transfer-Encoding"));
    }
    let (head, body) = request.into_parts();
    match timeout(BODY_TIME, to_bytes(body, BODY_BYTES)).await {
        Ok(Ok(bytes)) => Ok(Request::from_parts(head, Body::from(bytes))),
        // Any other error means that the body is too long.
        Ok(Err(error)) if is_malformed(&error) => Err(unread(StatusCode::BAD_REQUEST, "the body ends too soon")),
        Ok(Err(_)) => Err(unread(StatusCode::PAYLOAD_TOO_LARGE, Forbidden::NoLine)),
        Err(_) => Err(unread(StatusCode::REQUEST_TIMEOUT, "the line has not come")),
    }
}

/// The answer to a request whose body was not read. The connection then closes.
fn unread(status: StatusCode, why: impl Display) -> Response {
    ([(CONNECTION, "close")], refused(status, why)).into_response()
}

/// Whether hyper could not read a body.
fn is_malformed(error: &(dyn Error + 'static)) -> bool {
    std::iter::successors(Some(error), |&error| error.source()).any(|error| error.is::<hyper::Error>())
}

fn no_line() -> Response {
    refused(StatusCode::BAD_REQUEST, Forbidden::NoLine)
}

/// Streams the state and output of all machines while the page reads it.
async fn events(
    State(served): State<Arc<Served>>,
    Extension(visitor): Extension<Visitor>,
) -> Sse<impl Stream<Item = Result<Event, Infallible>> + use<>> {
    visitor.enter(Stage::Listening);
    let event = |message: Message| Event::default().id(message.number.to_string()).data(&*message.text);
    Sse::new(heard(&served.hub).map(move |message| Ok(event(message))))
}

/// The messages to a page: the state of all machines, then changes, and a heartbeat while nothing changes. A page that
/// falls too far behind gets a last message that says so. It may connect again.
fn heard(hub: &Arc<Hub>) -> impl Stream<Item = Message> + use<> {
    let (first, later) = hub.listen();
    let later = stream::unfold((Arc::clone(hub), Some(later)), |(hub, later)| async move {
        let mut later = later?;
        match timeout(BEAT, later.recv()).await {
            Ok(Ok(message)) => Some((message, (hub, Some(later)))),
            Ok(Err(RecvError::Lagged(_))) => Some((hub.tell(r#"{"is":"dropped"}"#), (hub, None))),
            Ok(Err(RecvError::Closed)) => None,
            Err(_) => Some((hub.tell(r#"{"is":"beat"}"#), (hub, Some(later)))),
        }
    });
    stream::iter(first).chain(later)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;
    use std::pin::pin;

    #[test]
    fn two_servers_of_a_computer_do_not_take_each_others_cookies() {
        let mut headers = HeaderMap::new();
        headers.insert(COOKIE, HeaderValue::from_static("weeder-8866=one; weeder-8867=other"));
        for (port, token) in [(8866, "one"), (8867, "other")] {
            let door = Door::lan(Ipv4Addr::LOCALHOST, port, false);
            assert_eq!(cookies(&headers, &door.cookie).collect::<Vec<_>>(), [token]);
        }
    }

    #[test]
    fn an_address_keeps_its_own_words_beside_the_mark_of_a_served_page() {
        for (query, address) in [
            ("", Some("/?served#work")),
            ("seed=7", Some("/?served&seed=7")),
            ("served", None),
            ("served&seed=7", None),
            ("seed=7&served", None),
        ] {
            assert_eq!(redirect(query).as_deref(), address, "{query}");
        }
    }

    #[tokio::test]
    async fn a_request_whose_body_is_not_read_closes_its_connection() {
        let chunked = Request::builder().header(TRANSFER_ENCODING, "chunked").body(Body::from("hold"));
        let long = Request::builder().body(Body::from("h".repeat(BODY_BYTES + 1)));
        for (request, status) in [(chunked, StatusCode::BAD_REQUEST), (long, StatusCode::PAYLOAD_TOO_LARGE)] {
            let answer = whole(request.unwrap()).await.unwrap_err();
            assert_eq!((answer.status(), &answer.headers()[CONNECTION]), (status, &HeaderValue::from_static("close")));
        }
        assert!(whole(Request::new(Body::from("hold"))).await.is_ok());
    }

    #[tokio::test]
    async fn a_page_too_far_behind_is_dropped_and_may_connect_again() {
        let hub = Arc::new(Hub::new(1, 5000, Box::new(link::moment::Moment::now)));
        let mut page = pin!(heard(&hub).map(|message| message.text));
        for number in 0..1000 {
            hub.news(0, serde_json::json!({ "is": "event", "said": number }));
        }
        assert!(page.next().await.unwrap().contains("lost"));
        assert_eq!(page.next().await.as_deref(), Some(r#"{"is":"dropped"}"#));
        assert_eq!(page.next().await, None);
        let mut page = pin!(heard(&hub).map(|message| message.text));
        assert!(page.next().await.unwrap().contains("lost"));
        assert_eq!(page.next().await.as_deref(), Some(r#"{"is":"beat"}"#));
        hub.news(0, serde_json::json!({ "is": "there" }));
        assert!(page.next().await.unwrap().contains("there"));
    }
}
