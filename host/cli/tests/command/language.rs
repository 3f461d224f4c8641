//! Checks of plain language. The manual and the help have short sentences, narrow tables, and lines that fit a terminal. No word in
//! them hides who acts, nor in comments and names of tests in the sources.

use crate::common::said;
use std::fs;
use std::path::{Path, PathBuf};

/// The repository's folder.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Words that hide who acts, or that chain clauses. They are not used.
const BANNED: [&str; 8] = ["nobody", "whoever", "whatever", "somebody", "anew", "whenever", "of which", "by which"];

/// Sources with comments, by the endings of their names.
const SOURCES: [&str; 4] = ["rs", "ts", "toml", "sh"];

/// Folders of built files, and of installed packages.
const BUILT: [&str; 5] = [".git", "build", "dist", "node_modules", "target"];

/// The longest sentence, in words.
const SENTENCE: usize = 30;

/// The widest table, and the longest line of help, in characters.
const TABLE: usize = 110;
const HELP_LINE: usize = 100;

/// The most words of the README.
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

/// The sources of the repository.
fn sources() -> Vec<(String, String)> {
    let (mut sources, mut folders) = (Vec::new(), vec![PathBuf::from(ROOT)]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("it is a folder") {
            let path = entry.expect("it is listed").path();
            let is_built = path.file_name().is_some_and(|name| BUILT.iter().any(|built| name == *built));
            let is_source = path.extension().is_some_and(|ending| SOURCES.iter().any(|source| ending == *source));
            if path.is_dir() && !is_built {
                folders.push(path);
            } else if is_source && path.is_file() {
                let name = path.strip_prefix(ROOT).expect("it is below the root").display().to_string();
                sources.push((name, fs::read_to_string(&path).expect("a source is text")));
            }
        }
    }
    sources.sort();
    sources
}

/// The prose of a source, a line each: its comments and its names of tests. Lines of code are empty.
fn prose(name: &str, source: &str) -> Vec<String> {
    let mark = if name.ends_with(".rs") || name.ends_with(".ts") { "//" } else { "#" };
    let (mut is_test, mut in_block) = (false, false);
    let prose = source.lines().map(|line| {
        let code = line.trim_start();
        let begins_block = mark == "//" && code.starts_with("/*");
        let is_comment = in_block || begins_block || code.starts_with(mark);
        in_block = (in_block || begins_block) && !line.contains("*/");
        let test = code.strip_prefix("fn ").filter(|_| is_test).or_else(|| code.strip_prefix("test(\""));
        is_test = code == "#[test]" || is_test && code.starts_with(['#', '/']);
        match (is_comment, test, line.split_once(&format!(" {mark} "))) {
            (true, ..) => code,
            (false, Some(name), _) => name,
            (false, None, Some((_, comment))) => comment,
            (false, None, None) => "",
        }
        .replace('_', " ")
    });
    prose.collect()
}

/// The banned words in the prose of a source, each with its file and line. A phrase may go on in the next line.
fn banned_in_source(name: &str, source: &str) -> Vec<String> {
    let lines = prose(name, source);
    let next = lines.iter().skip(1).map(String::as_str).chain([""]);
    let mut found = Vec::new();
    for (number, (line, next)) in (1..).zip(lines.iter().zip(next)) {
        let (here, later) = (banned(line), banned(next));
        let both =
            banned(&format!("{line} {next}")).into_iter().filter(|word| here.contains(word) || !later.contains(word));
        found.extend(both.map(|word| format!("{name}:{number}: {word}")));
    }
    found
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
fn no_comment_and_no_name_of_a_test_has_a_word_that_hides_who_acts() {
    let sources = sources();
    assert!(sources.len() > 500, "only {} sources were found", sources.len());
    let found: Vec<String> = sources.iter().flat_map(|(name, source)| banned_in_source(name, source)).collect();
    assert!(found.is_empty(), "say who or what acts, in these comments and names of tests:\n{}", found.join("\n"));
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

#[test]
fn a_banned_word_is_found_in_comments_and_names_of_tests_and_not_in_code() {
    // `%` stands for the mark of a comment, so that this file passes.
    let rust = "%! Rows of\n%! which one is lost.\nlet nobody = 1; % anew\n#[test]\nfn it_stops_whenever_it_may() {}\nfn anew() {}\n";
    assert_eq!(
        banned_in_source("a.rs", &rust.replace('%', "//")),
        ["a.rs:1: of which", "a.rs:3: anew", "a.rs:5: whenever"]
    );
    let script = "/**\n * Whatever\n */\ntest(\"somebody types\", () => {});\nconst nobody = 1;\n";
    assert_eq!(banned_in_source("a.ts", script), ["a.ts:2: whatever", "a.ts:4: somebody"]);
    assert_eq!(
        banned_in_source("a.toml", "# by which\nanew = 1 # whoever\n"),
        ["a.toml:1: by which", "a.toml:2: whoever"]
    );
}
