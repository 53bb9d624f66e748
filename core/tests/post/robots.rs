//! Readers of the robots' languages KRL, RAPID and TP. Rapid moves are those at 100 mm/s, the speed of the
//! shipped files.

use super::seen::{By, Seen};
use std::collections::BTreeMap;

/// Speed of a rapid move in mm/min.
const QUICK: f64 = 6_000.0;

fn number(text: &str) -> Result<f64, String> {
    text.trim().parse().map_err(|_| format!("{text:?} is no number"))
}

fn between<'a>(text: &'a str, open: &str, close: &str) -> Result<&'a str, String> {
    let behind = text.strip_prefix(open).ok_or_else(|| format!("{text:?} does not begin with {open}"))?;
    behind.strip_suffix(close).ok_or_else(|| format!("{text:?} does not end with {close}"))
}

fn moved(to: [f64; 3], feed: f64) -> Seen {
    Seen::Move { to, feed: (feed != QUICK).then_some(feed) }
}

/// Parses `X 1.0, Y 2.0, Z 3.0, A 0, B 0, C 180`.
fn frame(text: &str) -> Result<[f64; 3], String> {
    let rows: Vec<&str> = text.split(',').map(str::trim).collect();
    let [x, y, z, "A 0", "B 0", "C 180"] = rows[..] else { return Err(format!("the frame {text:?}")) };
    Ok([number(between(x, "X ", "")?)?, number(between(y, "Y ", "")?)?, number(between(z, "Z ", "")?)?])
}

pub(crate) fn krl(text: &str, name: &str) -> Result<Vec<Seen>, String> {
    let mut seen = Vec::new();
    let mut speed = None;
    let mut lines = text.lines();
    if lines.next() != Some("&ACCESS RVP") || lines.next() != Some(format!("DEF {name}( )").as_str()) {
        return Err("another beginning".to_owned());
    }
    let (mut ready, mut started) = (false, false);
    for line in lines {
        let feed = || speed.ok_or_else(|| "no $VEL.CP".to_owned());
        let argument = |call: &str| between(line, call, ")").ok();
        match line {
            "END" => return Ok(seen),
            "$BASE = BASE_DATA[1]" | "$TOOL = TOOL_DATA[1]" | "HALT" => {}
            // Speeds, accelerations and advance, which the controller needs before it may move.
            "BAS(#INITMOV,0)" => ready = true,
            "PTP $AXIS_ACT" if !ready => return Err("a move before BAS(#INITMOV,0)".to_owned()),
            "PTP $AXIS_ACT" => started = true,
            _ if line.starts_with(';') => {}
            _ if !started && !line.starts_with("$VEL.CP = ") => {
                return Err(format!("{line:?} before the first move"));
            }
            _ if line.starts_with("$VEL.CP = ") => {
                speed = Some(libm::round(number(&line["$VEL.CP = ".len()..])? * 6e10) / 1e6);
            }
            _ if line.starts_with("WAIT SEC ") => seen.push(Seen::Wait(number(&line["WAIT SEC ".len()..])?)),
            _ if line.starts_with("LIN ") => seen.push(moved(frame(between(line, "LIN {", "}")?)?, feed()?)),
            _ if line.starts_with("CIRC ") => {
                let (middle, to) = between(line, "CIRC {", "}")?.split_once("}, {").ok_or("two points")?;
                seen.push(Seen::Arc { to: frame(to)?, by: By::Through(frame(middle)?), feed: feed()? });
            }
            _ => match (argument("SPINDLE("), argument("BIT(")) {
                (Some(rpm), _) => seen.push(Seen::Spindle(number(rpm)?)),
                (_, Some(bit)) => seen.push(Seen::Bit(number(bit)? as u32)),
                _ => return Err(format!("{line:?} is not known")),
            },
        }
    }
    Err("no END".to_owned())
}

/// Parses `[1,2,3],down,free,none`.
fn target(text: &str) -> Result<[f64; 3], String> {
    let place = between(text, "[", "],down,free,none")?;
    let rows: Vec<f64> = place.split(',').map(number).collect::<Result<_, _>>()?;
    rows.try_into().map_err(|rows| format!("{rows:?}"))
}

pub(crate) fn rapid(text: &str, name: &str) -> Result<Vec<Seen>, String> {
    let body = between(text, &format!("MODULE {name}\n"), "ENDMODULE\n")?;
    let (_, main) = body.split_once("  PROC main()\n").ok_or("no main")?;
    let (main, _) = main.split_once("  ENDPROC\n").ok_or("no end of main")?;
    let mut seen = Vec::new();
    for line in main.lines().map(str::trim) {
        let statement = line.strip_suffix(';').ok_or_else(|| format!("{line:?} has no end"))?;
        let (verb, rest) = statement.split_once(' ').unwrap_or((statement, ""));
        match verb {
            "ConfL" | "TPWrite" | "Stop" => {}
            "spindle" => seen.push(Seen::Spindle(number(rest)?)),
            "bit" => seen.push(Seen::Bit(number(rest)? as u32)),
            "WaitTime" => seen.push(Seen::Wait(number(rest)?)),
            "MoveL" | "MoveC" => {
                let rest = between(rest, "[", ",fine,pcb_tool\\WObj:=pcb_board")?;
                let (points, speed) = rest
                    .rsplit_once("],")
                    .filter(|(_, last)| *last == "quick")
                    .map_or_else(|| rest.rsplit_once("],[").ok_or("no speed"), Ok)?;
                let feed = match speed {
                    "quick" => QUICK,
                    _ => number(between(speed, "", ",100,100,100]")?)? * 60.0,
                };
                match points.split_once("],[") {
                    // Each position has separate brackets, so `],[` only separates targets.
                    Some((middle, to)) if verb == "MoveC" => {
                        let by = By::Through(target(middle)?);
                        seen.push(Seen::Arc { to: target(to)?, by, feed });
                    }
                    None if verb == "MoveL" => seen.push(moved(target(points)?, feed)),
                    _ => return Err(format!("{line:?}")),
                }
            }
            _ => return Err(format!("{line:?} is not known")),
        }
    }
    Ok(seen)
}

fn points(text: &str) -> Result<BTreeMap<u32, [f64; 3]>, String> {
    let mut out = BTreeMap::new();
    for point in text.split("};").map(str::trim).filter(|point| !point.is_empty()) {
        let (name, body) = point.split_once('{').ok_or("no point")?;
        let index = number(between(name, "P[", "]")?)? as u32;
        let value = |axis: &str| -> Result<f64, String> {
            let (_, behind) = body
                .split_once(&format!("\t{axis} = "))
                .or_else(|| body.split_once(&format!(" {axis} = ")))
                .ok_or("an axis")?;
            number(behind.split_whitespace().next().unwrap_or_default())
        };
        if !body.contains("GP1:") || !body.contains("UF : 1, UT : 1") || value("W")? != 180.0 {
            return Err(format!("{point:?}"));
        }
        if out.insert(index, [value("X")?, value("Y")?, value("Z")?]).is_some() {
            return Err(format!("P[{index}] twice"));
        }
    }
    Ok(out)
}

pub(crate) fn tp(text: &str, name: &str) -> Result<Vec<Seen>, String> {
    let head = between(text, &format!("/PROG  {name}\n"), "/END\n")?;
    let (_, behind) = head.split_once("/MN\n").ok_or("no /MN")?;
    let (lines, last) = behind.split_once("/POS\n").ok_or("no /POS")?;
    let places = points(last)?;
    let at = |text: &str| -> Result<[f64; 3], String> {
        let index = number(between(text, "P[", "]")?)? as u32;
        places.get(&index).copied().ok_or_else(|| format!("no P[{index}]"))
    };
    let mut seen = Vec::new();
    let mut rpm = 0.0;
    let mut used = 0;
    // The second line of a circle has no number.
    for (index, line) in lines.replace("\n    :", "").lines().enumerate() {
        let (count, statement) = line.split_once(':').ok_or("no number")?;
        if count != (index + 1).to_string() {
            return Err(format!("line {} is numbered {count}", index + 1));
        }
        let statement = statement.strip_suffix(" ;").ok_or("no end")?.trim();
        let words: Vec<&str> = statement.split_whitespace().collect();
        match words[..] {
            ["L", point, speed, "FINE"] => {
                used += 1;
                seen.push(moved(at(point)?, number(between(speed, "", "mm/sec")?)? * 60.0));
            }
            ["C", middle, to, speed, "FINE"] => {
                used += 2;
                let feed = number(between(speed, "", "mm/sec")?)? * 60.0;
                seen.push(Seen::Arc { to: at(to)?, by: By::Through(at(middle)?), feed });
            }
            ["WAIT", time] => seen.push(Seen::Wait(number(between(time, "", "(sec)")?)?)),
            ["DO[1]=ON"] => seen.push(Seen::Spindle(rpm)),
            ["DO[1]=OFF"] => seen.push(Seen::Spindle(0.0)),
            ["UFRAME_NUM=1"] | ["UTOOL_NUM=1"] | ["PAUSE"] => {}
            [comment, ..] if comment.starts_with('!') => {}
            [word] if word.starts_with("GO[1]=") => rpm = number(&word[6..])?,
            [word] if word.starts_with("R[1]=") => seen.push(Seen::Bit(number(&word[5..])? as u32)),
            _ => return Err(format!("{line:?} is not known")),
        }
    }
    if used == places.len() { Ok(seen) } else { Err(format!("{used} of {} points are used", places.len())) }
}
