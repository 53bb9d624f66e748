//! Layer names by CAD. The same extension means different things to different CADs, so the whole set decides
//! which CAD wrote it.

use super::{Role, Side};
use crate::code;
use Role::{Copper, Drill, Mask, Other, Outline, Paste, Silk};

/// Whether `path` is `end`, or ends with a separator and `end`. No path ends with nothing.
pub fn is_end_of_path(path: &str, end: &str) -> bool {
    let front = path.strip_suffix(end).filter(|_| !end.is_empty());
    front.is_some_and(|front| front.is_empty() || front.ends_with(['/', '\\']))
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Meaning {
    pub(super) cad: &'static str,
    pub(super) role: Role,
    pub(super) side: Option<Side>,
}

const TOP: Option<Side> = Some(Side::Top);
const BOTTOM: Option<Side> = Some(Side::Bottom);
const INNER: Option<Side> = Some(Side::Inner);

/// A CAD and its name patterns: `*` is anything, `#` is one or more digits; all in lower case.
type Table = (&'static str, &'static [(&'static str, Role, Option<Side>)]);

/// Names that no table has are parsed for words later.
const TABLES: [Table; 20] = [
    (
        "KiCad",
        &[
            ("*f_cu.*", Copper, TOP),
            ("*f.cu.*", Copper, TOP),
            ("*b_cu.*", Copper, BOTTOM),
            ("*b.cu.*", Copper, BOTTOM),
            ("*in#_cu.*", Copper, INNER),
            ("*in#.cu.*", Copper, INNER),
            ("*f?mask.*", Mask, TOP),
            ("*b?mask.*", Mask, BOTTOM),
            ("*f?silk*.*", Silk, TOP),
            ("*b?silk*.*", Silk, BOTTOM),
            ("*f?paste.*", Paste, TOP),
            ("*b?paste.*", Paste, BOTTOM),
            ("*edge?cuts.*", Outline, None),
            ("*edgecuts.*", Outline, None),
            ("*?fab.*", Other, None),
            ("*?courtyard.*", Other, None),
            ("*?adhesive.*", Other, None),
            ("*dwgs_user.*", Other, None),
            ("*user_#.*", Other, None),
        ],
    ),
    (
        "Altium",
        &[
            ("*.gtl", Copper, TOP),
            ("*.gbl", Copper, BOTTOM),
            ("*.g#", Copper, INNER),
            ("*.g#l", Copper, INNER),
            ("*.gp#", Copper, INNER),
            ("*.gts", Mask, TOP),
            ("*.gbs", Mask, BOTTOM),
            ("*.gto", Silk, TOP),
            ("*.gbo", Silk, BOTTOM),
            ("*.gtp", Paste, TOP),
            ("*.gbp", Paste, BOTTOM),
            ("*.gko", Outline, None),
            ("*.gm1", Outline, None),
            ("*.gm", Outline, None),
            ("*.gml", Outline, None),
            ("*.gm#", Other, None),
            ("*.gpt", Other, TOP),
            ("*.gpb", Other, BOTTOM),
            ("*.gd#", Drill, None),
            ("*.gg#", Drill, None),
            ("*copper_signal_top.*", Copper, TOP),
            ("*copper_signal_bot*.*", Copper, BOTTOM),
            ("*copper_signal_#.*", Copper, INNER),
        ],
    ),
    (
        "Eagle",
        &[
            ("*.cmp", Copper, TOP),
            ("*.sol", Copper, BOTTOM),
            ("*.ly#", Copper, INNER),
            ("*.stc", Mask, TOP),
            ("*.sts", Mask, BOTTOM),
            ("*.plc", Silk, TOP),
            ("*.pls", Silk, BOTTOM),
            ("*.crc", Paste, TOP),
            ("*.crs", Paste, BOTTOM),
            ("*.tsp", Paste, TOP),
            ("*.dim", Outline, None),
            ("*.mil", Outline, None),
            ("*.oln", Outline, None),
            ("copper_top.*", Copper, TOP),
            ("copper_bottom.*", Copper, BOTTOM),
            ("copper_inner#.*", Copper, INNER),
            ("soldermask_top.*", Mask, TOP),
            ("soldermask_bottom.*", Mask, BOTTOM),
            ("silkscreen_top.*", Silk, TOP),
            ("silkscreen_bottom.*", Silk, BOTTOM),
            ("solderpaste_top.*", Paste, TOP),
            ("solderpaste_bottom.*", Paste, BOTTOM),
            ("profile.*", Outline, None),
        ],
    ),
    (
        "OrCAD",
        &[
            ("*.top", Copper, TOP),
            ("*.bot", Copper, BOTTOM),
            ("*.in#", Copper, INNER),
            ("*.gnd", Copper, INNER),
            ("*.pwr", Copper, INNER),
            ("*.smt", Mask, TOP),
            ("*.smb", Mask, BOTTOM),
            ("*.sst", Silk, TOP),
            ("*.ssb", Silk, BOTTOM),
            ("*.spt", Paste, TOP),
            ("*.spb", Paste, BOTTOM),
            ("*.drd", Drill, None),
            ("*.fab", Other, None),
        ],
    ),
    (
        "gEDA",
        &[
            ("*.top.*", Copper, TOP),
            ("*.bottom.*", Copper, BOTTOM),
            ("*.group#.*", Copper, INNER),
            ("*.topmask.*", Mask, TOP),
            ("*.bottommask.*", Mask, BOTTOM),
            ("*.topsilk.*", Silk, TOP),
            ("*.bottomsilk.*", Silk, BOTTOM),
            ("*.toppaste.*", Paste, TOP),
            ("*.bottompaste.*", Paste, BOTTOM),
            ("*.outline.*", Outline, None),
            ("*.fab.*", Other, None),
        ],
    ),
    (
        "DipTrace",
        &[
            ("top.gbr", Copper, TOP),
            ("bottom.gbr", Copper, BOTTOM),
            ("*topmask.gbr", Mask, TOP),
            ("*bottommask.gbr", Mask, BOTTOM),
            ("*topsilk.gbr", Silk, TOP),
            ("*bottomsilk.gbr", Silk, BOTTOM),
            ("*toppaste.gbr", Paste, TOP),
            ("*bottompaste.gbr", Paste, BOTTOM),
            ("*topassy.gbr", Other, TOP),
            ("*bottomassy.gbr", Other, BOTTOM),
            ("*boardoutline.gbr", Outline, None),
        ],
    ),
    (
        "Allegro",
        &[
            ("top.art", Copper, TOP),
            ("bottom.art", Copper, BOTTOM),
            ("bot.art", Copper, BOTTOM),
            ("*gnd*.art", Copper, INNER),
            ("*mask*top*.art", Mask, TOP),
            ("*mask*bot*.art", Mask, BOTTOM),
            ("*smt.art", Mask, TOP),
            ("*smb.art", Mask, BOTTOM),
            ("*silk*top*.art", Silk, TOP),
            ("*silk*bot*.art", Silk, BOTTOM),
            ("*paste*top*.art", Paste, TOP),
            ("*paste*bot*.art", Paste, BOTTOM),
            ("*outline*.art", Outline, None),
            ("*drill*.art", Drill, None),
            ("*fab*.art", Other, None),
        ],
    ),
    (
        "EasyEDA",
        &[
            ("*toplayer.*", Copper, TOP),
            ("*bottomlayer.*", Copper, BOTTOM),
            ("*innerlayer#.*", Copper, INNER),
            ("*topsoldermasklayer.*", Mask, TOP),
            ("*bottomsoldermasklayer.*", Mask, BOTTOM),
            ("*topsilk*layer.*", Silk, TOP),
            ("*bottomsilk*layer.*", Silk, BOTTOM),
            ("*toppastemasklayer.*", Paste, TOP),
            ("*bottompastemasklayer.*", Paste, BOTTOM),
            ("*boardoutline*.*", Outline, None),
            ("*documentlayer.*", Other, None),
            ("*customlayer*.*", Other, None),
            ("*.gcl", Other, None),
            ("*drilldrawinglayer.*", Drill, None),
        ],
    ),
    (
        "Proteus",
        &[
            ("*cadcam top copper.*", Copper, TOP),
            ("*cadcam bottom copper.*", Copper, BOTTOM),
            ("*cadcam inner copper*.*", Copper, INNER),
            ("*cadcam top solder resist.*", Mask, TOP),
            ("*cadcam bottom solder resist.*", Mask, BOTTOM),
            ("*cadcam top silk screen.*", Silk, TOP),
            ("*cadcam bottom silk screen.*", Silk, BOTTOM),
            ("*cadcam top smt paste mask.*", Paste, TOP),
            ("*cadcam bottom smt paste mask.*", Paste, BOTTOM),
            ("*cadcam mechanical*.*", Outline, None),
            ("*cadcam drill.*", Drill, None),
        ],
    ),
    (
        "PADS",
        &[
            ("top.pho", Copper, TOP),
            ("bottom.pho", Copper, BOTTOM),
            ("sm*21.pho", Mask, TOP),
            ("sm*28.pho", Mask, BOTTOM),
            ("ss*26.pho", Silk, TOP),
            ("ss*29.pho", Silk, BOTTOM),
            ("smd*23.pho", Paste, TOP),
            ("smd*22.pho", Paste, BOTTOM),
            ("dd*.pho", Drill, None),
        ],
    ),
    (
        "Fritzing",
        &[
            ("*coppertop.*", Copper, TOP),
            ("*copperbottom.*", Copper, BOTTOM),
            ("*masktop.*", Mask, TOP),
            ("*maskbottom.*", Mask, BOTTOM),
            ("*silktop.*", Silk, TOP),
            ("*silkbottom.*", Silk, BOTTOM),
            ("*pastemasktop.*", Paste, TOP),
            ("*pastemaskbottom.*", Paste, BOTTOM),
            ("*contour.*", Outline, None),
        ],
    ),
    (
        "Target",
        &[
            ("*.top", Copper, TOP),
            ("*.bottom", Copper, BOTTOM),
            ("*.inner#", Copper, INNER),
            ("*.stoptop", Mask, TOP),
            ("*.stopbot*", Mask, BOTTOM),
            ("*.positop", Silk, TOP),
            ("*.posibot*", Silk, BOTTOM),
            ("*.creamtop", Paste, TOP),
            ("*.creambot*", Paste, BOTTOM),
            ("*.outline", Outline, None),
        ],
    ),
    (
        "Mentor",
        &[
            ("etchlayer*top.*", Copper, TOP),
            ("etchlayer*bottom.*", Copper, BOTTOM),
            ("etchlayer#.*", Copper, INNER),
            ("soldermasktop.*", Mask, TOP),
            ("soldermaskbottom.*", Mask, BOTTOM),
            ("silkscreentop.*", Silk, TOP),
            ("silkscreenbottom.*", Silk, BOTTOM),
            ("solderpastetop.*", Paste, TOP),
            ("solderpastebottom.*", Paste, BOTTOM),
            ("boardoutline.*", Outline, None),
            ("contour.*", Outline, None),
            ("drilldrawing*.*", Drill, None),
        ],
    ),
    (
        "LibrePCB",
        &[
            ("*copper-top.*", Copper, TOP),
            ("*copper-bottom.*", Copper, BOTTOM),
            ("*copper-in#.*", Copper, INNER),
            ("*soldermask-top.*", Mask, TOP),
            ("*soldermask-bottom.*", Mask, BOTTOM),
            ("*silkscreen-top.*", Silk, TOP),
            ("*silkscreen-bottom.*", Silk, BOTTOM),
            ("*solderpaste-top.*", Paste, TOP),
            ("*solderpaste-bottom.*", Paste, BOTTOM),
            ("*outlines.*", Outline, None),
        ],
    ),
    (
        "FreePCB",
        &[
            ("top.grb", Copper, TOP),
            ("bottom.grb", Copper, BOTTOM),
            ("inner#.grb", Copper, INNER),
            ("top_solder_mask.grb", Mask, TOP),
            ("bottom_solder_mask.grb", Mask, BOTTOM),
            ("top_silk.grb", Silk, TOP),
            ("bottom_silk.grb", Silk, BOTTOM),
            ("board_outline.grb", Outline, None),
        ],
    ),
    (
        "DesignSpark",
        &[
            ("*top copper.*", Copper, TOP),
            ("*bottom copper.*", Copper, BOTTOM),
            ("*top copper (resist).*", Mask, TOP),
            ("*bottom copper (resist).*", Mask, BOTTOM),
            ("*top copper (paste).*", Paste, TOP),
            ("*bottom copper (paste).*", Paste, BOTTOM),
            ("*top silkscreen.*", Silk, TOP),
            ("*bottom silkscreen.*", Silk, BOTTOM),
            ("*board outline*.*", Outline, None),
        ],
    ),
    (
        "Sprint-Layout",
        &[
            ("*_copper_top.*", Copper, TOP),
            ("*_copper_bottom.*", Copper, BOTTOM),
            ("*_smdmask_top.*", Paste, TOP),
            ("*_soldermask_top.*", Mask, TOP),
            ("*_soldermask_bottom.*", Mask, BOTTOM),
            ("*_silkscreen_top.*", Silk, TOP),
            ("*_silkscreen_bottom.*", Silk, BOTTOM),
            ("*_outline.*", Outline, None),
        ],
    ),
    (
        "FAB 3000",
        &[
            ("tl", Copper, TOP),
            ("bl", Copper, BOTTOM),
            ("tm", Mask, TOP),
            ("bm", Mask, BOTTOM),
            ("ts", Silk, TOP),
            ("bs", Silk, BOTTOM),
            ("tp", Paste, TOP),
            ("bp", Paste, BOTTOM),
            ("ko", Outline, None),
            ("drl", Drill, None),
        ],
    ),
    (
        "pcb-rnd",
        &[
            ("*.asb", Other, BOTTOM),
            ("*.ast", Other, TOP),
            ("*.gbl", Copper, BOTTOM),
            ("*.gtl", Copper, TOP),
            ("*.oln", Outline, None),
        ],
    ),
    ("Gerber drill", &[("*.xln", Drill, None), ("*.drl", Drill, None), ("*.dri", Drill, None)]),
];

pub(super) fn meanings(base: &str) -> Vec<Meaning> {
    let base = base.to_ascii_lowercase();
    let mut found = Vec::new();
    for (cad, rows) in TABLES {
        let row = rows.iter().find(|(pattern, ..)| fits(pattern.as_bytes(), base.as_bytes()));
        found.extend(row.map(|&(_, role, side)| Meaning { cad, role, side }));
    }
    found
}

/// Extensions of files next to a board that are never layers.
const FOREIGN: [&str; 31] = [
    "png",
    "jpg",
    "jpeg",
    "gif",
    "bmp",
    "webp",
    "tif",
    "tiff",
    "ico",
    "pdf",
    "ps",
    "svg",
    "htm",
    "html",
    "xml",
    "doc",
    "docx",
    "xls",
    "xlsx",
    "ods",
    "odt",
    "step",
    "stp",
    "stl",
    "wrl",
    "3mf",
    "gz",
    "7z",
    "rar",
    "kicad_pcb",
    "url",
];
const NOTES: [&str; 10] =
    ["readme", "read-me", "read_me", "license", "licence", "notes", "changelog", "bom", "todo", "info"];
const DRILL_ENDINGS: [&str; 11] =
    ["drl", "xln", "exc", "txt", "tap", "nc", "cnc", "drd", "ncd", "rou", "drill"];

/// Why a file rejected with `code` doesn't matter: it isn't readable, and its name isn't that of a layer or a
/// drill file. None if it matters.
pub(super) fn foreign(base: &str, code: &str) -> Option<&'static str> {
    let reason = match code {
        "refused.binary" => code!("kind.not_text"),
        "refused.empty" => code!("kind.empty"),
        "refused.web_page" => code!("kind.markup"),
        _ => return None,
    };
    let lower = base.to_ascii_lowercase();
    let (stem, ending) = lower.rsplit_once('.').unwrap_or((lower.as_str(), ""));
    let gerber = ending.starts_with('g') && ending.len() <= 4;
    let is_note = NOTES.iter().any(|word| stem.contains(word));
    let known = gerber || !is_note && DRILL_ENDINGS.contains(&ending) || !meanings(base).is_empty();
    (FOREIGN.contains(&ending) || !known).then_some(reason)
}

/// Extensions that only layers have.
const LAYER_ENDINGS: [&str; 15] =
    ["gbr", "ger", "gbx", "gtl", "gbl", "gts", "gbs", "gto", "gbo", "gtp", "gbp", "gko", "gml", "gm1", "pho"];

/// True if the extension is one that only layers have: a text of this name without a layer is an error.
pub(super) fn is_called_like_layer(base: &str) -> bool {
    let ending = base.rsplit_once('.').map_or("", |(_, ending)| ending);
    LAYER_ENDINGS.iter().any(|known| known.eq_ignore_ascii_case(ending))
}

pub(super) fn is_called_like_drill(base: &str) -> bool {
    let ending = base.rsplit_once('.').map_or("", |(_, ending)| ending);
    ["drl", "xln", "exc"].iter().any(|known| known.eq_ignore_ascii_case(ending))
}

/// Matches a pattern: `*` is anything, `?` one letter, `#` digits.
fn fits(pattern: &[u8], name: &[u8]) -> bool {
    match pattern {
        [] => name.is_empty(),
        [b'*', rest @ ..] => (0..=name.len()).any(|at| name.get(at..).is_some_and(|name| fits(rest, name))),
        [b'#', rest @ ..] => {
            let digits = name.iter().take_while(|byte| byte.is_ascii_digit()).count();
            digits > 0 && fits(rest, name.get(digits..).unwrap_or_default())
        }
        [b'?', rest @ ..] => name.split_first().is_some_and(|(_, name)| fits(rest, name)),
        [letter, rest @ ..] => name.strip_prefix(&[*letter]).is_some_and(|name| fits(rest, name)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unreadable_files_matter_only_if_named_like_a_layer() {
        for (name, code, want) in [
            ("photo.png", "refused.binary", Some("kind.not_text")),
            ("board-F_Cu.png", "refused.binary", Some("kind.not_text")),
            ("Thumbs.db", "refused.binary", Some("kind.not_text")),
            ("zero", "refused.empty", Some("kind.empty")),
            (".gitkeep", "refused.empty", Some("kind.empty")),
            ("index.html", "refused.web_page", Some("kind.markup")),
            ("board-F_Cu.gbr", "refused.empty", None),
            ("board.drl", "refused.binary", None),
            ("board.TXT", "refused.empty", None),
            ("board.GTL", "refused.web_page", None),
            ("board.cmp", "refused.empty", None),
            ("README.TXT", "refused.web_page", Some("kind.markup")),
            ("zero", "refused.eia_tape", None),
        ] {
            assert_eq!(foreign(name, code), want, "{name}");
        }
    }

    #[test]
    fn text_named_like_a_layer_is_an_error() {
        use crate::artwork::{FileKind, Overrides, read_set};
        let drill = "M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n";
        for (name, kind, code) in [
            ("junk.gbr", FileKind::Refused, Some("gerber.not_recognised")),
            ("Junk.GTL", FileKind::Refused, Some("gerber.not_recognised")),
            ("readme.txt", FileKind::Unknown, None),
            ("board.gbrjob", FileKind::Unknown, None),
            ("junk.drl", FileKind::Unknown, Some("drill.not_recognised")),
        ] {
            let files = [("b.drl", drill), (name, "hello, this is no board")];
            let files = files.map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec()));
            let artwork = read_set(&files, &Overrides::default());
            let missing = artwork.missing(&[0, 1]).map(|said| said.code.as_str()).next();
            assert_eq!((artwork.files[1].kind, missing), (kind, code), "{name}");
            assert_eq!(artwork.files[1].has_error(), code.is_some(), "{name}");
        }
    }

    #[test]
    fn patterns_match_whole_names() {
        for (pattern, name, want) in [
            ("*.g#", "board.g12", true),
            ("*.g#", "board.gtl", false),
            ("*in#_cu.*", "x-in2_cu.gbr", true),
            ("*f?mask.*", "x-f_mask.gts", true),
            ("top.pho", "stop.pho", false),
            ("tl", "tl", true),
        ] {
            assert_eq!(fits(pattern.as_bytes(), name.as_bytes()), want, "{pattern} {name}");
        }
    }

    #[test]
    fn patterns_are_lower_case() {
        for (cad, rows) in TABLES {
            assert!(rows.iter().all(|(pattern, ..)| *pattern == pattern.to_ascii_lowercase()), "{cad}");
        }
    }
}
