//! A reader of exported programs for the sweep: G0 to G3 as GRBL executes them; the tool is from the file's
//! header.

/// A tool, from its name in the header.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Tool {
    /// A drill or an end mill.
    Round { radius: f64, drill: bool },
    /// A V-bit: radius of its tip, and growth of the radius per mm of height.
    Cone { tip: f64, slope: f64 },
}

impl Tool {
    /// `drill 0.8`, `end mill 0.8`, `V-bit 30 deg, tip 0.1`.
    fn named(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("{text:?} is no number"));
        if let Some(size) = text.strip_prefix("drill ") {
            return Ok(Self::Round { radius: number(size)? / 2.0, drill: true });
        }
        if let Some(size) = text.strip_prefix("end mill ") {
            return Ok(Self::Round { radius: number(size)? / 2.0, drill: false });
        }
        let cone = text.strip_prefix("V-bit ").and_then(|rest| rest.split_once(" deg, tip "));
        let (angle, tip) = cone.ok_or_else(|| format!("{text:?} is no tool"))?;
        let half = number(angle)?.to_radians() / 2.0;
        Ok(Self::Cone { tip: number(tip)? / 2.0, slope: half.sin() / half.cos() })
    }

    /// Its radius at a height above its tip.
    pub(crate) fn radius_at(self, above: f64) -> f64 {
        match self {
            Self::Round { radius, .. } => radius,
            Self::Cone { tip, slope } => tip + slope * above,
        }
    }
}

/// A straight segment of the tip's path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) from: [f64; 3],
    pub(crate) to: [f64; 3],
}

/// The content of a file.
#[derive(Debug)]
pub(crate) struct Read {
    pub(crate) tool: Tool,
    /// Segments below the surface.
    pub(crate) pieces: Vec<Piece>,
}

/// Maximum distance of a chord from its arc, mm.
const SAGITTA: f64 = 0.001;

/// Reads a file. Fails on anything that a controller would reject, and on a rapid in XY with the tip in the
/// board.
pub(crate) fn read(text: &str) -> Result<Read, String> {
    let (mut tool, mut pieces) = (None, Vec::new());
    let (mut at, mut motion) = ([0.0, 0.0, 100.0], 0);
    for line in text.lines() {
        if let Some(head) = line.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')) {
            if let Some((_, name)) = head.strip_prefix("tool ").and_then(|rest| rest.split_once(": ")) {
                if tool.is_some() {
                    return Err("two tools".to_owned());
                }
                tool = Some(Tool::named(name)?);
            }
            continue;
        }
        let (mut to, mut centre, mut moves) = (at, [0.0, 0.0], false);
        let mut pause = false;
        for word in line.split_whitespace() {
            let (letter, number) = word.split_at(1);
            let value: f64 = number.parse().map_err(|_| format!("{line:?}"))?;
            match (letter, number) {
                ("G", "0" | "1" | "2" | "3") => motion = value as u32,
                ("G", "4") => pause = true,
                ("G", "17" | "21" | "90" | "91.1" | "94") | ("M", "2" | "3" | "5") | ("F" | "S" | "P", _) => {
                }
                ("X", _) => (to[0], moves) = (value, true),
                ("Y", _) => (to[1], moves) = (value, true),
                ("Z", _) => (to[2], moves) = (value, true),
                ("I", _) => centre[0] = value,
                ("J", _) => centre[1] = value,
                _ => return Err(format!("{line:?}")),
            }
        }
        if pause || !moves {
            continue;
        }
        let along = to[0] != at[0] || to[1] != at[1] || motion >= 2;
        if motion == 0 && along && at[2].min(to[2]) <= 0.0 {
            return Err(format!("{line:?}: rapidly along the board with the tip in it"));
        }
        let places = if motion >= 2 { arc(at, to, centre, motion == 3) } else { vec![to] };
        for to in places {
            if at[2].min(to[2]) < 0.0 {
                pieces.push(Piece { from: at, to });
            }
            at = to;
        }
    }
    Ok(Read { tool: tool.ok_or("no tool")?, pieces })
}

/// Ends of an arc's chords.
fn arc(from: [f64; 3], to: [f64; 3], offset: [f64; 2], ccw: bool) -> Vec<[f64; 3]> {
    let centre = [from[0] + offset[0], from[1] + offset[1]];
    let radius = offset[0].hypot(offset[1]);
    let angle = |at: [f64; 3]| (at[1] - centre[1]).atan2(at[0] - centre[0]);
    let whole = std::f64::consts::TAU;
    let mut turn = if ccw { angle(to) - angle(from) } else { angle(from) - angle(to) };
    if from[..2] == to[..2] {
        turn = whole;
    } else if turn < 0.0 {
        turn += whole;
    }
    let step = 2.0 * (1.0 - SAGITTA / radius.max(2.0 * SAGITTA)).acos();
    let count = (turn / step).ceil().max(1.0);
    (1..=count as u32)
        .map(|index| {
            let share = f64::from(index) / count;
            let angle = angle(from) + if ccw { turn * share } else { -turn * share };
            let height = from[2] + (to[2] - from[2]) * share;
            if share >= 1.0 {
                to
            } else {
                [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin(), height]
            }
        })
        .collect()
}
