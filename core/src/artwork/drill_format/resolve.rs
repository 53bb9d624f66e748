//! Decides how to read the numbers of a drill program: from its own statements if it has any, else by
//! evidence. A reading is one interpretation: units, digits and omitted zeros.
//!
//! ```text
//! survey ─ sense ─▶ what statements settle
//! every reading ─▶ its holes (a sample) ─▶ share on copper ─▶ best allowed, best other
//! ```

use super::candidates::{Grounds, Ranked, agrees, rank, readings, sample};
use super::evidence::Neighbours;
use super::offset::{Look, look};
use super::plausible::{impossible, odd, oddity};
use super::tool_units;
use crate::artwork::companion::{Companion, Row, base};
use crate::artwork::drill::DrillFile;
use crate::artwork::excellon::{self, Sensed, Survey, Task, ToolTable, customary};
use crate::artwork::file::{FileRead, drill_program, plated_by_name};
use crate::artwork::number::Reading;
use crate::artwork::registration::{FITS_SHARE, same_place, same_size};
use crate::artwork::{Evidence, Overrides, Source, Zeros};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::Point;
use crate::units::Length;
use crate::{code, warning};

const MOST_SHOWN: usize = 2_000;
/// Copper can't distinguish readings whose shares are closer than this.
const CLOSE_SHARE: f64 = 0.10;
const MUCH_BETTER_SHARE: f64 = 0.30;
/// Copper under this share of the holes outweighs a report.
const NEARLY_ALL_SHARE: f64 = 0.95;
/// From this number of differences on, a report can't just have a typing error.
const FEWEST_DIFFER: usize = 2;
/// From this number of holes on, missing all copper can't be chance.
const MANY: usize = 8;

/// Reads a drill program. Fails with the reason why nothing is usable.
pub(in crate::artwork) fn program(
    name: &str,
    text: &[u8],
    neighbours: &Neighbours<'_>,
    person: &Overrides,
) -> Result<FileRead, Diagnostic> {
    let survey = excellon::survey(text);
    let Beside { stated, table, companions: beside, foreign } =
        companions(name, text, &survey, neighbours, person);
    let sensed = excellon::sense(&survey, &stated, person);
    let mut grounds = Grounds {
        name,
        text,
        survey: &survey,
        table: &table,
        sensed: &sensed,
        unplated: false,
        copper: neighbours.copper,
        outline: neighbours.outline,
    };
    grounds.unplated = neighbours.copper.is_some() && unplated(&grounds);
    let witnessed = grounds.copper.is_some() || grounds.outline.is_some();
    let ranking = if witnessed { rank(&grounds) } else { None };
    let mut choice = choose(&grounds, ranking.as_deref());
    let task = Task { name, text, reading: choice.reading, survey: &survey, table: &table };
    let settled = choice.evidence.source == Source::Copper;
    let (mut drill, mut diagnostics);
    (choice.reading, drill, diagnostics) = measured(task, &sensed, settled)?;
    let reading = choice.reading;

    let mut file = drill_program(name);
    let decimal = reading.zeros == Zeros::Decimal;
    file.units = Some(reading.units);
    file.number_format = (!decimal).then_some(reading.digits);
    file.zeros = Some(reading.zeros);
    file.plated = survey.file_plated;
    file.generator = survey.generator.clone();
    diagnostics.extend(warnings(name, &sensed, &choice, &survey, !drill.hits.is_empty()));
    let units = tool_units::settle(&mut drill, reading.units, &survey.sizes);
    diagnostics.extend(units.map(|warning| warning.at(name, 0, 0)));
    diagnostics.extend(impossible(name, &drill));
    diagnostics.extend(choice.seen.into_iter().map(|warning| warning.at(name, 0, 0)));
    diagnostics.extend(beside.iter().flat_map(|companion| disagreements(name, &drill, companion)));
    diagnostics.extend(foreign);
    file.evidence = Some(choice.evidence);
    for tool in drill.tools.iter_mut().filter(|tool| tool.plated.is_none()) {
        tool.plated = survey.file_plated;
    }
    file.drill = Some(drill);
    file.diagnostics = diagnostics;
    Ok(file)
}

/// Reads by `task`. If the result can hardly be a board, tries readings that differ only in parts without any
/// evidence, and takes the first that gives a board.
fn measured(
    mut task: Task<'_>,
    sensed: &Sensed,
    settled: bool,
) -> Result<(Reading, DrillFile, Vec<Diagnostic>), Diagnostic> {
    let (mut drill, mut diagnostics) = excellon::read(&task)?;
    let Some(mut code) = oddity(&drill) else { return Ok((task.reading, drill, diagnostics)) };
    let first = task.reading;
    let open = |source| source == Source::Default;
    let guessed = !settled && open(sensed.weakest());
    if guessed {
        let makes_a_board = |(drill, diagnostics): &(DrillFile, Vec<Diagnostic>)| {
            oddity(drill).is_none()
                && !diagnostics.iter().any(|diagnostic| diagnostic.code == code!("drill.out_of_range"))
        };
        let sample = Task { text: sample(task.text).unwrap_or_default(), ..task };
        let other = readings(sensed).into_iter().find(|&reading| {
            agrees(&reading, sensed, |source| !open(source))
                && excellon::read(&Task { reading, ..sample }).is_ok_and(|read| makes_a_board(&read))
        });
        if let Some(reading) = other
            && let Ok(read) = excellon::read(&Task { reading, ..task })
            && makes_a_board(&read)
        {
            ((drill, diagnostics), task.reading, code) = (read, reading, code!("drill.read_by_measure"));
        }
    }
    diagnostics.push(odd(task.name, &drill, code, &shown(&task.reading), &shown(&first)));
    Ok((task.reading, drill, diagnostics))
}

#[derive(Default)]
struct Beside<'a> {
    stated: excellon::Stated,
    table: ToolTable,
    companions: Vec<&'a Companion>,
    /// Warnings about reports of another board, which are ignored.
    foreign: Vec<Diagnostic>,
}

/// Collects the companions of this file, except those that contradict it.
fn companions<'a>(
    name: &str,
    text: &[u8],
    survey: &Survey,
    neighbours: &Neighbours<'a>,
    person: &Overrides,
) -> Beside<'a> {
    let mut beside = Beside::default();
    for (own, report, companion) in &neighbours.companions {
        if !companion.speaks_of(own, report, name, survey.routes, neighbours.one_board) {
            continue;
        }
        if let Some((differs, agrees)) = contradicts(name, text, survey, companion, person) {
            let warning = warning!("drill.report_of_another_board", ..).at(name, 0, 0);
            let warning = warning.with("report", base(own)).with("count", differs);
            beside.foreign.push(warning.with("of", differs + agrees));
            continue;
        }
        let Beside { stated, table, companions, .. } = &mut beside;
        stated.units = stated.units.or(companion.stated.units);
        stated.digits = stated.digits.or(companion.stated.digits);
        stated.zeros = stated.zeros.or(companion.stated.zeros);
        for code in companion.tool_codes() {
            // Rows that differ come from several files, and it isn't clear which is right: use none.
            let rows = companion.tool(code, name);
            let Some(row) =
                rows.first().filter(|row| rows.iter().all(|other| other.diameter == row.diameter))
            else {
                continue;
            };
            let entry = table.entry(code).or_insert((row.diameter, row.plated));
            entry.0 = entry.0.or(row.diameter);
        }
        companions.push(companion);
    }
    beside
}

/// The number of differences and matches between report and file, if the report is for another board: mostly
/// differences. Compares tool sizes stated in the file and hole counts; a tool missing in the report is a
/// difference.
fn contradicts(
    name: &str,
    text: &[u8],
    survey: &Survey,
    companion: &Companion,
    person: &Overrides,
) -> Option<(usize, usize)> {
    if companion.is_without_tools() {
        return None;
    }
    let reading = excellon::sense(survey, &companion.stated, person).reading;
    let table = ToolTable::new();
    let (drill, _) = excellon::read(&Task { name, text, reading, survey, table: &table }).ok()?;
    let (mut differs, mut agrees) = (0, 0);
    for (tool, counts) in drill.tools.iter().zip(drill.counts()) {
        let holes = counts.hits + counts.slots + counts.routed_paths;
        if holes == 0 {
            continue;
        }
        let rows = companion.tool(tool.code, name);
        let any = |fits: &dyn Fn(&Row) -> Option<bool>| rows.iter().filter_map(fits).reduce(|a, b| a | b);
        let size = any(&|row| Some(is_one_size(tool.diameter?, row.diameter?)));
        let count = any(&|row| Some(row.holes? == holes));
        let same: Vec<bool> =
            if rows.is_empty() { vec![false] } else { size.into_iter().chain(count).collect() };
        agrees += same.iter().filter(|same| **same).count();
        differs += same.iter().filter(|same| !**same).count();
    }
    (differs >= FEWEST_DIFFER && differs > agrees).then_some((differs, agrees))
}

/// True if two sizes differ only by rounding, up to 0.01 mm.
fn is_one_size(own: Length, other: Length) -> bool {
    (own - other).abs().nm() <= 10_000
}

/// True if the file declares all its holes unplated: by attributes, by sections or by name.
fn unplated(grounds: &Grounds<'_>) -> bool {
    let &Grounds { name, text, survey, table, sensed, .. } = grounds;
    if let Some(plated) = survey.file_plated {
        return !plated;
    }
    let text = sample(text).unwrap_or_default();
    let read = excellon::read(&Task { name, text, reading: sensed.reading, survey, table });
    let tools = read.map_or_else(|_| Vec::new(), |(drill, _)| drill.tools);
    if tools.iter().any(|tool| tool.plated.is_some()) {
        return tools.iter().all(|tool| tool.plated == Some(false));
    }
    plated_by_name(name) == Some(false)
}

struct Choice {
    reading: Reading,
    evidence: Evidence,
    /// The copper supports this reading, and no other one equally.
    confirmed: bool,
    /// Severity, code, and the other reading that the message is about.
    said: Vec<(Severity, &'static str, Option<Reading>)>,
    /// Results of the second look at its holes.
    seen: Vec<Diagnostic>,
}

/// Chooses a reading. Keeps what statements settle; for the rest, the copper decides if it supports a
/// reading, else the outline, else the default. Anything else than the default gets a warning.
fn choose(grounds: &Grounds<'_>, ranking: Option<&[Ranked]>) -> Choice {
    let sensed = grounds.sensed;
    let mut choice = Choice {
        reading: sensed.reading,
        evidence: Evidence::plain(sensed.weakest()),
        confirmed: false,
        said: Vec::new(),
        seen: Vec::new(),
    };
    let Some(ranking) = ranking else { return choice };
    // `rank` lists only the first of several readings with the same holes, and the sensed one is first.
    let Some(own) = ranking.iter().find(|ranked| ranked.reading == sensed.reading) else { return choice };
    let voting: Vec<&Ranked> = ranking.iter().filter(|ranked| grounds.copper_votes(ranked)).collect();
    let unsettled = !Sensed::stated(sensed.weakest());
    let own_votes = voting.iter().any(|ranked| ranked.reading == own.reading);
    let best = voting.iter().copied().find(|ranked| ranked.allowed);
    let best = best.filter(|best| !own_votes || best.fit.share >= own.fit.share + CLOSE_SHARE);
    let over_report = over_report(own, &voting);
    let chosen = over_report.or(best).unwrap_or(own);
    let speaks = own_votes || chosen.reading != own.reading;
    // An equally good reading counts in any size, because foreign copper on a grid fits many scales.
    let as_good = ranking.iter().find(|ranked| {
        ranked.allowed
            && ranked.possible
            && speaks
            && ranked.reading != chosen.reading
            && ranked.fit.share > chosen.fit.share - CLOSE_SHARE
    });
    let by_outline = if speaks { None } else { by_outline(grounds, own, ranking) };
    let chosen = by_outline.filter(|ranked| ranked.allowed && unsettled).unwrap_or(chosen);
    choice.reading = chosen.reading;
    choice.confirmed = speaks && as_good.is_none();
    if (unsettled || over_report.is_some()) && choice.confirmed {
        choice.evidence.source = Source::Copper;
    }
    if grounds.copper.is_some() {
        let rival = ranking.iter().find(|ranked| ranked.reading != chosen.reading);
        choice.evidence.score = Some(chosen.fit.share);
        choice.evidence.runner_up = rival.map(|rival| rival.fit.share);
        choice.evidence.runner_up_reading = rival.map(|rival| shown(&rival.reading));
        choice.evidence.runner_up_holes = rival.map(some_holes).unwrap_or_default();
        look_again(grounds, chosen, &mut choice);
    }
    let score = choice.evidence.score.unwrap_or_default();
    let better = voting
        .iter()
        .find(|rival| rival.reading != chosen.reading && rival.fit.share >= score + MUCH_BETTER_SHARE);
    choice.said.extend(
        better.map(|rival| (Severity::Warning, code!("drill.copper_disagrees"), Some(rival.reading))),
    );
    let as_good = as_good.filter(|_| unsettled);
    choice.said.extend(
        as_good.map(|rival| (Severity::Warning, code!("drill.copper_undecided"), Some(rival.reading))),
    );
    if let Some(other) = by_outline {
        let taken = chosen.reading == other.reading;
        let code = if taken { code!("drill.read_by_outline") } else { code!("drill.outline_disagrees") };
        let about = if taken { own } else { other };
        choice.said.push((Severity::Warning, code, Some(about.reading)));
    } else if chosen.reading != own.reading {
        let code = if over_report.is_some() {
            code!("drill.copper_over_report")
        } else {
            code!("drill.against_custom")
        };
        choice.said.push((Severity::Warning, code, Some(own.reading)));
    } else if choice.evidence.source == Source::Copper {
        choice.said.push((Severity::Note, code!("drill.read_by_copper"), None));
    }
    choice
}

/// A reading that only a report contradicts, with nearly all holes on copper, when the report's reading isn't
/// supported: then the report is for another board.
fn over_report<'a>(own: &Ranked, voting: &[&'a Ranked]) -> Option<&'a Ranked> {
    let best = voting.first().copied()?;
    let allowed = voting.iter().any(|ranked| ranked.allowed || ranked.reading == own.reading);
    (!allowed && best.own_words && best.fit.share >= NEARLY_ALL_SHARE).then_some(best)
}

/// Checks shift and mirroring of the chosen holes, if they can belong to the copper.
fn look_again(grounds: &Grounds<'_>, chosen: &Ranked, choice: &mut Choice) {
    let Some(copper) = grounds.copper.filter(|_| !grounds.unplated) else { return };
    if !chosen.as_large {
        if chosen.fit.share < FITS_SHARE && chosen.holes.len() >= MANY {
            choice.said.push((Severity::Warning, code!("drill.copper_of_another_size"), None));
        }
        return;
    }
    let Look { fit, warnings } = look(copper, &chosen.holes, &chosen.tools, chosen.fit);
    choice.seen = warnings;
    choice.evidence.score = Some(fit.share);
    choice.evidence.shift_mm = (fit.shift_mm != (0.0, 0.0)).then_some(fit.shift_mm);
}

/// A reading that fits the outline, if the sensed one is too large or too small for it.
fn by_outline<'a>(grounds: &Grounds<'_>, own: &Ranked, ranking: &'a [Ranked]) -> Option<&'a Ranked> {
    let outline = grounds.outline_of(own).filter(|outline| !same_size(own.bounds, *outline))?;
    let within = |ranked: &&Ranked| ranked.possible && same_place(ranked.bounds, outline);
    let allowed = ranking.iter().find(|ranked| ranked.allowed && within(ranked));
    allowed.or_else(|| ranking.iter().find(within))
}

fn some_holes(ranked: &Ranked) -> Vec<Point> {
    let every = ranked.holes.len().div_ceil(MOST_SHOWN).max(1);
    ranked.holes.iter().step_by(every).copied().collect()
}

/// A displayed reading: `inch 2.4 leading`.
fn shown(reading: &Reading) -> String {
    let Reading { units, digits, zeros } = reading;
    match zeros {
        Zeros::Decimal => format!("{} decimal", units.name()),
        _ => format!("{} {}.{} {}", units.name(), digits.integer, digits.decimal, zeros.name()),
    }
}

fn warnings(
    name: &str,
    sensed: &Sensed,
    choice: &Choice,
    survey: &Survey,
    has_hits: bool,
) -> Vec<Diagnostic> {
    let mut out = Vec::new();
    let mut say = |severity, code: &str, other: Option<&Reading>| {
        let diagnostic =
            Diagnostic::new(severity, code).at(name, 0, 0).with("reading", shown(&choice.reading));
        let other = other.map_or(String::new(), shown);
        let score = choice.evidence.score.map_or(String::new(), |score| format!("{:.0} %", score * 100.0));
        out.push(diagnostic.with("other", other).with("score", score));
    };
    if sensed.companion_disagrees {
        say(Severity::Warning, code!("drill.companion_disagrees"), None);
    }
    for (severity, code, other) in &choice.said {
        say(*severity, code, other.as_ref());
    }
    if choice.evidence.shift_mm.is_some() {
        say(Severity::Note, code!("drill.shifted_from_copper"), None);
    }
    let custom = Reading { digits: customary(choice.reading.units), ..choice.reading };
    let by_report = sensed.digits == Source::Companion && choice.reading == sensed.reading;
    let decimal = choice.reading.zeros == Zeros::Decimal;
    if by_report && !decimal && !choice.confirmed && choice.reading != custom {
        // If all numbers have exactly the digits of the report, that confirms it.
        if !survey.shape.is_full(choice.reading.digits) {
            say(Severity::Warning, code!("drill.report_against_custom"), Some(&custom));
        }
    }
    if choice.evidence.source == Source::Copper || !has_hits {
        return out;
    }
    match sensed.units {
        Source::Default => say(Severity::Error, code!("drill.units_unknown"), None),
        Source::Shape => say(Severity::Warning, code!("drill.units_by_sizes"), None),
        _ => {}
    }
    if !decimal {
        match sensed.weakest() {
            Source::Default => say(Severity::Warning, code!("drill.format_by_custom"), None),
            Source::Shape => say(Severity::Note, code!("drill.format_by_shape"), None),
            _ => {}
        }
    } else if survey.shape.points_missing() {
        say(Severity::Warning, code!("drill.points_missing"), None);
    }
    out
}

fn disagreements(name: &str, drill: &DrillFile, companion: &Companion) -> Vec<Diagnostic> {
    let mut out = Vec::new();
    for (tool, counts) in drill.tools.iter().zip(drill.counts()) {
        let rows = companion.tool(tool.code, name);
        let holes = counts.hits + counts.slots + counts.routed_paths;
        let said = |code: &str, found: String, promised: String| {
            let diagnostic =
                Diagnostic::warning(code).at(name, tool.line, 1).with("tool", format!("T{}", tool.code));
            diagnostic.with("found", found).with("promised", promised)
        };
        // A report on several files has several rows per tool: one of them must match.
        let promised: Vec<u32> = rows.iter().filter_map(|row| row.holes).collect();
        if let Some(first) = promised.first().filter(|_| holes > 0 && !promised.contains(&holes)) {
            out.push(said(code!("drill.report_counts_differ"), holes.to_string(), first.to_string()));
        }
        let sizes: Vec<Length> = rows.iter().filter_map(|row| row.diameter).collect();
        if let (Some(own), Some(&other)) = (tool.diameter, sizes.first())
            && !sizes.iter().any(|&size| is_one_size(own, size))
        {
            let mm = |length: Length| format!("{:.3}", length.mm());
            out.push(said(code!("drill.report_sizes_differ"), mm(own), mm(other)));
        }
    }
    out
}
