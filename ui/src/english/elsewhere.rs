//! No word that a person reads is written outside of this folder.

use std::path::{Path, PathBuf};

/// Says why there is no window, on stderr.
const BEFORE_THE_WINDOW: &str = "run.rs";

/// What looks like words and is not for people: keys, and names inside of the program.
const NOT_WORDS: [&str; 17] = [
    "Enter",
    "Escape",
    "Running",
    "canvas image",
    "canvas palette",
    "canvas plane",
    "class filter",
    "class finder",
    "class of the stroke",
    "custom colour",
    "progress numbers",
    "splat palette",
    "status folded",
    "strokes folded",
    "all of it is what the button says",
    "all of it is what the cursor depends on",
    "the few of a pipeline's many settings that differ",
];

/// A string literal with its line, counted from 1.
type Literal = (usize, String);

/// The string literals of Rust source, without those in comments.
fn literals(source: &str) -> Vec<Literal> {
    let text: Vec<char> = source.chars().collect();
    let at = |index: usize| text.get(index).copied().unwrap_or('\0');
    let mut found = Vec::new();
    let (mut index, mut line) = (0, 1);
    while index < text.len() {
        let (begin, mut end) = (index, index + 1);
        match at(index) {
            '/' if at(index + 1) == '/' => {
                while end < text.len() && at(end) != '\n' {
                    end += 1;
                }
            }
            '\'' if at(index + 1) == '\\' || at(index + 2) == '\'' => {
                end = index + if at(index + 1) == '\\' { 3 } else { 2 };
                while end < text.len() && at(end) != '\'' {
                    end += 1;
                }
                end += 1;
            }
            'r' if at(index + 1) == '#' && at(index + 2) == '"' => {
                end = index + 3;
                while end < text.len() && !(at(end) == '"' && at(end + 1) == '#') {
                    end += 1;
                }
                found.push((line, text[index + 3..end].iter().collect()));
                end += 2;
            }
            '"' => {
                while end < text.len() && at(end) != '"' {
                    end += if at(end) == '\\' { 2 } else { 1 };
                }
                found.push((line, text[index + 1..end].iter().collect()));
                end += 1;
            }
            _ => {}
        }
        index = end.min(text.len());
        line += text[begin..index].iter().filter(|&&char| char == '\n').count();
    }
    found
}

/// Two words or more, or one that begins like a sentence; values filled in are no words.
fn looks_like_words(literal: &str) -> bool {
    let parts = literal.split('{').enumerate().map(|(index, part)| match index {
        0 => part,
        _ => part.split_once('}').map_or("", |(_, after)| after),
    });
    let text = parts.collect::<Vec<_>>().join("_");
    let is_word = |word: &&str| {
        let letters = word.trim_matches(|char: char| ".,:;!?()_\"\\".contains(char));
        letters.len() > 1 && letters.chars().all(|char| char.is_alphabetic() || char == '\'')
    };
    let words: Vec<&str> = text.split_whitespace().filter(is_word).collect();
    match words[..] {
        [] => false,
        [word] => word.starts_with(char::is_uppercase),
        _ => true,
    }
}

/// Source files in a folder and below it, but for this folder and tests.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is = |name: &str| path.file_name().is_some_and(|file| file == name);
        if path.is_dir() && !is("english") {
            sources(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") && !is("tests.rs") && !is(BEFORE_THE_WINDOW)
        {
            found.push(path);
        }
    }
}

/// What comes before the tests of a file; they are at its end.
fn without_tests(source: &str) -> &str {
    let tests = ["mod tests {", "pub(super) mod tests {"]
        .iter()
        .filter_map(|tests| source.find(&format!("#[cfg(test)]\n{tests}")));
    &source[..tests.min().unwrap_or(source.len())]
}

#[test]
fn all_that_a_person_reads_is_in_this_folder() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    assert!(files.len() > 80, "the sources are not where they were");
    files.sort();
    let (mut strays, mut allowed) = (Vec::new(), NOT_WORDS.to_vec());
    for file in files {
        let source = std::fs::read_to_string(&file).unwrap();
        for (line, literal) in literals(without_tests(&source)) {
            if NOT_WORDS.contains(&literal.as_str()) {
                allowed.retain(|allowed| *allowed != literal);
            } else if looks_like_words(&literal) {
                strays.push(format!("{}:{line}: {literal:?}", file.display()));
            }
        }
    }
    assert!(
        strays.is_empty(),
        "move these to ui/src/english, or name them in NOT_WORDS if nobody reads them:\n{}",
        strays.join("\n")
    );
    assert!(
        allowed.is_empty(),
        "no longer there, so not needed in NOT_WORDS: {allowed:?}"
    );
}

#[test]
fn literals_are_told_from_comments_and_characters() {
    let source = "// \"no\"\nlet a = '\"'; let b = \"a \\\" b\";\n\nlet c: &'static str = r#\"raw \"x\"\"#;\n'\\'' \"end\"";
    let found = |line: usize, text: &str| (line, text.to_owned());
    assert_eq!(
        literals(source),
        [found(2, "a \\\" b"), found(4, "raw \"x\""), found(5, "end")]
    );
}

#[test]
fn words_are_told_from_names_and_formats() {
    for words in [
        "Export",
        "Browse...",
        "not saved",
        "{path} cannot be written",
        "Save {}",
    ] {
        assert!(looks_like_words(words), "{words}");
    }
    for other in [
        "canvas",
        "{value:.2} nats",
        "Ctrl+S",
        "Shift+Enter",
        "Ctrl+,",
        "{}: {}",
        "labels.json",
        "N",
    ] {
        assert!(!looks_like_words(other), "{other}");
    }
}
