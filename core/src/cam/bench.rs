//! Benchmarks of planning: tours through TSPLIB instances, and large random boards.
//!
//! The caller measures the time.

use super::tour::{self, Effort};
use super::{default_iterations, order};
use crate::board::{Board, Hole};
use crate::chance::Chance;
use crate::geometry::Point;
use crate::units::Length;

/// The coordinates of a TSPLIB instance with `NODE_COORD_SECTION`.
pub fn tsplib_coordinates(text: &str) -> Vec<(f64, f64)> {
    let rows = text.lines().skip_while(|line| !line.trim().starts_with("NODE_COORD")).skip(1);
    let numbers = rows.map_while(|line| {
        let mut words = line.split_whitespace().skip(1).map_while(|word| word.parse().ok());
        Some((words.next()?, words.next()?))
    });
    numbers.collect()
}

/// Excess length of the closed tour over `optimum`, as a fraction. Every rapid is rounded to a whole unit, as
/// in TSPLIB. `None` for an instance without coordinates.
pub fn tsplib_gap(text: &str, optimum: f64, seed: u64) -> Option<f64> {
    let coordinates = tsplib_coordinates(text);
    let mut places: Vec<Point> =
        coordinates.iter().map(|&(x, y)| Point::from_mm(x / 100.0, y / 100.0)).collect();
    places.sort_unstable();
    places.dedup();
    let effort = Effort { kicks: default_iterations(coordinates.len()), seed };
    let ring = tour::closed(&places, &order::straight_rapid(&places), effort, &mut |_| true)?;
    let first = *ring.first()?;
    let rapids = ring.iter().zip(ring.iter().skip(1).chain([&first]));
    let length: f64 = rapids
        .map(|(&a, &b)| libm::floor(order::straight_mm(places[a as usize], places[b as usize]) * 100.0 + 0.5))
        .sum();
    Some(length / optimum - 1.0)
}

/// A board of `holes` holes of 0.8 mm, scattered evenly over 500 × 500 mm.
pub fn scattered_board(holes: usize, seed: u64) -> Board {
    let mut chance = Chance::new(seed);
    let mut coordinate = || Length::from_um(chance.below(500_000) as i64);
    let hole = |line: u32| Hole {
        at: Point::new(coordinate(), coordinate()),
        diameter: Some(Length::from_um(800)),
        plated: None,
        source: 0,
        tool_code: 1,
        line,
    };
    Board { name: "scattered".to_owned(), holes: (1..).map(hole).take(holes).collect(), ..Board::default() }
}
