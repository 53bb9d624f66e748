//! Valid dialect files, and the reports about invalid ones.

use super::*;
use crate::post::{preview, shipped, warnings};

const HEAD: &str = "schema = 1\nname = \"x\"\nextension = \"nc\"\n";
const DRILL: &str = "[drill]\nstart = \"\"\nchange = \"\"\nhole = \"\"\nend = \"\"\n";

fn faults(text: &str) -> Vec<(String, u32, u32)> {
    let told = |diagnostic: &Diagnostic| {
        assert!(!diagnostic.message("en").contains('{'), "{}", diagnostic.message("en"));
        assert!(!diagnostic.advice("en").contains('{'), "{}", diagnostic.advice("en"));
        let place = diagnostic.place.clone().unwrap_or_else(|| panic!("{diagnostic:?}"));
        (diagnostic.code.clone(), place.line, place.column)
    };
    check("my.toml", text).iter().map(told).collect()
}

#[test]
fn shipped_postprocessors_are_valid() {
    for (name, text) in shipped() {
        let told: Vec<_> = check(name, text)
            .iter()
            .map(|diagnostic| format!("{:?} {}", diagnostic.place, diagnostic.message("en")))
            .collect();
        assert!(told.is_empty(), "{name}: {told:#?}");
        let dialect = Dialect::parse(name, text).unwrap_or_else(|diagnostic| panic!("{diagnostic:?}"));
        assert_eq!(warnings(&dialect), [], "{name}");
        let samples = preview(&dialect).unwrap_or_else(|diagnostic| panic!("{name}: {diagnostic:?}"));
        assert!(samples.len() >= 10, "{name}: {samples:#?}");
        assert!(samples.iter().all(|sample| !sample.text.contains('@')), "{name}: {samples:#?}");
    }
}

#[test]
fn moving_blocks_without_a_height_are_warnings() {
    let lifts = "G0 Z@HC@\n";
    for (name, text) in shipped().filter(|(name, _)| *name == "grbl") {
        let dialect = Dialect::parse(name, &text.replace(lifts, "")).unwrap();
        let told: Vec<String> = warnings(&dialect).iter().map(|warning| warning.message("en")).collect();
        let blocks = ["drill.change", "drill.end", "engrave.change", "engrave.end"];
        assert_eq!(told.len(), blocks.len(), "{told:#?}");
        for (told, block) in told.iter().zip(blocks) {
            assert!(told.contains(&format!(": {block} moves it without a height")), "{told}");
        }
        let blind = text.replace("G0 Z@Z@\n", "");
        let told = warnings(&Dialect::parse(name, &blind).unwrap());
        let leave = |warning: &Diagnostic| warning.message("en").contains(": engrave.leave moves it");
        assert!(told.iter().any(leave), "{told:#?}");
    }
}

#[test]
fn template_faults_have_their_positions() {
    // the four blocks as written, and the report: code, line, column
    type Row = (&'static str, &'static [(&'static str, u32, u32)]);
    let rows: [Row; 8] = [
        ("start = \"\"\nchange = \"\"\nhole = \"@Q@\"\nend = \"\"\n", &[("post.unknown_parameter", 7, 9)]),
        (
            "start = \"\"\nchange = \"\"\nhole = '''\nG0\n X@X@ @AX@ @XX@\n'''\nend = \"\"\n",
            &[("post.parameter_elsewhere", 9, 7), ("post.unknown_parameter", 9, 12)],
        ),
        (
            "start = \"G0 X@Z@\"\nchange = \"\"\nhole = \"\"\nend = \"\"\n",
            &[("post.parameter_elsewhere", 5, 14)],
        ),
        ("start = \"\"\nchange = \"@T\"\nhole = \"\"\nend = \"\"\n", &[("post.unclosed_parameter", 6, 11)]),
        (
            "start = \"a\\n@Q@\"\nchange = \"\"\nhole = \"\"\nend = \"\"\n",
            &[("post.unknown_parameter", 5, 9)],
        ),
        (
            "start = \"\"\nchange = \"\"\nend = \"@T+@\"\n",
            &[("post.missing_block", 4, 1), ("post.bad_arithmetic", 7, 8)],
        ),
        (
            "start = \"\"\nwobble = 1\nchange = \"\"\nhole = \"\"\nend = \"\"\n",
            &[("post.unknown_key", 6, 10)],
        ),
        (
            "start = 1\nchange = \"\"\nhole = \"\"\nend = \"\"\n",
            &[("post.missing_block", 4, 1), ("post.bad_value", 5, 9)],
        ),
    ];
    for (drill, expected) in rows {
        let expected: Vec<_> =
            expected.iter().map(|(code, line, column)| ((*code).to_owned(), *line, *column)).collect();
        assert_eq!(faults(&format!("{HEAD}[drill]\n{drill}")), expected, "{drill}");
    }
}

#[test]
fn settings_faults_are_reported() {
    assert_eq!(faults(&format!("{HEAD}{DRILL}")), []);
    // added text, and the codes
    let rows: [(&str, &[&str]); 14] = [
        ("[number]\ndecimals = 7\n", &["post.bad_value"]),
        ("[number]\ndecimals = 2.5\n", &["post.bad_value"]),
        ("[number.F]\ndecimals = 0\n[number.Q]\n", &["post.unknown_key"]),
        ("[number]\ntrailing_zeros = \"some\"\nplus = 1\n", &["post.bad_value", "post.bad_value"]),
        ("[lines]\nskippable = [\"drill.hole\", \"drill.hol\"]\n", &["post.unknown_block"]),
        ("[lines]\nending = \"cr\"\nstep = 0\n", &["post.bad_value", "post.bad_value"]),
        ("[modal]\nparameters = [\"X\", \"DX\", 3]\n", &["post.not_modal", "post.bad_value"]),
        ("[arcs]\nfull_circle_parts = 5\nlongst_deg = 180\n", &["post.bad_value", "post.unknown_key"]),
        ("[arcs]\nchord_error_mm = nan\n", &["post.bad_value"]),
        ("[program_name]\nlongest = 0\n", &["post.bad_value"]),
        ("[engrave]\nstart=''\n", &["post.missing_block"; 6]),
        ("[comments]\nopen = \"((((((((((\"\n", &["post.bad_value"]),
        ("[aproach]\n", &["post.unknown_key"]),
        ("[number\n", &["post.dialect_unreadable"]),
    ];
    for (added, expected) in rows {
        let mut codes: Vec<String> =
            faults(&format!("{HEAD}{DRILL}{added}")).into_iter().map(|fault| fault.0).collect();
        codes.sort();
        let mut expected = expected.to_vec();
        expected.sort_unstable();
        assert_eq!(codes, expected, "{added}");
    }
    for (from, to, code) in [
        ("schema = 1", "schema = 2", "post.schema"),
        ("schema = 1", "", "post.schema"),
        ("extension = \"nc\"", "extension = \"../nc\"", "post.bad_value"),
        ("extension = \"nc\"\n", "", "post.missing_key"),
        ("extension = \"nc\"", "extension = \"nc\"\nshift_mm = [1]", "post.bad_value"),
    ] {
        let text = format!("{HEAD}{DRILL}").replace(from, to);
        assert!(faults(&text).iter().any(|fault| fault.0 == code), "{to}: {:?}", faults(&text));
    }
    assert_eq!(faults(HEAD)[0].0, "post.no_templates");
    assert_eq!(faults(&"#".repeat(LARGEST + 1))[0].0, "post.dialect_too_large");
}

#[test]
fn suggestions_name_the_nearest_word() {
    let rows = [
        ("[lines]\nskippable = [\"drill.hol\"]\n", "drill.hole"),
        ("[arcs]\nlongst_deg = 180\n", "longest_deg"),
        ("[engraev]\n", "engrave"),
    ];
    for (added, meant) in rows {
        let told = check("my.toml", &format!("{HEAD}{DRILL}{added}"));
        let nearest =
            told[0].args.iter().find(|(name, _)| name == "nearest").map(|(_, value)| value.as_str());
        assert_eq!(nearest, Some(meant), "{added}");
    }
}
