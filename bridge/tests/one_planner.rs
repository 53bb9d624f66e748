//! Tests that every command gets the same program and figures for a drill job. Compares `plan`, `export`,
//! `simulate`, `run` and `cam` as real processes, and the page's worker, on all of our boards and the
//! corpus.

use annulus_app::engine::messages::{Answer, PlanReady, Request, Settings, ToPlan, ToRead};
use annulus_app::engine::{Cache, perform};
use annulus_core::cam::HoleOrder;
use annulus_core::cam::work::Work;
use annulus_core::job::Program;
use annulus_core::machine::virtual_drill;
use annulus_core::project::saved::SaidOfFiles;
use annulus_core::wire::program;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A job file for holes and slots only.
const HOLES: &str = "schema = 1\n[setup]\nface = \"top\"\npairs = 0\n[[operation]]\nkind = \"drill\"\n[[operation]]\nkind = \"mill_holes\"\n";
const FINDINGS: &str = "short,gap,break,gone,lost,hit,ring,sliver,shallow,remnant";
const MOST_STEPS: u64 = 400;

/// Runs a command, accepting all its errors in turn. Returns exit code, JSON object, and the accepted
/// codes.
fn answer(home: &Path, arguments: &[&str], given: &BTreeSet<String>) -> (i32, Value, BTreeSet<String>) {
    let mut accepted = given.clone();
    loop {
        let accept = accepted.iter().map(String::as_str).chain([FINDINGS]).collect::<Vec<_>>().join(",");
        let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
        command.args(arguments).args(["--json", "--accept", &accept]);
        let output = command.current_dir(home).env("ANNULUS_HOME", home.join("home")).output().unwrap();
        let object: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
        let told = object["error"]["code"].as_str().unwrap_or_default().to_owned();
        let exit = output.status.code().unwrap_or(-1);
        // `cam` reports all unaccepted errors at once.
        let errors: Vec<String> = if told == "cam.unacknowledged_errors" {
            let diagnostics = object["programs"].as_array().into_iter().flatten();
            let diagnostics = diagnostics
                .flat_map(|program| program["diagnostics"].as_array().cloned().unwrap_or_default());
            let errors = diagnostics.filter(|diagnostic| diagnostic["severity"] == "error");
            errors.filter_map(|error| error["code"].as_str().map(str::to_owned)).collect()
        } else {
            vec![told]
        };
        let before = accepted.len();
        if exit == 1 {
            accepted.extend(errors);
        }
        if accepted.len() == before {
            return (exit, object, accepted);
        }
    }
}

fn page(files: &[(String, Vec<u8>)], accept: &BTreeSet<String>) -> Option<PlanReady> {
    let mut cache = Cache::default();
    let machine = Settings::of(&virtual_drill());
    let wanted = ToRead {
        files: files.to_vec(),
        said: SaidOfFiles::default(),
        machine: Some(machine.clone()),
        ..ToRead::default()
    };
    let Ok(Answer::Read(reading)) = perform(Request::Read(wanted), &mut cache, &mut |_, _| {}) else {
        panic!("reading is no trouble")
    };
    let work = Work::drilling(&reading.board, &virtual_drill(), HoleOrder::Shortest);
    let accept = accept.iter().cloned().collect();
    let plan = ToPlan { board_key: 0, machine, work, loaded: None, accept, laid: None };
    match perform(Request::Plan(plan), &mut cache, &mut |_, _| {}) {
        Ok(Answer::Planned(planned)) => Some(*planned),
        _ => None,
    }
}

fn apart(bytes: &[u8]) -> (Program, BTreeSet<String>) {
    let mut program = program::decode(bytes).expect("a program");
    let accepted = std::mem::take(&mut program.accepted).into_iter().collect();
    (program, accepted)
}

/// Takes the board at `path` through all commands and the page. `None` if there is nothing to plan.
fn walk(path: &Path, home: &Path) -> Option<()> {
    let named = path.display().to_string();
    let alone: &[&str] = if path.is_file() { &["--ignore-siblings"] } else { &[] };
    let ask = |words: &[&str], accepted: &BTreeSet<String>| {
        let words: Vec<&str> = words.iter().copied().chain(alone.iter().copied()).collect();
        answer(home, &words, accepted)
    };
    let own = home.join("own.annulus-program");
    let (exit, plan, accepted) = ask(&["plan", &named, "-o", own.to_str()?], &BTreeSet::new());
    let read =
        |path: &Path| (path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(path).unwrap());
    let files: Vec<_> = files(path).iter().filter(|path| path.is_file()).map(|path| read(path)).collect();
    fs::write(home.join("holes.toml"), HOLES).unwrap();
    let words = ["cam", &named, "--job", "holes.toml", "--to", "program", "-o", "cam"];
    if exit != 0 {
        // If one refuses, all must refuse.
        let (exit, cam, all) = ask(&words, &accepted);
        assert_ne!(exit, 0, "{named}: plan refuses ({}), cam does not: {cam}", plan["error"]);
        assert!(page(&files, &all).is_none(), "{named}: plan refuses ({}), the page does not", plan["error"]);
        return None;
    }
    let bytes = fs::read(&own).unwrap();
    assert_eq!(plan["program_sha256"], program::key(&bytes), "{named}");
    let (program, seen) = apart(&bytes);

    // `cam` with the same operations.
    let out = home.join("cam");
    let _ = fs::remove_dir_all(&out);
    let (exit, cam, all) = ask(&words, &accepted);
    assert_eq!(exit, 0, "{named}: {}", cam["error"]);
    let file = cam["files"][0]["file"].as_str().expect("a file");
    let written = fs::read(home.join(file)).unwrap();
    let (by_cam, seen_by_cam) = apart(&written);
    assert!(program == by_cam, "{named}: cam\n{program:?}\n{by_cam:?}");
    // `cam` also reads the copper, so it may report more.
    assert!(seen.is_subset(&seen_by_cam), "{named}: {seen:?} {seen_by_cam:?}");
    if seen == seen_by_cam {
        assert_eq!(bytes, written, "{named}: cam");
    }

    // The page.
    let planned = page(&files, &all).unwrap_or_else(|| panic!("{named}: the page refuses"));
    let (by_page, seen_by_page) = apart(&planned.program);
    assert!(program == by_page, "{named}: page\n{program:?}\n{by_page:?}");
    let findings = |code: &&String| code.starts_with("proof.");
    let cam_alone: BTreeSet<_> = seen_by_cam.iter().filter(|code| !findings(code)).cloned().collect();
    assert_eq!(cam_alone, seen_by_page, "{named}");
    for (key, found) in [
        ("travel_before_mm", planned.travel_before_mm),
        ("travel_after_mm", planned.travel_after_mm),
        ("hop_time_before_s", planned.hop_time_before_s),
        ("hop_time_after_s", planned.hop_time_after_s),
    ] {
        let told = plan[key].as_f64().unwrap();
        assert!((told - found).abs() < 1e-6, "{named} {key}: {told} {found}");
    }
    let travel = plan["travel_after_mm"].as_f64().unwrap();
    assert!(travel <= plan["travel_before_mm"].as_f64().unwrap() + 1e-6, "{named}");
    let all = cam["programs"][0]["travel_mm"].as_f64().unwrap();
    assert_eq!(plan["travel_mm"].as_f64(), Some(all), "{named}");
    // Slots and wide holes add travel.
    let drills_alone =
        program.legs.iter().all(|leg| !matches!(leg.mark, annulus_core::job::Mark::Toolpath(_)));
    assert!(if drills_alone { (all - travel).abs() < 1e-5 } else { all > travel }, "{named}: {all} {travel}");

    // `export` and `simulate` give the same from the board as from the program.
    let holes: u64 = cam["programs"][0]["holes"].as_u64().unwrap();
    let own = own.to_str()?;
    let mut texts = Vec::new();
    for job in [named.as_str(), own] {
        let (exit, told, _) = ask(&["export", job, "--to", "excellon", "-o", "out.drl"], &accepted);
        assert_eq!(exit, 0, "{named}: {}", told["error"]);
        texts.push(fs::read(home.join("out.drl")).unwrap());
    }
    assert!(texts[0] == texts[1], "{named}: export");
    if holes <= MOST_STEPS {
        let digest = |job: &str| ask(&["simulate", job], &accepted).1["stream_digest"].clone();
        assert_eq!(digest(&named), digest(own), "{named}: simulate");
    }
    Some(())
}

/// The files of a board: the file itself, or the sorted files of its folder.
fn files(path: &Path) -> Vec<PathBuf> {
    if path.is_file() {
        return vec![path.to_owned()];
    }
    let mut files: Vec<PathBuf> = fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort_unstable();
    files
}

fn walk_all(paths: impl IntoIterator<Item = PathBuf>) -> usize {
    let home = tempfile::tempdir().unwrap();
    let walked = paths.into_iter().filter(|path| {
        let walked = walk(path, home.path()).is_some();
        println!("{} {}", if walked { "the same" } else { "nothing" }, path.display());
        walked
    });
    walked.count()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

#[test]
fn sample_boards_give_the_same_program_in_every_command() {
    let data = root().join("tests/data");
    // A hundred thousand holes take a minute each time.
    let small = |path: &PathBuf| fs::metadata(path).is_ok_and(|kind| kind.len() < 500_000);
    let mut paths: Vec<PathBuf> =
        [data.join("synthetic"), data.join("drill")].iter().flat_map(|at| files(at)).collect();
    paths.retain(small);
    paths.push(root().join("www/examples"));
    let walked = walk_all(paths);
    assert!(walked >= 30, "{walked}");
}

#[test]
fn real_boards_give_the_same_program_in_every_command() {
    let beside = || root().join("../shared/corpus");
    let corpus = std::env::var_os("ANNULUS_CORPUS").map_or_else(beside, PathBuf::from);
    if !corpus.is_dir() {
        assert!(std::env::var_os("ANNULUS_NOTHING_SKIPPED").is_none(), "no corpus");
        println!("skipped: no corpus");
        return;
    }
    let makers = files(&corpus).into_iter().filter(|path| path.is_dir());
    let boards = |maker: PathBuf| files(&maker).into_iter().filter(|path| path.is_dir());
    let apart = ["expected", "licenses", "synthetic", "tsplib"];
    let all = makers.filter(|maker| !apart.iter().any(|name| maker.ends_with(name))).flat_map(boards);
    // One in five, except in long tests.
    let (each, least) = if std::env::var_os("ANNULUS_LONG").is_some() { (1, 20) } else { (5, 5) };
    let walked = walk_all(all.step_by(each));
    assert!(walked >= least, "{walked}");
}

/// A real run makes the same steps, slots and wide holes included.
#[test]
fn run_and_simulation_have_the_same_stream() {
    let home = tempfile::tempdir().unwrap();
    let board = "M48\nMETRIC,TZ\nT1C0.8\nT2C4.0\nT3C1.0\n%\nT1\nX5.0Y5.0\nX9.0Y5.0\nT2\nX15.0Y9.0\nT3\nX3.0Y12.0G85X6.0Y12.0\nM30\n";
    fs::write(home.path().join("board.drl"), board).unwrap();
    let none = BTreeSet::new();
    let ask = |words: &str| {
        let words: Vec<&str> = words.split_whitespace().collect();
        let (exit, told, accepted) = answer(home.path(), &words, &none);
        assert_eq!((exit, accepted.len()), (0, 0), "{words:?}: {told}");
        told
    };
    let plan = ask("plan board.drl -o own.annulus-program");
    let rows: Vec<_> = plan["tools"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| {
            (
                row["n"].as_u64(),
                row["file_diameter_mm"].as_f64(),
                row["tool"]["form"].as_str(),
                row["holes"].as_u64(),
                row["slots"].as_u64(),
            )
        })
        .collect();
    assert_eq!(
        rows,
        [
            (Some(1), Some(0.8), Some("drill"), Some(2), Some(0)),
            (Some(2), Some(4.0), Some("mill"), Some(1), Some(0)),
            (Some(3), Some(1.0), Some("mill"), Some(0), Some(1)),
        ]
    );
    let (simulated, run) = (ask("simulate board.drl"), ask("run board.drl --time-scale 2000"));
    assert_eq!(simulated["stream_digest"], run["stream_digest"]);
    assert_eq!((&simulated["holes"], &run["holes_done"]), (&2.into(), &2.into()), "{run}");
    assert_eq!(simulated["toolpaths"], run["toolpaths_done"]);
    assert_eq!(run["drilled"]["missing"], 0, "{run}");
    // Without milling, two holes are left out, which must be accepted.
    let words = ["plan", "board.drl", "--no-mill"];
    let (exit, told, accepted) = answer(home.path(), &words, &none);
    let missing = ["plan.no_bit", "plan.slots_not_drilled"].map(str::to_owned);
    assert_eq!((exit, accepted), (0, BTreeSet::from(missing)), "{told}");
    assert_eq!(told["tools"].as_array().map(Vec::len), Some(1));
    // Planned again from the program, its milling is left out, which must be accepted.
    let (exit, told, accepted) = answer(home.path(), &["plan", "own.annulus-program"], &none);
    assert_eq!((exit, accepted), (0, BTreeSet::from(["job.toolpaths_left_out".to_owned()])), "{told}");
}
