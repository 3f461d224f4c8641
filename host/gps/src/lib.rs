//! Where on the ground things are: a satellite receiver's lines, the antenna's track along the wheel's distance, and a
//! map of a job.
//!
//! - [`sentence`] reads a line of NMEA 0183, [`receiver`] makes fixes and marks of them, and [`track`] finds what
//!   happened between fixes by the wheel's distance. [`plane`] knows the earth's shape.
//! - [`recorder`] makes a record's lines of what the receiver says. [`job`] reads a record, and [`summary`] counts it.
//!   [`map`] is it as GeoJSON, [`picture`] as a drawing.
//!
//! It opens no file and no port: a log's lines are given to it. It compiles for a browser as [`link`] does.

pub mod antenna;
pub mod job;
pub mod map;
pub mod picture;
pub mod plane;
pub mod receiver;
pub mod recorder;
pub mod sentence;
pub mod summary;
pub mod track;

pub use antenna::Antenna;
pub use job::{Job, Wanted};
pub use receiver::Receiver;
pub use recorder::Recorder;
