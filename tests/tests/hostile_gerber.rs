//! Small layers that require much work: each is painted, or rejected at an object, in a process with little
//! memory.
//!
//! Each test runs this program again as a child, with only the test [`child`] and the name of a layer in the
//! environment. The shell limits the child's memory.

use annulus_core::artwork::{FileRead, Overrides, painted, read_set};
use annulus_core::chance::Chance;
use std::fmt::Write;
use std::process::Command;

/// Environment variable with the child's layer.
const LAYER: &str = "ANNULUS_HOSTILE_LAYER";
/// Memory of a child in KiB, including program and stacks.
const MEMORY_KIB: u32 = 450_000;
/// CPU time limit of a child, s; generous enough for a machine ten times slower than one that takes 2 s.
const SECONDS: u32 = 40;

/// A random coordinate within `mm` millimetres, in the digits of a layer.
fn within(chance: &mut Chance, mm: usize) -> i64 {
    chance.below(2_000_000 * mm) as i64 - 1_000_000 * mm as i64
}

fn place(chance: &mut Chance, mm: usize) -> String {
    format!("X{}Y{}", within(chance, mm), within(chance, mm))
}

fn layer(aperture: &str, body: &str) -> String {
    format!("%FSLAX46Y46*%\n%MOMM*%\n{aperture}\nG75*\nD10*\n{body}M02*\n")
}

fn many(count: usize, mut line: impl FnMut(usize, &mut Chance) -> String) -> String {
    let mut chance = Chance::new(1);
    (0..count).fold(String::new(), |mut text, index| {
        let _ = writeln!(text, "{}", line(index, &mut chance));
        text
    })
}

/// Arcs in a region whose ends don't fit their centers, nearly full circles.
fn uneven_arcs(count: usize) -> String {
    let arcs = many(count, |index, chance| {
        let (x, way) = (100_000_000 + within(chance, 2), 2 + index % 2);
        format!(
            "G0{way}*X{x}Y{}I{}J{}D01*",
            index as i64 % 2 * -9_000,
            -x - within(chance, 1),
            within(chance, 1)
        )
    });
    layer("%ADD10C,0.5*%", &format!("G36*\nX100000000Y0D02*\n{arcs}G37*\n"))
}

/// Name of each layer, and whether it must be rejected.
const LAYERS: [(&str, bool); 20] = [
    ("uneven arcs, few", false),
    ("uneven arcs", true),
    ("a region that crosses itself 700,000 times", true),
    ("dark and clear by turns, apart", false),
    ("dark and clear by turns, on one place", true),
    ("a macro that crosses itself", true),
    ("a macro of many corners, for many apertures", false),
    ("a macro of many rings, for many apertures", true),
    ("large flashes", true),
    ("long strokes", true),
    ("strokes on one line", true),
    ("rectangles along arcs", true),
    ("apertures turned by many angles", true),
    ("a contour repeated", false),
    ("a hatch", true),
    ("many small strokes", false),
    ("many points", false),
    ("a heap of pads", false),
    ("pads all over each other", false),
    ("a fill of long strokes", false),
];

#[allow(clippy::too_many_lines, reason = "a table of texts")]
fn text_of(name: &str) -> String {
    let circle = "%ADD10C,0.5*%";
    let with_macro = |lines: &str, count: usize| {
        let apertures =
            (10..10 + count).fold(String::new(), |text, code| text + &format!("%ADD{code}M,1*%\n"));
        layer(&format!("%AMM*\n{lines}%\n{apertures}"), "X0Y0D03*\n")
    };
    let polarity = |mm: usize| {
        layer(
            circle,
            &many(20_000, |index, chance| format!("%LP{}*%{}D03*", ["D", "C"][index % 2], place(chance, mm))),
        )
    };
    match name {
        "uneven arcs, few" => uneven_arcs(8),
        "uneven arcs" => uneven_arcs(500),
        "a region that crosses itself 700,000 times" => {
            let corners = many(3_000, |_, chance| format!("{}D01*", place(chance, 100)));
            layer(circle, &format!("G36*\nG01*X0Y0D02*\n{corners}G37*\n"))
        }
        "dark and clear by turns, apart" => polarity(100),
        "dark and clear by turns, on one place" => polarity(1),
        "a macro that crosses itself" => {
            let mm = |chance: &mut Chance| within(chance, 50) as f64 / 1e6;
            let line = |index: usize, chance: &mut Chance| {
                let ends = [0; 4].map(|_| mm(chance).to_string()).join(",");
                format!("20,{},0.1,{ends},0*", index % 2)
            };
            with_macro(&many(1_400, line), 1)
        }
        "a macro of many corners, for many apertures" => {
            with_macro(&"5,1,10000,0,0,90,0*\n".repeat(300), 500)
        }
        "a macro of many rings, for many apertures" => {
            with_macro(&"6,0,0,90,0.001,0.001,1000,0,0,0*\n".repeat(300), 500)
        }
        "large flashes" => {
            layer("%ADD10C,900*%", &many(50_000, |_, chance| format!("{}D03*", place(chance, 1))))
        }
        "long strokes" => {
            layer("%ADD10C,0.01*%", &many(40_000, |_, chance| format!("{}D01*", place(chance, 100))))
        }
        "strokes on one line" => {
            layer("%ADD10R,0.1X0.1*%", &many(60_000, |_, chance| format!("X{}Y0D01*", within(chance, 100))))
        }
        "rectangles along arcs" => {
            let arc = |_: usize, chance: &mut Chance| {
                format!("G03*{}I{}J{}D01*", place(chance, 100), within(chance, 100), within(chance, 100))
            };
            layer("%ADD10R,0.5X0.5*%", &many(20_000, arc))
        }
        "apertures turned by many angles" => {
            let turned = |index: usize, _: &mut Chance| {
                format!("%LR{}.{:03}*%X{index}Y0D03*", index / 1_000, index % 1_000)
            };
            layer("%ADD10R,0.5X0.4*%", &many(40_000, turned))
        }
        "a contour repeated" => {
            let zigzag =
                many(5_000, |index, _| format!("X{}Y{}D01*", index * 1_000, 10_000 + index % 2 * 10_000));
            let contour = format!("G36*\nG01*X0Y0D02*\n{zigzag}X5000000Y0D01*X0Y0D01*\nG37*\n");
            layer(circle, &format!("%SRX500Y500I0.1J0.1*%\n{contour}%SR*%\n"))
        }
        "a hatch" => {
            let both = |index: usize, _: &mut Chance| {
                let at = index * 100_000;
                format!("X{at}Y0D02*Y100000000D01*\nX0Y{at}D02*X100000000D01*")
            };
            layer("%ADD10C,0.05*%", &many(1_000, both))
        }
        "a heap of pads" => {
            layer("%ADD10C,0.4*%", &many(5_800, |_, chance| format!("{}D03*", place(chance, 2))))
        }
        "pads all over each other" => {
            layer("%ADD10C,0.4*%", &many(10_000, |_, chance| format!("{}D03*", place(chance, 8))))
        }
        "a fill of long strokes" => {
            let row = |index: usize, _: &mut Chance| format!("X0Y{0}D02*X48000000Y{0}D01*", index * 7_000);
            layer("%ADD10C,0.02*%", &many(5_800, row))
        }
        "many small strokes" => {
            let short = |index: usize, _: &mut Chance| {
                let (x, y) = (index % 200 * 1_000_000, index / 200 * 1_000_000);
                format!("X{x}Y{y}D02*X{}D01*", x + 500_000)
            };
            layer("%ADD10C,0.1*%", &many(25_000, short))
        }
        _ => layer(circle, &"X1*".repeat(330_000)),
    }
}

fn read(name: &str) -> (FileRead, usize) {
    let text = text_of(name);
    assert!(text.len() <= 1_100_000, "{name}: {} bytes", text.len());
    let lines = text.lines().count();
    let mut artwork = read_set(&[("hostile.gbr".to_owned(), text.into_bytes())], &Overrides::default());
    (artwork.files.remove(0), lines)
}

#[test]
fn child() {
    let Ok(name) = std::env::var(LAYER) else { return };
    let (file, lines) = read(&name);
    match painted(file.gerber.as_ref().unwrap()) {
        Ok(region) => println!("painted {}", region.islands.len()),
        Err(much) => {
            assert!((1..=lines).contains(&(much.line as usize)), "{much:?}");
            println!("refused {} {}", much.line, much.diagnostic("hostile.gbr").message("en"));
        }
    }
}

#[test]
fn hostile_layers_of_1_mb_stay_within_their_memory() {
    let mut wrong = Vec::new();
    for (name, refused) in LAYERS {
        let limits = format!("ulimit -v {MEMORY_KIB} && ulimit -t {SECONDS} && exec \"$0\" \"$@\"");
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(limits).arg(std::env::current_exe().unwrap());
        shell.args(["--exact", "hostile_gerber::child", "--nocapture", "--test-threads=1"]);
        let output = shell.env(LAYER, name).env("MALLOC_ARENA_MAX", "1").output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let word = if refused { "refused" } else { "painted" };
        println!("{name}: {}", said.lines().find(|line| line.contains("ed ")).unwrap_or("nothing"));
        if !output.status.success() || !said.lines().any(|line| line.contains(&format!("{word} "))) {
            wrong.push(format!("{name} is not {word}: {:?} {said}", output.status));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
