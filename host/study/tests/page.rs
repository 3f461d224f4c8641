//! Tests of a trial's page, in a browser's and a reader's view.

use expect_test::expect;
use field::budget::{Budget, Part, Reason};
use field::machine::Machine;
use field::motion::Motion;
use field::tool_path::{Effect, WeedCount};
use roxmltree::{Document, Node, ParsingOptions};
use std::sync::LazyLock;
use study::evaluation::{Analysis, PlotRecord};
use study::experiment::{ControllerKind, PlotOutcome, Total, Zones};
use study::page::Page;
use study::statistics::Mean;

/// Four speeds, two spacings, three replications. With `damages`, damage grows with speed.
fn trial(damages: bool) -> Analysis {
    let mut records = Vec::new();
    for replication in 1..=3 {
        for (step, speed_km_h) in [1.0, 1.5, 2.0, 2.5].into_iter().enumerate() {
            for (wider, spacing_cm) in [50.0, 60.0].into_iter().enumerate() {
                let chance = (replication * 7 + step as u32 * 5 + wider as u32 * 3) % 5;
                records.push(PlotRecord {
                    plot: 0,
                    replication,
                    speed_km_h,
                    spacing_cm,
                    weeds_before: Some(150 + chance),
                    weeds_after: Some(20 + 3 * step as u32 + chance / 2),
                    plants: Some(97),
                    damaged: Some(if damages { step as u32 + chance / 2 } else { 0 }),
                    area_m2: Some(20.0),
                    time_s: Some(210.0 / speed_km_h + f64::from(chance)),
                    width_m: Some(0.4),
                    power_hp: Some(1.5),
                });
            }
        }
    }
    Analysis::of(records).unwrap()
}

/// A total with these plants damaged, zones reached and ground weeded, each out of a thousand.
fn total(controller: ControllerKind, speed_km_h: f64, damaged: u32, reached: u32, weeded: f64) -> Total {
    let plants = if damaged == 0 { 97 } else { 1000 };
    let plots = PlotOutcome {
        controller,
        record: PlotRecord { speed_km_h, ..PlotRecord::default() },
        effect: Effect { plants, damaged, in_row: WeedCount { before: 10_000, after: 5874 }, ..Effect::default() },
        zones: Zones { all: 1000, reached, margins_cut: 0 },
        weeded_share: weeded / 1000.0,
        weedable_share: if speed_km_h == 1.0 { 0.432 } else { 0.269 },
        undamaged_share: 0.0,
        budget: budget(weeded),
        alarms: 0,
        moved_s: 0.0,
    };
    Total { plots, weeded_percent: Mean::of(&[]) }
}

fn totals() -> Vec<Total> {
    vec![
        total(ControllerKind::Firmware, 1.0, 0, 0, 421.0),
        total(ControllerKind::WithoutLookAhead, 1.0, 0, 214, 448.0),
        total(ControllerKind::Paper, 1.0, 0, 306, 605.0),
        total(ControllerKind::Ideal, 1.0, 0, 935, 710.0),
        total(ControllerKind::Firmware, 2.5, 0, 12, 243.0),
        total(ControllerKind::WithoutLookAhead, 2.5, 29, 862, 339.0),
        total(ControllerKind::Paper, 2.5, 142, 977, 501.0),
        total(ControllerKind::Ideal, 2.5, 0, 991, 553.0),
    ]
}

/// One metre of row: `weeded_mm` of it weeded, 300 mm of canopy, and the rest lost to swings.
fn budget(weeded_mm: f64) -> Budget {
    let machine = Machine::default();
    let motion = Motion::steady(machine.beam_to_tool_mm, 1e9, 1000.0, machine.beam_to_tool_mm + 1000.0);
    let reasons = [(0.0..0.3, Part::Plants), (0.3..1.1, Part::Swings)];
    let reasons = reasons.map(|(times_s, part)| Reason { times_s, part });
    Budget::of(&(0.0..1000.0), &[1000.0 - weeded_mm..1000.0], &reasons, &machine, &motion)
}

fn row() -> String {
    let drawing =
        svg::Document::new().set("viewBox", (0, 0, 10, 10)).add(svg::node::element::Circle::new().set("r", 4));
    drawing.to_string()
}

/// A page with all parts.
fn full_page() -> String {
    page_of(&totals())
}

/// The same, parsed once.
fn full() -> Document<'static> {
    static XML: LazyLock<String> = LazyLock::new(|| closed(&full_page()));
    parse(&XML)
}

/// A page with all parts, of these totals.
fn page_of(totals: &[Total]) -> String {
    let parameters = [("seed".to_owned(), "7".to_owned()), ("engine".to_owned(), "native".to_owned())];
    let (analysis, row) = (trial(true), row());
    let summary = vec!["No plant was damaged.".to_owned(), "Most weeds are gone.".to_owned()];
    let command = "weeder trial --seed 7";
    let page =
        Page { summary, command, parameters: &parameters, totals, row: Some(&row), ..plain("A trial", &analysis) };
    page.html().unwrap()
}

/// A real trial's page, which has no comparison and no row.
fn plain<'a>(title: &'a str, analysis: &'a Analysis) -> Page<'a> {
    Page {
        title,
        summary: analysis.findings(),
        paper: Vec::new(),
        command: "weeder evaluate",
        parameters: &[],
        analysis,
        log: None,
        totals: &[],
        row: None,
    }
}

fn plain_page(title: &str, analysis: &Analysis) -> String {
    plain(title, analysis).html().unwrap()
}

/// The page as XML, once the elements are closed that HTML leaves open.
fn closed(html: &str) -> String {
    html.lines()
        .map(|line| if line.starts_with("<meta") { line.replace('>', "/>") } else { line.to_owned() })
        .collect::<Vec<_>>()
        .join("\n")
}

fn parse(xml: &str) -> Document<'_> {
    Document::parse_with_options(xml, ParsingOptions { allow_dtd: true, ..Default::default() }).unwrap()
}

/// The visible text of an element.
fn text(node: Node) -> String {
    node.descendants().filter(Node::is_text).filter_map(|text| text.text()).collect()
}

/// The cells of a table's body, by its caption.
fn cells(page: &Document, caption: &str) -> Vec<Vec<String>> {
    let table = |node: &Node| {
        node.has_tag_name("table") && node.first_element_child().is_some_and(|first| text(first) == caption)
    };
    let table = page.descendants().find(table).unwrap_or_else(|| panic!("no table {caption}"));
    let rows = table.descendants().filter(|node| node.has_tag_name("tr")).skip(1);
    rows.map(|row| row.children().filter(Node::is_element).map(text).collect()).collect()
}

#[test]
fn every_element_is_closed_and_every_id_unique() {
    let page = full();
    assert_eq!(page.root_element().tag_name().name(), "html");
    let mut ids: Vec<_> = page.descendants().filter_map(|node| node.attribute("id")).collect();
    let links = page.descendants().filter_map(|node| node.attribute("href"));
    for link in links {
        let target = link.strip_prefix('#').expect("links stay on the page");
        assert!(ids.contains(&target), "{link} leads nowhere");
    }
    let count = ids.len();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), count);
}

#[test]
fn the_page_needs_nothing_but_itself() {
    let html = full_page();
    for foreign in ["<script", "<link", "<img", "<iframe", "<object", "src=", "@import", "@font-face", "url("] {
        assert!(!html.contains(foreign), "{foreign}");
    }
    let without_namespaces = html.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    assert!(!without_namespaces.contains("http"));
    assert!(html.len() < 200_000, "{} bytes", html.len());
}

#[test]
fn the_loss_budget_fills_its_bars_and_its_rows_add_up() {
    let page = full();
    let bars: Vec<Node> = page.descendants().filter(|node| node.attribute("class") == Some("bar")).collect();
    assert_eq!(bars.len(), 2);
    for bar in bars {
        let grows = bar.children().filter_map(|piece| piece.attribute("style")?.strip_prefix("flex-grow: "));
        assert_eq!(grows.map(|grow| grow.parse::<u32>().unwrap()).sum::<u32>(), 1000);
    }
    let rows = cells(&page, "Where the row's ground went");
    assert_eq!(rows[0], ["1 km/h", "42.1", "30.0", "0.0", "0.0", "0.0", "27.9", "0.0"]);
}

#[test]
fn the_simulated_machine_stands_beside_published_ones_and_is_marked() {
    let rows = cells(&full(), "This machine, simulated, and machines in fields");
    assert_eq!(rows[1][0], "this firmware, SIMULATED");
    assert_eq!(rows[1][3..6], ["2.5", "41.3 in the row, \u{2013} in the plot", "0.0 (below 3.1)"]);
    let jia = rows.iter().find(|row| row[0].starts_with("Jia")).unwrap();
    assert_eq!(jia[3..6], ["4 to 7", "95.8", "0.6"]);
    assert!(rows.iter().skip(2).all(|row| !row[0].contains("SIMULATED") && !row[6].is_empty()));
}

#[test]
fn the_page_is_the_same_each_time() {
    assert_eq!(full_page(), full_page());
}

#[test]
fn every_plot_is_in_the_table_with_its_measures() {
    let page = full();
    let analysis = trial(true);
    let rows = cells(&page, "Each plot: counts, measurements and results");
    assert_eq!(rows.len(), 24);
    for (record, row) in analysis.records.iter().zip(rows) {
        let performance = record.performance();
        let number = |index: usize| row[index].parse::<f64>().unwrap();
        let shown: Vec<f64> = (1..18).map(number).collect();
        let expected = [
            f64::from(record.replication),
            record.speed_km_h,
            record.spacing_cm,
            f64::from(record.weeds_before.unwrap()),
            f64::from(record.weeds_after.unwrap()),
            f64::from(record.plants.unwrap()),
            f64::from(record.damaged.unwrap()),
            record.area_m2.unwrap(),
            record.time_s.unwrap(),
            record.width_m.unwrap(),
            record.power_hp.unwrap(),
            performance.plant_damage_percent.unwrap(),
            performance.weeding_efficiency_percent.unwrap(),
            performance.theoretical_capacity_ha_h.unwrap(),
            performance.effective_capacity_ha_h.unwrap(),
            performance.field_efficiency_percent.unwrap(),
            performance.performance_index.unwrap(),
        ];
        for (shown, expected) in shown.iter().zip(expected) {
            assert!((shown - expected).abs() <= 0.0501, "{shown} for {expected}");
        }
    }
    let means = cells(&page, "Means of the plots of each treatment");
    assert_eq!(means.len(), 8);
    assert_eq!(means[0][..2], ["1 km/h, 50 cm", "3"]);
}

#[test]
fn models_stand_beside_the_paper_s_figures() {
    let page = full();
    let analysis = trial(true);
    let headings: Vec<String> = page.descendants().filter(|node| node.has_tag_name("h3")).map(text).collect();
    for of in &analysis.responses {
        let title = of.response.title();
        assert!(headings.iter().any(|heading| heading == title), "{title}");
        for contradiction in of.published.contradictions {
            assert!(text(page.root_element()).contains(contradiction), "{contradiction}");
        }
    }
    // The equation of the weeding efficiency contradicts its text.
    let chapter = page
        .descendants()
        .filter(|node| node.has_tag_name("section"))
        .find(|section| section.first_element_child().is_some_and(|first| text(first) == "Weeding efficiency"))
        .unwrap();
    let words = text(chapter);
    assert!(words.contains("weeding efficiency = 97.2841 \u{2212} 0.199 × speed \u{2212} 0.2068 × spacing"), "{words}");
    let model = analysis.responses[1].model.as_ref().unwrap();
    for term in &model.terms {
        let estimate = format!("{:.2}", term.estimate.abs());
        assert!(words.contains(&estimate), "{} {estimate}", term.name);
    }
    assert!(words.contains(&format!("{:.4}", model.r_squared)));
    assert!(words.contains("0.8361"));
    let variance = analysis.responses[1].variance.as_ref().unwrap();
    for source in &variance.sources {
        assert!(words.contains(&source.name.replace(" x ", " × ")), "{}", source.name);
        // Four digits that count.
        let decimals = (3 - source.sum_of_squares.log10().floor() as i32).clamp(0, 5) as usize;
        assert!(words.contains(&format!("{:.decimals$}", source.sum_of_squares)), "{}", source.name);
    }
}

#[test]
fn controllers_are_compared_in_figures_and_in_a_table() {
    let page = full();
    expect![[r#"
        [
            [
                "1 km/h",
                "42.1",
                "44.8",
                "60.5",
                "71.0",
                "43.2",
            ],
            [
                "2.5 km/h",
                "24.3",
                "33.9",
                "50.1",
                "55.3",
                "26.9",
            ],
        ]
    "#]]
    .assert_debug_eq(&cells(&page, "Ground of the row weeded by each controller, %"));
    let words: Vec<_> = page.descendants().filter_map(|node| node.attribute("aria-label")).collect();
    let damage = words.iter().find(|words| words.starts_with("Plant damage in % of the plants")).unwrap();
    assert!(damage.contains("the paper's controller: 0.0 at 1 km/h, 14.2 at 2.5 km/h."), "{damage}");
}

#[test]
fn zones_reached_stand_beside_damage_and_the_page_says_how_they_differ() {
    let page = full();
    let rows = cells(&page, "Zones reached by each controller, %");
    assert_eq!(rows, [["1 km/h", "0.0", "21.4", "30.6", "93.5"], ["2.5 km/h", "1.2", "86.2", "97.7", "99.1"]]);
    let damage = cells(&page, "Plants damaged by each controller, %");
    assert_eq!(damage[1], ["2.5 km/h", "0.0", "2.9", "14.2", "0.0"]);
    let words = text(page.root_element()).replace('\n', " ");
    for difference in
        ["a sweep when the machine strays", "touched the zone round its stem", "not fully out of the row over it"]
    {
        assert!(words.contains(difference), "{difference}");
    }
}

#[test]
fn small_damage_does_not_read_as_0_and_no_count_reads_as_a_dash() {
    let mut totals = totals();
    totals[4].plots.effect = Effect { plants: 4800, damaged: 1, ..Effect::default() };
    totals[4].plots.zones = Zones::default();
    let xml = closed(&page_of(&totals));
    let page = parse(&xml);
    let first = |caption: &str| cells(&page, caption)[1][1].clone();
    assert_eq!(first("Plants damaged by each controller, %"), "0.021");
    assert_eq!(first("Zones reached by each controller, %"), "\u{2013}");
    let mut records = trial(true).records;
    records.iter_mut().for_each(|plot| (plot.plants, plot.damaged) = (None, None));
    records[1..].iter_mut().for_each(|plot| plot.area_m2 = None);
    let xml = closed(&plain_page("Not counted", &Analysis::of(records).unwrap()));
    let results = cells(&parse(&xml), "Result");
    assert_eq!(results[0], ["plants damaged", "\u{2013}", "counted in no plot"]);
    assert_eq!(results[2], ["ground", "20 m²", "in 1 plot"]);
}

#[test]
fn the_bound_is_named_for_the_kept_margins() {
    let page = full();
    let name = "most with every zone and margin kept";
    let names = |tag: &str| {
        page.descendants().filter(|node| node.has_tag_name(tag)).filter(|node| text(*node).trim() == name).count()
    };
    // The weeding's legend and table, and no other's.
    assert_eq!((names("li"), names("th")), (1, 1));
    let words = text(page.root_element()).to_lowercase();
    assert!(words.contains("not necessarily with stems"));
    assert!(words.matches(name).count() > 2, "it is explained too");
}

#[test]
fn every_picture_has_a_description() {
    let page = full();
    let pictures = page.descendants().filter(|node| node.tag_name().name() == "svg");
    let mut count = 0;
    for picture in pictures {
        let is_said = |node: Node| node.attribute("role") == Some("img") && node.attribute("aria-label").is_some();
        let is_hidden = |node: Node| node.attribute("aria-hidden") == Some("true");
        assert!(picture.ancestors().any(|node| is_said(node) || is_hidden(node)));
        count += usize::from(picture.ancestors().any(is_said));
    }
    // Three of the controllers, four measures, four of residuals, and the row.
    assert_eq!(count, 12);
}

#[test]
fn a_real_trial_is_evaluated_without_comparison_and_row() {
    let html = plain_page("Our field", &trial(true));
    let xml = closed(&html);
    let page = parse(&xml);
    let headings: Vec<String> = page.descendants().filter(|node| node.has_tag_name("h2")).map(text).collect();
    assert_eq!(
        headings,
        ["Performance against speed", "Findings", "Models", "Beside the paper", "Plots", "What is what", "Repeat it"]
    );
    // The first screen has the results with their intervals, before the first chart.
    let results = cells(&page, "Result");
    // 60 of 24 times 97 plants.
    assert_eq!(results[0][..2], ["plants damaged", "2.6 %"]);
    assert!(results[0][2].contains("two-sided 95 % interval") && results[1][2] == "mean of 24 plots", "{results:?}");
    assert!(html.contains("Over a <em>whole plot</em> it is higher"), "what was counted is not known");
    let (first, _) = html.split_once("<main>").unwrap();
    assert!(first.contains("24 plots of 8 treatments") && !first.contains("Weeding efficiency falls"), "{first}");
}

#[test]
fn a_measure_that_never_varies_has_no_model_and_the_page_says_why() {
    let analysis = trial(false);
    let why = analysis.responses[0].model.as_ref().unwrap_err().to_string();
    let xml = closed(&plain_page("No damage", &analysis));
    let words = text(parse(&xml).root_element());
    assert!(words.contains(&why[1..]), "{why}");
    assert!(!words.contains("NaN") && !words.contains("inf "), "no figure is none");
}

#[test]
fn a_trial_of_one_plot_has_a_page() {
    let mut records = trial(true).records;
    records.truncate(1);
    let html = plain_page("One plot", &Analysis::of(records).unwrap());
    let xml = closed(&html);
    let page = parse(&xml);
    assert_eq!(cells(&page, "Each plot: counts, measurements and results").len(), 1);
    assert!(!html.contains("NaN"));
}

#[test]
fn a_mean_at_a_nominal_speed_below_the_measured_ones_stays_in_its_chart() {
    let mut records = trial(true).records;
    records.retain(|plot| plot.speed_km_h.fract() == 0.0);
    records.iter_mut().for_each(|plot| plot.speed_km_h *= 1.15);
    let analysis = Analysis::at_speeds(records, &[1.0, 2.0]).unwrap();
    let xml = closed(&plain_page("Measured", &analysis));
    let page = parse(&xml);
    // Means are large circles, and plotters clamps what is outside the frame. A legend has one at 44.
    let xs =
        page.descendants().filter(|node| node.attribute("r") == Some("12")).filter_map(|node| node.attribute("cx"));
    let left = xs.map(|x| x.parse::<i32>().unwrap()).filter(|x| *x > 44).min().unwrap();
    assert!(left > 90, "{left}: the frame begins at 90");
}

#[test]
fn words_from_outside_stay_words() {
    let hostile = "<script>alert('1 & 2')</script>\"";
    let parameters = [(hostile.to_owned(), hostile.to_owned())];
    let analysis = trial(true);
    let [summary, paper] = [(); 2].map(|()| vec![hostile.to_owned()]);
    let page = Page { summary, paper, command: hostile, parameters: &parameters, ..plain(hostile, &analysis) };
    let html = page.html().unwrap();
    assert!(!html.contains("<script"));
    let xml = closed(&html);
    let page = parse(&xml);
    let said =
        |tag: &str| page.descendants().filter(|node| node.has_tag_name(tag)).any(|node| text(node).trim() == hostile);
    for tag in ["title", "h1", "p", "code", "th", "td"] {
        assert!(said(tag), "{tag}");
    }
}

#[test]
fn every_colour_of_a_plot_has_another_on_dark_paper() {
    let page = full();
    let style = page.descendants().find(|node| node.has_tag_name("style")).unwrap();
    let (_, dark) = style.text().unwrap().split_once("prefers-color-scheme: dark").unwrap();
    let plots = page.descendants().filter(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "svg")));
    for node in plots.flat_map(|plot| plot.descendants()) {
        for attribute in ["fill", "stroke"] {
            let Some(colour) = node.attribute(attribute).filter(|colour| colour.starts_with('#')) else { continue };
            let rule = format!("[{attribute}=\"{colour}\"]");
            assert!(dark.contains(&rule), "no rule {rule}");
        }
    }
}
