//! Isolation with and without the cache: equal results, and only families affected by a change are computed.

use super::*;

/// Random pads and tracks in cells of 2 mm: most are isolated, some touch their neighbours.
fn copper(chance: &mut Chance, count: usize) -> Vec<Path> {
    let mut paths = Vec::new();
    for _ in 0..count {
        paths.push(pad(chance));
    }
    paths
}

fn pad(chance: &mut Chance) -> Path {
    let cell = |chance: &mut Chance| 2.0 * chance.below(8) as f64 + chance.between(0.0, 0.4);
    let (x, y, size) = (cell(chance), cell(chance), chance.between(0.6, 1.8));
    match chance.below(3) {
        0 => circle(at(x, y), mm(size)),
        1 => boxed(x, y, x + size, y + size / 2.0),
        _ => {
            let track = Path::through(&[at(x, y), at(x + 0.3, y + 1.0), at(x + 2.5, y + 1.2)]).unwrap();
            sweep(&[track], mm(0.3)).islands[0].outer.clone()
        }
    }
}

fn edit(chance: &mut Chance, paths: &mut Vec<Path>, work: &mut Work) {
    let operation = &mut work.operations[0];
    let OperationKind::Isolate(isolate) = &mut operation.action else { panic!() };
    match chance.below(9) {
        0 => paths.push(pad(chance)),
        1 => drop(paths.remove(chance.below(paths.len()))),
        2 | 3 => {
            let moved = chance.below(paths.len());
            paths[moved] = pad(chance);
        }
        4 => isolate.passes = 1 + chance.below(4) as u32,
        5 => isolate.overlap_percent = chance.between(10.0, 60.0),
        6 => isolate.slivers = !isolate.slivers,
        7 => isolate.further = if isolate.further.is_empty() { vec!["thin".to_owned()] } else { Vec::new() },
        _ => operation.bit = if operation.bit == "m" { "thin" } else { "m" }.to_owned(),
    }
}

fn part(scene: &PlacedBoard, work: &Work) -> PlannedOperation {
    let options = PlanOptions { seed: 1, ..PlanOptions::default() };
    let means = Means { options: &options, rapid_time: &|a, b| a.distance_mm(b) };
    plan_operation(scene, work, 0, &virtual_drill(), &means, &mut |_| true).unwrap()
}

#[test]
fn cached_planning_equals_planning_from_scratch() {
    let (mut made, mut made_from_nothing) = (0, 0);
    for seed in 1..=8 {
        println!("seed {seed}");
        let mut chance = Chance::new(seed);
        let mut paths = copper(&mut chance, 40);
        let mut work = isolation(&with_copper(&paths), 0.3, |_| {});
        let mut kept = Kept::default();
        for step in 0..8 {
            let board = with_copper(&paths);
            let scene = PlacedBoard::of(&board, &work).remembering(kept);
            let found = part(&scene, &work);
            kept = scene.kept();
            let nothing = PlacedBoard::of(&board, &work);
            assert_eq!(found, part(&nothing, &work), "seed {seed} step {step}");
            made_from_nothing += nothing.kept().made();
            edit(&mut chance, &mut paths, &mut work);
        }
        made += kept.made();
    }
    assert!(made < made_from_nothing / 3, "{made} of {made_from_nothing} were made anew");
}

#[test]
fn change_recomputes_only_affected_parts() {
    // Isolated pads 5 mm apart: each is grown once and followed twice.
    let pads = |moved: f64| -> Vec<Path> {
        let place = |number: usize| (5.0 * (number % 5) as f64, 5.0 * (number / 5) as f64);
        let mut pads: Vec<Path> = (0..25).map(place).map(|(x, y)| circle(at(x, y), mm(2.0))).collect();
        pads[12] = circle(at(10.0 + moved, 10.0), mm(2.0));
        pads
    };
    let board = with_copper(&pads(0.0));
    let job = |change: fn(&mut Isolate)| isolation(&board, 0.3, change);
    let rows: [(&str, Vec<Path>, Work, u32); 6] = [
        ("nothing", pads(0.0), job(|_| {}), 0),
        ("direction", pads(0.0), job(|isolate| isolate.direction = CutDirection::Conventional), 0),
        ("a pad moves", pads(0.5), job(|_| {}), 4),
        // The pad and its new neighbour.
        ("a pad moves beside another", pads(2.9), job(|_| {}), 4),
        // The former last pass is computed again, because another one follows it.
        ("a pass more", pads(0.0), job(|isolate| isolate.passes += 1), 3 * 25),
        ("less overlap", pads(0.0), job(|isolate| isolate.overlap_percent -= 1.0), 3 * 25),
    ];
    for (what, paths, work, expected) in rows {
        let before = PlacedBoard::of(&board, &job(|_| {}));
        part(&before, &job(|_| {}));
        let kept = before.kept();
        let first = kept.made();
        assert_eq!(first, 4 * 25);
        let scene = PlacedBoard::of(&with_copper(&paths), &work).remembering(kept);
        part(&scene, &work);
        assert_eq!(scene.kept().made() - first, expected, "{what}");
    }
}
