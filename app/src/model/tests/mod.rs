//! Tests of the model as rows: events in short words, and the expected state.
//!
//! ```text
//! "open certain plan prove time"   ─▶   "nothing | job | "
//! ```

mod line;
mod story;

mod address_rows;
mod anew_rows;
mod at_change_rows;
mod board_rows;
mod contacts_rows;
mod controller_rows;
mod draw_rows;
mod drawn_files_rows;
mod drawn_groups_rows;
mod drawn_kept_rows;
mod drawn_pads_rows;
mod files_rows;
mod job_board_rows;
mod job_rows;
mod keeping_rows;
mod lab_rows;
mod level_rows;
mod lift_rows;
mod lines_rows;
mod link_rows;
mod machines_rows;
mod next_rows;
mod planning_rows;
mod play_rows;
mod presses_rows;
mod rest_rows;
mod second_side_rows;
mod settings_rows;
mod title_rows;
mod touch_off_rows;
mod way_back_rows;

/// Runs every row and compares the result; reports all rows that differ.
fn compare<T>(rows: &[(&str, &str)], told: impl Fn(&str) -> T, after: impl Fn(&T) -> String) {
    let wrong: Vec<String> = rows
        .iter()
        .filter_map(|(words, expected)| {
            let found = after(&told(words));
            (found != *expected).then(|| format!("{words}\n  expected {expected}\n  found    {found}"))
        })
        .collect();
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}
