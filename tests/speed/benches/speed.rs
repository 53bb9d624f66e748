//! Criterion benchmarks: parsing, planning, step streams, proofs. `cargo xtask bench` runs them and adds the
//! gaps of the tours, the speed in WebAssembly and the sizes of the page.

use annulus_app::drawing::{Act, Tool};
use annulus_app::keys::Tab;
use annulus_app::model::{DrawEvent, FrameEvent, Model, update};
use annulus_app::view::{Camera, Touch};
use annulus_core::artwork::{self, Overrides};
use annulus_core::cam::work::Work;
use annulus_core::cam::{self, HoleOrder};
use annulus_core::geometry::Point;
use annulus_core::proof::{self, ProofOptions};
use annulus_core::units::Length;
use annulus_core::{geometry, machine};
use annulus_speed::{make_stream, make_stream_on, steps_of, timeline, timeline_on};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::path::{Path, PathBuf};

fn corpus() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/corpus");
    let folder = std::env::var_os("ANNULUS_CORPUS").map_or(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no corpus");
    None
}

/// A file of 120,000 hits, repeated to 50 MB.
fn large_drill_file() -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/synthetic/h01-huge-120000-hits.drl");
    let text = std::fs::read(path).expect("the file is among the data of the tests");
    let newline = |from: usize| {
        text[from..].iter().position(|&byte| byte == b'\n').map_or(text.len(), |at| from + at + 1)
    };
    let first_hit = text.windows(2).position(|two| two == b"\nX").map_or(0, |at| at + 1);
    let tail = text.windows(4).rposition(|four| four == b"\nM30").map_or(text.len(), newline);
    let mut large = text[..first_hit].to_vec();
    while large.len() < 50_000_000 {
        large.extend_from_slice(&text[first_hit..tail]);
    }
    large.extend_from_slice(b"M30\n");
    large
}

fn parsing(criterion: &mut Criterion) {
    let bytes = large_drill_file();
    let files = vec![("large.drl".to_owned(), bytes)];
    let mut group = criterion.benchmark_group("parse");
    group.sample_size(10).throughput(Throughput::Bytes(files[0].1.len() as u64));
    group.bench_function("excellon 50 MB", |bencher| {
        bencher.iter(|| black_box(artwork::read_set(&files, &Overrides::default())).files.len());
    });
    group.finish();
}

/// Layers with heavily overlapping objects, read and painted.
fn dense_layers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("gerber");
    group.sample_size(10);
    type Paint = fn(&artwork::Gerber) -> Result<geometry::Region, artwork::TooMuch>;
    let rows: [(&str, String, Paint); 2] = [
        ("heap of 5,800 pads, read and painted", annulus_speed::layer::heap_of_pads(), artwork::painted),
        (
            "silkscreen of 74,000 lines, read and painted",
            annulus_speed::layer::dense_silkscreen(),
            artwork::painted_for_picture,
        ),
    ];
    for (name, text, paint) in rows {
        let files = vec![("layer.gbr".to_owned(), text.into_bytes())];
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let read = artwork::read_set(black_box(&files), &Overrides::default());
                read.files[0].gerber.as_ref().map(|layer| paint(layer).map(|region| region.islands.len()))
            });
        });
    }
    group.finish();
}

/// The largest copper layer of the corpus: read, in MB/s; and read and painted.
fn layers(criterion: &mut Criterion) {
    let Some(corpus) = corpus() else { return };
    let path = corpus.join("altium/limesdr-qpcie/LimeSDR-QPCIe_1v2.GTL");
    let files = vec![("board.gtl".to_owned(), std::fs::read(path).expect("the file is in the corpus"))];
    let read = || artwork::read_set(black_box(&files), &Overrides::default());
    let mut group = criterion.benchmark_group("gerber");
    group.sample_size(10).throughput(Throughput::Bytes(files[0].1.len() as u64));
    group.bench_function("LimeSDR top copper, read", |bencher| bencher.iter(|| read().files.len()));
    group.bench_function("LimeSDR top copper, read and painted", |bencher| {
        bencher.iter(|| {
            read().files[0]
                .gerber
                .as_ref()
                .map(|layer| artwork::painted(layer).map(|region| region.islands.len()))
        });
    });
    group.finish();
}

fn planning(criterion: &mut Criterion) {
    let machine = annulus_speed::machine();
    let mut group = criterion.benchmark_group("plan");
    group.sample_size(10);
    for holes in [1_000_usize, 100_000] {
        let board = cam::bench::scattered_board(holes, 1);
        let work = Work::drilling(&board, &machine, HoleOrder::Shortest);
        group.throughput(Throughput::Elements(holes as u64));
        group.bench_with_input(BenchmarkId::new("shortest", holes), &board, |bencher, board| {
            bencher.iter(|| annulus_speed::drilled(board, &work, &machine).parts.len());
        });
    }
    group.finish();
}

fn streams(criterion: &mut Criterion) {
    let job = timeline(500);
    let mut group = criterion.benchmark_group("stream");
    group.sample_size(10).throughput(Throughput::Elements(steps_of(&job)));
    group.bench_function("steps", |bencher| bencher.iter(|| black_box(make_stream(&job))));
    for (name, machine) in machine::presets() {
        let job = timeline_on(&machine, 500);
        group.throughput(Throughput::Elements(steps_of(&job)));
        group.bench_with_input(BenchmarkId::new("preset", name), &job, |bencher, job| {
            bencher.iter(|| black_box(make_stream_on(&machine, job)));
        });
    }
    group.finish();
}

/// Quality of the presets' step streams, and the presets' drilling speed.
fn presets(_: &mut Criterion) {
    for (name, machine) in machine::presets() {
        let job = timeline_on(&machine, 500);
        let Ok(stream) = annulus_core::steps::stream(&job, &machine) else { continue };
        let made = annulus_core::steps::bench::measure(&job, &stream);
        let seconds = job.total_s();
        println!(
            "stream/{name:<8} {:.3} bytes a step, {:.2} kB/s at most a moving axis, {:.3} µs at most off the plan ({} steps in {seconds:.0} s)",
            made.bytes as f64 / made.steps as f64,
            made.busiest_bytes_per_s / 1e3,
            made.worst_us,
            made.steps,
        );
        for pitch_mm in [0.5, 2.54, 10.0] {
            let Some(pace) = annulus_speed::pace(&machine, pitch_mm) else { continue };
            println!(
                "holes/{name:<8} pitch {pitch_mm:>5} mm: {:>6.1} holes/min, cycle {:.2} ms, {:+.2} % of the formula; bound {:.1} holes/min",
                60.0 / pace.planned_s,
                pace.planned_s * 1e3,
                (pace.planned_s / pace.formula_s - 1.0) * 100.0,
                60.0 / pace.bound_s,
            );
        }
    }
}

fn tours(_: &mut Criterion) {
    let Some(corpus) = corpus() else { return };
    let text =
        std::fs::read_to_string(corpus.join("tsplib/optima.json")).expect("the optima are in the corpus");
    let optima: serde_json::Value = serde_json::from_str(&text).expect("the optima are JSON");
    let rows = optima["instances"].as_array().or(optima["tsplib"].as_array()).cloned().unwrap_or_default();
    for row in rows {
        let (Some(name), Some(optimum)) = (row["name"].as_str(), row["optimum"].as_f64()) else { continue };
        let Ok(instance) = std::fs::read_to_string(corpus.join(format!("tsplib/{name}.tsp"))) else {
            continue;
        };
        let began = std::time::Instant::now();
        let gap = cam::bench::tsplib_gap(&instance, optimum, 1).unwrap_or(f64::NAN);
        println!(
            "tour/{name:<10} {:+.2} % over the optimum in {:.2} s",
            gap * 100.0,
            began.elapsed().as_secs_f64()
        );
    }
}

/// The proof of a layer of islands, isolated in two passes.
fn proofs(criterion: &mut Criterion) {
    let board = annulus_speed::copper::islands(1_000);
    let programs = [annulus_speed::copper::isolated(&board)];
    let verdict = proof::prove(&board, &programs, &ProofOptions::default());
    println!("proof/1000 islands: {} islands, {} findings", verdict.islands, verdict.findings.len());
    let mut group = criterion.benchmark_group("proof");
    group.sample_size(10);
    group.bench_function("1000 islands", |bencher| {
        bencher.iter(|| black_box(proof::prove(&board, &programs, &ProofOptions::default())).islands);
    });
    group.finish();
}

/// Geometry of a layer of 1,122 islands. Limits: 120 ms for one pass, 300 ms for three, 200 ms for the narrow
/// places.
fn copper_layer(criterion: &mut Criterion) {
    let outlines = annulus_speed::layer::outlines();
    let layer = geometry::union(&outlines);
    let segments: usize = layer.paths().map(|path| path.segments.len()).sum();
    println!("copper/layer: {} islands, {segments} segments", layer.islands.len());
    let mm = Length::from_mm;
    let mut group = criterion.benchmark_group("copper");
    group.sample_size(10);
    group.bench_function("union", |bencher| bencher.iter(|| black_box(geometry::union(&outlines))));
    group.bench_function("one pass", |bencher| bencher.iter(|| black_box(geometry::grow(&layer, mm(0.1)))));
    // Like isolation: each pass from the previous one.
    group.bench_function("three passes", |bencher| {
        bencher.iter(|| {
            let more = |pass: &geometry::Region| Some(geometry::grow(pass, mm(0.1)));
            let passes = std::iter::successors(more(black_box(&layer)), more);
            passes.take(3).map(|pass| pass.islands.len()).sum::<usize>()
        });
    });
    let pass = geometry::grow(&layer, mm(0.1));
    group.bench_function("slivers of a pass", |bencher| {
        bencher.iter(|| black_box(geometry::strips(&pass, mm(0.124), mm(0.178))).len());
    });
    group.bench_function("shrink", |bencher| bencher.iter(|| black_box(geometry::grow(&layer, -mm(0.05)))));
    group.bench_function("narrow places", |bencher| {
        bencher.iter(|| black_box(geometry::gaps(&layer, mm(0.3))));
    });
    let area = geometry::grow(&layer, mm(2.0));
    group.bench_function("lines midway", |bencher| {
        bencher.iter(|| black_box(geometry::voronoi(&layer, &area)));
    });
    let exposures = |(index, outlines): (usize, &[geometry::Path])| geometry::Exposure {
        clear: index % 3 == 2,
        outlines: outlines.to_vec(),
    };
    let exposures: Vec<geometry::Exposure> = outlines.chunks(10).enumerate().map(exposures).collect();
    group.bench_function(BenchmarkId::new("exposures", exposures.len()), |bencher| {
        bencher.iter(|| black_box(geometry::paint(&exposures)));
    });
    group.finish();
}

/// Changes a value of a small board's isolation and recomputes everything that the page would. Limit: 16 ms.
fn slider(criterion: &mut Criterion) {
    let slider = annulus_speed::slider::Slider::new();
    println!("slider/60 islands: {} legs", slider.moved_to(90));
    let mut depth_um = 80;
    criterion.bench_function("slider/60 islands, one pass", |bencher| {
        bencher.iter(|| {
            depth_um = if depth_um < 150 { depth_um + 1 } else { 80 };
            black_box(slider.moved_to(depth_um))
        });
    });
}

fn draw_event(model: &mut Model, event: DrawEvent) {
    black_box(update(model, event.into()));
}

fn press(model: &mut Model, touch: Touch, x: f64, y: f64) {
    draw_event(model, DrawEvent::Point { touch, at_mm: [x, y], shift: false, ctrl: false });
}

/// The board editor with 5,040 things, recomputing everything that the page shows. Limit: 16 ms per frame,
/// most of which the page and the picture need.
fn drawing(criterion: &mut Criterion) {
    let model = &mut Model::default();
    update(model, FrameEvent::Moved { camera: Camera { px_per_mm: 20.0, ..Camera::default() } }.into());
    update(model, FrameEvent::Show { tab: Tab::Draw }.into());
    for (tool, places) in [
        (Tool::Pad, [(2.0, 2.0), (6.0, 2.0)].as_slice()),
        (Tool::Track, [(2.0, 2.0), (4.0, 4.0), (6.0, 2.0)].as_slice()),
    ] {
        draw_event(model, DrawEvent::Take { tool });
        for (x, y) in places {
            press(model, Touch::Down, *x, *y);
            press(model, Touch::Up, *x, *y);
        }
    }
    draw_event(model, DrawEvent::Act { act: Act::All });
    let array = Act::Array { columns: 28, rows: 20, step: Point::from_mm(8.0, 6.0) };
    draw_event(model, DrawEvent::Act { act: array });
    draw_event(model, DrawEvent::Take { tool: Tool::Pad });
    let mut group = criterion.benchmark_group(format!("draw/{} things", model.draw.editor.drawing().len()));
    group.bench_function("a pad and back", |bencher| {
        bencher.iter(|| {
            press(model, Touch::Down, 300.0, 2.0);
            press(model, Touch::Up, 300.0, 2.0);
            draw_event(model, DrawEvent::Act { act: Act::Undo { back: true } });
        });
    });
    draw_event(model, DrawEvent::Take { tool: Tool::Select });
    draw_event(model, DrawEvent::Escape);
    press(model, Touch::Down, 2.0, 2.0);
    let mut x = 2.0;
    group.bench_function("a move of a dragged pad", |bencher| {
        bencher.iter(|| {
            x = if x < 6.0 { x + 0.5 } else { 2.0 };
            press(model, Touch::Move, x, 4.0);
        });
    });
    press(model, Touch::Up, x, 4.0);
    draw_event(model, DrawEvent::Act { act: Act::All });
    press(model, Touch::Down, 10.0, 2.0);
    group.bench_function("a move of everything", |bencher| {
        bencher.iter(|| {
            x = if x < 16.0 { x + 0.5 } else { 10.0 };
            press(model, Touch::Move, x, 4.0);
        });
    });
    group.finish();
}

criterion_group!(
    benches,
    presets,
    drawing,
    parsing,
    layers,
    dense_layers,
    tours,
    planning,
    streams,
    copper_layer,
    slider,
    proofs
);
criterion_main!(benches);
