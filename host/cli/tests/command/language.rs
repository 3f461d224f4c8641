//! Checks of plain language. The manual and the help have short sentences, narrow tables, and lines that fit a terminal. No word in
//! them hides who acts.

use crate::common::said;
use std::fs;
use std::path::{Path, PathBuf};

/// The repository's folder.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Words that hide who acts, or that chain clauses. They are not used.
const BANNED: [&str; 8] = ["nobody", "whoever", "whatever", "somebody", "anew", "whenever", "of which", "by which"];

const SENTENCE: usize = 30;

/// The widest table, and the longest line of help, in characters.
const TABLE: usize = 110;
const HELP_LINE: usize = 100;

const README: usize = 900;

/// The README, CONTRIBUTING.md, and every page of docs/.
fn pages() -> Vec<(String, String)> {
    let root = Path::new(ROOT);
    let docs =
        fs::read_dir(root.join("docs")).expect("there is a manual").map(|entry| entry.expect("it is listed").path());
    let beside = ["README.md", "CONTRIBUTING.md"].map(|page| root.join(page));
    let mut paths: Vec<PathBuf> = docs.chain(beside).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    paths.sort();
    let name = |path: &Path| path.strip_prefix(root).expect("it is in the repository").display().to_string();
    paths.iter().map(|path| (name(path), fs::read_to_string(path).expect("a page is text"))).collect()
}

/// Every command of `weeder` with its help, subcommands included.
fn helps() -> Vec<(String, String)> {
    let mut helps = Vec::new();
    let mut open = vec![Vec::new()];
    while let Some(words) = open.pop() {
        let mut arguments: Vec<&str> = words.iter().map(String::as_str).collect();
        arguments.push("--help");
        let help = said(Path::new(ROOT), &arguments);
        let listed = help.split_once("Commands:\n").map_or("", |(_, rest)| rest);
        let commands = listed.lines().take_while(|line| !line.is_empty());
        let names = commands.filter_map(|line| line.strip_prefix("  ").filter(|rest| !rest.starts_with(' ')));
        for name in names.filter_map(|line| line.split(' ').next()).filter(|name| *name != "help") {
            open.push([words.clone(), vec![name.to_owned()]].concat());
        }
        helps.push((format!("weeder {}", arguments.join(" ")), help));
    }
    helps
}

/// The banned words in a text, in any case, as whole words.
fn banned(text: &str) -> Vec<&'static str> {
    let words: Vec<String> =
        text.split(|c: char| !c.is_alphabetic()).filter(|word| !word.is_empty()).map(str::to_lowercase).collect();
    let text = format!(" {} ", words.join(" "));
    BANNED.into_iter().filter(|word| text.contains(&format!(" {word} "))).collect()
}

/// The text without code between backticks and without the targets of links. Each of them counts as one word.
fn plain(text: &str) -> String {
    let without_code: Vec<&str> =
        text.split('`').enumerate().map(|(index, part)| if index % 2 == 0 { part } else { "code" }).collect();
    let mut parts = without_code.concat();
    while let Some(begin) = parts.find("](") {
        let end = parts[begin..].find(')').map_or(parts.len(), |end| begin + end + 1);
        parts.replace_range(begin..end, "]");
    }
    parts
}

/// The sentences of a paragraph that are too long. A sentence ends with `.`, `!` or `?` before a space.
fn long_sentences(paragraph: &str) -> Vec<String> {
    let mut long = Vec::new();
    let mut sentence: Vec<&str> = Vec::new();
    let plain = plain(paragraph);
    for word in plain.split_whitespace() {
        sentence.push(word);
        if word.trim_end_matches(['*', ')', '"', ']']).ends_with(['.', '!', '?']) {
            long.extend((sentence.len() > SENTENCE).then(|| sentence.join(" ")));
            sentence.clear();
        }
    }
    long.extend((sentence.len() > SENTENCE).then(|| sentence.join(" ")));
    long
}

/// The paragraphs of a page in Markdown: list items, headings and cells are some of their own, and blocks of code are none.
fn paragraphs(page: &str) -> Vec<String> {
    let (mut paragraphs, mut paragraph, mut in_code) = (Vec::new(), String::new(), false);
    for line in page.lines().map(str::trim).chain([""]) {
        let fence = line.starts_with("```");
        let item = line
            .strip_prefix("- ")
            .or_else(|| line.split_once(". ").and_then(|(number, rest)| number.parse::<u32>().is_ok().then_some(rest)));
        let ends = in_code || fence || line.is_empty() || item.is_some() || line.starts_with(['|', '#', '<']);
        if ends && !paragraph.is_empty() {
            paragraphs.push(std::mem::take(&mut paragraph));
        }
        in_code ^= fence;
        if line.starts_with('|') {
            paragraphs.extend(line.split('|').map(|cell| cell.trim().to_owned()));
        } else if !in_code && !fence && !line.starts_with('<') {
            paragraph = format!("{paragraph} {}", item.unwrap_or(line)).trim().to_owned();
        }
    }
    paragraphs
}

#[test]
fn no_page_and_no_help_has_a_word_that_hides_who_acts() {
    let changes = fs::read_to_string(Path::new(ROOT).join("CHANGELOG.md")).expect("it lists what has changed");
    let found: Vec<String> = pages()
        .into_iter()
        .chain(helps())
        .chain([("CHANGELOG.md".to_owned(), changes)])
        .flat_map(|(name, text)| {
            banned(&text).into_iter().map(move |word| format!("{name}: {word}")).collect::<Vec<_>>()
        })
        .collect();
    assert_eq!(found, [""; 0]);
}

#[test]
fn no_sentence_of_the_manual_or_of_the_help_is_long() {
    let in_pages = pages().into_iter().map(|(name, text)| (name, paragraphs(&text)));
    // Lines of help that are indented alike are one paragraph, as they are wrapped. A line with columns is one of its own.
    let in_help = helps().into_iter().map(|(name, text)| {
        let mut parts: Vec<(usize, String)> = Vec::new();
        for line in text.lines() {
            let (indent, words) = (line.len() - line.trim_start().len(), line.trim());
            match (words.rsplit_once("  "), parts.last_mut()) {
                (Some((_, last_column)), _) => parts.push((usize::MAX, last_column.to_owned())),
                (None, Some((last, part))) if *last == indent && !words.is_empty() => *part += &format!(" {words}"),
                (None, _) => parts.push((indent, words.to_owned())),
            }
        }
        let is_example = |part: &str| part.contains("weeder ") && !part.contains(". ");
        (name, parts.into_iter().filter(|(_, part)| !is_example(part)).map(|(_, part)| part).collect())
    });
    let found: Vec<String> = in_pages
        .chain(in_help)
        .flat_map(|(name, parts): (String, Vec<String>)| {
            let long: Vec<String> = parts.iter().flat_map(|part| long_sentences(part)).collect();
            long.into_iter().map(move |sentence| format!("{name}: {sentence}"))
        })
        .collect();
    assert_eq!(found, [""; 0], "more than {SENTENCE} words");
}

#[test]
fn every_table_of_the_manual_and_every_line_of_the_help_is_narrow_enough() {
    let is_of_table = |line: &str| line.starts_with(['|', '┌', '│', '╞', '└']);
    let too_wide = |(name, text): (String, String), of: &dyn Fn(&str) -> bool, most: usize| -> Vec<String> {
        let lines = text.lines().filter(|line| of(line) && line.chars().count() > most);
        lines.map(|line| format!("{name}: {line}")).collect()
    };
    let mut found: Vec<String> = pages().into_iter().flat_map(|page| too_wide(page, &is_of_table, TABLE)).collect();
    found.extend(helps().into_iter().flat_map(|help| too_wide(help, &|_| true, HELP_LINE)));
    assert_eq!(found, [""; 0]);
}

#[test]
fn the_readme_is_short() {
    let readme = fs::read_to_string(Path::new(ROOT).join("README.md")).expect("there is a README");
    assert!(readme.split_whitespace().count() <= README);
}

#[test]
fn every_page_of_the_manual_is_in_its_summary_once() {
    let docs = Path::new(ROOT).join("docs");
    let summary = fs::read_to_string(docs.join("SUMMARY.md")).expect("the manual has a summary");
    for (name, _) in pages() {
        let Some(page) = name.strip_prefix("docs/").filter(|page| *page != "SUMMARY.md") else { continue };
        assert_eq!(summary.matches(&format!("]({page})")).count(), 1, "{page}");
    }
}

#[test]
fn a_long_sentence_a_banned_word_and_a_paragraph_are_found() {
    let long = format!("Short. {} end.", "word ".repeat(SENTENCE));
    assert_eq!(long_sentences(&long).len(), 1);
    assert!(long_sentences(&format!("Short. {}end.", "word ".repeat(SENTENCE - 1))).is_empty());
    assert_eq!(banned("Somebody asks, of\nwhich row."), ["somebody", "of which"]);
    assert!(banned("manewer").is_empty());
    let page = "# A page\n\nOne\nparagraph.\n- an item\n  of two lines\n\n```sh\nno text\n```\n| a | cell |\n";
    let found: Vec<String> = paragraphs(page).into_iter().filter(|part| !part.is_empty()).collect();
    assert_eq!(found, ["# A page", "One paragraph.", "an item of two lines", "a", "cell"]);
}
