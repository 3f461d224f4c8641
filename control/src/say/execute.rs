//! Runs commands: what each does to the machine, and how its answer begins.

use super::{
    answer::Answer,
    command::{Action, Command, ParseError},
};
use crate::{ground::class::Classifier, memory::Memory, operate::plot::Plot, settings::Setting, weeder::Controller};

/// Runs a line and begins its answer.
#[inline(never)]
pub fn execute<C, M>(line: Result<&Command, ParseError>, controller: &mut Controller<C, M>) -> Answer
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
    let Command { action, setting, number, force } = *command;
    let mut refused = None;
    let result = match action {
        Action::Help => return Answer::Help(0),
        Action::Explain => return Answer::Explain(setting),
        Action::Status => return Answer::Status,
        Action::GetAll => return Answer::GetAll(0),
        Action::Get => return Answer::Get(setting),
        Action::Version => return Answer::Version,
        Action::Examples => return Answer::Examples(0),
        Action::Dump => return Answer::DumpHeading,
        Action::Set => {
            refused = Some(setting);
            controller.set(setting, number)
        }
        Action::Save => controller.save(),
        Action::Revert => controller.take_saved(),
        Action::Defaults => controller.take_defaults(),
        Action::CalibrateStart => controller.calibrate_start(),
        Action::Calibrate => {
            refused = Some(Setting::TicksPerM);
            match controller.calibrate(number, force) {
                Ok(()) => return Answer::Calibrated,
                refused => refused,
            }
        }
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
        Action::ForgetAll => {
            controller.forget_all();
            Ok(())
        }
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
        Err(error) => Answer::Refused(error, refused),
    }
}
