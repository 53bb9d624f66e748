//! Tests of saved projects on the command line. A project is a job for every command, its statements
//! precede its files, and a project saved here equals the page's.

use super::{BOARD, CAM, answer, folder};
use annulus_app::engine::messages::{Answer, Request, Settings, ToRead};
use annulus_app::engine::{Cache, perform};
use annulus_core::machine::virtual_drill;
use annulus_core::project::saved::{self, Project, SaidOfFiles};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

fn project() -> Project {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../www/examples");
    let files = BOARD.map(|name| (name.to_owned(), fs::read(examples.join(name)).unwrap())).to_vec();
    Project {
        files,
        said: SaidOfFiles::default(),
        job: Some("schema = 1\n[setup]\ncolumns = 2\n".to_owned()),
    }
}

#[test]
fn saved_project_works_with_every_command() {
    let folder = folder();
    let home = folder.path();
    fs::write(home.join("board.annulus"), saved::write(&project()).unwrap()).unwrap();
    let take = "--fix-gaps --to program";
    let (exit, told) = answer(home, &format!("cam board.annulus {take} -o project"));
    assert_eq!(exit, 0, "{told}");
    let (exit, told) = answer(home, &format!("{CAM} --set setup.columns=2 {take} -o files"));
    assert_eq!(exit, 0, "{told}");
    let read = |name: &str| fs::read(home.join(name)).unwrap();
    assert_eq!(read("project/board-top.program"), read("files/sensor-top.program"));
    assert_eq!(answer(home, "prove board.annulus project/board-top.program --accept lost").0, 0);
    for (arguments, exit) in [
        ("inspect board.annulus", 0),
        ("plan board.annulus", 1),
        ("plan board.annulus --accept job.operations_left_out", 0),
        ("export board.annulus --to grbl -o out.nc --accept job.operations_left_out", 0),
        ("simulate board.annulus", 1),
        ("simulate board.annulus --accept job.operations_left_out", 0),
        ("cam board.annulus sensor.drl --to grbl -o out", 2),
    ] {
        assert_eq!(answer(home, arguments).0, exit, "{arguments}");
    }
    // A command reports what it leaves out, and does the rest as in the job: two boards in a panel.
    let (_, told) = answer(home, "plan board.annulus");
    assert_eq!(told["error"]["code"], "job.operations_left_out", "{told}");
    let (_, one) = answer(home, "plan sensor.drl");
    let (_, two) = answer(home, "plan board.annulus --accept job.operations_left_out");
    let holes = |told: &serde_json::Value| {
        told["tools"].as_array().unwrap().iter().map(|row| row["holes"].as_u64().unwrap()).sum::<u64>()
    };
    assert_eq!(holes(&two), 2 * holes(&one));
}

#[test]
fn project_settings_override_the_files_own() {
    let folder = folder();
    let home = folder.path();
    let mut project = project();
    project.files.push(("more.drl".to_owned(), b"M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n".to_vec()));
    let holes = [None, Some(vec!["sensor.drl".to_owned()])].map(|used| {
        project.said = SaidOfFiles { used, ..SaidOfFiles::default() };
        fs::write(home.join("board.annulus"), saved::write(&project).unwrap()).unwrap();
        // By its name the file belongs to another board.
        let (exit, told) = answer(home, "plan board.annulus --accept board.several,job.operations_left_out");
        assert_eq!(exit, 0, "{told}");
        let rows = told["tools"].as_array().unwrap().iter();
        rows.map(|row| row["holes"].as_u64().unwrap()).sum::<u64>()
    });
    // On both boards of the panel.
    assert_eq!(holes[0], holes[1] + 2);
    project.job = Some("schema = 1\n[setup]\ncolour = 1\n".to_owned());
    fs::write(home.join("board.annulus"), saved::write(&project).unwrap()).unwrap();
    let (exit, told) = answer(home, "cam board.annulus --to grbl -o out");
    let place = &told["error"]["place"];
    assert_eq!((exit, &place["file"], &place["line"]), (1, &"job.toml".into(), &3.into()), "{told}");
}

fn saved_by_the_page(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut cache = Cache::default();
    let mut ask = |request| perform(request, &mut cache, &mut |_, _| {}).unwrap();
    let machine = Some(Settings::of(&virtual_drill()));
    let Answer::Read(reading) =
        ask(Request::Read(ToRead { files: files.to_vec(), machine, ..ToRead::default() }))
    else {
        panic!()
    };
    let job = Some(annulus_core::project::write(&reading.work));
    let project = Project { files: files.to_vec(), said: SaidOfFiles::default(), job };
    let Answer::Saved(bytes) = ask(Request::Save(project)) else { panic!() };
    bytes
}

#[test]
fn saved_project_equals_the_project_of_the_page() {
    let folder = folder();
    let home = folder.path();
    let files = BOARD.map(|name| (name.to_owned(), fs::read(home.join(name)).unwrap()));
    let (exit, told) =
        answer(home, &format!("{CAM} --ignore-siblings --to grbl -o out --save-project board.annulus"));
    assert_eq!((exit, &told["error"]["code"]), (1, &"cam.unread_findings".into()), "{told}");
    let bytes = fs::read(home.join("board.annulus")).unwrap();
    assert_eq!(bytes, saved_by_the_page(&files));
    // Saving it again over itself changes nothing.
    answer(home, "cam board.annulus --to grbl -o out --save-project board.annulus");
    assert_eq!(fs::read(home.join("board.annulus")).unwrap(), bytes);
    // The project contains the changes made by flags and fixes.
    let flags = "--set setup.columns=2 --units mm --align-layers --fix-gaps";
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

/// A drawing is a job too: alone, over files, and in a project saved by the page or here.
#[test]
fn drawing_works_alone_and_in_a_project() {
    let folder = folder();
    let home = folder.path();
    let drawing = include_bytes!("../../../www/drawings/robot.json").to_vec();
    fs::write(home.join("robot.drawing.json"), &drawing).unwrap();
    let (exit, told) = answer(home, "inspect robot.drawing.json");
    let roles: Vec<&str> =
        told["files"].as_array().unwrap().iter().map(|file| file["role"].as_str().unwrap()).collect();
    assert_eq!((exit, roles), (0, vec!["copper", "drill"]), "{told}");
    let (exit, told) = answer(home, "plan robot.drawing.json");
    let of = |told: &serde_json::Value| {
        let rows = told["tools"].as_array().unwrap().iter();
        rows.map(|row| row["holes"].as_u64().unwrap()).sum::<u64>()
    };
    let alone = of(&told);
    assert!(exit == 0 && alone > 0, "{told}");
    let (_, told) = answer(home, "plan sensor.drl");
    let sensor = of(&told);

    // The page's project of the files with the drawing over them.
    let mut files = BOARD.map(|name| (name.to_owned(), fs::read(home.join(name)).unwrap())).to_vec();
    files.push(("robot.drawing.json".to_owned(), drawing));
    fs::write(home.join("both.annulus"), saved_by_the_page(&files)).unwrap();
    let (exit, told) = answer(home, "plan both.annulus --accept job.operations_left_out");
    assert_eq!((exit, of(&told)), (0, alone + sensor), "{told}");
    // Saved here, it still contains the drawing.
    answer(home, "cam both.annulus --to program -o out --save-project again.annulus");
    let kept = saved::read("again", &fs::read(home.join("again.annulus")).unwrap()).unwrap();
    assert!(kept.files.iter().any(|(name, _)| name == "robot.drawing.json"));
    // A drawing that is only in the same folder is not combined with the file.
    assert_eq!(of(&answer(home, "plan sensor.drl").1), sensor);
}

#[test]
fn project_contains_the_siblings_that_the_board_needs() {
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
    // A whole folder has no neighbours, and its name stays in front.
    fs::create_dir(home.join("board")).unwrap();
    for name in BOARD {
        fs::copy(home.join(name), home.join("board").join(name)).unwrap();
    }
    let whole = home.join("board").display().to_string();
    answer(home, &format!("cam {whole} {take} -o out --save-project whole.annulus"));
    let kept = saved::read("whole", &fs::read(home.join("whole.annulus")).unwrap()).unwrap();
    assert_eq!((kept.files.len(), kept.said), (3, SaidOfFiles::default()));
    assert!(kept.files.iter().all(|(name, _)| name.starts_with("board/sensor")), "{:?}", kept.files[0].0);
    let (exit, told) =
        answer(home, &format!("cam sensor.drl {take} -o out --save-project no/such/x.annulus"));
    assert_eq!((exit, &told["error"]["code"]), (3, &"job.not_written".into()), "{told}");
}
