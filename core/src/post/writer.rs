//! A program in a dialect's words: one block for each elementary action (S6 S7).
//!
//! ```text
//!  leg  prepare            ┐
//!  leg  change bit  ────────▶ start, change or load  a new file where the dialect wants one
//!  leg  hole        ────────▶ hole, or a peck for every stroke
//!  leg  way  rapid, plunge ─▶ approach
//!            mill ──────────▶ line
//!            mill arc ──────▶ arc or helix, either sense; in parts or as lines where the controller wants that
//!            retract ───────▶ leave
//!  leg  finish      ────────▶ end
//! ```
//!
//! Comes in: a program, a dialect. Goes out: files, in work coordinates, shifted as the dialect says. Does not know which
//! dialects there are.

use super::arcs::{Curve, Piece, Tip};
use super::dialect::{Changes, Dialect, FileSplit, NameStyle, Templates};
use super::head::{self, FileOf};
use super::names::{Block, TemplateKind};
use super::preview::Sample;
use super::sheet::OpenFile;
use super::values::{Action, Frame, number_of};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::{Briefing, Command, CommandPlace, Leg, Mark, Program};
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// How far a bit's radius may be from the one a template is for.
const RADIUS_SLACK: Length = Length::from_um(1);
/// Longest name of a file, in letters, without its ending.
const LONGEST_NAME: usize = 60;

/// In fewer letters no name of a side is written out.
const LITTLE_ROOM: usize = 12;

/// A file that was written.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OutputFile {
    /// Its name with extension.
    pub name: String,
    /// What it says.
    pub text: String,
    /// For each line of the text, the last command of the program that is done with it.
    pub commands: Vec<CommandPlace>,
    /// The bits that it is for, as indices into the program's bits.
    pub bits: Vec<u32>,
    /// The number by which it calls each of them.
    pub numbers: Vec<u32>,
    /// How they come into the spindle.
    pub changes: Changes,
}

/// The program in the words of `dialect`. Refused where the dialect has no template or block for what the program does, or
/// where a template would fill the memory.
pub fn write_with(dialect: &Dialect, program: &Program) -> Result<Vec<OutputFile>, Diagnostic> {
    write_side(dialect, program, &Briefing::of(program), 0)
}

/// The same of a program that is side `side` of a job: its files are numbered behind those of the sides before it, and their
/// heads say what the job's `briefing` knows.
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

/// The program block by block: what `preview` shows.
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

/// The name of the only file of a program, with `extension`.
pub(super) fn file_name(program: &Program, extension: &str) -> String {
    format!("{}.{extension}", name(None, program, ""))
}

/// Whether a leg mills: then it is written with the engraving template, whatever it is for.
fn mills(leg: &Leg) -> bool {
    let cuts = |command: &Command| matches!(command, Command::Mill { .. } | Command::MillArc { .. });
    matches!(leg.mark, Mark::Toolpath(_)) || leg.commands.iter().any(cuts)
}

/// The template for each leg: that of the work it does or leads to.
pub(super) fn parts(program: &Program, dialect: &Dialect) -> Vec<TemplateKind> {
    let own = |leg: &Leg| match leg.mark {
        _ if mills(leg) => Some(TemplateKind::Engrave),
        Mark::Hole(_) => Some(TemplateKind::Drill),
        _ => None,
    };
    let only = if dialect.drill.is_some() { TemplateKind::Drill } else { TemplateKind::Engrave };
    let mut next = program.legs.iter().rev().find_map(own).unwrap_or(only);
    let mut parts: Vec<TemplateKind> = program
        .legs
        .iter()
        .rev()
        .map(|leg| {
            next = own(leg).unwrap_or(next);
            next
        })
        .collect();
    parts.reverse();
    parts
}

struct Writer<'a> {
    dialect: &'a Dialect,
    program: &'a Program,
    sheet: Option<OpenFile<'a>>,
    part: TemplateKind,
    done: Vec<(TemplateKind, (String, Vec<CommandPlace>))>,
    /// How many files there will be is not known when a name is needed: they are counted first.
    files: Vec<FileOf>,
    /// The numbers of the program's bits.
    tools: Vec<u32>,
    now: Action,
    /// The leg that is written, by its index.
    number: u32,
    /// The last command that is done with what is written.
    command: CommandPlace,
    /// Where a rapid move goes that was not written yet.
    over: Option<Point>,
    /// The bit that is in, if one was asked for.
    bit: Option<u32>,
    /// What the file said last of the spindle's speed.
    said_rpm: u32,
    /// What every block made, where somebody wants to know.
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
            TemplateKind::Drill => "post.no_drill_template",
            TemplateKind::Engrave => "post.milling",
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

    /// What a leg without work says of place, spindle and time.
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

    /// A file for `part` is open afterwards; with `loaded`, a new one begins with the bit that is in.
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

    /// The file that is open is ended.
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

    /// What all actions of a file of this name share.
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

    /// Writes a block; afterwards the tip is where it goes.
    fn write(&mut self, block: Block, action: Action) -> Result<(), Diagnostic> {
        let templates = self.templates(self.part)?;
        let template = templates.blocks.get(&block).ok_or_else(|| {
            let diagnostic = Diagnostic::error("post.no_block").with("dialect", &self.dialect.name);
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

    /// The bit that the file is for is in: it need only turn.
    fn load(&mut self) -> Result<(), Diagnostic> {
        self.over = None;
        self.said_rpm = self.now.rpm;
        let here = self.now.to;
        self.write(Block::Load, Action { to: here, ..self.now })
    }

    /// The spindle turns as it should.
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

    /// Over the place where a move in the board begins, at the height where the tip is.
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

    /// Refuses a bit of another radius than the one the template is for.
    fn fits(&self, height: Length) -> Result<(), Diagnostic> {
        let Some(radius) = self.templates(self.part)?.tool_radius else { return Ok(()) };
        let Some(bit) = self.program.bits.get(self.now.bit as usize) else { return Ok(()) };
        let found = Length::from_nm(bit.width_at(Length::ZERO - height).nm() / 2);
        if height > Length::ZERO || (found - radius).abs() <= RADIUS_SLACK {
            return Ok(());
        }
        let diagnostic = Diagnostic::error("post.tool_radius").with("bit", bit.called());
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

/// The job's name with `suffix`, as the dialect allows it.
pub(super) fn name(style: Option<NameStyle>, program: &Program, suffix: &str) -> String {
    let base = program.name.rsplit(['/', '\\']).next().unwrap_or_default();
    let base = base.rsplit_once('.').map_or(base, |(stem, _)| if stem.is_empty() { base } else { stem });
    let NameStyle { longest, capitals } =
        style.unwrap_or(NameStyle { longest: LONGEST_NAME, capitals: false });
    let free = style.is_none();
    let plain = |c: char| match c {
        _ if c.is_ascii_alphanumeric() || c == '_' => c,
        '-' | '.' if free => c,
        _ => '_',
    };
    let mut text: String = base.chars().map(plain).collect();
    if !text.starts_with(|c: char| c.is_ascii_alphabetic() || (free && c.is_ascii_digit())) {
        text.insert(0, 'P');
    }
    // Names of one job differ at their ends (sides of a board), so the middle is what goes.
    let room = longest.saturating_sub(suffix.len()).max(1);
    if text.len() > room {
        let word = text.rfind(['_', '-']).map_or(4, |at| text.len() - at);
        let word = word.min(text.len());
        // Where there is little room a side is its first letter.
        let side = text.get(text.len() - word + 1..).is_some_and(|word| ["bottom", "top"].contains(&word));
        let short = side && (2..LITTLE_ROOM).contains(&room);
        let mut end = text.split_off(text.len() - if short { word } else { word.min(room / 2) });
        end.truncate(if short { 2 } else { room });
        text.truncate(room - end.len());
        text.push_str(&end);
    }
    text.push_str(suffix);
    if capitals { text.to_ascii_uppercase() } else { text }
}
