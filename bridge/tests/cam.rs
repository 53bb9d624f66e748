//! `annulus cam` and `annulus prove` as real processes on the sample board (N24, N8, N10): what is refused before anything
//! is planned, that nothing is written while a finding is unread, and that a saved job gives the same programs.

use annulus_app::engine::messages::{Answer, Request, Settings, ToPlan, ToRead, ToWrite};
use annulus_app::engine::{Shelf, perform};
use annulus_core::machine::virtual_drill;
use annulus_core::project::saved::{self, Project, Said};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// The sample board: holes, copper of the top, outline.
const BOARD: [&str; 3] = ["sensor.drl", "sensor-top.gbr", "sensor-outline.gbr"];
const CAM: &str = "cam sensor.drl sensor-top.gbr sensor-outline.gbr";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../www/examples");
    for name in BOARD {
        fs::copy(examples.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

fn annulus(home: &Path, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(arguments.split_whitespace()).arg("--json");
    command.current_dir(home).env("ANNULUS_HOME", home.join("home")).output().unwrap()
}

/// Exit code and the one object on standard output, whose `ok` and `error` must fit the exit code.
fn answer(home: &Path, arguments: &str) -> (i32, Value) {
    let output = annulus(home, arguments);
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(text.lines().count(), 1, "{arguments}: {output:?}");
    let object: Value = serde_json::from_str(&text).unwrap();
    let exit = output.status.code().unwrap();
    assert_eq!(object["ok"], exit == 0, "{arguments}: {object}");
    for key in ["code", "message", "advice"] {
        let said = object["error"][key].as_str().is_some_and(|text| !text.is_empty());
        assert_eq!(said, exit != 0, "{arguments}: {object}");
    }
    (exit, object)
}

fn codes(findings: &Value) -> Vec<&str> {
    findings.as_array().unwrap().iter().map(|row| row["code"].as_str().unwrap()).collect()
}

#[test]
fn an_unread_gap_keeps_every_program_from_being_written() {
    let folder = folder();
    let home = folder.path();
    let (exit, told) = answer(home, &format!("{CAM} --to grbl -o out --save-job job.toml"));
    assert_eq!((exit, &told["error"]["code"]), (1, &"cam.unread_findings".into()), "{told}");
    assert_eq!(told["findings_unread"], 1);
    let side = &told["programs"][0];
    assert_eq!(side["files"].as_array().map(Vec::len), Some(0));
    assert_eq!(codes(&side["findings"]), ["proof.gap"]);
    let gap = &side["findings"][0];
    assert!((gap["width_mm"].as_f64().unwrap() - 0.122).abs() < 0.001, "{gap}");
    assert_eq!((&gap["unread"], &gap["accepted"]), (&true.into(), &false.into()));
    assert!(gap["cures"][0]["depth_mm"].as_f64().is_some_and(|depth| depth < 0.08), "lengths in mm: {gap}");
    assert!(!home.join("out").exists());
    assert!(home.join("job.toml").exists(), "the job is there to be mended");
    // Whoever has read it, by name or by kind, gets the program.
    let id = gap["id"].as_str().unwrap();
    for word in [id, "gap", "proof.gap"] {
        let (exit, told) = answer(home, &format!("{CAM} --to grbl -o {word} --accept {word}"));
        assert_eq!((exit, &told["findings_unread"]), (0, &0.into()), "{word}");
        assert!(home.join(word).join("sensor-top.nc").exists(), "{word}: {told}");
    }
}

#[test]
fn a_cured_job_is_written_reported_and_gives_the_same_bytes_again() {
    let folder = folder();
    let home = folder.path();
    let arguments = "--cure --to program -o first --save-job job.toml";
    let (exit, told) = answer(home, &format!("{CAM} {arguments}"));
    assert_eq!(exit, 0, "{told}");
    let side = &told["programs"][0];
    for key in
        ["total_time_s", "milled_mm", "travel_mm", "plunges", "retracts", "holes", "ways", "tool_changes"]
    {
        assert!(side[key].as_f64() > Some(0.0), "{key}: {side}");
    }
    assert_eq!(side["face"], "top");
    let forms: Vec<&str> =
        side["tools"].as_array().unwrap().iter().map(|tool| tool["form"].as_str().unwrap()).collect();
    assert!(["vee", "drill", "mill"].iter().all(|form| forms.contains(form)), "{forms:?}");
    let file = &side["files"][0];
    let bytes = fs::read(home.join(file["file"].as_str().unwrap())).unwrap();
    assert_eq!((&file["bytes"], &file["sha256"]), (&bytes.len().into(), &side["program_sha256"]));

    let (exit, again) = answer(home, &format!("{CAM} --job job.toml --accept lost --to program -o second"));
    assert_eq!(exit, 0, "{again}");
    assert_eq!(fs::read(home.join("second/sensor-top.program")).unwrap(), bytes);
    let (exit, timed) = answer(home, "simulate first/sensor-top.program");
    assert_eq!((exit, &timed["total_time_s"]), (0, &side["total_time_s"]));
    // Bores and the cut-out go down along helices and ramps: both count them at their length.
    assert_eq!(timed["milled_mm"], side["milled_mm"]);
    let of_tools = side["tools"].as_array().unwrap().iter().filter_map(|tool| tool["milled_mm"].as_f64());
    assert!((of_tools.sum::<f64>() - side["milled_mm"].as_f64().unwrap()).abs() < 0.01, "{side}");
}

#[test]
fn holes_that_nothing_fits_are_left_out_and_nothing_is_written_before_that_was_seen() {
    let folder = folder();
    let home = folder.path();
    let drill = "M48\nMETRIC\nT1C0.8\nT2C0.15\n%\nG90\nT1\nX5.0Y5.0\nX9.0Y5.0\nT2\nX7.0Y5.0\nX8.0Y6.5\nM30\n";
    fs::write(home.join("vias.drl"), drill).unwrap();
    let (exit, told) = answer(home, "cam vias.drl --alone --to grbl -o out");
    assert_eq!((exit, &told["error"]["code"]), (1, &"cam.unseen_losses".into()), "{told}");
    let side = &told["programs"][0];
    assert_eq!((&told["losses_unseen"], &side["holes"]), (&1.into(), &2.into()), "{told}");
    let loss = &side["remarks"][0];
    assert_eq!((&loss["weight"], &loss["code"]), (&"loss".into(), &"cam.holes_missing".into()));
    let said = loss["message"].as_str().unwrap();
    assert!(said.contains("2 holes of 0.15 mm") && said.contains("X 7.000 Y 5.000"), "{said}");
    assert!(!home.join("out").exists());
    let (exit, told) = answer(home, "cam vias.drl --alone --to grbl -o out --accept cam.holes_missing");
    assert_eq!((exit, &told["losses_unseen"]), (0, &0.into()), "{told}");
    assert!(home.join("out/vias-top.nc").exists());
}

#[test]
fn copper_without_a_drill_file_is_milled_though_nothing_says_which_layer_it_is() {
    let folder = folder();
    let home = folder.path();
    let pads = "%FSLAX33Y33*%\n%MOMM*%\n%ADD10C,1.5*%\nD10*\nX2000Y2000D03*\nX9000Y5000D03*\nM02*\n";
    fs::create_dir(home.join("lone")).unwrap();
    fs::write(home.join("lone/layer1.off"), pads).unwrap();
    let (exit, told) = answer(home, "cam lone --to grbl -o out");
    assert_eq!(exit, 0, "{told}");
    assert!(told["programs"][0]["milled_mm"].as_f64().unwrap() > 10.0, "{told}");
    assert_eq!(codes(&told["remarks"]), ["set.only_copper", "board.no_holes"]);
    assert!(home.join("out/lone-top.nc").exists());
    // Without copper there is nothing to do, and drilling alone needs a drill file.
    fs::create_dir(home.join("none")).unwrap();
    fs::write(home.join("none/read.me"), "hello\n").unwrap();
    for (arguments, code) in
        [("cam none --to grbl -o out", "job.no_board"), ("plan lone", "job.no_drill_file")]
    {
        let (exit, told) = answer(home, arguments);
        assert_eq!((exit, &told["error"]["code"]), (1, &code.into()), "{arguments}: {told}");
    }
}

#[test]
fn what_a_cure_costs_is_listed_and_stops_nothing() {
    let folder = folder();
    let home = folder.path();
    // A mill that is 20 µm too wide for the gap, and no thinner bit.
    let job = "schema = 1\n[[bit]]\nname = \"m\"\nform = \"mill\"\ndiameter = 0.142\n\
               [[operation]]\nkind = \"isolate\"\nbit = \"m\"\n";
    fs::write(home.join("job.toml"), job).unwrap();
    let (exit, told) =
        answer(home, &format!("{CAM} --job job.toml --cure --to grbl -o out --save-job cured.toml"));
    assert_eq!((exit, &told["findings_unread"]), (0, &0.into()), "{told}");
    let side = &told["programs"][0];
    assert!(codes(&side["remarks"]).contains(&"cam.cure_takes"), "{side}");
    let lost: Vec<&Value> =
        side["findings"].as_array().unwrap().iter().filter(|row| row["code"] == "proof.lost").collect();
    assert!(!lost.is_empty() && lost.iter().all(|row| row["agreed"] == true), "{side}");
    assert!(lost.iter().all(|row| row["width_mm"].as_f64() < Some(0.016)), "{lost:?}");
    // Without the cure in its job nobody agreed.
    let (exit, told) = answer(home, &format!("{CAM} --job cured.toml --to program -o own"));
    assert_eq!(exit, 0, "{told}");
    fs::create_dir(home.join("board")).unwrap();
    for name in BOARD {
        fs::copy(home.join(name), home.join("board").join(name)).unwrap();
    }
    assert_eq!(answer(home, "prove board own/sensor-top.program --job cured.toml").0, 0);
    assert_eq!(answer(home, "prove board own/sensor-top.program --job job.toml").0, 1);
}

#[test]
fn what_cannot_be_written_is_refused_before_anything_is_planned() {
    let folder = folder();
    let home = folder.path();
    // The board is missing: whoever looks for it first ends otherwise.
    for (arguments, exit, code) in [
        ("--to wobble", 2, "post.unknown_target"),
        ("--to program --lines-only", 2, "cam.own_form_has_arcs"),
        ("--to grbl --lines-only 3", 2, "cli.usage"),
        ("--to missing.toml", 3, "job.unreadable"),
        ("--to grbl", 3, "files.missing"),
        ("--to grbl --accept nonsense", 2, "cli.unknown_accept"),
        ("--to grbl --accept gap,0123abcd,proof.still", 3, "files.missing"),
    ] {
        let (found, told) = answer(home, &format!("cam missing.drl -o out {arguments}"));
        assert_eq!((found, &told["error"]["code"]), (exit, &code.into()), "{arguments}: {told}");
    }
    for (arguments, exit) in [
        ("--set passes", 2),
        ("--set isolate.passes=0", 2),
        ("--set operation.speed=0", 2),
        ("--machine missing", 3),
        ("--job missing.toml", 3),
    ] {
        assert_eq!(answer(home, &format!("{CAM} --to grbl -o out {arguments}")).0, exit, "{arguments}");
    }
    assert!(!home.join("out").exists());
}

#[test]
fn what_a_template_leaves_uncertain_is_told_with_what_it_writes() {
    let folder = folder();
    let home = folder.path();
    let (_, grbl) = annulus_core::post::shipped().find(|(name, _)| *name == "grbl").unwrap();
    fs::write(home.join("own.toml"), grbl.replace("G0 Z@H@\n", "")).unwrap();
    fs::write(home.join("same.toml"), grbl).unwrap();
    for (arguments, doubts) in [
        (format!("{CAM} --cure -o out --to own.toml"), 4),
        (format!("{CAM} --cure -o out --to same.toml"), 0),
        (format!("{CAM} --cure -o out --to program"), 0),
        ("export sensor.drl -o out.nc --to own.toml".to_owned(), 4),
        ("export sensor.drl -o out.nc --to grbl".to_owned(), 0),
    ] {
        let (exit, told) = answer(home, &arguments);
        assert_eq!(exit, 0, "{arguments}: {told}");
        let remarks = told["remarks"].as_array().unwrap().iter();
        let told: Vec<&Value> = remarks.filter(|row| row["code"] == "post.no_height").collect();
        assert_eq!(told.len(), doubts, "{arguments}");
        assert!(told.iter().all(|row| row["weight"] == "note"), "{told:?}");
    }
}

#[test]
fn a_wrong_job_file_is_told_with_its_place() {
    let folder = folder();
    let home = folder.path();
    let isolate = "schema = 1\n[[operation]]\nkind = \"isolate\"\n";
    for (text, code, line, column) in [
        (format!("{isolate}colour = 3\n"), "project.unknown_row", 4, 1),
        (format!("{isolate}  depth = -0.1\n"), "machine.setting_range", 4, 11),
        ("schema = 1\n[setup]\ncolumns = 1000\n".to_owned(), "machine.setting_range", 3, 11),
        ("schema = 1\n[setup\n".to_owned(), "project.syntax", 2, 7),
    ] {
        fs::write(home.join("job.toml"), &text).unwrap();
        let (exit, told) =
            answer(home, &format!("{CAM} --job job.toml --to grbl -o out --save-job kept.toml"));
        let place = &told["error"]["place"];
        assert_eq!((exit, &told["error"]["code"]), (1, &code.into()), "{text}: {told}");
        assert_eq!(
            (&place["file"], &place["line"], &place["column"]),
            (&"job.toml".into(), &line.into(), &column.into())
        );
        assert!(!home.join("out").exists() && !home.join("kept.toml").exists(), "{text}");
    }
}

#[test]
fn arcs_become_lines_where_they_are_asked_to() {
    let folder = folder();
    let home = folder.path();
    for (lines_only, arcs) in [("", true), ("--lines-only", false)] {
        let (exit, told) = answer(home, &format!("{CAM} --cure --to grbl -o out {lines_only}"));
        assert_eq!(exit, 0, "{told}");
        let text = fs::read_to_string(home.join("out/sensor-top.nc")).unwrap();
        let is_arc =
            |line: &str| line.split_whitespace().any(|word| ["G2", "G3", "G02", "G03"].contains(&word));
        assert_eq!(text.lines().any(is_arc), arcs, "{lines_only}");
    }
}

#[test]
fn a_program_is_proved_on_the_board_as_its_job_lays_it() {
    let folder = folder();
    let home = folder.path();
    fs::create_dir(home.join("board")).unwrap();
    for name in BOARD {
        fs::rename(home.join(name), home.join("board").join(name)).unwrap();
    }
    let cam = "cam board --set setup.columns=2 --cure --to program -o out --save-job job.toml";
    let (exit, told) = answer(home, cam);
    assert_eq!(exit, 0, "{told}");
    let (exit, proved) = answer(home, "prove board out/board-top.program --job job.toml --accept lost");
    assert_eq!((exit, &proved["unread"]), (0, &0.into()), "{proved}");
    let (exit, alone) = answer(home, "prove board out/board-top.program");
    assert_eq!(exit, 0, "{alone}");
    assert_eq!(proved["islands"].as_u64(), alone["islands"].as_u64().map(|islands| 2 * islands));
    assert_eq!(answer(home, "prove board out/board-top.program --job missing.toml").0, 3);
    assert_eq!(answer(home, "prove board out/board-top.program --job job.toml --turn not").0, 2);
}

/// The sample board with one more panel as a saved project.
fn project() -> Project {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../www/examples");
    let files = BOARD.map(|name| (name.to_owned(), fs::read(examples.join(name)).unwrap())).to_vec();
    Project { files, said: Said::default(), job: Some("schema = 1\n[setup]\ncolumns = 2\n".to_owned()) }
}

#[test]
fn a_saved_project_is_a_job_for_every_command() {
    let folder = folder();
    let home = folder.path();
    fs::write(home.join("board.annulus"), saved::write(&project()).unwrap()).unwrap();
    let take = "--cure --to program";
    let (exit, told) = answer(home, &format!("cam board.annulus {take} -o project"));
    assert_eq!(exit, 0, "{told}");
    let (exit, told) = answer(home, &format!("{CAM} --set setup.columns=2 {take} -o files"));
    assert_eq!(exit, 0, "{told}");
    let read = |name: &str| fs::read(home.join(name)).unwrap();
    assert_eq!(read("project/board-top.program"), read("files/sensor-top.program"));
    assert_eq!(answer(home, "prove board.annulus project/board-top.program --accept lost").0, 0);
    for (arguments, exit) in [
        ("inspect board.annulus", 0),
        ("plan board.annulus", 0),
        ("export board.annulus --to grbl -o out.nc", 0),
        ("simulate board.annulus", 0),
        ("cam board.annulus sensor.drl --to grbl -o out", 2),
    ] {
        assert_eq!(answer(home, arguments).0, exit, "{arguments}");
    }
}

#[test]
fn what_a_project_says_of_its_files_goes_before_what_they_say() {
    let folder = folder();
    let home = folder.path();
    let mut project = project();
    project.files.push(("more.drl".to_owned(), b"M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n".to_vec()));
    let holes = [None, Some(vec!["sensor.drl".to_owned()])].map(|used| {
        project.said = Said { used, ..Said::default() };
        fs::write(home.join("board.annulus"), saved::write(&project).unwrap()).unwrap();
        let (exit, told) = answer(home, "plan board.annulus");
        assert_eq!(exit, 0, "{told}");
        let rows = told["tools"].as_array().unwrap().iter();
        rows.map(|row| row["holes"].as_u64().unwrap()).sum::<u64>()
    });
    assert_eq!(holes[0], holes[1] + 1);
    project.job = Some("schema = 1\n[setup]\ncolour = 1\n".to_owned());
    fs::write(home.join("board.annulus"), saved::write(&project).unwrap()).unwrap();
    let (exit, told) = answer(home, "cam board.annulus --to grbl -o out");
    let place = &told["error"]["place"];
    assert_eq!((exit, &place["file"], &place["line"]), (1, &"job.toml".into(), &3.into()), "{told}");
}

/// The bytes that the page saves of `files` as they open.
fn saved_by_the_page(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut shelf = Shelf::default();
    let mut ask = |request| perform(request, &mut shelf, &mut |_, _| {}).unwrap();
    let machine = Some(Settings::of(&virtual_drill()));
    let Answer::Read(reading) =
        ask(Request::Read(ToRead { files: files.to_vec(), machine, ..ToRead::default() }))
    else {
        panic!()
    };
    let job = Some(annulus_core::project::write(&reading.work));
    let project = Project { files: files.to_vec(), said: Said::default(), job };
    let Answer::Saved(bytes) = ask(Request::Save(project)) else { panic!() };
    bytes
}

#[test]
fn a_project_saved_here_is_the_one_that_the_page_saves() {
    let folder = folder();
    let home = folder.path();
    let files = BOARD.map(|name| (name.to_owned(), fs::read(home.join(name)).unwrap()));
    let (exit, told) = answer(home, &format!("{CAM} --alone --to grbl -o out --save-project board.annulus"));
    assert_eq!((exit, &told["error"]["code"]), (1, &"cam.unread_findings".into()), "{told}");
    let bytes = fs::read(home.join("board.annulus")).unwrap();
    assert_eq!(bytes, saved_by_the_page(&files));
    // Saved again from itself, over itself, it stays.
    answer(home, "cam board.annulus --to grbl -o out --save-project board.annulus");
    assert_eq!(fs::read(home.join("board.annulus")).unwrap(), bytes);
    // What flags say and cures change is in it.
    let flags = "--set setup.columns=2 --units mm --align --cure";
    let (exit, told) = answer(home, &format!("{CAM} {flags} --to program -o flags --save-project f.annulus"));
    assert_eq!(exit, 0, "{told}");
    let kept = saved::read("f", &fs::read(home.join("f.annulus")).unwrap()).unwrap();
    assert_eq!((kept.said.numbers.units.as_deref(), kept.said.aligned), (Some("mm"), true));
    let job = kept.job.unwrap();
    assert!(job.contains("columns = 2") && job.contains("[[operation.cure]]"), "{job}");
    let (exit, told) = answer(home, "cam f.annulus --accept lost --to program -o again");
    assert_eq!(exit, 0, "{told}");
    let read = |name: &str| fs::read(home.join(name)).unwrap();
    assert_eq!(read("again/f-top.program"), read("flags/sensor-top.program"));
}

#[test]
fn what_lies_beside_a_file_is_in_its_project_where_the_board_needs_it() {
    let folder = folder();
    let home = folder.path();
    fs::write(home.join("read.me"), "nothing to see\n").unwrap();
    let take = "--accept gap --to program";
    let (exit, told) = answer(home, &format!("cam sensor.drl {take} -o out --save-project one.annulus"));
    assert_eq!(exit, 0, "{told}");
    let kept = saved::read("one", &fs::read(home.join("one.annulus")).unwrap()).unwrap();
    let names: BTreeSet<&str> = kept.files.iter().map(|(name, _)| name.as_str()).collect();
    assert!(names.is_superset(&BTreeSet::from(BOARD)), "{names:?}");
    assert_eq!(kept.said.used, Some(vec!["sensor.drl".to_owned()]));
    let (exit, told) = answer(home, &format!("cam one.annulus {take} -o again"));
    assert_eq!(exit, 0, "{told}");
    let read = |name: &str| fs::read(home.join(name)).unwrap();
    assert_eq!(read("again/one-top.program"), read("out/sensor-top.program"));
    // A whole folder leaves nothing beside it, and its name stays in front.
    fs::create_dir(home.join("board")).unwrap();
    for name in BOARD {
        fs::copy(home.join(name), home.join("board").join(name)).unwrap();
    }
    let whole = home.join("board").display().to_string();
    answer(home, &format!("cam {whole} {take} -o out --save-project whole.annulus"));
    let kept = saved::read("whole", &fs::read(home.join("whole.annulus")).unwrap()).unwrap();
    assert_eq!((kept.files.len(), kept.said), (3, Said::default()));
    assert!(kept.files.iter().all(|(name, _)| name.starts_with("board/sensor")), "{:?}", kept.files[0].0);
    let (exit, told) =
        answer(home, &format!("cam sensor.drl {take} -o out --save-project no/such/x.annulus"));
    assert_eq!((exit, &told["error"]["code"]), (3, &"job.not_written".into()), "{told}");
}

/// What the worker of the page makes of `files`, and what it says of the board.
fn page(files: &[(String, Vec<u8>)], aligned: bool, target: &str) -> (Vec<(String, String)>, Vec<String>) {
    let mut shelf = Shelf::default();
    let mut ask = |request| perform(request, &mut shelf, &mut |_, _| {}).unwrap();
    let machine = Settings::of(&virtual_drill());
    let said = Said { aligned, ..Said::default() };
    let wanted = ToRead { files: files.to_vec(), said, machine: Some(machine.clone()), ..ToRead::default() };
    let Answer::Read(reading) = ask(Request::Read(wanted)) else { panic!() };
    let accept = vec!["plan.no_bit".to_owned()];
    let wanted = ToPlan { board_key: 0, machine, work: reading.work, loaded: None, accept, laid: None };
    let Answer::Planned(planned) = ask(Request::Plan(wanted)) else { panic!() };
    let target = target.to_owned();
    let fall_to = Some(virtual_drill().process.feed_height);
    let wanted = ToWrite { program: planned.program, target, text: None, lines_only: None, fall_to };
    let Answer::Written(written) = ask(Request::Write(wanted)) else { panic!() };
    (written, reading.remarks.into_iter().map(|remark| remark.code).collect())
}

#[test]
fn real_boards_give_the_same_bytes_in_page_and_command_line() {
    let corpus = std::env::var_os("ANNULUS_CORPUS").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/corpus"),
        std::path::PathBuf::from,
    );
    if !corpus.is_dir() {
        assert_ne!(std::env::var("CI").as_deref(), Ok("true"), "no corpus");
        println!("skipped: no corpus");
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let take = "--to grbl --accept short,gap,break,gone,lost,hit,ring,sliver,shallow,remnant,plan.no_bit";
    for name in ["kicad/2013-clockblock", "easyeda/easytrace-tht"] {
        let folder = corpus.join(name);
        let mut names: Vec<_> = fs::read_dir(&folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort_unstable();
        let files: Vec<_> =
            names.iter().map(|name| (name.clone(), fs::read(folder.join(name)).unwrap())).collect();
        let (exit, told) = answer(out.path(), &format!("cam {} {take} -o out", folder.display()));
        assert_eq!(exit, 0, "{name}: {told}");
        let side = &told["programs"].as_array().unwrap().last().unwrap()["files"][0]["file"];
        let written = fs::read_to_string(out.path().join(side.as_str().unwrap())).unwrap();
        let (page, _) = page(&files, false, "grbl");
        assert!(page[0].1 == written, "{name}: {} {}", page[0].1.len(), written.len());
    }
}

#[test]
fn layers_that_lie_apart_are_moved_when_asked_and_page_and_command_line_agree() {
    let folder = folder();
    let home = folder.path();
    // The holes as if exported with another zero point: 5 mm too far in X.
    let text = fs::read_to_string(home.join(BOARD[0])).unwrap();
    let moved = |line: &str| {
        let (x, y) = line.strip_prefix('X')?.split_once('Y')?;
        Some(format!("X{:.3}Y{y}", x.parse::<f64>().ok()? + 5.0))
    };
    let lines: Vec<String> =
        text.lines().map(|line| moved(line).unwrap_or_else(|| line.to_owned())).collect();
    assert_ne!(lines.join("\n"), text);
    fs::write(home.join(BOARD[0]), lines.join("\n")).unwrap();
    let files = BOARD.map(|name| (name.to_owned(), fs::read(home.join(name)).unwrap()));
    let mut both = Vec::new();
    for (flag, aligned) in [("", false), ("--align", true)] {
        let take = format!("--accept short,gap,break,gone,lost,hit,ring,sliver --to grbl -o out{aligned}");
        let (exit, told) = answer(home, &format!("{CAM} {take} {flag}"));
        assert_eq!(exit, 0, "{told}");
        let codes = codes(&told["remarks"]);
        assert_eq!(codes.contains(&"board.holes_shifted"), !aligned, "{codes:?}");
        let written = fs::read_to_string(home.join(format!("out{aligned}/sensor-top.nc"))).unwrap();
        let (page, remarks) = page(&files, aligned, "grbl");
        assert_eq!(page, [("sensor-top.nc".to_owned(), written.clone())]);
        let told = |code: &str| remarks.iter().any(|remark| remark == code);
        assert_eq!((told("board.holes_shifted"), told("board.moved")), (!aligned, aligned));
        both.push(written);
    }
    assert_ne!(both[0], both[1]);
}

#[test]
fn what_lies_beside_a_board_stops_nothing_but_another_copper_has_to_be_seen() {
    let folder = folder();
    let home = folder.path();
    let board = home.join("board");
    fs::create_dir_all(board.join("old")).unwrap();
    for name in BOARD {
        fs::copy(home.join(name), board.join(name)).unwrap();
    }
    fs::write(board.join("photo.png"), [[0x89_u8, 0x50, 0xFF, 0x03]; 64].concat()).unwrap();
    fs::write(board.join("zero"), b"").unwrap();
    let take = "--accept short,gap,break,gone,lost,hit,ring,sliver --to grbl -o out";
    let (exit, told) = answer(home, &format!("cam board {take}"));
    assert_eq!(exit, 0, "{told}");
    fs::write(board.join("more.drl"), b"").unwrap();
    let (exit, told) = answer(home, &format!("cam board {take}"));
    assert_eq!((exit, &told["error"]["code"]), (1, &"refused.empty".into()), "{told}");
    fs::remove_file(board.join("more.drl")).unwrap();
    // The same copper with one pad less, first in a folder of its own, then beside the files that are asked for.
    let copper = fs::read_to_string(home.join(BOARD[1])).unwrap();
    let flash = copper.lines().rfind(|line| line.ends_with("D03*")).unwrap();
    for (place, command, stops) in
        [("board/old/sensor-top.gbr", "cam board", true), ("more-top.gbr", CAM, false)]
    {
        fs::write(home.join(place), copper.replacen(&format!("{flash}\n"), "", 1)).unwrap();
        let (exit, told) = answer(home, &format!("{command} {take}"));
        assert_eq!(exit, i32::from(stops), "{place}: {told}");
        assert_eq!(stops, told["error"]["code"] == "board.two_coppers", "{place}: {told}");
    }
}
