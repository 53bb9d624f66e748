//! Golden files of one small board in every dialect. `ANNULUS_BLESS=1` accepts a change.

use super::{one, programs};
use annulus_core::machine::virtual_drill;
use annulus_core::post::{self, FileSplit, Manner};
use std::fs;
use std::path::Path;

#[test]
fn small_board_matches_the_golden_file_of_every_target() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/post");
    let manner = Manner { files: Some(FileSplit::Job), ..Manner::on(&virtual_drill()) };
    for name in post::targets() {
        let file = one(post::write(name, &programs::small(), &manner).unwrap().unwrap());
        let extension = file.name.rsplit_once('.').map_or("", |(_, extension)| extension);
        let path = folder.join(format!("{name}.{extension}"));
        if std::env::var_os("ANNULUS_BLESS").is_some() {
            fs::create_dir_all(&folder).unwrap();
            fs::write(&path, &file.text).unwrap();
        }
        let golden = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(file.text, golden, "{}", path.display());
    }
}
