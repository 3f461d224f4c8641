//! `weeder plan`: creates a randomised plan of a field trial, as a table to fill in.

use anyhow::Result;
use clap::Args;
use frame::{OutName, Replace, Results, command_line, number_within, whole_within};
use study::plan::Plan;
use study::sweep::{SPACINGS_CM, SPEEDS_KM_H};
use study::table::distinct;

#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder plan --out trial.csv                       the paper's speeds and spacings in three blocks
  weeder plan --out trial.csv --sheets sheets.html  with a sheet for each plot, to print
  weeder plan --speeds 1,2 --spacings 50 --blocks 5 --seed 7
  weeder evaluate trial.csv                         after you have filled it in")]
pub struct Arguments {
    /// Forward speeds in km/h, each 0.1 to 8.
    #[arg(long, value_delimiter = ',', default_value = "1,1.5,2,2.5", value_parser = number_within(SPEEDS_KM_H.0..=SPEEDS_KM_H.1))]
    speeds: Vec<f64>,
    /// Plant spacings in cm, each 5 to 500.
    #[arg(long, value_delimiter = ',', default_value = "50,60", value_parser = number_within(SPACINGS_CM.0..=SPACINGS_CM.1))]
    spacings: Vec<f64>,
    /// Blocks, 2 to 100: each has every speed with every spacing once. The table calls them replications.
    #[arg(long, default_value = "3", value_parser = whole_within(2..=100_u32))]
    blocks: u32,
    /// Working width of the machine in m, 0.01 to 50, for the table.
    #[arg(long, value_parser = number_within(0.01..=50.0))]
    width: Option<f64>,
    /// Power that it needs in hp, 0.001 to 1000, for the table.
    #[arg(long, value_parser = number_within(0.001..=1000.0))]
    power: Option<f64>,
    /// Random seed, 0 to 18446744073709551615.
    #[arg(long, default_value = "1", value_parser = whole_within(0..=u64::MAX))]
    seed: u64,
    /// Write the table into this file instead of printing it.
    #[arg(long, value_name = "FILE.csv")]
    out: Option<OutName>,
    /// Also write a page to print, with a sheet for each plot.
    #[arg(long, value_name = "FILE.html")]
    sheets: Option<OutName>,
    #[command(flatten)]
    replace: Replace,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let out = arguments.out.as_ref().map(|out| out.file(arguments.replace)).transpose()?;
    let sheets = arguments.sheets.as_ref().map(|sheets| sheets.file(arguments.replace)).transpose()?;
    let plan = Plan {
        speeds_km_h: distinct(arguments.speeds.clone()),
        spacings_cm: distinct(arguments.spacings.clone()),
        blocks: arguments.blocks,
        width_m: arguments.width,
        power_hp: arguments.power,
        seed: arguments.seed,
    };
    let notes = [
        format!("Randomised: {}", command_line()?),
        "Mark out the plots side by side in this order; a block is a stretch of field that is as even as it can be."
            .to_owned(),
        "Count weeds on the same marked ground before and after, and the plants; write down area and time with turns."
            .to_owned(),
        "Then: weeder evaluate THIS_FILE".to_owned(),
    ];
    if let Some(sheets) = &sheets {
        sheets.write(|to| Ok(plan.write_sheets(to)?))?;
    }
    match &out {
        None => {
            let mut table = Vec::new();
            plan.write_csv(&notes, &mut table)?;
            write!(Results, "{}", String::from_utf8_lossy(&table))
        }
        Some(out) => {
            out.write(|to| Ok(plan.write_csv(&notes, to)?))?;
            writeln!(
                Results,
                "Written: {}, {} plots in {} blocks",
                out.path().display(),
                plan.plots().len(),
                plan.blocks
            )
        }
    }
}
