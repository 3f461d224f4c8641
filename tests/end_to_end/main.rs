//! End-to-end tests: the real ELF in the virtual Uno, observed at its pins and its serial line.
//!
//! Each file has one behaviour. All are modules of one test program, so that the firmware is built once and the
//! simulations share the cores. The assertions concern behaviour outside the chip. The decisions are tested in
//! `control`, and the simulator in `field`.

mod alarms;
mod common;
mod console_grammar;
mod console_settings;
mod encoder_at_full_rate;
mod end_switch_and_moves_by_hand;
mod field_examples;
mod field_trial;
mod host_link;
mod interrupt_budgets;
mod leaves_the_row_when_told;
mod long_beam_distance;
mod memory_budget;
mod native_run;
mod on_the_bench;
mod paper_mode;
mod performance_servo_jitter;
mod performance_swing_commands;
mod power_and_memory_faults;
mod proved_bounds;
mod random_walks;
mod recipes;
mod recordings;
mod saved_while_the_servo_is_timed;
mod second_beam;
mod sensor_faults;
mod serial_noise;
mod servo_pulses;
mod soak;
mod stops_and_rolls_back;
mod tall_weeds;
mod the_schedule_on_the_pins;
mod turns_of_the_loop;
mod unseen_plants;
mod wakes_up_in_hold;
mod weeds_at_every_speed;
