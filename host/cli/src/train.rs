//! `weeder train`: trains an example table from labelled detections, and reports how well it separates plants from
//! weeds.

use anyhow::{Error, Result, bail, ensure};
use clap::builder::TypedValueParser;
use clap::{ArgGroup, Args};
use control::{
    ground::{class::Class, examples},
    settings::Setting,
};
use field::row::Kind;
use frame::{
    Messages, OutFile, OutName, Replace, Results,
    source::{self, offering},
    whole_within, write_if_asked,
};
use link::examples::CAPACITY;
use serde_json::{Value, json};
use std::fmt::{self, Display, Formatter};
use std::path::{Path, PathBuf};
use study::statistics::Share;
use study::training::synthetic::{CROPS, Crop};
use study::training::{
    self, Beside, Confusion, DEFAULT_MOST_EXAMPLES, Labelled, MOST_EXAMPLES, Training, listing, regions, synthetic,
    table::{self, ToLearn},
};

#[derive(Args)]
#[command(group = ArgGroup::new("objects").required(true).args(["files", "synthetic"]), after_help = "\
Examples:
  weeder train field.csv --picture field.svg                    print its error rates, and draw it
  weeder train field.csv --force --out control/src/ground/examples/table.rs    for the next `weeder flash`
  weeder train --synthetic                                      the built-in table, from simulated rows
  weeder train --synthetic --crop maize --beside --out maize.csv    examples for `weeder examples push`")]
pub struct Arguments {
    /// CSV files with the columns speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,label (plant or weed); - for
    /// standard input.
    #[arg(value_name = "FILE.csv", value_parser = source::file())]
    files: Vec<PathBuf>,
    /// Learn from simulated rows at four speeds and two spacings.
    #[arg(long)]
    synthetic: bool,
    /// The crop of the simulated rows: chilli, broccoli or maize.
    #[arg(long, value_name = "CROP", default_value = "chilli", value_parser = crop(), hide_possible_values = true, conflicts_with = "files")]
    crop: &'static Crop,
    /// Random seed, 0 to 18446744073709551615.
    #[arg(long, default_value = "1", value_parser = whole_within(0..=u64::MAX), conflicts_with = "files")]
    seed: u64,
    /// Write the table as Rust source for the firmware (.rs), or as examples (.csv).
    #[arg(long, value_name = "FILE.rs|FILE.csv")]
    out: Option<OutName>,
    /// Examples that vote: 1 to 15, or `auto` for the best number.
    #[arg(long, value_name = "auto|N", default_value = "auto", value_parser = votes)]
    k: Votes,
    #[arg(
        long,
        value_name = "N",
        default_value_t = DEFAULT_MOST_EXAMPLES,
        value_parser = whole_within(0..=MOST_EXAMPLES),
        help = format!("Most examples that the table may have, 0 to {MOST_EXAMPLES}: flash has no room for more")
    )]
    max: usize,
    /// Select at most 32 examples for `weeder examples push`, instead of a table for the firmware.
    #[arg(long, conflicts_with_all = ["max", "picture"])]
    beside: bool,
    /// Draw the table's decisions.
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<OutName>,
    #[command(flatten)]
    replace: Replace,
    /// Print JSON instead of words.
    #[arg(long)]
    json: bool,
}

/// A training of so many detections takes half a minute. The time grows with the square of their number.
const QUICK: usize = 5000;

/// How many examples vote; `None` for the best number.
type Votes = Option<u8>;

/// A crop; a shell that completes offers the names.
fn crop() -> impl TypedValueParser<Value = &'static Crop> {
    offering(|| CROPS.iter().map(|crop| crop.name).collect(), find_crop)
}

fn find_crop(name: &str) -> Result<&'static Crop, String> {
    CROPS.iter().find(|crop| crop.name == name).ok_or_else(|| {
        let names: Vec<&str> = CROPS.iter().map(|crop| crop.name).collect();
        format!(
            "it has to be one of {}; of another crop, roll along a row and teach it, see docs/training.md",
            names.join(", ")
        )
    })
}

fn votes(text: &str) -> Result<Votes, String> {
    let given = text.parse().ok().filter(|k| (1..=training::MAX_K).contains(k));
    if text == "auto" || given.is_some() {
        return Ok(given);
    }
    Err(format!("it has to be auto or a number from 1 to {}", training::MAX_K))
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let replace = arguments.replace;
    let table = arguments.out.as_ref().map(|out| destination(out, replace)).transpose()?;
    let picture = arguments.picture.as_ref().map(|picture| picture.file(replace)).transpose()?;
    let objects = arguments.objects()?;
    if arguments.beside {
        return beside(arguments, table.as_ref(), &objects);
    }
    let training = training::train(&objects, arguments.k, arguments.max)?;
    let fresh = Fresh::of(arguments, &training, &objects)?;
    let printed = match arguments.json {
        true => writeln!(Results, "{:#}", in_json(&training, &objects, &fresh)),
        false => report(&training, &objects, &fresh),
    };
    tell_k(training.k);
    if let Some(plants) = training.forgotten() {
        writeln!(
            Messages,
            "With the table, {plants} more plants are unknown than with all detections: allow more examples (--max, at most {MOST_EXAMPLES}), or take out weeds with a wrong label"
        );
    }
    let is_rust = table.as_ref().is_some_and(|table| is_rust(table.path()));
    write_if_asked(table.as_ref(), "Table", arguments.json, |to| match is_rust {
        true => Ok(to.write_all(listing::rust(&training, &arguments.command()).as_bytes())?),
        false => Ok(listing::write_csv(&training.kept, to)?),
    })?;
    write_if_asked(picture.as_ref(), "Picture", arguments.json, |to| {
        Ok(svg::write(to, &regions::draw(&training, &objects))?)
    })?;
    printed
}

impl Arguments {
    fn objects(&self) -> Result<Vec<Labelled>> {
        if self.synthetic {
            return synthetic::objects(self.crop, self.seed);
        }
        let ToLearn { labelled, unlabelled, repeated, contradictions, misread } = table::read_labelled(&self.files)?;
        if unlabelled > 0 {
            writeln!(Messages, "Passed over {unlabelled} without a label");
        }
        if repeated > 0 {
            writeln!(Messages, "Passed over {repeated} that repeat another line");
        }
        if let Some(first) = contradictions.first() {
            writeln!(Messages, "Learned {} with both labels, such as {first}", contradictions.len());
        }
        let count = labelled.len();
        // As many weeds can be unknown to a table that knows its crop.
        if 10 * misread > count {
            writeln!(
                Messages,
                "The machine classified {misread} of {count} otherwise, so the spacings after them differ from those at work: teach some first, and roll again"
            );
        }
        if count > QUICK {
            writeln!(Messages, "Learning from {count} detections takes long: half as many take a quarter of the time");
        }
        Ok(labelled)
    }

    /// The command that gives the same table again.
    fn command(&self) -> String {
        let mut words = vec!["weeder train".to_owned()];
        if self.synthetic {
            words.push("--synthetic".to_owned());
            if self.crop != &CROPS[0] {
                words.push(format!("--crop {}", self.crop.name));
            }
            words.push(format!("--seed {}", self.seed));
        }
        words.extend(self.files.iter().map(|file| file.display().to_string()));
        if let Some(k) = self.k {
            words.push(format!("--k {k}"));
        }
        words.push(format!("--max {}", self.max));
        words.join(" ")
    }
}

/// Chooses the examples to teach in addition to the built-in table, and prints the result.
fn beside(arguments: &Arguments, table: Option<&OutFile>, objects: &[Labelled]) -> Result<()> {
    if table.is_some_and(|table| is_rust(table.path())) {
        bail!("examples to teach beside the built-in table are written as CSV (.csv)");
    }
    let Beside { chosen, before, after } = training::beside(objects, arguments.k, usize::from(CAPACITY))?;
    let printed = match arguments.json {
        true => writeln!(
            Results,
            "{:#}",
            json!({
                "objects": objects.len(),
                "examples": chosen.len(),
                "built_in_alone": counts_in_json(&before),
                "with_these": counts_in_json(&after),
            })
        ),
        false => writeln!(
            Results,
            "Detections  {}\nExamples    {} chosen\n\nBy the built-in table alone\n\n{before}\n\nBy both together\n\n{after}\n",
            objects.len(),
            chosen.len()
        ),
    };
    tell_k(arguments.k.unwrap_or(examples::K));
    write_if_asked(table, "Table", arguments.json, |to| Ok(listing::write_csv(&chosen, to)?))?;
    if let Some(table) = table.filter(|_| chosen.is_empty()) {
        writeln!(Messages, "{} has no example: none improves the built-in table", table.path().display());
    }
    printed
}

/// Says how to set the k of the examples, if it is not the machine's default.
fn tell_k(k: u8) {
    let default = Setting::K.default();
    if u16::from(k) != default {
        writeln!(
            Messages,
            "These examples are for a k of {k}, and the machine starts with {default}: `set k {k}`, then `save`"
        );
    }
}

/// What a table does with detections that it was not learned from.
enum Fresh {
    /// Those of another simulated field, with this seed.
    AnotherField(u64, Confusion),
    /// Those that were held out.
    HeldOut(Confusion),
    /// None: why the rest teaches no table.
    None(Error),
}

impl Fresh {
    fn of(arguments: &Arguments, training: &Training, objects: &[Labelled]) -> Result<Self> {
        if !arguments.synthetic {
            let held_out = training::held_out(objects, arguments.k, arguments.max);
            return Ok(held_out.map_or_else(Self::None, Self::HeldOut));
        }
        let seed = arguments.seed.wrapping_add(1);
        let another = synthetic::objects(arguments.crop, seed)?;
        Ok(Self::AnotherField(seed, training.model().classify(&another)))
    }
}

impl Display for Fresh {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let classified = match self {
            Self::AnotherField(seed, classified) => {
                writeln!(f, "Detections of another field (seed {seed}), classified by the table\n")?;
                classified
            }
            Self::HeldOut(classified) => {
                writeln!(f, "Held out: each fifth of the detections, classified by a table of the others\n")?;
                classified
            }
            Self::None(why) => {
                return write!(
                    f,
                    "Held out: nothing, so nothing tells how the table does in the field. Without a fifth of the detections, {why}"
                );
            }
        };
        let plants = plants_cut(classified);
        writeln!(f, "{classified}")?;
        write!(f, "In the field, {plants} % of the plants may be classified as weeds ({})", plants.kind())
    }
}

fn report(training: &Training, objects: &[Labelled], fresh: &Fresh) -> Result<()> {
    writeln!(Results, "Detections  {}", objects.len())?;
    writeln!(Results, "k           {}", training.k)?;
    writeln!(Results, "Radius      {} (squared distance beyond which a detection is unknown)", training.radius)?;
    writeln!(Results, "Scale       value that maps onto 0, and onto 255")?;
    for (column, range) in table::COLUMNS.iter().zip(training.ranges) {
        writeln!(Results, "            {column:<13} {:>6} {:>6}", range.lowest, range.highest)?;
    }
    writeln!(Results, "Taken out   {} as noise", training.edited_out)?;
    writeln!(Results, "Examples    {} kept", training.kept.len())?;
    writeln!(Results, "\nBefore condensing: each detection classified by all others\n\n{}", training.leave_one_out)?;
    writeln!(
        Results,
        "\nAfter condensing: the detections that it was learned from, classified by the table\n\n{}",
        training.by_table
    )?;
    writeln!(Results, "\n{fresh}\n")
}

fn in_json(training: &Training, objects: &[Labelled], fresh: &Fresh) -> Value {
    let scale = table::COLUMNS.iter().zip(training.ranges);
    let scale = scale.map(|(column, range)| ((*column).to_owned(), json!([range.lowest, range.highest])));
    json!({
        "objects": objects.len(),
        "k": training.k,
        "radius_squared": training.radius,
        "scale": Value::Object(scale.collect()),
        "taken_out": training.edited_out,
        "examples": training.kept.len(),
        "before_condensing": counts_in_json(&training.leave_one_out),
        "after_condensing": counts_in_json(&training.by_table),
        "another_field": match fresh {
            Fresh::AnotherField(_, classified) => Some(counts_in_json(classified)),
            _ => None,
        },
        "held_out": match fresh {
            Fresh::HeldOut(classified) => Some(counts_in_json(classified)),
            _ => None,
        },
    })
}

fn counts_in_json(classified: &Confusion) -> Value {
    let of = |kind| {
        let count = |class| classified.of(kind, class);
        json!({ "plant": count(Class::Plant), "unknown": count(Class::Unknown), "weed": count(Class::Weed) })
    };
    json!({
        "objects": classified.total(),
        "plants_taken_for_weeds": classified.plants_taken_for_weeds(),
        "plants_taken_for_weeds_share": plants_cut(classified),
        "plants_as": of(Kind::Plant),
        "weeds_as": of(Kind::Weed),
    })
}

/// The share of the plants that would be cut.
fn plants_cut(classified: &Confusion) -> Share {
    Share::of(classified.plants_taken_for_weeds() as u64, classified.count(Kind::Plant) as u64)
}

/// Whether a table is written as Rust, by the ending of its name, and not as CSV.
fn is_rust(table: &Path) -> bool {
    table.extension().is_some_and(|ending| ending == "rs")
}

/// The table's file, if the ending of its name selects a format.
fn destination(name: &OutName, replace: Replace) -> Result<OutFile> {
    let path = name.path();
    let has_format = is_rust(path) || path.extension().is_some_and(|ending| ending == "csv");
    ensure!(has_format, "{}: a table is written as Rust (.rs) or as CSV (.csv)", path.display());
    name.file(replace)
}
