//! Names of files without the words that only say which layer it is: what is left is the name of the board.
//!
//! ```text
//!   LimeSDR-QPCIe_1v2-RoundHoles.TXT ─▶ lime sdr qpcie 1v2         ThruHolePlated.ncd ─▶ nothing
//! ```
//!
//! Comes in: a name. Goes out: words in lower case. Knows no tables of CADs.

/// Words of layers, drill files and side files; the longer first where one begins with another.
const WORDS: [&str; 112] = [
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
/// Short words: only when they stand alone.
const SHORT: [&str; 28] = [
    "cu", "np", "nc", "in", "l", "rev", "version", "tl", "bl", "ts", "bs", "tm", "bm", "tp", "bp", "ko",
    "fr", "sig", "pwr", "gnd", "smt", "smd", "eco", "usr", "user", "dwgs", "margin", "orig",
];

/// Layers whose side is one letter in front: `F_Cu`.
const SIDED: [&str; 7] = ["cu", "mask", "silk", "paste", "fab", "courty", "adhes"];
/// Words for a board: a number behind them tells boards apart.
const BOARDS: [&str; 3] = ["board", "pcb", "circuit"];

/// The words of a name that may be the board's.
pub(super) fn stem_words(base: &str) -> Vec<String> {
    let stem = base.rfind('.').filter(|&at| at > 0).and_then(|at| base.get(..at)).unwrap_or(base);
    let parts: Vec<&str> =
        stem.split(|letter: char| !letter.is_alphanumeric()).filter(|part| !part.is_empty()).collect();
    let next = |at: usize| parts.get(at + 1).map_or(String::new(), |next| next.to_lowercase());
    let side = |at: usize, part: &str| part.len() == 1 && SIDED.iter().any(|word| next(at).starts_with(word));
    let kept =
        parts.iter().enumerate().filter(|(at, part)| !side(*at, part)).flat_map(|(_, part)| pieces(part));
    kept.filter(|word| !is_layer(word)).map(|word| short(&word)).collect()
}

/// `RoundHoles` is two words; a word that is all of layer words stays whole.
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

/// A name for people, of the board that the file at `path` is of: what the file is called. Where that only says which layer it is, the
/// folder or archive that it was brought in.
pub fn board_name(path: &str) -> String {
    let parts = || brought(path).rsplit(['/', '\\']).filter(|part| !part.is_empty());
    let named = |part: &&str| !stem_words(part).is_empty();
    let part = parts().find(named).or_else(|| parts().next()).unwrap_or(path);
    let part = part.strip_suffix('!').unwrap_or(part);
    part.rsplit_once('.').map_or(part, |(stem, _)| stem).to_owned()
}

/// The end of `path` that a person brought: a path from elsewhere (`/home/…`, `../…`, `C:\…`) leads through folders to a file or archive.
fn brought(path: &str) -> &str {
    if !path.starts_with(['/', '\\', '.']) && !path.contains(':') {
        return path;
    }
    let file = path.find("!/").unwrap_or(path.len());
    path.get(..file).and_then(|way| way.rfind(['/', '\\'])).and_then(|at| path.get(at + 1..)).unwrap_or(path)
}

/// Whether a word is made of layer words and numbers behind them.
fn is_layer(word: &str) -> bool {
    let without = word.trim_end_matches(|letter: char| letter.is_ascii_digit());
    if BOARDS.contains(&without) {
        return without == word;
    }
    SHORT.contains(&without) || !without.is_empty() && is_made_of_words(word)
}

fn is_made_of_words(word: &str) -> bool {
    let rest = word.trim_start_matches(|letter: char| letter.is_ascii_digit());
    rest.is_empty()
        || WORDS.iter().any(|known| rest.strip_prefix(known).is_some_and(is_made_of_words))
        || ["nc", "np"].iter().any(|known| {
            rest.strip_prefix(known).is_some_and(|rest| !rest.is_empty() && is_made_of_words(rest))
        })
}

/// A word without the layer it ends with: `myboardtop`.
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
    fn what_is_left_is_the_name_of_the_board() {
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
            (".drl", ""),
        ] {
            assert_eq!(stem_words(name).join(" "), want, "{name}");
        }
    }

    #[test]
    fn a_file_that_is_called_after_its_layer_gives_its_folders_name() {
        for (path, want) in [
            ("Excellon_PTH_Through.drl", "Excellon_PTH_Through"),
            ("Robot Arm/Excellon_PTH_Through.drl", "Robot Arm"),
            ("robot/Gerber/NC Drill/Excellon_PTH_Through.drl", "robot"),
            ("downloads\\robot.zip!/gerber/drill.txt", "robot"),
            ("robot/clockblock-NPTH.drl", "clockblock-NPTH"),
            ("/home/robot/drill.txt", "drill"),
            ("../boards/robot/drill.txt", "drill"),
            ("/home/boards/robot.zip!/gerber/drill.txt", "robot"),
            ("C:\\boards\\drill.txt", "drill"),
            ("", ""),
        ] {
            assert_eq!(board_name(path), want, "{path}");
        }
    }
}
