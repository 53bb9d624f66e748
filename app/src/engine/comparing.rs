//! Compares two versions of a board's files.
//!
//! Uses no cache, because it runs in a separate worker.

use super::board_files::board_of;
use super::mesh::mesh;
use super::messages::{Compared, CopperMarks, ToCompare};
use crate::picture;
use annulus_core::board::changes::changes;
use annulus_core::cam::carried::carried;
use annulus_core::geometry::Region;

pub(super) fn compare(wanted: &ToCompare) -> Compared {
    let (before, now) = (board_of(&wanted.before), board_of(&wanted.now));
    let mut changes = changes(&before, &now);
    let origin = picture::origin(picture::body(&now));
    let mut marks = Vec::new();
    for side in &mut changes.copper {
        // The page needs only the triangles.
        let [added, gone] = [&mut side.added, &mut side.gone].map(|area: &mut Region| {
            let area = std::mem::take(area);
            mesh(&area, origin)
        });
        marks.push(CopperMarks { face: side.face, added, gone });
    }
    let work = carried(&wanted.work, &before, &now, changes.shift);
    let work = (work != wanted.work).then_some(work);
    Compared { changes, marks, work }
}
