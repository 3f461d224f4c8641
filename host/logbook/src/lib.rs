//! A session's log.
//!
//! [`log`] writes and reads it, and [`pieces`] reads it bit by bit. A [`follower`] knows the settings in use, the commands without an answer, restarts and
//! positions at each of its lines. [`worked`] divides it into the stretches that were worked, and [`replay`] repeats the
//! firmware's decisions. Maps and pictures of it are made by `gps` and the page.
//!
//! The log is not trusted: a line may be damaged, cut short or from another version. It also compiles for a browser.

mod disk;
pub mod follower;
pub mod log;
pub mod pieces;
pub mod replay;
pub mod worked;
