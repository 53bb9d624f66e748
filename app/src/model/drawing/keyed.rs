//! Applies keys to the drawing.

use super::Draw;
use crate::drawing::keys::StepSize;
use crate::drawing::{DrawKey, Editor, Tool};
use annulus_core::board::drawing::Layer;
use annulus_core::board::drawing::PadShape;
use annulus_core::units::Length;

/// In the view from below, right is towards smaller X.
pub(super) fn as_seen(key: DrawKey, mirrored: bool) -> DrawKey {
    match key {
        DrawKey::Step { x, y, size } if mirrored => DrawKey::Step { x: -x, y, size },
        key => key,
    }
}

pub(super) fn by_key(draw: &mut Draw, key: DrawKey, group: &str) {
    let editor = &mut draw.editor;
    match key {
        DrawKey::Tool(Tool::Pad) if editor.tool == Tool::Pad => {
            let at = PadShape::ALL.iter().position(|shape| *shape == editor.pen.shape).unwrap_or(0);
            editor.pen.shape = PadShape::ALL[(at + 1) % PadShape::ALL.len()];
        }
        DrawKey::Tool(tool) => editor.take(tool),
        DrawKey::Move => {
            editor.take(Tool::Select);
            choose_at_aim(editor);
        }
        DrawKey::Step { x, y, size } => {
            let step = step_of(draw, size);
            draw.editor.nudge((x, y), step);
        }
        DrawKey::Place if editor.tool == Tool::Select => choose_at_aim(editor),
        DrawKey::Place => editor.place(),
        DrawKey::End => drop(editor.leave()),
        DrawKey::Back => editor.back_by_a_piece(),
        DrawKey::Act(act) => editor.act(act),
        DrawKey::Group => editor.group(group),
        DrawKey::Side { upper } => editor.pen.draw_on(if upper { Layer::Top } else { Layer::Bottom }),
        // These only move the focus, which is up to the screen.
        DrawKey::Numbers | DrawKey::Rename | DrawKey::Type { .. } => {}
    }
}

fn choose_at_aim(editor: &mut Editor) {
    let reach = Length::from_nm(editor.grid.step.nm() / 2);
    if let Some(hit) = editor.hit(editor.aim.at(), reach, false) {
        editor.choose_hit(hit, false, false);
        editor.open_to_chosen();
    }
}

fn step_of(draw: &Draw, size: StepSize) -> Length {
    let step = draw.editor.grid.step;
    match size {
        StepSize::Fine => Length::from_nm((step.nm() / 10).max(1)),
        StepSize::Grid => step,
        StepSize::Far => step * 10,
    }
}
