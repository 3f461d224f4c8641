//! `weeder train`: makes an example table of labelled objects, and says how well it tells plants from weeds.

use crate::Finding;
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use field::training::{
    self, DEFAULT_MOST_EXAMPLES, Labelled, MOST_EXAMPLES, Training, listing, regions, synthetic, table,
};
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// What the user asks of a training.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder train field.csv --picture field.svg                    say how well it would do, and draw it
  weeder train field.csv --out control/src/examples/table.rs    have the next `weeder flash` take it along
  weeder train --synthetic                                      the built-in table, from simulated rows")]
pub struct Arguments {
    /// CSV files with the columns speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,label; label is plant or weed.
    #[arg(value_name = "FILE.csv", required_unless_present = "synthetic", conflicts_with = "synthetic")]
    files: Vec<PathBuf>,
    /// Learn from simulated rows at four speeds and two spacings instead.
    #[arg(long)]
    synthetic: bool,
    /// Which of all the possible simulated fields: the same seed gives the same table.
    #[arg(long, default_value = "1", conflicts_with = "files")]
    seed: u64,
    /// Write the table: as Rust source for the firmware (.rs), or as a table of examples (.csv).
    #[arg(long, value_name = "FILE.rs|FILE.csv")]
    out: Option<PathBuf>,
    /// Examples that vote: 1 to 15, or `auto` for those that do best.
    #[arg(long, value_name = "auto|N", default_value = "auto")]
    k: Votes,
    #[arg(
        long,
        value_name = "N",
        default_value_t = DEFAULT_MOST_EXAMPLES,
        help = format!("Most examples that the table may have, up to {MOST_EXAMPLES}")
    )]
    max: usize,
    /// Draw what the table decides.
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
}

/// How many examples vote.
#[derive(Clone, Copy)]
enum Votes {
    Auto,
    Given(u8),
}

impl FromStr for Votes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let given = text.parse().ok().filter(|k| (1..=training::MAX_K).contains(k));
        given.map(Self::Given).ok_or_else(|| format!("it has to be auto or a number from 1 to {}", training::MAX_K))
    }
}

/// Trains, and prints what came of it.
///
/// # Errors
/// Where a file or its contents are wrong, or the table would not fit.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    ensure!(
        arguments.max <= MOST_EXAMPLES,
        "too many examples for the flash budget: --max is {} and there is room for {MOST_EXAMPLES}",
        arguments.max
    );
    let write = arguments.out.as_deref().map(writer).transpose()?;
    let objects = arguments.objects()?;
    let k = match arguments.k {
        Votes::Auto => None,
        Votes::Given(k) => Some(k),
    };
    let training = training::train(&objects, k, arguments.max)?;
    report(&training, &objects);
    if arguments.synthetic {
        let seed = arguments.seed.wrapping_add(1);
        println!("\nObjects of another field (seed {seed}), judged by the table\n");
        println!("{}", training.model().judge(&synthetic::objects(seed)?));
    }
    println!();
    if let (Some(path), Some(write)) = (&arguments.out, write) {
        write(&training, &arguments.command(), path)?;
        println!("Table       {}", path.display());
    }
    if let Some(path) = &arguments.picture {
        svg::save(path, &regions::draw(&training, &objects))
            .with_context(|| format!("{} cannot be written", path.display()))?;
        println!("Picture     {}", path.display());
    }
    Ok(Finding::Good)
}

impl Arguments {
    fn objects(&self) -> Result<Vec<Labelled>> {
        if self.synthetic {
            return Ok(synthetic::objects(self.seed)?);
        }
        let lesson = table::read_labelled(&self.files)?;
        if lesson.unlabelled > 0 {
            println!("Passed over {} without a label", lesson.unlabelled);
        }
        Ok(lesson.objects)
    }

    /// The command that gives the same table again.
    fn command(&self) -> String {
        let mut words = vec!["weeder train".to_owned()];
        if self.synthetic {
            words.push(format!("--synthetic --seed {}", self.seed));
        }
        words.extend(self.files.iter().map(|file| file.display().to_string()));
        if let Votes::Given(k) = self.k {
            words.push(format!("--k {k}"));
        }
        words.push(format!("--max {}", self.max));
        words.join(" ")
    }
}

fn report(training: &Training, objects: &[Labelled]) {
    println!("Objects     {}", objects.len());
    println!("k           {}", training.k);
    println!("Radius      {} (squared distance beyond which an object is unknown)", training.radius);
    println!("Scale       value that maps onto 0, and onto 255");
    for (column, range) in table::COLUMNS.iter().zip(training.ranges) {
        println!("            {column:<13} {:>6} {:>6}", range.lowest, range.highest);
    }
    println!("Taken out   {} as noise", training.edited_out);
    println!("Examples    {} kept", training.kept.len());
    println!("\nBefore condensing: each object judged by all others\n");
    println!("{}", training.leave_one_out);
    println!("\nAfter condensing: all objects judged by the table\n");
    println!("{}", training.by_table);
}

/// Writes a table, given the command that made it, to a file.
type Write = fn(&Training, &str, &Path) -> Result<()>;

/// How a table is written to a file of this name.
fn writer(path: &Path) -> Result<Write> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("rs") => Ok(|training, command, path| {
            let text = listing::rust(training, command);
            fs::write(path, text).with_context(|| format!("{} cannot be written", path.display()))
        }),
        Some("csv") => Ok(|training, _, path| {
            let context = || format!("{} cannot be written", path.display());
            let file = fs::File::create(path).with_context(context)?;
            listing::write_csv(training, file).with_context(context)
        }),
        _ => bail!("{}: a table is written as Rust (.rs) or as CSV (.csv)", path.display()),
    }
}
