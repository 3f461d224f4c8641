//! A session over a port, which is opened again when it is lost.
//!
//! The caller calls [`Connection::turn`] in a loop. A turn waits for one read at most. Without a port it does not wait,
//! and the caller does.

use super::LinkError;
use super::moment::Moment;
use super::session::{Happening, Session};
use super::wire::Wire;
use std::time::Duration;

/// Pause of a caller between two turns without a port.
pub const PAUSE: Duration = Duration::from_millis(20);

/// Time between two tries to open the port again.
const RETRY: Duration = Duration::from_secs(1);

/// Opens a wire, from another thread. Called again each time that the wire is lost.
pub type Opener = Box<dyn FnMut() -> Result<Wire, LinkError> + Send>;

/// A session and its port.
pub struct Connection {
    /// What is typed, and what has happened.
    pub session: Session,
    open: Box<dyn FnMut() -> Result<Wire, LinkError>>,
    wire: Option<Wire>,
    tried: Option<Moment>,
}

impl Connection {
    /// A connection without a port: the turns call `open` until it returns one.
    pub fn waiting_for(open: impl FnMut() -> Result<Wire, LinkError> + 'static) -> Self {
        Self { session: Session::default(), open: Box::new(open), wire: None, tried: None }
    }

    /// Reads, types, and returns what happened since the last turn.
    pub fn turn(&mut self, clock: impl Fn() -> Moment) -> Vec<Happening> {
        let now = clock();
        if self.wire.is_none() && self.tried.is_none_or(|tried| now.since(tried) >= RETRY) {
            self.tried = Some(now);
            match (self.open)() {
                Ok(wire) => {
                    self.session.open(wire.resets);
                    self.wire = Some(wire);
                }
                Err(error) => self.session.lose(error),
            }
        }
        let received = self.wire.as_mut().map_or(Ok(Vec::new()), Wire::read).unwrap_or_else(|error| {
            self.session.lose(error);
            Vec::new()
        });
        // The computer may have slept since: a command must not be typed behind its deadline.
        let now = clock();
        let mut turn = self.session.turn(now, &received);
        if let Some(wire) = &mut self.wire {
            if turn.is_given_up {
                wire.discard_unsent();
            }
            if let Err(error) = wire.write(&turn.to_send) {
                wire.discard_unsent();
                self.session.lose(error);
                turn.happened.extend(self.session.turn(now, &[]).happened);
            }
        }
        if !self.session.is_open() && self.wire.take().is_some() {
            self.tried = Some(now);
        }
        turn.happened
    }
}
