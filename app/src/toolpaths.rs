//! A program as it is drawn: strokes as wide as the cut, the travel between them, the stops in order.
//!
//! ```text
//!   travel ─ ─ ─ ▶ ●━━━━━━━━●      stop 3: a hole, or a toolpath: all cuts of one leg
//!                  ╲ as wide as the tool cuts at that depth
//! ```

use annulus_core::geometry::{Point, chords};
use annulus_core::job::{Command, Leg, Mark, Program, travel_mm};
use annulus_core::units::Length;

const CHORD_ERROR_MM: f64 = 0.005;
/// Further cuts are not drawn.
const MOST_CUTS: usize = 1_500_000;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Toolpaths {
    /// Holes and toolpaths in order of execution.
    pub stops: Vec<Mark>,
    /// Straight segments of all toolpaths.
    pub cuts: Vec<ToolpathPiece>,
    pub travels: Vec<Travel>,
    /// For each leg of the program, the number of stops before it.
    pub before: Vec<u32>,
    pub travel_mm: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolpathPiece {
    pub a_mm: [f32; 2],
    pub b_mm: [f32; 2],
    /// Width of the cut at the surface; 0 if the tip is above it.
    pub width_mm: f32,
    pub stop: u32,
    /// Index into the program's tools.
    pub bit: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    pub a_mm: [f32; 2],
    pub b_mm: [f32; 2],
    /// Index of the stop that it leads to.
    pub stop: u32,
}

impl Toolpaths {
    /// Number of completed stops in leg `leg` after `holes` holes.
    pub fn done(&self, leg: u32, holes: u32) -> u32 {
        let before = self.before.get(leg as usize).copied().unwrap_or(self.stops.len() as u32);
        let is_hole = |(_, mark): &(u32, &Mark)| matches!(mark, Mark::Hole(_));
        let drilled = (1..).zip(&self.stops).filter(is_hole);
        let through = holes.checked_sub(1).and_then(|last| drilled.map(|(stop, _)| stop).nth(last as usize));
        before.max(through.unwrap_or(0))
    }

    pub fn toolpath_count(&self) -> usize {
        self.stops.iter().filter(|mark| matches!(mark, Mark::Toolpath(_))).count()
    }
}

/// True if a leg with this mark is a stop: a hole or a toolpath.
pub const fn is_stop(mark: Mark) -> bool {
    matches!(mark, Mark::Hole(_) | Mark::Toolpath(_))
}

struct Head<'a> {
    program: &'a Program,
    corner: Point,
    at: Point,
    height: Length,
    bit: u32,
    toolpaths: Toolpaths,
}

/// The toolpaths of `program` relative to `corner`, in work coordinates.
pub fn toolpaths(program: &Program, corner: Point) -> Toolpaths {
    let height = program.safe_height;
    let toolpaths = Toolpaths { travel_mm: travel_mm(program), ..Toolpaths::default() };
    let mut head = Head { program, corner, at: Point::default(), height, bit: 0, toolpaths };
    for leg in &program.legs {
        if let Mark::ToolChange(bit) = leg.mark {
            head.bit = bit;
        }
        head.leg(leg);
    }
    head.toolpaths
}

impl Head<'_> {
    fn leg(&mut self, leg: &Leg) {
        self.toolpaths.before.push(self.toolpaths.stops.len() as u32);
        for command in &leg.commands {
            match *command {
                Command::Rapid { to } => self.travel(to),
                Command::Plunge { to, .. } | Command::Retract { to } => self.height = to,
                Command::Mill { to, height, .. } => self.cut([to], height),
                Command::MillArc { to, height, center, ccw, .. } => {
                    self.cut(chords::arc(self.at, to, center, !ccw, CHORD_ERROR_MM), height);
                }
                Command::Dwell { .. } | Command::Spindle { .. } | Command::AwaitBit { .. } => {}
            }
        }
        if is_stop(leg.mark) {
            self.toolpaths.stops.push(leg.mark);
        }
    }

    fn place(&self, at: Point) -> [f32; 2] {
        [(at.x - self.corner.x).mm() as f32, (at.y - self.corner.y).mm() as f32]
    }

    fn travel(&mut self, to: Point) {
        let (a_mm, b_mm) = (self.place(self.at), self.place(to));
        if a_mm != b_mm {
            self.toolpaths.travels.push(Travel { a_mm, b_mm, stop: self.toolpaths.stops.len() as u32 });
        }
        self.at = to;
    }

    /// A ramp is drawn as wide as at its deeper end.
    fn cut(&mut self, points: impl IntoIterator<Item = Point>, height: Length) {
        let depth = -self.height.min(height);
        let bit = self.program.bits.get(self.bit as usize);
        let width_mm = match bit {
            Some(bit) if depth > Length::ZERO => bit.width_at(depth).mm() as f32,
            _ => 0.0,
        };
        for to in points {
            if self.toolpaths.cuts.len() < MOST_CUTS {
                let (a_mm, b_mm) = (self.place(self.at), self.place(to));
                let stop = self.toolpaths.stops.len() as u32;
                self.toolpaths.cuts.push(ToolpathPiece { a_mm, b_mm, width_mm, stop, bit: self.bit });
            }
            self.at = to;
        }
        self.height = height;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apart(a: [f32; 2], b: [f32; 2]) -> f64 {
        let [dx, dy] = [f64::from(b[0] - a[0]), f64::from(b[1] - a[1])];
        libm::sqrt(dx * dx + dy * dy)
    }
    use annulus_core::job::{Bit, Cutter};

    fn mm(mm: f64) -> Length {
        Length::from_mm(mm)
    }

    fn program() -> Program {
        let at = Point::from_mm;
        let vee = Cutter::Vee { tip: mm(0.1), angle_mdeg: 90_000 };
        let bits = vec![
            Bit { diameter: mm(3.0), name: "V".to_owned(), cutter: vee, handling: Default::default() },
            Bit {
                diameter: mm(0.8),
                name: "0.8".to_owned(),
                cutter: Cutter::Drill,
                handling: Default::default(),
            },
        ];
        let feed_um_per_s = 1_000;
        let down = |to| Command::Plunge { to, feed_um_per_s, gate: None };
        let mill = |to, height| Command::Mill { to, height, feed_um_per_s };
        let round = Command::MillArc {
            to: at(3.0, 1.0),
            height: mm(-0.1),
            center: at(2.0, 1.0),
            ccw: true,
            feed_um_per_s,
        };
        let up = Command::Retract { to: mm(2.0) };
        let way = vec![
            Command::Rapid { to: at(1.0, 1.0) },
            down(mm(-0.1)),
            mill(at(3.0, 1.0), mm(-0.1)),
            round,
            up,
        ];
        let hole = vec![Command::Rapid { to: at(5.0, 5.0) }, down(mm(-2.0)), up];
        let leg = |mark, commands| Leg { mark, commands };
        Program {
            name: String::new(),
            machine: String::new(),
            origin: Point::default(),
            bits,
            spindles: 1,
            safe_height: mm(2.0),
            legs: vec![
                leg(Mark::ToolChange(0), vec![]),
                leg(Mark::Toolpath(0), way),
                leg(Mark::ToolChange(1), vec![]),
                leg(Mark::Hole(7), hole),
                leg(Mark::Finish, vec![Command::Rapid { to: at(0.0, 0.0) }]),
            ],
            accepted: vec![],
        }
    }

    #[test]
    fn cut_width_follows_the_tool_at_its_depth() {
        let found = toolpaths(&program(), Point::from_mm(1.0, 0.0));
        assert_eq!(found.stops, [Mark::Toolpath(0), Mark::Hole(7)]);
        assert_eq!(found.cuts[0].a_mm, [0.0, 1.0]);
        assert_eq!(found.cuts[0].b_mm, [2.0, 1.0]);
        assert!((found.cuts[0].width_mm - 0.3).abs() < 1e-6, "{}", found.cuts[0].width_mm);
        assert!(found.cuts.iter().all(|cut| cut.stop == 0 && cut.bit == 0));
        let length = 2.0 + 2.0 * std::f64::consts::PI;
        let cut: f64 = found.cuts.iter().map(|cut| apart(cut.a_mm, cut.b_mm)).sum();
        assert!((cut - length).abs() < 0.05, "{cut}");
        let stops: Vec<_> = found.travels.iter().map(|travel| travel.stop).collect();
        assert_eq!(stops, [0, 1, 2], "to the way, to the hole, home");
        assert_eq!(found.toolpath_count(), 1);
    }

    #[test]
    fn stops_are_counted_by_leg() {
        let found = toolpaths(&program(), Point::default());
        let done: Vec<_> = (0..=5).map(|leg| found.done(leg, 0)).collect();
        assert_eq!(done, [0, 0, 1, 1, 2, 2]);
        assert_eq!(found.done(3, 1), 2, "the hole is through before its leg is over");
    }

    #[test]
    fn cut_above_the_board_has_no_width() {
        let mut program = program();
        if let Some(Command::Mill { height, .. }) = program.legs[1].commands.get_mut(2) {
            *height = mm(0.5);
        }
        program.legs[1].commands[1] = Command::Retract { to: mm(0.5) };
        assert_eq!(toolpaths(&program, Point::default()).cuts[0].width_mm, 0.0);
    }
}
