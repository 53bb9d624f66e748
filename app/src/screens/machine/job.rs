//! The job in work: how far, which hole, which stage, how long, and the controls that go with it.
//!
//! Comes in: the latest status. Goes out: Start… (opens the pre-flight), Pause, Resume, Stop after hole.

use super::{controller, ended, spindles, words};
use crate::format::duration;
use crate::i18n::{key, language, say, sentence, t};
use crate::keys::Tab;
use crate::model::{FrameEvent, StartEvent, Unseen, job_board};
use crate::page::link::{self, Link};
use crate::page::send;
use crate::page::{frame, open_board, open_job};
use crate::parts::{self, WorkCount, WorkPart};
use crate::screens::{shown, top_bar, welcome};
use crate::widgets::{fact, menu_word, push, push_if};
use annulus_core::control::State;
use annulus_core::job::Program;
use annulus_core::machine::ToolWear;
use annulus_core::motion::drill_cycles;
use annulus_core::wire::{Ask, Status};
use leptos::ev;
use leptos::html::{self, div, dl, h2, header, label, p, section, select, span, strong};
use leptos::prelude::*;

fn from<T: Default>(line: Link, get: impl FnOnce(&Status) -> T) -> T {
    line.status.with(|status| status.as_ref().map(|status| get(status)).unwrap_or_default())
}

/// The whole column.
pub(crate) fn job() -> impl IntoView {
    let line = link::link();
    let broken_off =
        Memo::new(move |_| line.interrupted.with(|one| one.as_ref().map(|one| one.name.clone())));
    let name = move || {
        let running = from(line, |status| status.job_name.clone());
        let planned = open_board().job.with(|job| job.as_ref().map(|job| job.program.name.clone()));
        running.or(planned).or_else(|| broken_off.get()).unwrap_or_else(|| say!("page.job.none"))
    };
    section().class("block").attr("aria-label", t!("page.job.title")).child((
        header().child(h2().child(name)),
        to_restore(line, broken_off),
        progress(line),
        stages(line),
        controls(line),
        facts(line),
        spindles::spindles(),
    ))
}

/// While no board is open: the one that the page had before it was loaded again, to be restored right here.
fn to_restore(line: Link, broken_off: Memo<Option<String>>) -> impl IntoView {
    let offer = Memo::new(move |_| {
        let is_free = open_board().document.with(Option::is_none)
            && open_board().task.with(Option::is_none)
            && from(line, |status| status.job.clone()).is_none();
        let found = |name: &Option<String>| {
            open_board().offers.with(|offers| job_board::to_restore(name.as_deref(), offers).cloned())
        };
        broken_off.with(found).filter(|_| is_free)
    });
    move || offer.get().map(|offer| welcome::kept(offer, Some("status")))
}

/// Holes and toolpaths of the job on show. Of a board that is not as programmed the holes are those that are where they should be, and
/// those that were to be made; the second says whether that is so.
fn counted(line: Link) -> Memo<(WorkCount, bool)> {
    let count = |program: &Program| (program.hole_count() as u32, program.toolpath_count() as u32);
    let planned = move || {
        let shown = link::link().shown_job;
        shown.with(|job| job.as_ref().map_or((0, 0), |job| count(&job.program)))
    };
    let there = Memo::new(move |_| {
        let told = ended::differs(line)?;
        let run = line.ended.with(|ended| ended.as_ref().map(|ended| ended.holes_done));
        let run = run.unwrap_or_else(|| planned().0);
        if run == 0 {
            return None;
        }
        Some((run.saturating_sub(told.missing.saturating_add(told.shifted)), run))
    });
    // By what the machine tells; once the job ended, by what it made.
    Memo::new(move |_| {
        let told = from(line, |status| WorkCount {
            holes: (status.holes_done, status.holes_total),
            toolpaths: (status.toolpaths_done, status.toolpaths_total),
        });
        let mut counted = told.or_ended(shown::made_at_end(line), planned());
        let there = there.get();
        if let (0, Some(there)) = (told.holes.1, there) {
            counted.holes = there;
        }
        (counted, there.is_some())
    })
}

fn progress(line: Link) -> impl IntoView {
    let counted = counted(line);
    // Of a job in work by its time: toolpaths take most of it. Else by what was made.
    let running =
        |status: &Status| (status.holes_total + status.toolpaths_total > 0).then_some(status.done_share);
    let share = Memo::new(move |_| from(line, running).or_else(|| counted.get().0.share()));
    let percent =
        move || share.get().map_or(String::new(), |share| format!("{:.0} %", (share * 100.0).floor()));
    let holes = move || {
        let (WorkCount { holes: (done, total), toolpaths: (way, toolpaths) }, differs) = counted.get();
        match (differs, toolpaths, total) {
            (true, ..) => say!("page.job.there", done = done, total = total),
            (_, 0, 0) => String::new(),
            (_, 0, _) => say!("page.job.holes", done = done, total = total),
            (_, _, 0) => say!("page.job.toolpaths", done = way, total = toolpaths),
            _ => say!("page.job.both", way = way, toolpaths = toolpaths, done = done, total = total),
        }
    };
    let times = move || {
        let of_job = |status: &Status| status.job.is_some().then_some((status.elapsed_s, status.left_s));
        from(line, of_job).map(|(elapsed, left)| {
            say!("page.job.times", elapsed = sentence(&duration(elapsed)), left = sentence(&duration(left)))
        })
    };
    let part = part_in_work(line);
    let idle = move || {
        let (WorkCount { holes: (holes, _), toolpaths: (toolpaths, _) }, differs) = counted.get();
        let none_made = holes + toolpaths == 0 && !differs;
        let is_idle = none_made && from(line, |status| status.job.clone()).is_none();
        let planned = line.shown_job.get().filter(|_| is_idle)?;
        let (holes, toolpaths) = (planned.program.hole_count(), planned.program.toolpath_count());
        Some(match (holes, toolpaths) {
            (_, 0) => say!("page.job.planned_holes", holes = holes),
            (0, _) => say!("page.job.planned_toolpaths", toolpaths = toolpaths),
            _ => say!("page.job.planned", holes = holes, toolpaths = toolpaths),
        })
    };
    let title =
        move || part.get().map_or_else(|| idle().unwrap_or_else(holes), |(part, _)| sentence_of(&part));
    div().class("job-progress").child((
        div().class("big").child((strong().child(title), span().child(percent))),
        p().class("tabular").child(within(part)),
        html::progress()
            .attr("aria-label", t!("page.job.progress"))
            .attr("max", "1")
            .prop("value", move || share.get().unwrap_or(0.0)),
        p().class("quiet tabular").child(times),
    ))
}

/// The hole or the toolpath in work, of those of its part.
fn within(part: Memo<Option<(Named, u32)>>) -> impl Fn() -> Option<String> + Send + Sync + 'static {
    move || {
        part.get().map(|(part, done)| {
            let done = (done + 1).min(part.part.count);
            if part.part.drills {
                say!("page.job.holes", done = done, total = part.part.count)
            } else {
                say!("page.job.toolpaths", done = done, total = part.part.count)
            }
        })
    }
}

/// A part of the job in work, and what it is called.
#[derive(Clone, PartialEq)]
struct Named {
    part: WorkPart,
    number: usize,
    of: usize,
    bit: String,
    operation: Option<String>,
}

/// The part in work, and how many of its holes or toolpaths are done; none where no job runs.
fn part_in_work(line: Link) -> Memo<Option<(Named, u32)>> {
    let operations = Memo::new(move |_| {
        let own = open_board().job.with(|own| own.as_ref().map(|own| own.key.clone()));
        let shown = line.shown_job.with(|job| job.as_ref().map(|job| job.key.clone()));
        let plan = open_board().plan.get().filter(|_| own == shown);
        plan.map(|plan| plan.toolpath_operations.clone()).unwrap_or_default()
    });
    let all = Memo::new(move |_| {
        let of = |operations: &Vec<u16>| {
            line.shown_job.with(|job| job.as_ref().map(|job| parts::parts(&job.program, operations)))
        };
        operations.with(of).unwrap_or_default()
    });
    let leg = Memo::new(move |_| from(line, |status| status.job.as_ref().and(status.leg)));
    Memo::new(move |_| {
        let (leg, parts) = (leg.get()?, all.get());
        line.shown_job.with(|job| {
            let program = &job.as_ref()?.program;
            let place = parts::place(program, &parts, leg)?;
            let part = *parts.get(place.at)?;
            let bit = part.bit.and_then(|bit| program.bits.get(bit as usize));
            let bit = bit.map(|bit| bit.title(&language())).unwrap_or_default();
            let work = open_job().work.get();
            let operation =
                part.operation.and_then(|at| work.as_ref()?.operations.get(usize::from(at)).cloned());
            let operation = operation.map(|operation| crate::screens::cam::name_of(&operation));
            Some((Named { part, number: place.at + 1, of: parts.len(), bit, operation }, place.done))
        })
    })
}

/// What is being done, and how much of the job it is.
fn sentence_of(named: &Named) -> String {
    let work = named.operation.clone().unwrap_or_else(|| {
        crate::i18n::text(
            if named.part.drills { key!("page.stage.drill") } else { key!("page.stage.mill") },
            &[],
        )
    });
    say!("page.job.part", number = named.number, of = named.of, work = work, bit = named.bit)
}

/// XY › approach › drilling › retract, the one in work marked.
fn stages(line: Link) -> impl IntoView {
    let now = Memo::new(move |_| from(line, |status| status.stage));
    let mills = Memo::new(move |_| words::mills(line));
    let chips = move || {
        let chip = |(stage, word)| {
            span()
                .class("stage-chip")
                .attr("aria-current", move || (now.get() == Some(stage)).then_some("step"))
                .child(move || crate::i18n::text(word, &[]))
        };
        words::stages(mills.get()).map(chip).into_iter().collect::<Vec<_>>()
    };
    div().class("stages").attr("role", "group").attr("aria-label", t!("page.stage.title")).child(chips)
}

fn controls(line: Link) -> impl IntoView {
    let may =
        move |states: &[State]| line.may_act() && line.state().is_some_and(|state| states.contains(&state));
    let can_start = move || {
        may(&[State::Ready])
            && open_board().job.with(Option::is_some)
            && open_board().unseen().is_none()
            && open_board().cleared()
    };
    let paused = Memo::new(move |_| line.state() == Some(State::Paused));
    let hold = move || {
        if paused.get() {
            push_if(
                "button large primary",
                move || line.may_act(),
                t!("page.job.resume"),
                |_| link::ask(Ask::Resume),
            )
            .into_any()
        } else {
            push_if(
                "button large",
                move || may(&[State::Running]),
                t!("page.job.pause"),
                |_| link::ask(Ask::Pause),
            )
            .into_any()
        }
    };
    let why = Memo::new(move |_| (line.state() == Some(State::Ready)).then(|| reason(line)).flatten());
    let cure = move |tab: Tab| {
        push("button small wide", move || top_bar::name_of(tab), move |_| send(FrameEvent::Show { tab }))
    };
    let said = move || why.get().map(|(text, there)| (p().class("quiet wide").child(text), there.map(cure)));
    div().class("buttons").child((
        push_if("button large primary wide", can_start, t!("page.job.start"), |_| send(StartEvent::Open)),
        said,
        hold,
        push_if(
            "button large",
            move || may(&[State::Running, State::Pausing, State::Paused, State::ToolChange]),
            t!("page.job.stop_after_hole"),
            |_| link::ask(Ask::StopAfterHole),
        ),
        overrides(line),
    ))
}

/// Percentages of a menu, and how they are written.
type Percents = &'static [(u8, &'static str)];

const HUNDREDS: Percents =
    &[(10, "10"), (25, "25"), (50, "50"), (75, "75"), (100, "100"), (125, "125"), (150, "150"), (200, "200")];
const RAPIDS: Percents = &[(25, "25"), (50, "50"), (100, "100")];

/// An override of the machine.
#[derive(Clone, Copy)]
struct Overridden {
    /// Key of its name.
    name: &'static str,
    percents: Percents,
    /// What it is; none on a machine that has none of its kind.
    is: fn(&Status) -> Option<u8>,
    ask: fn(u8) -> Ask,
}

/// How fast the job goes, in percent of the plan; on a controller the spindle and the rapids too.
fn overrides(line: Link) -> impl IntoView {
    let feed = Overridden {
        name: key!("page.job.feed_override"),
        percents: HUNDREDS,
        is: |status| Some(status.feed_override_percent),
        ask: |percent| Ask::FeedOverride { percent },
    };
    let spindle = Overridden {
        name: key!("page.job.spindle_override"),
        percents: HUNDREDS,
        is: |status| status.spindle_override_percent,
        ask: |percent| Ask::SpindleOverride { percent },
    };
    let rapid = Overridden {
        name: key!("page.job.rapid_override"),
        percents: RAPIDS,
        is: |status| status.rapid_override_percent,
        ask: |percent| Ask::RapidOverride { percent },
    };
    let has = move |one: Overridden| Memo::new(move |_| from(line, one.is).is_some());
    let (turns, hurries) = (has(spindle), has(rapid));
    (
        percent_menu(line, feed),
        move || turns.get().then(|| percent_menu(line, spindle)),
        move || hurries.get().then(|| percent_menu(line, rapid)),
    )
}

/// A menu of percentages; one that somebody else made of it stands there too.
fn percent_menu(line: Link, one: Overridden) -> impl IntoView {
    let now = Memo::new(move |_| from(line, one.is).unwrap_or(100));
    let odd = Memo::new(move |_| one.percents.iter().all(|(percent, _)| *percent != now.get()));
    let name = move || crate::i18n::text(one.name, &[]);
    let words = one.percents.iter().map(|(percent, word)| {
        menu_word(word, move || now.get() == *percent, move || say!("page.job.percent", percent = percent))
    });
    let other = move || {
        odd.get().then(|| menu_word("", || true, move || say!("page.job.percent", percent = now.get())))
    };
    label().class("field wide").child((
        span().child(name),
        select()
            .attr("aria-label", name)
            .prop("disabled", move || !line.may_act())
            .on(ev::change, move |event| {
                if let Ok(percent) = event_target_value(&event).parse() {
                    link::ask((one.ask)(percent));
                }
            })
            .child((words.collect::<Vec<_>>(), other)),
    ))
}

/// Why Start is not to be had, and the screen where that is cured.
fn reason(line: Link) -> Option<(String, Option<Tab>)> {
    if !line.control.get().yours {
        return Some((say!("page.job.needs_control"), None));
    }
    let at_board = |text: String| Some((text, Some(Tab::Board)));
    if let Some(unseen) = open_board().unseen() {
        return at_board(match unseen {
            Unseen::Several => say!("page.job.several_unseen"),
            Unseen::Unread => say!("page.job.errors_unacknowledged"),
            Unseen::Board => say!("page.job.board_unseen"),
        });
    }
    if !open_board().refused.with(Vec::is_empty) {
        return at_board(say!("page.job.refused"));
    }
    if open_board().job.with(Option::is_none) {
        return at_board(say!("page.job.no_plan"));
    }
    (!open_board().cleared()).then(|| (say!("page.job.problems_unread"), Some(Tab::Cam)))
}

fn facts(line: Link) -> impl IntoView {
    let plans = controller::plans(line);
    let text =
        move |get: fn(&Status) -> Option<String>| move || from(line, get).unwrap_or_else(|| "–".to_owned());
    let bit = move || {
        let bit = from(line, |status| status.bit);
        let name = line
            .shown_job
            .with(|job| Some(job.as_ref()?.program.bits.get(bit? as usize)?.title(&language())));
        name.unwrap_or_else(|| "–".to_owned())
    };
    let worn = move || {
        let number = line.tools.with(|report| report.in_spindle);
        let tool = open_board().machine.with(|machine| {
            let tool = machine.rack.iter().find(|tool| Some(tool.number) == number)?.clone();
            let wear = line.tools.with(|report| ToolWear::of(&report.wear, &machine.name, &tool));
            Some(format!("T{}: {}", tool.number, words::wear_words(&tool, &wear)))
        });
        tool.unwrap_or_else(|| "–".to_owned())
    };
    let lowest = move || {
        let unit = frame().unit.get();
        let mm = from(line, |status| status.lower_dead_point_mm);
        mm.map_or_else(
            || "–".to_owned(),
            |mm| format!("{} {}", crate::i18n::number(unit.coordinate(mm)), crate::i18n::unit_word()),
        )
    };
    let release = move || {
        open_board().machine.with(|machine| {
            match (drill_cycles::overlaps(machine), machine.senses_contact()) {
                (false, _) => say!("page.job.release_after"),
                (true, true) => say!("page.job.release_sensor"),
                (true, false) => say!("page.job.release_time"),
            }
        })
    };
    dl().class("facts").child((
        fact(t!("page.job.command"), text(|status| status.command.clone())),
        fact(t!("page.job.bit"), bit),
        fact(t!("page.job.wear"), worn),
        fact(t!("page.job.spindle"), move || {
            say!("page.job.rpm", rpm = from(line, |status| status.spindle_rpm))
        }),
        // A controller that plans its own motion has a bottom and goes on aside by its program alone.
        move || {
            let both =
                || (fact(t!("page.job.lower_dead_point"), lowest), fact(t!("page.job.release"), release));
            (!plans.get()).then(both)
        },
        fact(t!("page.job.delay"), move || {
            line.delay_ms
                .get()
                .map_or_else(|| "–".to_owned(), |ms| say!("page.job.ms", ms = format!("{ms:.0}")))
        }),
    ))
}
