//! Positions on the ground: a satellite receiver's lines, the antenna's track along the wheel's distance, and a map of
//! a job.
//!
//! - [`sentence`] parses a line of NMEA 0183. [`receiver`] makes fixes and marks from sentences. [`track`] finds
//!   positions between fixes by the wheel's distance, and [`wheel`] compares that. [`plane`] has the earth's shape.
//! - [`recorder`] makes a log's lines from the receiver's output, or from a file by [`playback`]. [`job`] reads a log, and [`summary`] counts it.
//!   [`map`] exports it as GeoJSON, and [`picture`] draws it.
//! - [`simulated`] is a receiver on a simulated machine.
//!
//! It opens no file and no port: the caller passes a log's lines. Like [`link`], it compiles for a browser.

pub mod antenna;
pub mod job;
pub mod map;
pub mod picture;
pub mod plane;
pub mod playback;
pub mod receiver;
pub mod recorder;
pub mod sentence;
pub mod simulated;
pub mod summary;
pub mod track;
pub mod wheel;

pub use antenna::Antenna;
pub use job::{Job, Wanted};
pub use recorder::Recorder;
