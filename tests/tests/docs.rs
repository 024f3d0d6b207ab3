//! The documentation is short, its links lead somewhere, its page of commands is what the programs print; and the packages
//! of the window depend on each other as docs/design.md says.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use inplace_tests::{files_below, program};

/// The programs whose help is in docs/commands.md; all lie beside the first.
const PROGRAMS: [&str; 2] = ["inplace", "inplace-lab"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// All files below a folder of the repository.
fn files(folder: &str) -> Vec<PathBuf> {
    files_below(&root().join(folder))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn pages_keep_to_their_limits() {
    let limits = [
        ("README.md", 130, 1000),
        ("CHANGELOG.md", 40, 999),
        ("docs/design.md", 400, 8000),
    ];
    for (page, most_lines, most_words) in limits {
        let text = read(page);
        let (lines, words) = (text.lines().count(), text.split_whitespace().count());
        assert!(lines <= most_lines, "{page}: {lines} lines");
        assert!(words <= most_words, "{page}: {words} words");
    }
}

#[test]
fn links_lead_to_files_and_headings_and_no_picture_is_left_over() {
    let in_docs = files("docs");
    let is = |path: &Path, ending: &str| path.extension().is_some_and(|found| found == ending);
    let pages = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md"].map(PathBuf::from);
    let mut linked = BTreeSet::new();
    for page in pages.iter().chain(in_docs.iter().filter(|path| is(path, "md"))) {
        for link in read(page).split("](").skip(1) {
            let link = link.split([')', ' ']).next().unwrap();
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            if link.contains("://") {
                continue;
            }
            let page_itself = page.file_name().unwrap().to_str().unwrap();
            let file = if file.is_empty() { page_itself } else { file };
            let target = root().join(page).with_file_name(file);
            let target = fs::canonicalize(target).unwrap_or_else(|_| panic!("{}: {link}", page.display()));
            let found = heading.is_empty() || headings(&read(&target)).contains(heading);
            assert!(found, "{}: {link}: there is no such heading", page.display());
            linked.insert(target);
        }
    }
    for picture in in_docs.iter().filter(|path| is(path, "png") || is(path, "svg")) {
        let path = fs::canonicalize(root().join(picture)).unwrap();
        assert!(linked.contains(&path), "{}: no page shows it", picture.display());
    }
}

/// The headings of a page as GitHub names them in links.
fn headings(page: &str) -> BTreeSet<String> {
    let kept = |c: &char| c.is_alphanumeric() || " -_".contains(*c);
    let slug = |title: &str| title.to_lowercase().chars().filter(kept).collect::<String>();
    let titles = page.lines().filter(|line| line.starts_with('#'));
    titles.map(|title| slug(title).trim().replace(' ', "-")).collect()
}

#[test]
fn the_page_of_commands_is_what_the_programs_print() {
    let again = "cargo build && INPLACE_WRITE_DOCS=1 cargo test -p inplace-tests --test docs";
    let mut page = format!(
        "# Commands\n\nWhat `--help` prints. The [guide](guide/README.md) explains how to use the programs, \
         [formats.md](formats.md) the files.\n\nThis page is generated:\n\n    {again}\n"
    );
    for name in PROGRAMS {
        let path = program().with_file_name(format!("{name}{}", std::env::consts::EXE_SUFFIX));
        describe(&path, &[name], &mut page);
    }
    let path = root().join("docs/commands.md");
    if std::env::var_os("INPLACE_WRITE_DOCS").is_some() {
        fs::write(&path, &page).unwrap();
    }
    let written = fs::read_to_string(&path).unwrap_or_default();
    assert!(written == page, "docs/commands.md is out of date: {again}");
}

/// Adds the help of a command and those below it.
fn describe(program: &Path, command: &[&str], page: &mut String) {
    let output = Command::new(program).args(&command[1..]).arg("--help").output();
    let output = output.unwrap_or_else(|error| panic!("{}: {error}", program.display()));
    assert!(output.status.success(), "{command:?} --help: {}", output.status);
    let help = String::from_utf8(output.stdout).unwrap();
    let level = "#".repeat(command.len() + 1);
    let title = command.join(" ");
    *page += &format!("\n{level} {title}\n\n```text\n{}\n```\n", help.trim_end());
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    for line in listed.take_while(|line| line.starts_with("  ")) {
        let name = line.split("  ").nth(1).unwrap();
        if !["", "help"].contains(&name) {
            describe(program, &[command, &[name]].concat(), page);
        }
    }
}

#[test]
fn the_model_of_the_window_does_not_know_how_it_is_drawn() {
    let manifest = read("ui/model/Cargo.toml");
    for package in ["egui", "eframe", "wgpu"] {
        assert!(!manifest.contains(package), "ui/model/Cargo.toml names {package}");
    }
}

/// The path of a module, such as `["canvas", "view"]`.
type Module = Vec<String>;

/// The paths that `text` begins with, such as `super::{a, b::C}` in `module`.
fn paths(text: &str, module: &[String]) -> Vec<Module> {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
    let (path, rest) = text.split_at(end.unwrap_or(text.len()));
    let group = rest.strip_prefix('{').and_then(|rest| rest.split('}').next());
    let whole = group.unwrap_or("").split(',').map(|last| {
        let mut found = module.to_vec();
        for part in path.split("::").chain(last.trim().split("::")) {
            match part {
                "crate" => found.clear(),
                "super" => found.truncate(found.len().saturating_sub(1)),
                "self" | "" => {}
                name => found.push(name.to_owned()),
            }
        }
        found
    });
    whole.collect()
}

/// A module and its folder count as one beside the others of their folder; a module and those in its folder may import
/// each other.
#[test]
fn modules_of_the_window_import_each_other_without_a_cycle() {
    let sources = files("ui/src").into_iter().filter_map(|file| {
        let inside = file.strip_prefix(root().join("ui/src")).unwrap();
        let inside = inside.with_extension("");
        let parts = inside.iter().map(|part| part.to_str().unwrap().to_owned());
        let mut module: Module = parts.collect();
        module.retain(|part| part != "mod" && part != "lib");
        let shipped = file.extension()? == "rs" && !module.iter().any(|part| part == "tests");
        shipped.then(|| (module, read(&file)))
    });
    let sources: BTreeMap<Module, String> = sources.collect();
    let mut imports: BTreeMap<(&[String], Module), String> = BTreeMap::new();
    for (module, code) in &sources {
        let code = code.split("#[cfg(test)]\nmod tests {").next().unwrap();
        let code = code.lines().filter(|line| !line.trim_start().starts_with("//"));
        let code = code.collect::<Vec<_>>().join("\n");
        let starts = code.match_indices("crate::").chain(code.match_indices("super::"));
        for at in starts.map(|(at, _)| at).filter(|&at| !code[..at].ends_with("::")) {
            for path in paths(&code[at..], module) {
                let shared = module.iter().zip(&path).take_while(|(a, b)| a == b).count();
                if shared < module.len().min(path.len()) && sources.contains_key(&path[..=shared]) {
                    let text = format!("{} imports {}", module.join("::"), path.join("::"));
                    imports.insert((&module[..=shared], path[..=shared].to_vec()), text);
                }
            }
        }
    }
    // Whoever imports nothing, or is imported by nobody, is in no cycle.
    let mut before = usize::MAX;
    while imports.len() < before {
        before = imports.len();
        let importers: BTreeSet<Module> = imports.keys().map(|(from, _)| from.to_vec()).collect();
        let imported: BTreeSet<Module> = imports.keys().map(|(_, to)| to.clone()).collect();
        imports.retain(|(from, to), _| imported.contains(*from) && importers.contains(to));
    }
    let found: Vec<_> = imports.into_values().collect();
    assert!(found.is_empty(), "cycles among these imports: {found:#?}");
}
