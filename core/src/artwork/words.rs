//! Board names from file names, by removing the words that only name the layer.
//!
//! ```text
//!   LimeSDR-QPCIe_1v2-RoundHoles.TXT ─▶ lime sdr qpcie 1v2         ThruHolePlated.ncd ─▶ nothing
//! ```

use super::layer_words::is_known;
use super::text::composed;

/// Words of layers, drill files and other files; the longer first if one starts with another.
const WORDS: [&str; 117] = [
    "drillmap",
    "document",
    "isolation",
    "gcode",
    "assy",
    "bottommost",
    "soldermask",
    "silkscreen",
    "solderpaste",
    "keepout",
    "keepin",
    "topmost",
    "profile",
    "boundary",
    "dimension",
    "mechanical",
    "components",
    "component",
    "placement",
    "assembly",
    "courtyard",
    "adhesive",
    "fabrication",
    "excellon",
    "unplated",
    "nonplated",
    "plated",
    "through",
    "thruhole",
    "drilling",
    "drawing",
    "routing",
    "outlines",
    "outline",
    "border",
    "contour",
    "original",
    "comments",
    "signal",
    "ground",
    "internal",
    "inner",
    "overlay",
    "stencil",
    "legend",
    "export",
    "output",
    "gerbers",
    "gerber",
    "layers",
    "layer",
    "copper",
    "circuit",
    "artwork",
    "bottom",
    "solder",
    "resist",
    "paste",
    "cream",
    "front",
    "back",
    "mask",
    "silk",
    "side",
    "edge",
    "cuts",
    "cut",
    "drills",
    "drill",
    "route",
    "router",
    "round",
    "holes",
    "hole",
    "slots",
    "slot",
    "thru",
    "vias",
    "via",
    "mounting",
    "transform",
    "tools",
    "tool",
    "table",
    "report",
    "list",
    "files",
    "file",
    "board",
    "pcb",
    "backup",
    "archive",
    "copy",
    "final",
    "plane",
    "power",
    "etch",
    "fab",
    "top",
    "bot",
    "stop",
    "pads",
    "pad",
    "mech",
    "cadcam",
    "cam",
    "npth",
    "pth",
    "non",
    "lyr",
    "drl",
    "art",
    "gbr",
    "new",
    "old",
    "all",
    "ncd",
];
/// Short words, which count only on their own.
const SHORT: [&str; 32] = [
    "map", "iso", "cnc", "doc", "cu", "np", "nc", "in", "l", "rev", "version", "tl", "bl", "ts", "bs", "tm",
    "bm", "tp", "bp", "ko", "fr", "sig", "pwr", "gnd", "smt", "smd", "eco", "usr", "user", "dwgs", "margin",
    "orig",
];

/// Minimum length of words for layers and sides in other languages; shorter ones can mean anything.
const LONG: usize = 4;

/// Layers with a one-letter side in front: `F_Cu`.
const SIDED: [&str; 7] = ["cu", "mask", "silk", "paste", "fab", "courty", "adhes"];
/// Words for a board; a number after them distinguishes boards.
const BOARDS: [&str; 3] = ["board", "pcb", "circuit"];

pub(super) fn stem_words(base: &str) -> Vec<String> {
    let stem = base.rfind('.').filter(|&at| at > 0).and_then(|at| base.get(..at)).unwrap_or(base);
    let stem = composed(stem);
    let kept = words(&stem).into_iter().filter(|word| !word.is_side).flat_map(|word| pieces(word.text));
    let kept: Vec<String> = kept.filter(|word| !is_layer(word)).map(|word| short(&word)).collect();
    if is_span(&kept) { Vec::new() } else { kept }
}

/// True if only the layer range of the holes remains: `drill_1_16`.
fn is_span(words: &[String]) -> bool {
    let is_layer = |word: &String| word.len() <= 2 && word.bytes().all(|byte| byte.is_ascii_digit());
    words.len() == 2 && words.iter().all(is_layer)
}

struct Word<'n> {
    text: &'n str,
    end: usize,
    /// The one-letter side before its layer: the `F` of `F_Cu`.
    is_side: bool,
    /// Only names the layer.
    is_layer: bool,
}

fn words(stem: &str) -> Vec<Word<'_>> {
    let texts: Vec<&str> =
        stem.split(|letter: char| !letter.is_alphanumeric()).filter(|text| !text.is_empty()).collect();
    let mut words = Vec::with_capacity(texts.len());
    let mut end = 0;
    for (at, &text) in texts.iter().enumerate() {
        let next = texts.get(at + 1).map_or(String::new(), |next| next.to_lowercase());
        let is_side = text.len() == 1 && SIDED.iter().any(|word| next.starts_with(word));
        end += stem.get(end..).and_then(|rest| rest.find(text)).unwrap_or_default() + text.len();
        words.push(Word { text, end, is_side, is_layer: is_side || is_layer(&text.to_lowercase()) });
    }
    words
}

/// `RoundHoles` is two words; a word made only of layer words is dropped.
fn pieces(part: &str) -> Vec<String> {
    if is_layer(&part.to_lowercase()) {
        return Vec::new();
    }
    let mut words: Vec<String> = Vec::new();
    let mut before = None::<char>;
    for letter in part.chars() {
        let starts = before.is_none_or(|before| before.is_lowercase() && letter.is_uppercase());
        match words.last_mut().filter(|_| !starts) {
            Some(word) => word.extend(letter.to_lowercase()),
            None => words.push(letter.to_lowercase().collect()),
        }
        before = Some(letter);
    }
    words
}

/// The displayed name of the board with the files at `paths`: the common start of their names, without
/// trailing layer words. If they share nothing, the name of the first file; if all names are layer words, the
/// folder or archive of the first.
///
/// ```text
///   clockblock.drl  clockblock-NPTH.drl  clockblock-F_Cu.gbr ─▶ clockblock
///   clockblock-NPTH.drl alone ─▶ clockblock
/// ```
pub fn board_name(paths: &[&str]) -> String {
    let named =
        paths.iter().filter_map(|path| parts(path).next()).filter(|part| !stem_words(part).is_empty());
    let named: Vec<&str> = named.map(stem).collect();
    let Some((first, others)) = named.split_first() else {
        return paths.first().map(|path| folder_name(path)).unwrap_or_default();
    };
    let words = words(first);
    let is_in_all = |word: &&Word| {
        let begin = first.get(..word.end).unwrap_or_default();
        others.iter().all(|other| begins_with(other, begin))
    };
    let common = words.iter().take_while(is_in_all).count();
    let whole = words.get(..common).and_then(|common| first.get(..common.last()?.end));
    // If a file has exactly this name, all of it is the board's name.
    let whole = whole.filter(|whole| others.iter().chain([first]).any(|stem| stem.len() == whole.len()));
    let whole = whole.filter(|_| !others.is_empty());
    let shorter = [common, words.len()].into_iter().find_map(|count| {
        let last = words.get(..count)?.iter().rfind(|word| !word.is_layer)?;
        first.get(..last.end)
    });
    whole.or(shorter).unwrap_or(first).to_owned()
}

/// The folder or archive of a file whose name is only layer words; without one, the file's own name.
fn folder_name(path: &str) -> String {
    let named = |part: &&str| !stem_words(part).is_empty();
    let part = parts(path).find(named).or_else(|| parts(path).next()).unwrap_or(path);
    stem(part.strip_suffix('!').unwrap_or(part)).to_owned()
}

fn parts(path: &str) -> impl Iterator<Item = &str> {
    brought(path).rsplit(['/', '\\']).filter(|part| !part.is_empty())
}

fn stem(base: &str) -> &str {
    base.rsplit_once('.').map_or(base, |(stem, _)| stem)
}

/// True if `name` starts with the words `begin`, ignoring case.
fn begins_with(name: &str, begin: &str) -> bool {
    let ends = |rest: &str| !rest.starts_with(char::is_alphanumeric);
    name.get(..begin.len()).is_some_and(|same| same.to_lowercase() == begin.to_lowercase())
        && name.get(begin.len()..).is_some_and(ends)
}

/// The part of `path` that the user gave. For a path from elsewhere (`/home/…`, `../…`, `C:\…`) that is only
/// its file or archive.
fn brought(path: &str) -> &str {
    if !path.starts_with(['/', '\\', '.']) && !path.contains(':') {
        return path;
    }
    let file = path.find("!/").unwrap_or(path.len());
    path.get(..file).and_then(|way| way.rfind(['/', '\\'])).and_then(|at| path.get(at + 1..)).unwrap_or(path)
}

fn is_layer(word: &str) -> bool {
    let without = word.trim_end_matches(|letter: char| letter.is_ascii_digit());
    if BOARDS.contains(&without) {
        return without == word;
    }
    SHORT.contains(&without)
        || !without.is_empty() && (is_made_of_words(word) || without.len() >= LONG && is_known(without))
}

fn is_made_of_words(word: &str) -> bool {
    let rest = word.trim_start_matches(|letter: char| letter.is_ascii_digit());
    rest.is_empty()
        || WORDS.iter().any(|known| rest.strip_prefix(known).is_some_and(is_made_of_words))
        || ["nc", "np"].iter().any(|known| {
            rest.strip_prefix(known).is_some_and(|rest| !rest.is_empty() && is_made_of_words(rest))
        })
}

/// A word without a layer word at its end: `myboardtop`.
fn short(word: &str) -> String {
    let ends = WORDS
        .iter()
        .filter(|known| !BOARDS.contains(known))
        .filter(|known| known.len() >= 3 && word.len() >= known.len() + 3);
    let longest = ends.filter_map(|known| word.strip_suffix(known)).min_by_key(|rest| rest.len());
    longest.unwrap_or(word).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stem_words_exclude_layer_words() {
        for (name, want) in [
            ("clockblock-F_Cu.gbr", "clockblock"),
            ("clockblock-NPTH.drl", "clockblock"),
            ("ThruHolePlated.ncd", ""),
            ("EtchLayer2Bottom.gdo", ""),
            ("Excellon_PTH_Through.drl", ""),
            ("LimeSDR-QPCIe_1v2-RoundHoles.TXT", "lime sdr qpcie 1v2"),
            ("Demo_Brushless_DRILLS-PTH.drl", "demo brushless"),
            ("ncdrill.DRD", ""),
            ("yawdamper-gerber - CADCAM Top Copper.GBR", "yawdamper"),
            ("myboardtop.gbr", "myboard"),
            ("radiodrill.drl", "radio"),
            ("keyboard.drl", "keyboard"),
            ("board2.drl", "board2"),
            ("board_b.drl", "b"),
            ("b-F_Cu.gbr", "b"),
            ("board-PTH-drl_map.gbr", ""),
            ("Gerber_DocumentLayer.GDL", ""),
            ("drill_1_16.xln", ""),
            ("amp_drill_1_16.xln", "amp 1 16"),
            ("iso_cnc.nc", ""),
            ("platine_bohrungen.drl", "platine"),
            ("amp_Kupfer_unten.gbr", "amp"),
            ("底层.gbr", ""),
            (".drl", ""),
        ] {
            assert_eq!(stem_words(name).join(" "), want, "{name}");
        }
    }

    #[test]
    fn board_name_is_the_common_part_of_file_names() {
        let rows: [(&[&str], &str); 24] = [
            (
                &["clockblock-NPTH.drl", "clockblock.drl", "clockblock-F_Cu.gbr", "clockblock-Edge_Cuts.gbr"],
                "clockblock",
            ),
            (&["robot/clockblock-NPTH.drl"], "clockblock"),
            (&["clockblock-PTH.drl", "clockblock-NPTH.drl"], "clockblock"),
            (
                &["multivibrator.drl", "multivibrator-B.Cu.gbr", "multivibrator-Edge.Cuts.gbr"],
                "multivibrator",
            ),
            (&["multivibrator-B.Cu.gbr"], "multivibrator"),
            (&["herovco_front.drl", "herovco_front-EdgeCuts.gm1"], "herovco_front"),
            (&["carte_test-B_Cu.gbr"], "carte_test"),
            (&["gerber-x2-drill-pth.gbr"], "gerber-x2"),
            (
                &[
                    "LimeSDR-QPCIe_1v2-RoundHoles.TXT",
                    "LimeSDR-QPCIe_1v2-SlotHoles.TXT",
                    "LimeSDR-QPCIe_1v2.GTL",
                ],
                "LimeSDR-QPCIe_1v2",
            ),
            (&["LimeSDR-QPCIe_1v2-RoundHoles.TXT"], "LimeSDR-QPCIe_1v2"),
            (
                &[
                    "Demo_Brushless_Controller_Project_DRILLS-PTH.drl",
                    "Demo_Brushless_Controller_Project_COPPER-TOP.gbr",
                ],
                "Demo_Brushless_Controller_Project",
            ),
            (
                &["yawdamper-gerber - CADCAM Drill.DRL", "yawdamper-gerber - CADCAM Top Copper.GBR"],
                "yawdamper",
            ),
            (&["IRNASIoTbank1.2.Drill", "IRNASIoTbank1.2.Outline"], "IRNASIoTbank1.2"),
            (&["controller.plated-drill.cnc", "controller.bottom.gbr"], "controller"),
            (&["MinnowMax_RevA1_NCDRILL.drl", "MinnowMax_RevA1_NCROUTE.rou"], "MinnowMax_RevA1"),
            (&["panel.drl", "panel_BoardOutline.gbr", "panel_Bottom.gbr"], "panel"),
            (&["SE_SG_IF_V2.TXT", "SE_SG_IF_V2.DRL", "se_sg_if_v2.gtl"], "SE_SG_IF_V2"),
            (&["thruhole.tap", "rs232_cm.top"], "rs232_cm"),
            (&["design_export.drl", "design_export.gtl"], "design_export"),
            // If a drill file and a layer have the same name, all of it is the board's name.
            (&["motor-power.drl", "motor-power.gtl"], "motor-power"),
            (&["webcam.drl"], "webcam"),
            (&["clock-F_Cu.gbr", "clock-F_Mask.gbr"], "clock"),
            // Nothing in common: the name of the drill file.
            (&["amp-drill.drl", "ampere-F_Cu.gbr"], "amp"),
            (&[], ""),
        ];
        for (paths, want) in rows {
            assert_eq!(board_name(paths), want, "{paths:?}");
        }
    }

    #[test]
    fn file_named_after_its_layer_takes_the_folder_name() {
        for (path, want) in [
            ("Excellon_PTH_Through.drl", "Excellon_PTH_Through"),
            ("Robot Arm/Excellon_PTH_Through.drl", "Robot Arm"),
            ("robot/Gerber/NC Drill/Excellon_PTH_Through.drl", "robot"),
            ("downloads\\robot.zip!/gerber/drill.txt", "robot"),
            ("/home/robot/drill.txt", "drill"),
            ("../boards/robot/drill.txt", "drill"),
            ("/home/boards/robot.zip!/gerber/drill.txt", "robot"),
            ("C:\\boards\\drill.txt", "drill"),
            ("", ""),
        ] {
            assert_eq!(board_name(&[path]), want, "{path}");
        }
    }
}
