//! What is measured: place and speed by the encoder, the switches, why the machine was reset, and whether encoder and beam can be
//! believed. What any of it means for the tool is decided elsewhere.

pub mod monitor;
pub mod quadrature;
pub mod readings;
pub mod reset;
pub mod sensors;
pub mod speed;
pub mod switch;
