//! Settles how a drill program is read, by words where there are any and by evidence where not.
//!
//! Comes in: the text of a program and what lies beside it. Goes out: the file, read, with the ground of its reading, and a
//! remark for every doubt. Does not read the words itself.
//!
//! ```text
//! survey ─ sense ─▶ what words settle
//! every reading ─▶ its holes (a sample) ─▶ share on copper ─▶ best allowed, best other
//! ```

use super::drill::DrillFile;
use super::excellon::{self, Sensed, Survey, Task, ToolTable, customary};
use super::measure::oddity;
use super::number::Reading;
use super::read::{FileRead, Neighbours, drill_program, plated_by_name};
use super::registration::{Copper, FITS, Fit, SAMPLE, every};
use super::second_look::{Look, look};
use super::text::front;
use super::{Digits, Evidence, Overrides, Source, Units, Zeros, tool_units};
use crate::geometry::Point;
use crate::remark::{Remark, Weight};

/// Bytes of a program that are read under every reading.
const SAMPLED_BYTES: usize = 96 * 1024;
/// Readings closer than this cannot be told apart by copper.
const CLOSE: f64 = 0.10;
/// A reading that is this much better than what words say makes words doubtful.
const MUCH_BETTER: f64 = 0.30;
/// Below this, copper says nothing: it may belong to another board.
const SAYS_NOTHING: f64 = 0.30;

/// Reads a drill program. The error is the remark why nothing of it is kept.
pub(super) fn program(
    name: &str,
    text: &[u8],
    neighbours: &Neighbours<'_>,
    person: &Overrides,
) -> Result<FileRead, Remark> {
    let survey = excellon::survey(text);
    let (stated, table, beside) = companions(name, &survey, neighbours);
    let sensed = excellon::sense(&survey, &stated, person);
    let mut grounds = Grounds {
        name,
        text,
        survey: &survey,
        table: &table,
        sensed: &sensed,
        unplated: false,
        copper: neighbours.copper,
    };
    grounds.unplated = neighbours.copper.is_some() && unplated(&grounds);
    let ranking = grounds.copper.and_then(|copper| rank(&grounds, copper));
    let mut choice = choose(&grounds, ranking.as_deref());
    let task = Task { name, text, reading: choice.reading, survey: &survey, table: &table };
    let on_copper = choice.evidence.score.is_some_and(|score| score >= FITS);
    let (mut drill, mut remarks);
    (choice.reading, drill, remarks) = if on_copper {
        let (drill, remarks) = excellon::read(&task)?;
        (choice.reading, drill, remarks)
    } else {
        measured(task, &sensed)?
    };
    let reading = choice.reading;

    let mut file = drill_program(name);
    let decimal = reading.zeros == Zeros::Decimal;
    file.units = Some(reading.units);
    file.number_format = (!decimal).then_some(reading.digits);
    file.zeros = Some(reading.zeros);
    file.plated = survey.file_plated;
    file.generator = survey.generator.clone();
    remarks.extend(doubts(name, &sensed, &choice, &survey, !drill.hits.is_empty()));
    let units = tool_units::settle(&mut drill, reading.units, &survey.sizes);
    remarks.extend(units.map(|doubt| doubt.at(name, 0, 0)));
    remarks.extend(choice.seen.into_iter().map(|doubt| doubt.at(name, 0, 0)));
    remarks.extend(beside.iter().flat_map(|companion| disagreements(name, &drill, companion)));
    file.evidence = Some(choice.evidence);
    for tool in drill.tools.iter_mut().filter(|tool| tool.plated.is_none()) {
        tool.plated = survey.file_plated;
    }
    file.drill = Some(drill);
    file.remarks = remarks;
    Ok(file)
}

/// Reads as `task` says; or, where that can hardly be a board, under a reading that is one and differs only in what nothing
/// speaks for.
fn measured(mut task: Task<'_>, sensed: &Sensed) -> Result<(Reading, DrillFile, Vec<Remark>), Remark> {
    let (mut drill, mut remarks) = excellon::read(&task)?;
    let Some(mut code) = oddity(&drill) else { return Ok((task.reading, drill, remarks)) };
    let first = task.reading;
    let open = |source| source == Source::Default;
    let guessed = open(sensed.weakest());
    if guessed {
        let makes_a_board = |(drill, remarks): &(DrillFile, Vec<Remark>)| {
            oddity(drill).is_none() && !remarks.iter().any(|remark| remark.code == "drill.out_of_range")
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
            ((drill, remarks), task.reading, code) = (read, reading, "drill.read_by_measure");
        }
    }
    let weight = if guessed { Weight::Loss } else { Weight::Doubt };
    let size = drill.centre_bounds().map_or(String::new(), |bounds| {
        format!("{:.1} × {:.1} mm", (bounds.max.x - bounds.min.x).mm(), (bounds.max.y - bounds.min.y).mm())
    });
    let remark = Remark::new(weight, code).at(task.name, 0, 0).with("reading", shown(&task.reading));
    remarks.push(remark.with("other", shown(&first)).with("size", size));
    Ok((task.reading, drill, remarks))
}

/// What companions that speak of this file say about numbers and tools.
fn companions<'a>(
    name: &str,
    survey: &Survey,
    neighbours: &Neighbours<'a>,
) -> (excellon::Stated, ToolTable, Vec<&'a super::companion::Companion>) {
    let mut stated = excellon::Stated::default();
    let mut table = ToolTable::new();
    let mut beside = Vec::new();
    for (own, text, companion) in &neighbours.companions {
        if companion.speaks_of(own, text, name, survey.routes) {
            stated.units = stated.units.or(companion.stated.units);
            stated.digits = stated.digits.or(companion.stated.digits);
            stated.zeros = stated.zeros.or(companion.stated.zeros);
            for (&code, row) in &companion.tools {
                let entry = table.entry(code).or_insert((row.diameter, row.plated));
                entry.0 = entry.0.or(row.diameter);
            }
            beside.push(*companion);
        }
    }
    (stated, table, beside)
}

/// Whole lines from the front of a program.
fn sample(text: &[u8]) -> Option<&[u8]> {
    let text = front(text, SAMPLED_BYTES);
    let end = text.iter().rposition(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(text.len());
    text.get(..end)
}

/// A reading and how its holes fit.
struct Ranked {
    reading: Reading,
    fit: Fit,
    holes: Vec<Point>,
    /// Which tools drill those that are single holes.
    tools: Vec<Option<u16>>,
    /// Whether it agrees with every part that words settle.
    allowed: bool,
}

/// What the choice of a reading goes by, copper apart.
struct Grounds<'a> {
    name: &'a str,
    text: &'a [u8],
    survey: &'a Survey,
    table: &'a ToolTable,
    sensed: &'a Sensed,
    /// The file says that none of its holes is plated: they need not lie on copper.
    unplated: bool,
    copper: Option<&'a Copper>,
}

/// Whether the file says, by an attribute, by its sections or by its name, that none of its holes is plated.
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

/// Fits of all readings, best first; readings that give the same holes stand once. None if there are no holes.
fn rank(grounds: &Grounds<'_>, copper: &Copper) -> Option<Vec<Ranked>> {
    let &Grounds { name, survey, table, sensed, unplated, .. } = grounds;
    let text = sample(grounds.text)?;
    let mut all: Vec<Ranked> = Vec::new();
    for reading in readings(sensed) {
        let Ok((drill, _)) = excellon::read(&Task { name, text, reading, survey, table }) else { continue };
        // Single holes come first.
        let single = drill.hits.len();
        let centres: Vec<(Point, Option<u16>)> = (0..)
            .zip(drill.centres())
            .map(|(at, (point, tool))| (point, (at < single).then_some(tool)))
            .collect();
        let (holes, tools): (Vec<Point>, Vec<Option<u16>>) =
            every(centres.iter().copied(), centres.len(), SAMPLE).unzip();
        if holes.len() < 3 || all.iter().any(|other| other.holes == holes) {
            continue;
        }
        let allowed = agrees(&reading, sensed, Sensed::stated);
        all.push(Ranked { reading, fit: copper.fit(&holes), holes, tools, allowed });
    }
    // Holes that need no copper fit somewhere by chance.
    if !unplated && all.iter().all(|ranked| ranked.fit.share < FITS) {
        for ranked in &mut all {
            let shifted = copper.fit_shifted(&ranked.holes);
            if shifted.share >= FITS {
                ranked.fit = shifted;
            }
        }
    }
    // The order of `readings` is custom; a stable sort keeps it among equals.
    all.sort_by(|a, b| b.fit.share.total_cmp(&a.fit.share));
    (!all.is_empty()).then_some(all)
}

/// Whether the reading is the sensed one in every part that is settled by its ground.
fn agrees(reading: &Reading, sensed: &Sensed, settled: impl Fn(Source) -> bool) -> bool {
    let (own, decimal) = (&sensed.reading, sensed.reading.zeros == Zeros::Decimal);
    let units = !settled(sensed.units) || reading.units == own.units;
    let digits = decimal || !settled(sensed.digits) || reading.digits == own.digits;
    let zeros = decimal || !settled(sensed.zeros) || reading.zeros == own.zeros;
    units && digits && zeros
}

/// Every plausible reading, the sensed one first.
fn readings(sensed: &Sensed) -> Vec<Reading> {
    const MM: [(u8, u8); 5] = [(3, 3), (4, 2), (3, 2), (4, 4), (4, 3)];
    const INCH: [(u8, u8); 5] = [(2, 4), (2, 3), (3, 5), (2, 5), (3, 3)];
    let mut all = vec![sensed.reading];
    let zeros = match sensed.reading.zeros {
        Zeros::Decimal => vec![Zeros::Decimal],
        Zeros::Trailing => vec![Zeros::Trailing, Zeros::Leading],
        own => vec![own, Zeros::Trailing],
    };
    for (units, formats) in [(Units::Inch, INCH), (Units::Mm, MM)] {
        let formats = formats.map(|(integer, decimal)| Digits { integer, decimal });
        for digits in [sensed.reading.digits, customary(units)].into_iter().chain(formats) {
            all.extend(zeros.iter().map(|&zeros| Reading { units, digits, zeros }));
        }
    }
    all
}

/// What is decided, and how sure.
struct Choice {
    reading: Reading,
    evidence: Evidence,
    /// A reading that words exclude and copper likes much better.
    better: Option<Reading>,
    /// Another reading that words allow and copper likes as well.
    as_good: Option<Reading>,
    /// What a second look at its holes says.
    seen: Vec<Remark>,
}

fn choose(grounds: &Grounds<'_>, ranking: Option<&[Ranked]>) -> Choice {
    let sensed = grounds.sensed;
    let plain = |score| Choice {
        reading: sensed.reading,
        evidence: Evidence {
            source: sensed.weakest(),
            score,
            runner_up: None,
            runner_up_reading: None,
            shift_mm: None,
        },
        better: None,
        as_good: None,
        seen: Vec::new(),
    };
    let Some(ranking) = ranking else { return plain(None) };
    // Readings with the same holes stand once, under whichever came first: the sensed one does.
    let Some(best) = ranking.iter().find(|ranked| ranked.allowed) else { return plain(None) };
    let own = ranking.iter().find(|ranked| ranked.reading == sensed.reading).unwrap_or(best);
    let copper_decides = best.fit.share >= SAYS_NOTHING && best.fit.share >= own.fit.share + CLOSE;
    let chosen = if copper_decides { best } else { own };
    let share = chosen.fit.share;
    let rival = ranking.iter().find(|ranked| ranked.reading != chosen.reading);
    let unsettled = !Sensed::stated(sensed.weakest());
    let speaks = share >= SAYS_NOTHING;
    let as_good = ranking.iter().find(|ranked| {
        ranked.allowed && ranked.reading != chosen.reading && speaks && ranked.fit.share > share - CLOSE
    });
    let source = if unsettled && speaks && as_good.is_none() { Source::Copper } else { sensed.weakest() };
    let again = grounds.copper.filter(|_| !grounds.unplated);
    let again = again.map(|copper| look(copper, &chosen.holes, &chosen.tools, chosen.fit));
    let Look { fit, doubts } = again.unwrap_or_else(|| Look { fit: chosen.fit, doubts: Vec::new() });
    let better = rival.filter(|rival| rival.fit.share >= fit.share + MUCH_BETTER).map(|rival| rival.reading);
    let better = better.filter(|_| unsettled || !grounds.unplated);
    let moved = fit.shift_mm != (0.0, 0.0);
    Choice {
        reading: chosen.reading,
        evidence: Evidence {
            source,
            score: Some(fit.share),
            runner_up: rival.map(|rival| rival.fit.share),
            runner_up_reading: rival.map(|rival| shown(&rival.reading)),
            shift_mm: moved.then_some(fit.shift_mm),
        },
        better,
        as_good: as_good.filter(|_| unsettled).map(|ranked| ranked.reading),
        seen: doubts,
    }
}

/// A reading for people: `inch 2.4 leading`.
fn shown(reading: &Reading) -> String {
    let Reading { units, digits, zeros } = reading;
    match zeros {
        Zeros::Decimal => format!("{} decimal", units.name()),
        _ => format!("{} {}.{} {}", units.name(), digits.integer, digits.decimal, zeros.name()),
    }
}

/// What remains doubtful about the numbers.
fn doubts(name: &str, sensed: &Sensed, choice: &Choice, survey: &Survey, has_hits: bool) -> Vec<Remark> {
    let mut out = Vec::new();
    let mut say = |weight, code: &str, other: Option<&Reading>| {
        let remark = Remark::new(weight, code).at(name, 0, 0).with("reading", shown(&choice.reading));
        let other = other.map_or(String::new(), shown);
        let score = choice.evidence.score.map_or(String::new(), |score| format!("{:.0} %", score * 100.0));
        out.push(remark.with("other", other).with("score", score));
    };
    if sensed.companion_disagrees {
        say(Weight::Doubt, "drill.companion_disagrees", None);
    }
    if let Some(better) = &choice.better {
        say(Weight::Doubt, "drill.copper_disagrees", Some(better));
    }
    let by_copper = choice.evidence.source == Source::Copper;
    if let Some(other) = &choice.as_good {
        say(Weight::Doubt, "drill.copper_undecided", Some(other));
    } else if by_copper {
        say(Weight::Note, "drill.read_by_copper", None);
    }
    if choice.evidence.shift_mm.is_some() {
        say(Weight::Note, "drill.shifted_from_copper", None);
    }
    if by_copper || !has_hits {
        return out;
    }
    match sensed.units {
        Source::Default => say(Weight::Loss, "drill.units_unknown", None),
        Source::Shape => say(Weight::Doubt, "drill.units_by_sizes", None),
        _ => {}
    }
    if choice.reading.zeros != Zeros::Decimal {
        match sensed.weakest() {
            Source::Default => say(Weight::Doubt, "drill.format_by_custom", None),
            Source::Shape => say(Weight::Note, "drill.format_by_shape", None),
            _ => {}
        }
    } else if survey.shape.with_point < survey.shape.numbers {
        say(Weight::Doubt, "drill.points_missing", None);
    }
    out
}

/// Where a report counts or measures otherwise than the file.
fn disagreements(name: &str, drill: &DrillFile, companion: &super::companion::Companion) -> Vec<Remark> {
    let mut out = Vec::new();
    for (tool, counts) in drill.tools.iter().zip(drill.counts()) {
        let Some(row) = companion.tools.get(&tool.code) else { continue };
        let holes = counts.hits + counts.slots + counts.routed_paths;
        let said = |code: &str, found: String, promised: String| {
            let remark = Remark::new(Weight::Doubt, code)
                .at(name, tool.line, 1)
                .with("tool", format!("T{}", tool.code));
            remark.with("found", found).with("promised", promised)
        };
        if let Some(promised) = row.holes.filter(|&promised| promised != holes && holes > 0) {
            out.push(said("drill.report_counts_differ", holes.to_string(), promised.to_string()));
        }
        if let (Some(own), Some(other)) = (tool.diameter, row.diameter)
            && (own - other).abs().nm() > 10_000
        {
            let mm = |length: crate::units::Length| format!("{:.3}", length.mm());
            out.push(said("drill.report_sizes_differ", mm(own), mm(other)));
        }
    }
    out
}
