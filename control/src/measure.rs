//! Measurement: position and speed from the encoder, the switches, the cause of a reset, and faults of encoder and beam. The
//! consequences for the tool are decided elsewhere.

pub mod monitor;
pub mod quadrature;
pub mod readings;
pub mod reset;
pub mod sensors;
pub mod speed;
pub mod switch;
