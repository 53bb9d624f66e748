//! The copper left on the carved board equals the copper that the proof computes exactly. Compares only cells
//! whose neighbours are all carved alike.

use annulus_core::board::{BoardWanted, from_artwork_with};
use annulus_core::cam::PlanOptions;
use annulus_core::cam::toolpaths::{Means, lower_work, plan_work};
use annulus_core::cam::work::Work;
use annulus_core::geometry::{Bounds, Island, Point, Region, rectangle};
use annulus_core::machine::virtual_drill;
use annulus_core::motion;
use annulus_core::proof;
use annulus_core::sim::{Carving, Playback, Stock};
use annulus_core::units::Length;
use annulus_tests::{corpus, read_folder};
use std::sync::Arc;

/// Folders of the corpus.
const BOARDS: [&str; 4] =
    ["kicad/4.0-multivibrator", "easyeda/easytrace-tht", "kicad/2013-clockblock", "eagle/arduino-uno"];
/// Every n-th row is compared.
const ROWS: usize = 5;

/// The edges of a region as lines, mm.
fn edges(region: &Region) -> Vec<[[f64; 2]; 2]> {
    let mm = |at: &Point| [at.x.mm(), at.y.mm()];
    let lines = region.paths().flat_map(|path| {
        let mut points: Vec<[f64; 2]> = path.flattened(0.001).iter().map(mm).collect();
        points.extend(points.first().copied());
        points.windows(2).map(|two| [two[0], two[1]]).collect::<Vec<_>>()
    });
    lines.collect()
}

/// X positions at which a row at height `y` crosses the edges, ascending.
fn crossings(edges: &[[[f64; 2]; 2]], y: f64) -> Vec<f64> {
    let passed = edges.iter().filter(|[a, b]| (a[1] > y) != (b[1] > y));
    let mut at: Vec<f64> = passed.map(|[a, b]| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])).collect();
    at.sort_by(f64::total_cmp);
    at
}

fn is_inside(crossings: &[f64], x: f64) -> bool {
    crossings.partition_point(|at| *at < x) % 2 == 1
}

#[test]
fn carved_copper_matches_the_proof_within_a_cell() {
    let Some(corpus) = corpus() else { return };
    let machine = virtual_drill();
    let options = PlanOptions::default();
    let rapid_time = |from: Point, to: Point| motion::rapid_time_s(&machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    for name in BOARDS {
        let artwork = read_folder(&corpus.join(name));
        let wanted = BoardWanted { copper: true, aligned: true };
        let board = from_artwork_with(&artwork, &artwork.default_use(), wanted).0;
        let mut work = Work::default_for(&board, &machine);
        work.setup.face = work.faces()[0];
        let (planned, _) = plan_work(&board, &work, &machine, &means, &mut |_| true).expect("a plan");
        let program = lower_work(&planned, &work, &machine);
        let asked = proof::ProofOptions { face: work.setup.face, ..proof::ProofOptions::default() };
        let left = proof::prove(&planned.board, std::slice::from_ref(&program), &asked).left;
        let playback = Arc::new(Playback::new(motion::timeline(&program, &machine).expect("a timeline")));
        let total_s = playback.total_s();
        // Without an outline, the proof makes a blank itself.
        let blank = |bounds| Region { islands: vec![Island { outer: rectangle(bounds), holes: vec![] }] };
        let board = match planned.board.outline.bounds() {
            Some(_) => planned.board.outline.clone(),
            None => blank(left.bounds().expect("copper")),
        };
        let bounds = board.bounds().expect("a board");
        let moved = |at: Point| Point::new(at.x - program.origin.x, at.y - program.origin.y);
        let bounds = Bounds { min: moved(bounds.min), max: moved(bounds.max) }.grown(Length::from_um(500));
        let stock = Stock::new(bounds, machine.process.board_thickness).expect("a stock").with_points(130.0);
        let mut carving = Carving::new(playback, program.bits.clone(), stock);
        assert!(carving.seek(total_s, u64::MAX));
        let (wrong, seen) = differences(carving.stock(), &program.origin, &board, &left);
        println!("{name}: {seen} places, cells of {} mm", carving.stock().cell_mm());
        assert!(seen > 20_000, "{name}: only {seen} places");
        assert!(
            wrong.is_empty(),
            "{name}: {} of {seen} differ: {:?}",
            wrong.len(),
            wrong.iter().take(6).collect::<Vec<_>>()
        );
    }
}

/// Positions where carving and proof disagree, with 1 if the carving left copper, and the number of compared
/// cells. A cell counts only if all cells around it agree within carving and within proof, so slivers
/// narrower than a cell are ignored.
fn differences(stock: &Stock, origin: &Point, board: &Region, left: &Region) -> (Vec<[f64; 3]>, usize) {
    let (cell, [columns, rows], low) = (stock.cell_mm(), stock.cells(), stock.low_mm());
    let (board, left) = (edges(board), edges(left));
    let copper = annulus_core::board::COPPER_THICKNESS.mm();
    let is_left = |x: f64, y: f64| stock.depth_mm([x, y]).is_some_and(|depth| depth < copper);
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for row in (2..rows.saturating_sub(2)).step_by(ROWS) {
        let y = low[1] + (row as f64 + 0.5) * cell;
        let at_y = y + origin.y.mm();
        let edge = [-2.0, 0.0, 2.0].map(|step| crossings(&board, at_y + step * cell));
        let kept = [-1.0, 0.0, 1.0].map(|step| crossings(&left, at_y + step * cell));
        for column in 2..columns.saturating_sub(2) {
            let x = low[0] + (column as f64 + 0.5) * cell;
            let here = is_left(x, y);
            let near = |step: f64| edge.iter().all(|row| is_inside(row, x + origin.x.mm() + step * cell));
            if ![-2.0, 0.0, 2.0].into_iter().all(near) {
                continue;
            }
            let mut around = [-1.0, 0.0, 1.0].into_iter().flat_map(|dx| [-1.0, 1.0].map(|dy| (dx, dy)));
            let alike = around.all(|(dx, dy)| is_left(x + dx * cell, y + dy * cell) == here)
                && is_left(x - cell, y) == here
                && is_left(x + cell, y) == here;
            if alike {
                seen += 1;
                let at = |step: f64| x + origin.x.mm() + step * cell;
                let otherwise =
                    |row: &Vec<f64>| [-1.0, 0.0, 1.0].iter().all(|step| is_inside(row, at(*step)) != here);
                if kept.iter().all(otherwise) {
                    wrong.push([x, y, f64::from(u8::from(here))]);
                }
            }
        }
    }
    (wrong, seen)
}
