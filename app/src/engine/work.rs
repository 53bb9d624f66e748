//! Handles one request and returns its answer. Independent of the browser, so that it can be tested natively.

use super::cache::Cache;
use super::mesh::{layers, mesh};
use super::messages::{Answer, BoardRow, FileRow, LayerRow, Reading, Request, Timed, ToRead, ToTime, Traced};
use super::{board_files, exporting, part, planning, proving, writing};
use crate::picture;
use annulus_core::artwork::{self, Artwork, FileRead, Role, Side};
use annulus_core::board::{self, BoardWanted, drawing, from_artwork_with};
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::geometry::{Bounds, Point};
use annulus_core::machine::{Machine, virtual_drill};
use annulus_core::project::{self, saved};
use annulus_core::sim::summary;
use annulus_core::wire::program;
use annulus_core::{motion, steps};

/// How many layers are painted in addition to the copper.
const MOST_LAYERS: usize = 24;

const MOST_PICTURES: usize = 12;

/// Progress of a reading in per cent when all files are read.
const READ: u64 = 10;
/// Progress when the board has its copper.
const PAINTED: u64 = 70;
/// Progress when the copper is cut into triangles.
const MESHED: u64 = 80;

/// Progress of timing in per cent when all moves are timed.
const TIMED: u64 = 30;
/// Progress when the steps are computed.
const STEPPED: u64 = 95;

pub fn perform(
    request: Request,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Answer, Vec<Diagnostic>> {
    let one = |diagnostic| vec![diagnostic];
    match request {
        Request::Open(wanted) => saved::read(&wanted.name, &wanted.bytes).map(Answer::Opened).map_err(one),
        Request::Save(project) => saved::write(&project).map(Answer::Saved).map_err(one),
        Request::Read(wanted) => Ok(Answer::Read(Box::new(read(&wanted, cache, progress)))),
        Request::Trace(wanted) => Ok(Answer::Traced(trace(&wanted))),
        Request::WriteOver(wanted) => {
            board_files::write(&wanted).map(|written| Answer::WrittenOver(Box::new(written))).map_err(one)
        }
        Request::Plan(wanted) => {
            planning::plan(&wanted, cache, progress).map(|planned| Answer::Planned(Box::new(planned)))
        }
        Request::Prove(wanted) => proving::prove(&wanted, cache, progress).map(Answer::Proved),
        Request::Export(wanted) => {
            exporting::export(&wanted, cache, progress).map(|exported| Answer::Exported(Box::new(exported)))
        }
        Request::Lines(wanted) => exporting::lines(&wanted, cache, progress).map(Answer::Lines),
        Request::Check(wanted) => Ok(Answer::Checked(writing::check(&wanted))),
        Request::Time(wanted) => time(&wanted, progress).map(Answer::Timed),
        Request::Compare(wanted) => Ok(Answer::Compared(Box::new(board_files::compare(&wanted)))),
        Request::Underside(wanted) => planning::underside(&wanted, cache).map(Answer::Underside),
    }
}

fn read(wanted: &ToRead, cache: &mut Cache, progress: &mut dyn FnMut(u64, u64)) -> Reading {
    let artwork = board_files::artwork(wanted, &mut part(progress, 0, READ));
    let boards = several(&artwork);
    let artwork = board_files::as_said(wanted, artwork);
    let (artwork, used, board, mut diagnostics) =
        board_files::board(wanted, artwork, &mut part(progress, READ, PAINTED));
    progress(PAINTED, 100);
    let body = picture::body(&board);
    let mut layers = layers(&board, body);
    progress(MESHED, 100);
    let copper = layers.clone();
    layers.extend(other_layers(&artwork, body, &mut diagnostics, &mut part(progress, MESHED, 100)));
    let machine = wanted.machine.as_ref().and_then(|machine| machine.machine().ok());
    let work = work(wanted, &board, &machine.unwrap_or_else(virtual_drill), &mut diagnostics);
    let all: Vec<usize> = (0..artwork.files.len()).collect();
    let errors = diagnostics
        .iter()
        .chain(artwork.missing(&all))
        .filter(|diagnostic| diagnostic.severity == Severity::Error);
    let lost = errors.map(|error| error.code.clone()).collect();
    let on_page = board.without_areas();
    cache.keep(wanted.board_key, board, lost);
    cache.keep_copper(body, copper);
    Reading {
        files: artwork.files.into_iter().map(FileRow::of).collect(),
        used: used.iter().map(|row| *row as u32).collect(),
        boards,
        board: on_page,
        board_key: wanted.board_key,
        body,
        layers,
        work,
        diagnostics,
    }
}

/// The objects of the files, without those of drawings among them.
fn trace(wanted: &ToRead) -> Traced {
    let artwork = board_files::as_said(wanted, board_files::artwork(wanted, &mut |_, _| {}));
    let used = board_files::used(wanted, &artwork);
    let asked = BoardWanted { copper: false, aligned: wanted.said.aligned };
    let (board, _) = from_artwork_with(&artwork, &used, asked);
    let outline_mm = picture::rings(&board.outline, Point::default());
    Traced { imported: drawing::imported(&artwork, &used), outline_mm }
}

/// The boards with copper or holes in `artwork`; empty unless there are several.
fn several(artwork: &Artwork) -> Vec<BoardRow> {
    let made =
        |file: &FileRead| file.role == Role::Copper || file.role == Role::Drill && file.drill.is_some();
    let rows = artwork.files.iter().enumerate();
    let made: Vec<usize> = rows.filter(|(_, file)| made(file)).map(|(row, _)| row).collect();
    let names: Vec<String> = artwork.boards(&made).into_iter().map(|(name, _)| name).collect();
    if names.len() < 2 {
        return Vec::new();
    }
    let all: Vec<usize> = (0..artwork.files.len()).collect();
    let boards = artwork.boards(&all).into_iter().filter(|(name, _)| names.contains(name));
    let row = |(at, (name, files)): (usize, (String, Vec<usize>))| {
        let layer = |row: &&usize| artwork.files.get(**row).is_some_and(|file| file.role == Role::Copper);
        let is_top = |row: &usize| artwork.files.get(*row).is_some_and(|file| file.side == Some(Side::Top));
        let layer = files.iter().filter(layer).max_by_key(|row| (is_top(row), std::cmp::Reverse(**row)));
        let layer = layer.copied().filter(|_| at < MOST_PICTURES);
        let gerber = layer.and_then(|row| artwork.files.get(row)?.gerber.as_ref());
        let region = gerber.and_then(|gerber| artwork::painted(gerber).ok());
        let picture_of = layer.filter(|_| region.is_some()).map(|row| row as u32);
        let mesh = region.map(|region| mesh(&region, picture::origin(region.bounds()))).unwrap_or_default();
        let files = files.into_iter().map(|row| row as u32).collect();
        BoardRow { name, files, picture_of, mesh }
    };
    boards.enumerate().map(row).collect()
}

/// The job that the board opens with: the saved one if it can be read, else the default.
fn work(wanted: &ToRead, board: &board::Board, machine: &Machine, diagnostics: &mut Vec<Diagnostic>) -> Work {
    let usual = Work::default_for(board, machine);
    let Some(job) = &wanted.job else { return usual };
    project::read(saved::JOB, job, &usual).unwrap_or_else(|why| {
        diagnostics.push(why);
        usual
    })
}

/// Solder mask, silkscreen, paste and inner copper as display layers: the first file of each kind and side.
/// `progress` receives the number of files done.
fn other_layers(
    artwork: &Artwork,
    body: Option<Bounds>,
    diagnostics: &mut Vec<Diagnostic>,
    progress: &mut dyn FnMut(u64, u64),
) -> Vec<LayerRow> {
    let origin = picture::origin(body);
    let mut seen = Vec::new();
    let mut rows = Vec::new();
    for (index, file) in (0..).zip(&artwork.files) {
        progress(u64::from(index), artwork.files.len() as u64);
        let shown = matches!(file.role, Role::Mask | Role::Silk | Role::Paste)
            || (file.role == Role::Copper && file.side == Some(Side::Inner));
        let Some(gerber) = file.gerber.as_ref().filter(|_| shown && rows.len() < MOST_LAYERS) else {
            continue;
        };
        let known = (file.role, file.side);
        if file.side != Some(Side::Inner) && seen.contains(&known) {
            continue;
        }
        seen.push(known);
        let region = match artwork::painted_for_picture(gerber) {
            Ok(region) => region,
            Err(much) => {
                // Only the display lacks the layer, so a warning is enough.
                diagnostics.push(Diagnostic { severity: Severity::Warning, ..much.diagnostic(&file.name) });
                continue;
            }
        };
        rows.push(LayerRow {
            file: Some(index),
            role: file.role,
            side: file.side,
            islands: region.islands.len() as u32,
            mesh: mesh(&region, origin),
        });
    }
    rows
}

fn time(wanted: &ToTime, progress: &mut dyn FnMut(u64, u64)) -> Result<Timed, Vec<Diagnostic>> {
    let one = |diagnostic| vec![diagnostic];
    let machine = wanted.machine.machine()?;
    let program = program::decode(&wanted.program).map_err(one)?;
    let timeline =
        motion::timeline_telling(&program, &machine, &mut part(progress, 0, TIMED)).map_err(one)?;
    let stream =
        steps::stream_telling(&timeline, &machine, &mut part(progress, TIMED, STEPPED)).map_err(one)?;
    let numbers = summary(&timeline, &stream, &machine);
    let [x, y, z, ..] = numbers.steps;
    progress(STEPPED, 100);
    Ok(Timed {
        stream_digest: steps::digest(&stream),
        total_s: timeline.total_s(),
        timeline,
        steps: [x, y, z],
        holes: program.hole_count() as u32,
    })
}

#[cfg(test)]
mod tests {
    use super::super::messages::{
        Envelope, Exported, PlanReady, Settings, ToCompare, ToExport, ToOpen, ToPlan, ToProve, ToUnderside,
        UnderTile,
    };
    use super::*;
    use annulus_core::artwork::{FileKind, Units};
    use annulus_core::board::changes::Fate;
    use annulus_core::cam;
    use annulus_core::cam::toolpaths::planned_operations;
    use annulus_core::cam::work::{Flip, Operation, OperationKind};
    use annulus_core::geometry::{Island, Path, Point, Region};
    use annulus_core::job::Command;
    use annulus_core::machine::hobby_3018;
    use annulus_core::post::SheetRow;
    use annulus_core::project::saved::{NumberReading, Project, SaidOfFiles};
    use annulus_core::proof;
    use annulus_core::sim::{self, Stock, TILE};
    use annulus_core::units::Length;
    use std::collections::BTreeSet;

    const DRILL: &[u8] =
        b"M48\nMETRIC\nT1C0.800\nT2C1.000\n%\nG90\nT1\nX10.0Y10.0\nX40.0Y10.0\nX12.0Y10.0\nX38.0Y11.0\nT2\nX20.0Y20.0\nM30\n";

    fn reading() -> (Reading, Cache) {
        let files =
            vec![("board.drl".to_owned(), DRILL.to_vec()), ("notes.txt".to_owned(), b"hello".to_vec())];
        let wanted = ToRead { files, board_key: 3, ..ToRead::default() };
        let mut cache = Cache::default();
        match perform(Request::Read(wanted), &mut cache, &mut |_, _| {}) {
            Ok(Answer::Read(reading)) => (*reading, cache),
            other => panic!("{other:?}"),
        }
    }

    fn drilling(order: cam::HoleOrder) -> Work {
        let mut work = reading().0.work;
        for operation in &mut work.operations {
            if let OperationKind::Drill(drill) = &mut operation.action {
                drill.order = order;
            }
        }
        work
    }

    fn planned(order: cam::HoleOrder, told: &mut Vec<(u64, u64)>) -> PlanReady {
        let machine = Settings::of(&virtual_drill());
        let wanted =
            ToPlan { board_key: 3, machine, work: drilling(order), loaded: None, accept: vec![], laid: None };
        match perform(Request::Plan(wanted), &mut reading().1, &mut |done, total| told.push((done, total))) {
            Ok(Answer::Planned(planned)) => *planned,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn every_file_is_listed_and_drill_files_give_the_holes() {
        let (reading, _) = reading();
        let rows: Vec<_> = reading.files.iter().map(|row| (row.read.name.as_str(), row.read.kind)).collect();
        assert_eq!(rows[0], ("board.drl", FileKind::Drill));
        assert_eq!(rows.len(), 2);
        assert_eq!(reading.used, [0]);
        assert_eq!(reading.board.holes.len(), 5);
        let row = &reading.files[0];
        assert_eq!((row.drill.unwrap().hits, row.read.units), (5, Some(Units::Mm)));
    }

    #[test]
    fn alignment_moves_holes_onto_the_copper() {
        let (mut copper, mut drill) = (String::new(), String::from("M48\nMETRIC\nT1C0.8\n%\nT1\n"));
        for i in 0..60_i64 {
            // An irregular grid, so that only one shift fits.
            let (x, y) = (i * 7 % 31 * 1_270, i * i % 53 * 830);
            copper += &format!("X{x}Y{y}D03*\n");
            drill += &format!("X{:.3}Y{:.3}\n", (x - 3_295) as f64 / 1e3, (y - 20_124) as f64 / 1e3);
        }
        let copper =
            format!("%FSLAX33Y33*%%MOMM*%%TF.FileFunction,Copper,L1,Top*%%ADD10C,1*%D10*\n{copper}M02*");
        let files = [("a.gbr", copper), ("a.drl", drill + "M30\n")];
        let files = files.map(|(name, text)| (name.to_owned(), text.into_bytes())).to_vec();
        for (aligned, y) in [(false, -20.124), (true, 0.0)] {
            let said = SaidOfFiles { aligned, ..SaidOfFiles::default() };
            let wanted = ToRead { files: files.clone(), said, ..ToRead::default() };
            let reading = read(&wanted, &mut Cache::default(), &mut |_, _| {});
            let found = reading.board.holes[0].at.y.mm();
            assert!((found - y).abs() < 0.01, "{aligned}: {found}, {:?}", reading.diagnostics);
        }
    }

    #[test]
    fn changed_board_files_are_compared_with_the_old_ones() {
        let file = |text: &str| vec![("a.drl".to_owned(), text.as_bytes().to_vec())];
        let old = String::from_utf8_lossy(DRILL).into_owned();
        let new = old.replace("M30", "X90.0Y90.0\nM30");
        let to_read = |text: &str| ToRead { files: file(text), ..ToRead::default() };
        let compare = |before: &str, now: &str| {
            let wanted = ToCompare { before: to_read(before), now: to_read(now), work: Work::default() };
            let request = Request::Compare(Box::new(wanted));
            let Ok(Answer::Compared(compared)) = perform(request, &mut Cache::default(), &mut |_, _| {})
            else {
                panic!()
            };
            *compared
        };
        let found = compare(&old, &new);
        assert_eq!((found.changes.holes.len(), found.changes.holes[0].fate), (1, Fate::Added));
        assert!(compare(&new, &new).changes.is_none() && found.work.is_none());
        let bytes = postcard::to_allocvec(&Answer::Compared(Box::new(found.clone()))).unwrap();
        assert_eq!(postcard::from_bytes::<Answer>(&bytes).unwrap(), Answer::Compared(Box::new(found)));
    }

    #[test]
    fn saved_project_opens_unchanged() {
        let said = SaidOfFiles {
            numbers: NumberReading { units: Some("mm".to_owned()), ..NumberReading::default() },
            used: Some(vec!["b.drl".to_owned()]),
            ..SaidOfFiles::default()
        };
        let mut work = drilling(cam::HoleOrder::File);
        work.setup.panel.columns = 2;
        let job = Some(project::write(&work));
        let files = ["a.drl", "b.drl"].map(|name| (name.to_owned(), DRILL.to_vec())).to_vec();
        let kept = Project { files, said, job };
        let perform = |request| super::perform(request, &mut Cache::default(), &mut |_, _| {}).unwrap();
        let Answer::Saved(bytes) = perform(Request::Save(kept.clone())) else { panic!() };
        let name = "board.annulus".to_owned();
        let Answer::Opened(opened) = perform(Request::Open(ToOpen { name, bytes })) else { panic!() };
        assert_eq!(opened, kept);
        let Project { files, said, job } = opened;
        let wanted = ToRead { files, said, job, ..ToRead::default() };
        let Answer::Read(reading) = perform(Request::Read(wanted)) else { panic!() };
        assert_eq!(
            (reading.used, reading.work, reading.board.sources),
            (vec![1], work, vec!["b.drl".to_owned()])
        );
    }

    #[test]
    fn plan_drills_every_hole_once_without_more_travel() {
        for order in [cam::HoleOrder::Shortest, cam::HoleOrder::Fastest, cam::HoleOrder::File] {
            let mut told = Vec::new();
            let planned = planned(order, &mut told);
            let mut holes = planned.order();
            holes.sort_unstable();
            assert_eq!(holes, [0, 1, 2, 3, 4], "{order:?}");
            assert!(planned.travel_after_mm <= planned.travel_before_mm + 1e-9, "{order:?}");
            assert!(told.iter().all(|(done, total)| done <= total));
        }
    }

    #[test]
    fn timed_program_gives_the_same_result_twice() {
        let planned = planned(cam::HoleOrder::Shortest, &mut Vec::new());
        let wanted = ToTime { program: planned.program, machine: Settings::of(&virtual_drill()) };
        let time = || perform(Request::Time(wanted.clone()), &mut Cache::default(), &mut |_, _| {});
        let Ok(Answer::Timed(timed)) = time() else { panic!("{:?}", time()) };
        assert_eq!(timed.holes, 5);
        assert!(timed.total_s > 1.0 && timed.steps.iter().all(|steps| *steps > 100), "{:?}", timed.steps);
        assert_eq!(time(), Ok(Answer::Timed(timed)));
    }

    #[test]
    fn worker_requests_survive_serialization() {
        let machine = Settings::of(&virtual_drill());
        assert_eq!(machine.machine(), Ok(virtual_drill()));
        let request = Request::Plan(ToPlan {
            board_key: 3,
            machine,
            work: drilling(cam::HoleOrder::Fastest),
            loaded: None,
            accept: vec!["x".to_owned()],
            laid: None,
        });
        let bytes = postcard::to_allocvec(&Envelope { id: 7, request: request.clone() }).unwrap();
        let back: Envelope = postcard::from_bytes(&bytes).unwrap();
        assert_eq!((back.id, back.request), (7, request));
    }

    #[test]
    fn new_worker_reports_a_missing_board() {
        let machine = Settings::of(&virtual_drill());
        let wanted =
            ToPlan { board_key: 3, machine, work: Work::default(), loaded: None, accept: vec![], laid: None };
        let refused = perform(Request::Plan(wanted), &mut Cache::default(), &mut |_, _| {});
        assert!(refused.is_err_and(|diagnostics| diagnostics[0].code == "engine.board_gone"));
    }

    #[test]
    fn copper_layers_list_the_bottom_first_from_the_body_corner() {
        let square = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
        let outer = Path::through(&square.map(|(x, y)| Point::from_mm(x, y))).unwrap();
        let region = Region { islands: vec![Island { outer, holes: vec![] }] };
        let on = |face| board::Copper { face, region: region.clone(), ..board::Copper::default() };
        let board = board::Board {
            copper: vec![on(board::Face::Top), on(board::Face::Bottom)],
            ..board::Board::default()
        };
        let rows = layers(&board, picture::body(&board));
        let sides: Vec<_> = rows.iter().map(|row| row.side.unwrap()).collect();
        assert_eq!(sides, [Side::Bottom, Side::Top], "the lower one is drawn first");
        assert_eq!(rows[0].mesh.triangles.len(), 2);
        assert_eq!(rows[0].mesh.bounds_mm(), Some([[4.0, 4.0], [6.0, 5.0]]), "from the corner of the body");
    }

    #[test]
    fn pad_names_follow_the_board_when_it_is_turned_over() {
        let mut cache = Cache::default();
        let mut ask = |request| super::perform(request, &mut cache, &mut |_, _| {}).unwrap();
        let copper =
            b"%FSLAX33Y33*%%MOMM*%%TF.FileFunction,Copper,L2,Bot*%%ADD10C,1*%D10*%TO.P,J1,2*%%TO.N,GND*%\
            X1000Y1000D03*%TD*%X9000Y1000D03*M02*";
        let machine = Settings::of(&virtual_drill());
        let files = vec![("b-bottom.gbr".to_owned(), copper.to_vec())];
        let wanted = ToRead { files, machine: Some(machine.clone()), ..ToRead::default() };
        let Answer::Read(reading) = ask(Request::Read(wanted)) else { panic!() };
        let said = |board: &board::Board| {
            let pads = board.copper.iter().flat_map(|copper| &copper.named);
            let rows = pads.map(|pad| format!("{} {:?} {}", pad.name, pad.net, pad.at.x.mm()));
            (rows.collect::<Vec<_>>(), board.copper.iter().all(|copper| copper.region.is_empty()))
        };
        assert_eq!(said(&reading.board), (vec!["J1.2 Some(\"GND\") 1".to_owned()], true));
        let work = reading.work;
        let wanted = ToPlan { board_key: 0, machine, work, loaded: None, accept: Vec::new(), laid: None };
        let Answer::Planned(planned) = ask(Request::Plan(wanted)) else { panic!() };
        let laid = planned.laid.unwrap();
        assert_eq!(said(&laid.board), (vec!["J1.2 Some(\"GND\") 9".to_owned()], true), "turned over");
    }

    #[test]
    fn cut_with_stopped_spindle_names_its_operation() {
        let mut cache = Cache::default();
        let mut ask = |request| super::perform(request, &mut cache, &mut |_, _| {}).unwrap();
        let copper = b"%FSLAX33Y33*%%MOMM*%%TF.FileFunction,Copper,L1,Top*%%ADD10C,1*%D10*X1000Y1000D03*X9000Y1000D03*M02*";
        let files = vec![("b-top.gbr".to_owned(), copper.to_vec())];
        let machine = Settings::of(&virtual_drill());
        let wanted = ToRead { files, machine: Some(machine.clone()), ..ToRead::default() };
        let Answer::Read(reading) = ask(Request::Read(wanted)) else { panic!() };
        let mut work = reading.work;
        work.operations.iter_mut().for_each(|operation| operation.spindle_rpm = Some(0));
        let wanted = ToPlan {
            board_key: 0,
            machine,
            work: work.clone(),
            loaded: None,
            accept: Vec::new(),
            laid: None,
        };
        let Answer::Planned(planned) = ask(Request::Plan(wanted)) else { panic!() };
        let prove = ToProve { board_key: 0, program: planned.program, work };
        let Answer::Proved(proved) = ask(Request::Prove(prove)) else { panic!() };
        let said: Vec<String> =
            proved.findings.iter().map(|finding| finding.diagnostic().message("en")).collect();
        assert!(said.iter().any(|said| said.starts_with("Isolate cuts 0.080 mm deep")), "{said:?}");
    }

    /// Reads a board with holes and with copper on both sides.
    fn two_sided(ask: &mut dyn FnMut(Request) -> Answer) -> ToPlan {
        let copper = |side: &str| {
            let text = format!(
                "%FSLAX33Y33*%%MOMM*%%TF.FileFunction,Copper,{side}*%%ADD10C,2*%D10*X1000Y1000D03*X9000Y1000D03*M02*"
            );
            (format!("b-{side}.gbr"), text.into_bytes())
        };
        let drill = "M48\nMETRIC\nT1C0.800\n%\nG90\nT1\nX1.0Y1.0\nX9.0Y1.0\nM30\n";
        let files = vec![copper("L1,Top"), copper("L2,Bot"), ("b.drl".to_owned(), drill.into())];
        let machine = Settings::of(&virtual_drill());
        let wanted = ToRead { files, machine: Some(machine.clone()), ..ToRead::default() };
        let Answer::Read(reading) = ask(Request::Read(wanted)) else { panic!() };
        let work = reading.work;
        ToPlan { board_key: 0, machine, work, loaded: None, accept: Vec::new(), laid: None }
    }

    /// The fastest plunge of a program, µm/s, and its highest spindle speed, rpm.
    fn fastest(bytes: &[u8]) -> (u32, u32) {
        let program = program::decode(bytes).unwrap();
        let commands = program.legs.iter().flat_map(|leg| &leg.commands);
        commands.fold((0, 0), |(down, most), command| match command {
            Command::Plunge { feed_um_per_s, .. } => (down.max(*feed_um_per_s), most),
            Command::Spindle { rpm } => (down, most.max(*rpm)),
            _ => (down, most),
        })
    }

    #[test]
    fn new_machine_sets_speeds_except_edited_ones() {
        let mut cache = Cache::default();
        let mut ask = |request| super::perform(request, &mut cache, &mut |_, _| {}).unwrap();
        let mut plan = two_sided(&mut ask);
        let mut planned = |plan: &ToPlan| {
            let Answer::Planned(ready) = ask(Request::Plan(plan.clone())) else { panic!() };
            fastest(&ready.program)
        };
        assert_eq!(planned(&plan), (12_000, 30_000));
        plan.machine = Settings::of(&hobby_3018());
        assert_eq!(planned(&plan), (2_000, 10_000));
        for operation in &mut plan.work.operations {
            (operation.plunge_mm_per_s, operation.spindle_rpm) = (Some(1.0), Some(8_000));
        }
        assert_eq!(planned(&plan), (1_000, 8_000));
        plan.machine = Settings::of(&virtual_drill());
        assert_eq!(planned(&plan), (1_000, 8_000));
    }

    #[test]
    fn long_tasks_report_steady_progress() {
        let mut cache = Cache::default();
        let mut phases: Vec<Vec<u64>> = Vec::new();
        let mut ask = |request| {
            let mut told = Vec::new();
            let answer = super::perform(request, &mut cache, &mut |done, total| {
                assert!(done <= total, "{done} of {total}");
                told.push(done * 100 / total.max(1));
            });
            phases.push(told);
            answer.unwrap()
        };
        let plan = two_sided(&mut ask);
        let Answer::Planned(ready) = ask(Request::Plan(plan.clone())) else { panic!() };
        let (board_key, work, program) = (plan.board_key, plan.work.clone(), ready.program.clone());
        ask(Request::Prove(ToProve { board_key, program: program.clone(), work }));
        ask(Request::Time(ToTime { program, machine: plan.machine.clone() }));
        let target = "grbl".to_owned();
        ask(Request::Export(ToExport { plan, read: Vec::new(), target, text: None, lines_only_mm: None }));
        for (phase, told) in ["reading", "planning", "proving", "timing", "writing"].into_iter().zip(phases) {
            assert!(told.is_sorted(), "{phase} goes back: {told:?}");
            let stands: Vec<u64> = told.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let longest = stands
                .into_iter()
                .chain(told.first().copied())
                .chain(told.last().map(|last| 100 - last))
                .max();
            assert!(longest.is_some_and(|longest| longest <= 55), "{phase} leaps: {told:?}");
            assert!(told.len() > 3, "{phase}: {told:?}");
        }
    }

    #[test]
    fn edit_recomputes_only_what_depends_on_it() {
        type Change = fn(&mut Work);
        fn speeds(work: &mut Work) {
            for operation in &mut work.operations {
                let usual = operation.speeds(&virtual_drill());
                operation.feed_mm_per_s = Some(usual.feed_mm_per_s * 0.5);
                operation.plunge_mm_per_s = Some(usual.plunge_mm_per_s * 0.5);
                operation.spindle_rpm = Some(usual.spindle_rpm - 1_000);
            }
        }
        fn isolations(work: &mut Work, change: fn(&mut Operation)) {
            work.operations.iter_mut().filter(|one| one.action.word() == "isolate").for_each(change);
        }
        fn depth(work: &mut Work) {
            isolations(work, |operation| operation.depth += Length::from_um(10));
        }
        // Expected number of operations that are planned again (at most all of the side), and of proofs.
        let rows: [(&str, Change, usize, u32); 6] = [
            ("nothing", |_| {}, 0, 0),
            ("feed, plunge and rpm", speeds, 0, 0),
            ("a name", |work| isolations(work, |one| one.name = "Grooves".to_owned()), 0, 0),
            ("a depth", depth, 1, 1),
            ("a spindle that stands", |work| isolations(work, |one| one.spindle_rpm = Some(0)), 0, 1),
            ("a rim", |work| work.setup.margin += Length::from_um(100), usize::MAX, 1),
        ];
        fn both(plan: &ToPlan, cache: &mut Cache) -> [Answer; 2] {
            let mut ask = |request| super::perform(request, cache, &mut |_, _| {}).unwrap();
            let planned = ask(Request::Plan(plan.clone()));
            let Answer::Planned(ready) = &planned else { panic!() };
            let (program, work) = (ready.program.clone(), plan.work.clone());
            let proved = ask(Request::Prove(ToProve { board_key: 0, program, work }));
            [planned, proved]
        }
        let board = |cache: &mut Cache| {
            two_sided(&mut |request| super::perform(request, cache, &mut |_, _| {}).unwrap())
        };
        for (what, change, parts, proofs) in rows {
            let (mut cache, mut empty) = (Cache::default(), Cache::default());
            let mut plan = board(&mut cache);
            both(&plan, &mut cache);
            let before = cache.made();
            change(&mut plan.work);
            let found = both(&plan, &mut cache);
            let made = cache.made();
            let parts = parts.min(planned_operations(&plan.work).count()) as u32;
            assert_eq!((made.parts - before.parts, made.proofs - before.proofs), (parts, proofs), "{what}");
            board(&mut empty);
            assert_eq!(found, both(&plan, &mut empty), "{what}: as from nothing");
        }
    }

    #[test]
    fn underside_cuts_match_the_first_side_after_a_flip() {
        let mut cache = Cache::default();
        let mut ask = |request| super::perform(request, &mut cache, &mut |_, _| {}).unwrap();
        let mut plan = two_sided(&mut ask);
        for flip in [Flip::LeftRight, Flip::TopBottom] {
            plan.work.setup.flip = flip;
            let [first, second] = plan.work.faces()[..] else { panic!("two sides") };
            let low = Point::from_mm(-3.0, -3.0);
            let bounds = Bounds::of(low).with(Point::from_mm(17.0, 9.0));
            let mut under = |face| -> Vec<UnderTile> {
                plan.work.setup.face = face;
                let wanted = ToUnderside { plan: plan.clone(), bounds };
                let Answer::Underside(tiles) = ask(Request::Underside(wanted)) else { panic!() };
                tiles
            };
            assert_eq!(under(first), [], "nothing was done before the first side");
            let below = under(second);
            plan.work.setup.face = second;
            let Answer::Planned(planned) = ask(Request::Plan(plan.clone())) else { panic!() };
            let program = program::decode(&planned.program).unwrap();
            let mut above = Stock::new(bounds, Length::from_um(1_600)).unwrap();
            for cut in sim::cuts(&program) {
                above.carve(&cut.way, &program.bits[cut.bit as usize], 0.0, 1.0);
            }
            // Both sides have equal pads and equal isolation.
            let isolated = |depth: u16| (1..=300).contains(&depth);
            let lower: BTreeSet<[usize; 2]> = below
                .iter()
                .flat_map(|tile| {
                    let cell =
                        |at: usize| [tile.first[0] as usize + at % TILE, tile.first[1] as usize + at / TILE];
                    (0..TILE * TILE).filter(|at| isolated(tile.depths_um[*at])).map(cell).collect::<Vec<_>>()
                })
                .collect();
            let upper: BTreeSet<[usize; 2]> = above
                .tiles()
                .flat_map(|tile| {
                    let cell = |at: usize| [tile.first[0] + at % TILE, tile.first[1] + at / TILE];
                    let depths = tile.depths_um.map(|depths| depths.to_vec()).unwrap_or_default();
                    depths
                        .into_iter()
                        .enumerate()
                        .filter(|(_, depth)| isolated(*depth))
                        .map(|(at, _)| cell(at))
                        .collect::<Vec<_>>()
                })
                .collect();
            let both = lower.intersection(&upper).count() as f64;
            assert!(both > 1_000.0, "{flip:?}: {both} cells");
            let share = both / lower.union(&upper).count() as f64;
            assert!(share > 0.9, "{flip:?}: only {share} of what is isolated lies over each other");
        }
    }

    #[test]
    fn turned_copper_reuses_triangles_only_if_unchanged() {
        let mut cache = Cache::default();
        let mut plan = two_sided(&mut |request| super::perform(request, &mut cache, &mut |_, _| {}).unwrap());
        for face in [board::Face::Top, board::Face::Bottom] {
            plan.work.setup.face = face;
            let request = Request::Plan(plan.clone());
            let Ok(Answer::Planned(planned)) = super::perform(request, &mut cache, &mut |_, _| {}) else {
                panic!()
            };
            let board = &cache.last(0).unwrap().planned.board;
            assert_eq!(planned.laid.unwrap().layers, layers(board, picture::body(board)), "{face:?}");
        }
        let read = cache.board(0).unwrap();
        let body = picture::body(read);
        assert_eq!(cache.copper(read, body), Some(layers(read, body)), "nothing is cut again");
        assert_eq!(cache.copper(read, None), None, "elsewhere in the picture");
        assert_eq!(cache.copper(&board::Board { copper: Vec::new(), ..read.clone() }, body), None);
    }

    #[test]
    fn two_sided_export_numbers_files_and_waits_for_review() {
        let mut cache = Cache::default();
        let mut ask = |request| super::perform(request, &mut cache, &mut |_, _| {}).unwrap();
        let plan = two_sided(&mut ask);
        assert_eq!(plan.work.faces().len(), 2);
        let mut export = |read: Vec<String>, target: &str, lines_only| -> Exported {
            let target = target.to_owned();
            let wanted = ToExport { plan: plan.clone(), read, target, text: None, lines_only_mm: lines_only };
            let Answer::Exported(exported) = ask(Request::Export(wanted)) else { panic!() };
            *exported
        };
        let first = export(Vec::new(), "grbl", None);
        // The lines in the simulation are those of the files.
        for (side, face) in first.sides.iter().zip(plan.work.faces()) {
            let mut up = plan.clone();
            up.work.setup.face = face;
            let wanted = ToExport {
                plan: up,
                read: vec![],
                target: "grbl".to_owned(),
                text: None,
                lines_only_mm: None,
            };
            let mut cache_of_lines = Cache::default();
            let mut ask = |request| super::perform(request, &mut cache_of_lines, &mut |_, _| {}).unwrap();
            let _ = two_sided(&mut ask);
            assert_eq!(ask(Request::Lines(wanted)), Answer::Lines(side.clone()), "{face:?}");
        }
        assert_eq!(first.unread, [], "two pads far apart leave nothing to be read");
        let names: Vec<&str> = first.files().map(|file| file.name.as_str()).collect();
        assert!(names.len() > 3, "{names:?}");
        for (number, name) in (1..).zip(&names) {
            assert!(name.starts_with(&format!("{number:02}-")), "{names:?}");
        }
        let sides: Vec<bool> = names.iter().map(|name| name.contains("-bottom-")).collect();
        assert!(sides.contains(&true) && sides.contains(&false), "{names:?}");
        let sheet = first.sheet("en");
        let listed: Vec<&str> = sheet
            .rows
            .iter()
            .filter_map(|row| if let SheetRow::File(cells) = row { Some(cells[1][0].as_str()) } else { None })
            .collect();
        assert_eq!(listed, names, "the run sheet has the same in the same order");
        assert!(sheet.rows.iter().any(|row| matches!(row, SheetRow::Turn(_))), "and where to turn");
        let arcs = |exported: &Exported| {
            exported
                .files()
                .any(|file| file.text.lines().any(|line| line.starts_with("G3") || line.starts_with("G2 ")))
        };
        assert!(arcs(&first) && !arcs(&export(Vec::new(), "grbl", Some(0.005))));
        let own: Vec<String> =
            export(Vec::new(), "fanuc", None).files().map(|file| file.name.clone()).collect();
        assert_eq!(own.len(), 2, "a changer needs one file a side: {own:?}");
        assert_ne!(own[0], own[1]);
    }

    #[test]
    fn export_is_refused_while_the_other_side_has_problems() {
        let mut cache = Cache::default();
        let mut ask = |request| super::perform(request, &mut cache, &mut |_, _| {});
        let mut plan = two_sided(&mut |request| ask(request).unwrap());
        let up = plan.work.setup.face;
        for operation in &mut plan.work.operations {
            if operation.face != up {
                operation.spindle_rpm = Some(0);
            }
        }
        let target = "grbl".to_owned();
        let wanted = ToExport { plan, read: Vec::new(), target, text: None, lines_only_mm: None };
        let Answer::Exported(exported) = ask(Request::Export(wanted.clone())).unwrap() else { panic!() };
        assert!(exported.sides.is_empty() && exported.unread.len() == 1, "{:?}", exported.unread);
        assert_ne!(exported.unread[0].0, up);
        let target = "nobody".to_owned();
        let why = ask(Request::Export(ToExport { target, ..wanted })).unwrap();
        assert!(matches!(why, Answer::Exported(exported) if exported.sides.is_empty()), "unread goes first");
    }

    #[test]
    fn one_of_several_boards_is_chosen() {
        let copper = |board: &str| {
            let text =
                "%FSLAX33Y33*%%MOMM*%%TF.FileFunction,Copper,L1,Top*%%ADD10C,2*%D10*X1000Y1000D03*M02*";
            (format!("{board}-F_Cu.gbr"), text.as_bytes().to_vec())
        };
        let drill = |board: &str| (format!("{board}.drl"), DRILL.to_vec());
        let files = vec![copper("left"), copper("right"), drill("left"), drill("right")];
        let wanted = |board: Option<&str>| ToRead {
            files: files.clone(),
            said: SaidOfFiles { board: board.map(str::to_owned), ..SaidOfFiles::default() },
            ..ToRead::default()
        };
        let both = read(&wanted(None), &mut Cache::default(), &mut |_, _| {});
        let names: Vec<_> =
            both.boards.iter().map(|board| (board.name.as_str(), board.files.len())).collect();
        assert_eq!(names, [("left", 2), ("right", 2)]);
        assert!(both.boards.iter().all(|board| !board.mesh.triangles.is_empty()), "each with a picture");
        assert!(
            both.diagnostics.iter().any(|diagnostic| diagnostic.code == "board.several"),
            "{:?}",
            both.diagnostics
        );
        let right = read(&wanted(Some("right")), &mut Cache::default(), &mut |_, _| {});
        assert_eq!(right.used, [3]);
        assert!(
            right.diagnostics.iter().all(|diagnostic| diagnostic.code != "board.several"),
            "{:?}",
            right.diagnostics
        );
        assert_eq!(right.boards.len(), 2, "the other one can still be chosen");
    }

    #[test]
    fn problems_and_fixes_survive_serialization() {
        let cure = proof::Cure::Deeper {
            bit: "V".to_owned(),
            depth: Length::from_um(80),
            width: Length::from_um(140),
        };
        let at = Point::from_mm(1.0, 2.0);
        let finding = proof::Finding {
            ends: Some((at, Point::from_mm(1.0, 2.005))),
            leg: Some((0, 3)),
            operation: Some("@page.cam.word.clear".to_owned()),
            cures: vec![cure],
            agreed: true,
            ..proof::Finding::new(proof::FindingKind::Shallow, at, Length::from_um(5), vec!["GND".to_owned()])
        };
        let whole = proof::Whole { gaps: 3, shallower: None, rest: 3, tip: None, tip_opens: 0 };
        let groups = vec![proof::Group {
            kind: proof::FindingKind::Shallow,
            must_be_read: false,
            tool: None,
            count: 2,
            least: Length::from_um(5),
            most: Length::from_um(9),
            pairs: vec![proof::Pair { nets: vec![], least: Length::from_um(5), ids: vec!["0".to_owned()] }],
        }];
        let findings = vec![finding];
        let outcome =
            proof::ProofResult { nets: 3, isolated: 2, isolates: true, ..proof::ProofResult::default() };
        let proved = proof::Verdict {
            findings,
            more: 1,
            groups,
            whole: Some(whole),
            outcome,
            ..proof::Verdict::default()
        };
        let bytes = postcard::to_allocvec(&Answer::Proved(proved.clone())).unwrap();
        assert_eq!(postcard::from_bytes::<Answer>(&bytes).unwrap(), Answer::Proved(proved));
    }

    #[test]
    fn damaged_program_is_refused_with_a_diagnostic() {
        let wanted = ToTime { program: b"no program".to_vec(), machine: Settings::of(&virtual_drill()) };
        let refused = perform(Request::Time(wanted), &mut Cache::default(), &mut |_, _| {});
        assert!(refused.is_err_and(|diagnostics| diagnostics[0].code == "program.not_one"));
    }
}
