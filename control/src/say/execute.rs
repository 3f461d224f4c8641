//! Runs commands: what each does to the machine, and how its answer begins.

use super::{
    answer::Answer,
    command::{Action, Command, ParseError},
};
use crate::{
    ground::class::Classifier,
    memory::Memory,
    operate::{command_error::CommandError, plot::Plot},
    settings::Setting,
    weeder::Controller,
};

/// Runs a line and begins its answer, for a caller that can do both at once.
pub fn answer_to<C: Classifier, M: Memory>(
    line: Result<&Command, ParseError>,
    controller: &mut Controller<C, M>,
) -> Answer {
    match line {
        Ok(command) => execute(command, controller),
        Err(error) => refuse(error, controller),
    }
}

/// Begins the answer to a line that is no command.
pub(super) fn refuse<C: Classifier, M: Memory>(error: ParseError, controller: &mut Controller<C, M>) -> Answer {
    controller.count_command_error();
    error.into()
}

/// Runs a command and begins its answer.
#[inline(never)]
pub fn execute<C: Classifier, M: Memory>(command: &Command, controller: &mut Controller<C, M>) -> Answer {
    let Command { action, setting, number, force } = *command;
    let result = match action {
        Action::Help => return Answer::Help(0),
        Action::Explain => return Answer::Explain(setting),
        Action::Status => return Answer::Status,
        Action::GetAll => return Answer::GetAll(0),
        Action::Get => return Answer::Get(setting),
        Action::Version => return Answer::Version,
        Action::Examples => return Answer::Examples(0),
        Action::Dump => return Answer::DumpHeading,
        Action::Set => match controller.set(setting, number) {
            Err(CommandError::OutOfRange) => return Answer::OutOfRange(setting),
            Err(CommandError::NotInHold) => return Answer::HoldToSet(setting),
            result => result,
        },
        Action::Save => controller.save(),
        Action::Revert => controller.take_saved(),
        Action::Defaults => controller.take_defaults(),
        Action::CalibrateStart => controller.calibrate_start(),
        Action::Calibrate => match controller.calibrate(number, force) {
            Ok(()) => return Answer::Calibrated,
            Err(CommandError::OutOfRange) => return Answer::OutOfRange(Setting::TicksPerM),
            Err(CommandError::NotInHold) => return Answer::HoldToSet(Setting::TicksPerM),
            result => result,
        },
        Action::CalibrateServo => controller.calibrate_servo(),
        Action::ServoIn => controller.servo_in(),
        Action::ServoOut => controller.servo_out(),
        Action::Servo => controller.servo_by_hand(number),
        Action::TestRow => controller.test_row(number),
        Action::TestWatchdog => controller.test_watchdog(),
        Action::PlotOn | Action::PlotOff | Action::PlotTeleplot => {
            controller.set_plot(match action {
                Action::PlotOn => Plot::Arduino,
                Action::PlotTeleplot => Plot::Teleplot,
                _ => Plot::Off,
            });
            Ok(())
        }
        Action::Start | Action::StartNow => controller.start(matches!(action, Action::StartNow)),
        Action::LabelPlant | Action::LabelWeed => {
            controller.label(u8::from(matches!(action, Action::LabelPlant)), force)
        }
        Action::Feature => {
            controller.enter_feature(number as u8);
            Ok(())
        }
        Action::TeachPlant | Action::TeachWeed => controller.teach(u8::from(matches!(action, Action::TeachPlant))),
        Action::Forget => controller.forget(number as u8),
        Action::ForgetAll => controller.forget_all(),
        Action::Hold => {
            controller.hold();
            Ok(())
        }
        Action::Clear => {
            controller.clear();
            Ok(())
        }
        Action::EventsOn | Action::EventsOff => {
            controller.enable_events(matches!(action, Action::EventsOn));
            Ok(())
        }
    };
    match result {
        Ok(()) => Answer::Ok,
        Err(error) => Answer::Refused(error),
    }
}
