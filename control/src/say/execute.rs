//! Runs commands: what each does to the machine, and how its answer begins.

use super::{
    answer::Answer,
    command::{Command, ParseError},
};
use crate::{
    ground::class::Classifier, memory::Memory, operate::command_error::CommandError, settings::Setting,
    weeder::Controller,
};

/// Runs a line and begins its answer.
#[inline(never)]
pub fn execute<C, M>(line: Result<Command, ParseError>, controller: &mut Controller<C, M>) -> Answer
where
    C: Classifier,
    M: Memory,
{
    let command = match line {
        Ok(command) => command,
        Err(error) => {
            controller.count_command_error();
            return Answer::Wrong(error);
        }
    };
    match command {
        Command::Help => Answer::Help(0),
        Command::Explain(setting) => Answer::Explain(setting),
        Command::Status => Answer::Status,
        Command::GetAll => Answer::GetAll(0),
        Command::Get(setting) => Answer::Get(setting),
        Command::Version => Answer::Version,
        Command::Examples => Answer::Examples(0),
        Command::Dump => Answer::DumpHeading,
        Command::Set(setting, value) => done(controller.set(setting, value), Some(setting)),
        Command::Save => done(controller.save(), None),
        Command::Revert => done(controller.take_saved(), None),
        Command::Defaults => done(controller.take_defaults(), None),
        Command::CalibrateStart => done(controller.calibrate_start(), None),
        Command::Calibrate { distance_mm, force } => match controller.calibrate(distance_mm, force) {
            Ok(()) => Answer::Get(Setting::TicksPerM),
            refused => done(refused, Some(Setting::TicksPerM)),
        },
        Command::CalibrateServo => done(controller.calibrate_servo(), None),
        Command::ServoIn => done(controller.servo_in(), None),
        Command::ServoOut => done(controller.servo_out(), None),
        Command::Servo(pulse_us) => done(controller.servo_by_hand(pulse_us), None),
        Command::TestRow { speed_mm_s } => done(controller.test_row(speed_mm_s), None),
        Command::TestWatchdog => done(controller.test_watchdog(), None),
        Command::Plot(plot) => {
            controller.set_plot(plot);
            Answer::Ok
        }
        Command::Start { now } => done(controller.start(now), None),
        Command::Label { label, force } => done(controller.label(label, force), None),
        Command::Feature(feature) => {
            controller.enter_feature(feature);
            Answer::Ok
        }
        Command::Teach(label) => done(controller.teach(label), None),
        Command::Forget(number) => done(controller.forget(number), None),
        Command::ForgetAll => {
            controller.forget_all();
            Answer::Ok
        }
        Command::Hold => {
            controller.hold();
            Answer::Ok
        }
        Command::Clear => {
            controller.clear();
            Answer::Ok
        }
        Command::Events(on) => {
            controller.enable_events(on);
            Answer::Ok
        }
    }
}

/// The answer to a command that can fail.
#[inline(never)]
fn done(result: Result<(), CommandError>, setting: Option<Setting>) -> Answer {
    match result {
        Ok(()) => Answer::Ok,
        Err(error) => Answer::Refused(error, setting),
    }
}
