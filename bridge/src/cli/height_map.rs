//! Prints a height map as text and as JSON.

use annulus_core::level::HeightMap;
use annulus_core::units::Length;
use serde_json::{Value, json};

/// The map as a table in µm, with the highest Y on top.
pub(super) fn text(map: &HeightMap) -> String {
    let columns = usize::from(map.grid.columns);
    let rows = map.heights.chunks(columns).rev().map(|row| {
        let words: Vec<String> = row.iter().map(|height| format!("{:>6}", height.nm() / 1_000)).collect();
        words.join("") + "\n"
    });
    let [low, high] = map.span();
    let table: String = rows.collect();
    format!("Height above the work zero, µm:\n{table}From {:.3} to {:.3} mm.\n", low.mm(), high.mm())
}

/// The map as JSON.
pub(super) fn object(map: &HeightMap) -> Value {
    let um = |height: &Length| height.nm() as f64 / 1e3;
    let [low, high] = map.span();
    json!({
        "columns": map.grid.columns,
        "rows": map.grid.rows,
        "low_mm": [map.grid.low.x.mm(), map.grid.low.y.mm()],
        "high_mm": [map.grid.high.x.mm(), map.grid.high.y.mm()],
        "heights_um": map.heights.iter().map(um).collect::<Vec<_>>(),
        "lowest_um": um(&low),
        "highest_um": um(&high),
        "map": map.key(),
    })
}
