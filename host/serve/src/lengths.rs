//! Finds requests that give the length of their body twice, by `Content-Length` and by `Transfer-Encoding`.
//!
//! hyper drops the first of the two before any other code sees the request. So this module counts the lines as they are
//! received. A request with `Transfer-Encoding` is refused if more `Content-Length` lines were received than the
//! requests have shown. Bytes that a client sends ahead count as well. So a client that does not wait for its answer
//! may be refused, but no bad request passes.
//!
//! RFC 9112, section 6.1: such a request may be an attempt at request smuggling, and should be handled as an error.

use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::task::{Context, Poll, ready};
use tokio::io::{AsyncRead, ReadBuf};

const NAME: &[u8] = b"content-length:";

/// The `Content-Length` lines of a connection.
#[derive(Default)]
pub struct Lengths {
    come: AtomicUsize,
    shown: AtomicUsize,
}

impl Lengths {
    /// Whether a request gives its length twice. `shown` is its number of `Content-Length` lines; `is_encoded` is true
    /// if it has a `Transfer-Encoding`.
    pub fn are_two(&self, shown: usize, is_encoded: bool) -> bool {
        let shown = self.shown.fetch_add(shown, Ordering::Relaxed) + shown;
        is_encoded && shown != self.come.load(Ordering::Relaxed)
    }
}

/// Finds the lines in received bytes.
#[derive(Default)]
struct Lines {
    /// Matched bytes of the name at the beginning of this line. `None` if the line has another beginning.
    matched: Option<usize>,
}

impl Lines {
    /// The number of lines whose name is completed by these bytes.
    fn count(&mut self, bytes: &[u8]) -> usize {
        let mut lines = 0;
        for byte in bytes {
            self.matched = match self.matched {
                _ if *byte == b'\n' => Some(0),
                Some(matched) if NAME[matched] == byte.to_ascii_lowercase() => Some(matched + 1),
                _ => None,
            };
            if self.matched == Some(NAME.len()) {
                lines += 1;
                self.matched = None;
            }
        }
        lines
    }
}

/// A stream that counts these lines as they are read.
pub struct Counted<S> {
    stream: S,
    lines: Lines,
    lengths: Arc<Lengths>,
}

impl<S> Counted<S> {
    /// Counts the lines of a stream.
    pub fn new(stream: S, lengths: Arc<Lengths>) -> Self {
        Self { stream, lines: Lines::default(), lengths }
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Counted<S> {
    fn poll_read(mut self: Pin<&mut Self>, context: &mut Context, buffer: &mut ReadBuf) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        ready!(Pin::new(&mut self.stream).poll_read(context, buffer))?;
        let lines = self.lines.count(&buffer.filled()[before..]);
        self.lengths.come.fetch_add(lines, Ordering::Relaxed);
        Poll::Ready(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_counted_with_any_header_and_any_split() {
        let head =
            b"POST / HTTP/1.1\r\nCONTENT-Length: 4\nX: content-length:\r\ncontent-length2: 4\r\n content-length: 4\r\n\
            content-content-length: 1\r\ncontent-length:4\r\n\r\n";
        assert_eq!(Lines::default().count(head), 2);
        for cut in 0..head.len() {
            let mut lines = Lines::default();
            assert_eq!(lines.count(&head[..cut]) + lines.count(&head[cut..]), 2, "cut at {cut}");
        }
    }

    #[test]
    fn a_request_has_two_lengths_where_a_line_has_come_that_it_does_not_show() {
        let lengths = Lengths::default();
        lengths.come.store(1, Ordering::Relaxed);
        assert!(!lengths.are_two(1, false));
        assert!(!lengths.are_two(0, true));
        lengths.come.store(2, Ordering::Relaxed);
        assert!(!lengths.are_two(0, false) && lengths.are_two(0, true));
    }
}
