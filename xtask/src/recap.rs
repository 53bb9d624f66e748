//! Collects failures from the runners' output, to print them again at the end of the log.
//!
//! ```text
//! native   "---- NAME stdout ----" below "failures:" ─┐
//! wasm     "---- NAME output ----" below "failures:" ─┼─▶ name and lines ─▶ the end of the log
//! browser  "not ok 3 - NAME" and its block, to "..." ─┘
//! ```

/// Lines to print of a failure: from its start, and from its end.
const HEAD: usize = 10;
const TAIL: usize = 8;

/// Position of the last line in the output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Place {
    /// Anywhere else.
    #[default]
    Outside,
    /// After `failures:`, before the first block.
    Failures,
    /// In the block of the last noted failure.
    Block,
    /// In the TAP block of the last noted failure.
    Tap,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Failure {
    name: String,
    lines: Vec<String>,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Recap {
    place: Place,
    failures: Vec<Failure>,
}

impl Recap {
    pub(crate) fn hear(&mut self, line: &str) {
        let words = line.trim();
        if let Some(name) = words.strip_prefix("not ok ") {
            let name = name.split_once(" - ").map_or(name, |(_, name)| name);
            self.note(name);
            self.place = Place::Tap;
            return;
        }
        match self.place {
            Place::Tap if words == "..." => self.place = Place::Outside,
            Place::Tap if words == "---" => {}
            Place::Tap => self.keep(line),
            _ if line == "failures:" => self.place = Place::Failures,
            _ if line == "successes:" || line.starts_with("test result: ") => self.place = Place::Outside,
            Place::Outside => {
                if let Some(name) = verdict(words) {
                    self.note(name);
                }
            }
            Place::Failures | Place::Block => {
                if let Some(name) = heading(line) {
                    self.note(name);
                    self.place = Place::Block;
                } else if self.place == Place::Block {
                    self.keep(line);
                }
            }
        }
    }

    fn note(&mut self, name: &str) {
        let known = self.failures.iter().position(|failure| failure.name == name);
        let failure = known.map(|at| self.failures.remove(at));
        self.failures.push(failure.unwrap_or(Failure { name: name.to_owned(), lines: Vec::new() }));
    }

    fn keep(&mut self, line: &str) {
        if let Some(failure) = self.failures.last_mut().filter(|_| !line.trim().is_empty()) {
            failure.lines.push(line.to_owned());
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.failures.is_empty()
    }

    /// Notes a suite that failed without a failed test, with its last lines.
    pub(crate) fn without_a_test(&mut self, lines: Vec<String>) {
        self.failures.push(Failure { name: "failed outside of its tests".to_owned(), lines });
    }

    pub(crate) fn told(&self, suite: &str) -> Vec<String> {
        let mut told = Vec::new();
        for failure in &self.failures {
            told.push(format!("✗ {suite}: {}", failure.name));
            let count = failure.lines.len();
            for (at, line) in failure.lines.iter().enumerate() {
                if at < HEAD || at + TAIL >= count {
                    told.push(format!("    {line}"));
                } else if at == HEAD {
                    told.push(format!("    … {} lines …", count - HEAD - TAIL));
                }
            }
        }
        told
    }
}

/// The name in `test NAME ... FAILED`.
fn verdict(words: &str) -> Option<&str> {
    let rest = words.strip_prefix("test ")?;
    rest.strip_suffix(" ... FAILED").or_else(|| rest.strip_suffix(" ... FAIL"))
}

fn heading(line: &str) -> Option<&str> {
    let name = line.strip_prefix("---- ")?.strip_suffix(" ----")?;
    name.strip_suffix(" stdout").or_else(|| name.strip_suffix(" output"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(output: &str) -> Vec<String> {
        let mut recap = Recap::default();
        output.lines().for_each(|line| recap.hear(line));
        recap.told("native")
    }

    #[test]
    fn native_failure_is_named_with_its_panic() {
        let output = "test a::good ... ok\ntest a::bad ... FAILED\ntest a::gone ... FAILED\n\nsuccesses:\n\n\
                      ---- a::good stdout ----\nchatter\n\nsuccesses:\n    a::good\n\nfailures:\n\n\
                      ---- a::bad stdout ----\nthread 'a::bad' panicked at a.rs:3:5:\nleft: 1\n\n\nfailures:\n    \
                      a::bad\n    a::gone\n\ntest result: FAILED. 1 passed; 2 failed\nchatter";
        let expected = [
            "✗ native: a::gone",
            "✗ native: a::bad",
            "    thread 'a::bad' panicked at a.rs:3:5:",
            "    left: 1",
        ];
        assert_eq!(told(output), expected);
    }

    #[test]
    fn wasm_and_tap_output_is_parsed() {
        let wasm = "test walk ... FAIL\n\nfailures:\n\n---- walk output ----\n    panicked\n\nfailures:\n\n    walk\n";
        assert_eq!(told(wasm), ["✗ native: walk", "        panicked"]);
        let tap = "ok 1 - fine\n  ---\n  duration_ms: 3\n  ...\nnot ok 2 - STOP stops\n  ---\n  error: 'waited'\n  \
                   ...\n# fail 1";
        assert_eq!(told(tap), ["✗ native: STOP stops", "      error: 'waited'"]);
    }

    #[test]
    fn long_failure_is_cut_in_the_middle() {
        let long: String = (0..100).map(|line| format!("{line}\n")).collect();
        let told = told(&format!("failures:\n---- long stdout ----\n{long}"));
        assert_eq!(told.len(), 1 + HEAD + 1 + TAIL);
        assert_eq!(
            (told[HEAD + 1].as_str(), told.last().map(String::as_str)),
            ("    … 82 lines …", Some("    99"))
        );
    }
}
