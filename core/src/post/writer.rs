//! Writes a program in a dialect: one block for each elementary action.
//!
//! ```text
//!  leg  prepare            ┐
//!  leg  change tool ────────▶ start, change or load  a new file if the dialect wants one
//!  leg  hole        ────────▶ hole, or a peck for every drill cycle
//!  leg  path rapid, plunge ─▶ approach
//!            mill ──────────▶ line
//!            mill arc ──────▶ arc or helix; in parts or as lines if the controller needs it
//!            retract ───────▶ leave
//!  leg  finish      ────────▶ end
//! ```

use super::arcs::{Curve, Piece, Tip};
use super::dialect::{Changes, Dialect, FileSplit, Templates};
use super::head::{self, FileOf, mills, name, parts};
use super::names::{Block, TemplateKind};
use super::sheet::OpenFile;
use super::values::{Action, Frame, number_of};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::{Briefing, Command, CommandPlace, Leg, Mark, Program};
use crate::units::Length;
use crate::{code, error};
use serde::{Deserialize, Serialize};

const RADIUS_SLACK: Length = Length::from_um(1);

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OutputFile {
    /// With extension.
    pub name: String,
    pub text: String,
    /// For each line of the text, the last program command that it completes.
    pub commands: Vec<CommandPlace>,
    /// Its tools: indices into the program's tools.
    pub bits: Vec<u32>,
    /// The number of each of them in the file.
    pub numbers: Vec<u32>,
    pub changes: Changes,
}

/// The program in `dialect`. Refused if the dialect has no template or block for a command, or if a template
/// would fill the memory.
pub fn write_with(dialect: &Dialect, program: &Program) -> Result<Vec<OutputFile>, Diagnostic> {
    write_side(dialect, program, &Briefing::of(program), 0)
}

/// As [`write_with`], for side `side` of a job: file numbers continue those of the sides before, and headers
/// include the job's `briefing`.
pub fn write_side(
    dialect: &Dialect,
    program: &Program,
    briefing: &Briefing,
    side: usize,
) -> Result<Vec<OutputFile>, Diagnostic> {
    let mut writer = Writer::new(dialect, program, briefing, side);
    let parts = parts(program, dialect);
    for ((number, leg), &part) in (0..).zip(&program.legs).zip(&parts) {
        writer.number = number;
        writer.leg(leg, part)?;
    }
    writer.finish(parts.last().copied().unwrap_or(TemplateKind::Drill))
}

pub(super) fn write_traced(dialect: &Dialect, program: &Program) -> Result<Vec<Sample>, Diagnostic> {
    let mut writer = Writer::new(dialect, program, &Briefing::of(program), 0);
    writer.trace = Some(Vec::new());
    let parts = parts(program, dialect);
    for ((number, leg), &part) in (0..).zip(&program.legs).zip(&parts) {
        writer.number = number;
        writer.leg(leg, part)?;
    }
    writer.close()?;
    Ok(writer.trace.unwrap_or_default())
}

pub(super) fn file_name(program: &Program, extension: &str) -> String {
    format!("{}.{extension}", name(None, program, ""))
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sample {
    pub part: TemplateKind,
    pub block: Block,
    pub text: String,
}

struct Writer<'a> {
    dialect: &'a Dialect,
    program: &'a Program,
    sheet: Option<OpenFile<'a>>,
    part: TemplateKind,
    done: Vec<(TemplateKind, (String, Vec<CommandPlace>))>,
    /// The files, counted in advance: their names depend on their number.
    files: Vec<FileOf>,
    tools: Vec<u32>,
    now: Action,
    number: u32,
    command: CommandPlace,
    /// Target of a rapid move that is not yet written.
    over: Option<Point>,
    bit: Option<u32>,
    said_rpm: u32,
    trace: Option<Vec<Sample>>,
}

impl<'a> Writer<'a> {
    fn new(dialect: &'a Dialect, program: &'a Program, briefing: &Briefing, side: usize) -> Self {
        let start = Tip { at: Point::default(), height: program.safe_height };
        Self {
            dialect,
            program,
            sheet: None,
            part: TemplateKind::Drill,
            done: Vec::new(),
            files: head::files(dialect, program, briefing, side),
            tools: briefing.numbers(side),
            now: Action { from: start, to: start, lift: program.safe_height, ..Action::default() },
            number: 0,
            command: CommandPlace::default(),
            over: None,
            bit: None,
            said_rpm: 0,
            trace: None,
        }
    }

    fn templates(&self, part: TemplateKind) -> Result<&'a Templates, Diagnostic> {
        let code = match part {
            TemplateKind::Drill => code!("post.no_drill_template"),
            TemplateKind::Engrave => code!("post.milling"),
        };
        self.dialect
            .templates(part)
            .ok_or_else(|| Diagnostic::error(code).with("dialect", &self.dialect.name))
    }

    fn leg(&mut self, leg: &Leg, part: TemplateKind) -> Result<(), Diagnostic> {
        match leg.mark {
            Mark::Prepare | Mark::Finish => {
                self.command = leg.end(self.number);
                self.settings(leg);
                Ok(())
            }
            Mark::ToolChange(bit) => {
                let apart = self.dialect.files == FileSplit::Bit;
                if apart {
                    self.close()?;
                }
                (self.bit, self.now.bit) = (Some(bit), bit);
                self.open(part, false)?;
                self.command = leg.end(self.number);
                self.settings(leg);
                if apart && self.templates(part)?.blocks.contains_key(&Block::Load) {
                    return self.load();
                }
                self.change()
            }
            Mark::Hole(_) if !mills(leg) => {
                self.open(part, true)?;
                self.hole(leg)
            }
            Mark::Hole(_) | Mark::Toolpath(_) => {
                self.open(part, true)?;
                leg.placed(self.number).try_for_each(|(place, command)| {
                    self.command = place;
                    self.command(command)
                })
            }
        }
    }

    /// Takes position, spindle and dwell from a leg without work.
    fn settings(&mut self, leg: &Leg) {
        self.now.wait_us = 0;
        for command in &leg.commands {
            match *command {
                Command::Rapid { to } => self.over = Some(to),
                Command::Spindle { rpm } => self.now.rpm = rpm,
                Command::Dwell { us } => self.now.wait_us = us,
                _ => {}
            }
        }
    }

    /// Opens a file for `part` if needed; with `loaded`, a new one starts with the current tool.
    fn open(&mut self, part: TemplateKind, loaded: bool) -> Result<(), Diagnostic> {
        let templates = self.templates(part)?;
        let other = part != self.part;
        let ending = self.templates(self.part).map(|before| &before.extension);
        let apart = self.dialect.files == FileSplit::Operation || ending != Ok(&templates.extension);
        if other && apart {
            self.close()?;
        }
        self.part = part;
        if let Some(sheet) = &mut self.sheet {
            sheet.turn_to(part);
            return Ok(());
        }
        self.sheet = Some(OpenFile::new(self.dialect, part));
        // Each file must start the spindle itself.
        self.said_rpm = 0;
        self.command = CommandPlace { leg: self.number, command: 0 };
        let home = Tip { at: Point::default(), height: self.program.safe_height };
        let start = Action { from: home, to: home, ..self.now };
        self.write(Block::Start, start)?;
        if loaded && self.bit.is_some() {
            self.change()?;
        }
        Ok(())
    }

    fn close(&mut self) -> Result<(), Diagnostic> {
        if self.sheet.is_none() {
            return Ok(());
        }
        let home = Tip { at: Point::default(), height: self.program.safe_height };
        self.write(Block::End, Action { from: self.now.to, to: home, ..self.now })?;
        self.now.to = home;
        if let Some(sheet) = self.sheet.take() {
            self.done.push((self.part, sheet.finish()));
        }
        Ok(())
    }

    fn finish(mut self, part: TemplateKind) -> Result<Vec<OutputFile>, Diagnostic> {
        if self.sheet.is_none() && self.done.is_empty() {
            self.open(part, false)?;
        }
        self.close()?;
        let mut files = Vec::new();
        for (index, (part, written)) in std::mem::take(&mut self.done).into_iter().enumerate() {
            let (text, commands) = written;
            let FileOf { name, bits, .. } = self.files.get(index).cloned().unwrap_or_default();
            let name = format!("{name}.{}", self.templates(part)?.extension);
            let numbers = bits.iter().map(|bit| number_of(&self.tools, *bit)).collect();
            files.push(OutputFile { name, text, commands, bits, numbers, changes: self.dialect.changes() });
        }
        Ok(files)
    }

    fn frame<'n>(&self, templates: &Templates, file: Option<&'n FileOf>, tools: &'n [u32]) -> Frame<'n>
    where
        'a: 'n,
    {
        let (numbers, fall_to) = (&self.dialect.numbers, self.dialect.fall_to);
        let safe = self.program.safe_height;
        Frame {
            program: self.program,
            name: file.map_or("", |file| &file.name),
            numbers,
            shift: templates.shift,
            fall_to,
            change_at: self.dialect.change_at.unwrap_or(safe).max(safe),
            tools,
            file: file.map_or(1, |file| file.number),
            rapids: self.dialect.rapids,
            head_width: self.dialect.comments.longest.unwrap_or(usize::MAX),
            head: file.map_or(&[], |file| &file.head),
        }
    }

    fn write(&mut self, block: Block, action: Action) -> Result<(), Diagnostic> {
        let templates = self.templates(self.part)?;
        let template = templates.blocks.get(&block).ok_or_else(|| {
            let diagnostic = error!("post.no_block", dialect = &self.dialect.name, ..);
            diagnostic.with("block", block.key()).with("template", self.part.key())
        })?;
        let frame = self.frame(templates, self.files.get(self.done.len()), &self.tools);
        if let Some(sheet) = &mut self.sheet {
            let before = sheet.written().len();
            sheet.write(self.command, block, template, |name| frame.value(&action, name))?;
            if let Some(trace) = &mut self.trace {
                let text = sheet.written().get(before..).unwrap_or_default().to_owned();
                trace.push(Sample { part: self.part, block, text });
            }
        }
        (self.now.from, self.now.to) = (action.to, action.to);
        Ok(())
    }

    fn change(&mut self) -> Result<(), Diagnostic> {
        let at = self.over.take().unwrap_or_default();
        let to = Tip { at, height: self.program.safe_height };
        self.said_rpm = self.now.rpm;
        self.write(Block::Change, Action { to, ..self.now })
    }

    /// The file's tool is in: only start the spindle.
    fn load(&mut self) -> Result<(), Diagnostic> {
        self.over = None;
        self.said_rpm = self.now.rpm;
        let here = self.now.to;
        self.write(Block::Load, Action { to: here, ..self.now })
    }

    fn spindle(&mut self) -> Result<(), Diagnostic> {
        if self.said_rpm == self.now.rpm {
            return Ok(());
        }
        self.said_rpm = self.now.rpm;
        self.write(Block::Spindle, self.now)
    }

    fn hole(&mut self, leg: &Leg) -> Result<(), Diagnostic> {
        let mut strokes: Vec<(CommandPlace, Action)> = Vec::new();
        for (place, command) in leg.placed(self.number) {
            match command {
                Command::Rapid { to } => self.over = Some(to),
                Command::Spindle { rpm } => self.now.rpm = rpm,
                Command::Plunge { to, feed_um_per_s, .. } => {
                    let at = self.over.unwrap_or(self.now.to.at);
                    let to = Tip { at, height: to };
                    let lift = self.program.safe_height;
                    strokes.push((place, Action { to, lift, feed_um_per_s, wait_us: 0, ..self.now }));
                }
                Command::Dwell { us } => {
                    if let Some((done, stroke)) = strokes.last_mut() {
                        (*done, stroke.wait_us) = (place, us);
                    }
                }
                Command::Retract { to } => {
                    if let Some((done, stroke)) = strokes.last_mut() {
                        (*done, stroke.lift) = (place, to);
                    }
                }
                _ => {}
            }
        }
        self.command = strokes.first().map_or(self.command, |(done, _)| *done);
        self.spindle()?;
        let block = if strokes.len() > 1 { Block::Peck } else { Block::Hole };
        for (done, stroke) in strokes {
            (self.over, self.command) = (None, done);
            self.write(block, Action { from: self.now.to, rpm: self.now.rpm, ..stroke })?;
            self.now.to.height = stroke.lift;
        }
        Ok(())
    }

    fn command(&mut self, command: Command) -> Result<(), Diagnostic> {
        match command {
            Command::Rapid { to } => self.over = Some(to),
            Command::Spindle { rpm } => self.now.rpm = rpm,
            Command::Plunge { to, feed_um_per_s, .. } => {
                self.now.feed_um_per_s = feed_um_per_s;
                let up = self.now.to.height >= self.program.safe_height;
                let over = self.over.take().or(up.then_some(self.now.to.at));
                match over {
                    Some(at) => self.approach(Tip { at, height: to })?,
                    None => self.line(Tip { at: self.now.to.at, height: to })?,
                }
            }
            Command::Mill { to, height, feed_um_per_s } => {
                self.arrive(feed_um_per_s)?;
                self.line(Tip { at: to, height })?;
            }
            Command::MillArc { to, height, center, ccw, feed_um_per_s } => {
                self.arrive(feed_um_per_s)?;
                let to = Tip { at: to, height };
                self.curve(Curve { from: self.now.to, to, centre: center, ccw })?;
            }
            Command::Retract { to } => {
                let at = self.now.to.at;
                self.write(Block::Leave, Action { to: Tip { at, height: to }, ..self.now })?;
            }
            Command::Dwell { us } => self.write(Block::Wait, Action { wait_us: us, ..self.now })?,
            Command::AwaitBit { bit } => {
                (self.bit, self.now.bit) = (Some(bit), bit);
                self.change()?;
            }
        }
        Ok(())
    }

    /// Moves over the start of a move in the board, at the current height.
    fn arrive(&mut self, feed_um_per_s: u32) -> Result<(), Diagnostic> {
        self.now.feed_um_per_s = feed_um_per_s;
        match self.over.take() {
            Some(at) => self.approach(Tip { at, height: self.now.to.height }),
            None => self.spindle(),
        }
    }

    fn approach(&mut self, to: Tip) -> Result<(), Diagnostic> {
        self.fits(to.height)?;
        self.spindle()?;
        self.write(Block::Approach, Action { to, ..self.now })
    }

    /// Refuses a tool with another radius than the template's.
    fn fits(&self, height: Length) -> Result<(), Diagnostic> {
        let Some(radius) = self.templates(self.part)?.tool_radius else { return Ok(()) };
        let Some(bit) = self.program.bits.get(self.now.bit as usize) else { return Ok(()) };
        let found = Length::from_nm(bit.width_at(Length::ZERO - height).nm() / 2);
        if height > Length::ZERO || (found - radius).abs() <= RADIUS_SLACK {
            return Ok(());
        }
        let diagnostic = error!("post.tool_radius", bit = bit.called(), ..);
        Err(diagnostic.with("found", found.mm()).with("expected", radius.mm()))
    }

    fn line(&mut self, to: Tip) -> Result<(), Diagnostic> {
        self.write(Block::Line, Action { to, curve: None, ..self.now })
    }

    fn curve(&mut self, curve: Curve) -> Result<(), Diagnostic> {
        let templates = self.templates(self.part)?;
        let frame = self.frame(templates, None, &[]);
        let arcs = &self.dialect.arcs;
        let own = !arcs.lines_only && arcs.helix == super::dialect::Helix::Blocks;
        for piece in curve.pieces(arcs, templates.centre(), |at| frame.written(at)) {
            match piece {
                Piece::Line(to) => self.line(to)?,
                Piece::Arc(to, _) => {
                    let part = Curve { from: self.now.to, to, ..curve };
                    let rises = part.from.height != to.height;
                    let block = match (own && rises, curve.ccw) {
                        (false, false) => Block::ArcCw,
                        (false, true) => Block::ArcCcw,
                        (true, false) => Block::HelixCw,
                        (true, true) => Block::HelixCcw,
                    };
                    self.write(block, Action { to, curve: Some(part), ..self.now })?;
                    self.now.curve = None;
                }
            }
        }
        Ok(())
    }
}
