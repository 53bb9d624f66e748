//! Random boards: good programs have no findings; a path that is removed, shallow, moved or widened is found.

use super::*;
use crate::chance::Chance;

/// Islands in the cells of an uneven grid, and one path along every border between two cells or to the
/// outside.
fn cells(chance: &mut Chance) -> (Board, Vec<Toolpath>, Vec<(String, String)>) {
    let count = 2 + (chance.unit() * 3.0) as usize;
    let mut lines = || -> Vec<f64> {
        let mut at = 0.0;
        let mut step = |chance: &mut Chance| {
            at += chance.between(1.0, 3.0);
            at
        };
        std::iter::repeat_with(|| step(chance)).take(count + 1).collect()
    };
    let (xs, ys) = (lines(), lines());
    let mut rects = Vec::new();
    let name = |column: usize, row: usize| format!("{column}/{row}");
    let mut names = Vec::new();
    for column in 0..count {
        for row in 0..count {
            let mut inset = || chance.between(0.12, 0.4);
            let (left, bottom) = (xs[column] + inset(), ys[row] + inset());
            rects.push((left, bottom, xs[column + 1] - inset(), ys[row + 1] - inset()));
            names.push(name(column, row));
        }
    }
    let (mut toolpaths, mut neighbours) = (Vec::new(), Vec::new());
    for line in 0..=count {
        for cell in 0..count {
            toolpaths.push(way(&[(xs[line], ys[cell]), (xs[line], ys[cell + 1])], 0.1));
            neighbours.push((line > 0 && line < count).then(|| (name(line - 1, cell), name(line, cell))));
            toolpaths.push(way(&[(xs[cell], ys[line]), (xs[cell + 1], ys[line])], 0.1));
            neighbours.push((line > 0 && line < count).then(|| (name(cell, line - 1), name(cell, line))));
        }
    }
    let rows: Vec<(Rect, Option<&str>)> =
        rects.iter().zip(&names).map(|(rect, name)| (*rect, Some(name.as_str()))).collect();
    let pair = |pair: Option<(String, String)>| pair.unwrap_or_default();
    (board(&rows), toolpaths, neighbours.into_iter().map(pair).collect())
}

#[test]
fn every_removed_toolpath_is_a_short() {
    for seed in 1..=12 {
        println!("seed {seed}");
        let (board, toolpaths, neighbours) = cells(&mut Chance::new(seed));
        assert_eq!(found(&board, &[program(mill(0.2), &toolpaths)]), [], "seed {seed}");
        for (missing, (one, other)) in neighbours.iter().enumerate().filter(|(_, pair)| !pair.0.is_empty()) {
            let mut rest = toolpaths.clone();
            let gone = rest.remove(missing);
            let findings = found(&board, &[program(mill(0.2), &rest)]);
            assert_eq!(kinds(&findings), [FindingKind::Short], "seed {seed} way {missing}: {findings:#?}");
            let short = only(&findings, FindingKind::Short);
            let mut nets = vec![one.clone(), other.clone()];
            nets.sort();
            assert_eq!(short.nets, nets, "seed {seed} way {missing}");
            // The position is in the gap of the removed path.
            let path =
                Path::through(&gone.points.iter().map(|&(x, y)| Point::from_mm(x, y)).collect::<Vec<_>>());
            let away = edges::spots(&path.unwrap());
            let upright = (away[0].x - away[1].x).abs() < 1e-9;
            let off = if upright { short.at.x.mm() - away[0].x } else { short.at.y.mm() - away[0].y };
            assert!(off.abs() <= 0.2, "seed {seed} way {missing}: {short:?}");
        }
    }
}

#[test]
fn every_shallow_moved_or_widened_toolpath_is_found() {
    for seed in 1..=6 {
        println!("seed {seed}");
        let mut chance = Chance::new(seed);
        let (board, toolpaths, neighbours) = cells(&mut chance);
        for (index, _) in neighbours.iter().enumerate().filter(|(_, pair)| !pair.0.is_empty()).step_by(3) {
            let mut shallow = toolpaths.clone();
            shallow[index].depth = 0.034;
            let found_shallow = kinds(&found(&board, &[program(mill(0.2), &shallow)]));
            assert_eq!(found_shallow, [FindingKind::Short, FindingKind::Shallow], "seed {seed} way {index}");
            // Moved by 0.45 the path cuts into the neighbouring copper.
            let mut moved = toolpaths.clone();
            let upright = moved[index].points[0].0 == moved[index].points[1].0;
            for (x, y) in &mut moved[index].points {
                *(if upright { x } else { y }) += 0.45;
            }
            let found_moved = kinds(&found(&board, &[program(mill(0.2), &moved)]));
            assert!(found_moved.contains(&FindingKind::Lost), "seed {seed} way {index}: {found_moved:?}");
        }
        let wide = kinds(&found(&board, &[program(mill(0.9), &toolpaths)]));
        assert!(wide.contains(&FindingKind::Lost), "seed {seed}: {wide:?}");
    }
}

#[test]
fn proof_depends_on_a_turning_spindle_and_not_on_speeds() {
    for seed in 1..=12 {
        println!("seed {seed}");
        let mut chance = Chance::new(seed);
        let (board, mut toolpaths, _) = cells(&mut chance);
        toolpaths.remove(chance.below(toolpaths.len()));
        let program = program(mill(0.2), &toolpaths);
        let mut other = program.clone();
        other.machine = "another".to_owned();
        for leg in &mut other.legs {
            leg.commands.insert(chance.below(leg.commands.len()), Command::Dwell { us: 7 });
            for command in &mut leg.commands {
                match command {
                    Command::Plunge { feed_um_per_s, .. } | Command::Mill { feed_um_per_s, .. } => {
                        *feed_um_per_s += chance.below(900) as u32;
                    }
                    Command::Spindle { rpm } => *rpm += chance.below(900) as u32,
                    _ => {}
                }
            }
        }
        assert_ne!(program, other);
        assert_eq!(unhurried(&program), unhurried(&other), "seed {seed}");
        let proved =
            |program: &Program| prove(&board, std::slice::from_ref(program), &ProofOptions::default());
        assert_eq!(proved(&program), proved(&other), "seed {seed}");
        assert_eq!(proved(&program), proved(&unhurried(&program)), "seed {seed}");
        let stop = |command: &mut Command| {
            if let Command::Spindle { rpm } = command {
                *rpm = 0;
            }
        };
        other.legs.iter_mut().flat_map(|leg| &mut leg.commands).for_each(stop);
        assert_ne!(unhurried(&program), unhurried(&other), "seed {seed}: nothing turns");
    }
}
