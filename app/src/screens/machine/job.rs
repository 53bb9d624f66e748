//! The running job: progress, current hole, stage, time, and the controls for it.

use super::{controller, ended, offer, spindles, words};
use crate::format::duration;
use crate::i18n::{key, language, say, sentence, t};
use crate::keys::Tab;
use crate::model::{FrameEvent, Model, StartEvent, Unseen, job_board};
use crate::page::{board, link, read, send, shared, watch};
use crate::parts::{self, WorkCount, WorkPart};
use crate::screens::{shown, top_bar, welcome};
use crate::widgets::{fact, menu_word, push, push_guarded, push_if};
use annulus_core::control::State;
use annulus_core::job::Program;
use annulus_core::machine::{Output, ToolWear};
use annulus_core::motion::drill_cycles;
use annulus_core::wire::{Ask, Status};
use leptos::ev;
use leptos::html::{self, div, dl, h2, header, label, p, section, select, span, strong};
use leptos::prelude::*;

fn from<T: Default>(get: impl FnOnce(&Status) -> T) -> T {
    shared(|m| &m.link.status).with(|status| status.as_ref().map(|status| get(status)).unwrap_or_default())
}

pub(crate) fn job() -> impl IntoView {
    let broken_off = Memo::new(move |_| {
        watch(|m| &m.link.interrupted).with(|one| one.as_ref().map(|one| one.name.clone()))
    });
    let name = move || {
        let running = from(|status| status.job_name.clone());
        let planned = shared(|m| &m.board.job).with(|job| job.as_ref().map(|job| job.program.name.clone()));
        running.or(planned).or_else(|| broken_off.get()).unwrap_or_else(|| say!("page.job.none"))
    };
    section().class("block").attr("aria-label", t!("page.job.title")).child((
        header().child(h2().child(name)),
        to_restore(broken_off),
        progress(),
        stages(),
        controls(),
        facts(),
        spindles::spindles(),
    ))
}

/// With no board open: the offer to restore the board that was open before a reload.
fn to_restore(broken_off: Memo<Option<String>>) -> impl IntoView {
    let offer = Memo::new(move |_| {
        let has_job = |m: &Model| m.link.status.as_ref().is_some_and(|status| status.job.is_some());
        let is_free = read(|m| m.board.document.is_none() && m.task().is_none()) && !read(has_job);
        let found = |name: &Option<String>| {
            watch(|m| &m.keeping.offers)
                .with(|offers| job_board::to_restore(name.as_deref(), offers).cloned())
        };
        broken_off.with(found).filter(|_| is_free)
    });
    move || offer.get().map(|offer| welcome::kept(offer, Some("status")))
}

/// Completed and total counts of the shown job. If the board differs from the program, the holes are those in
/// the right position, of those drilled; then the flag is true.
fn counted() -> Memo<(WorkCount, bool)> {
    let count = |program: &Program| (program.hole_count() as u32, program.toolpath_count() as u32);
    let planned =
        move || shared(|m| &m.start.shown).with(|job| job.as_ref().map_or((0, 0), |job| count(&job.program)));
    let there = Memo::new(move |_| {
        let told = ended::differs()?;
        let run = read(|m| m.link.ended.as_ref().map(|ended| ended.end.holes_done));
        let run = run.unwrap_or_else(|| planned().0);
        if run == 0 {
            return None;
        }
        Some((run.saturating_sub(told.missing.saturating_add(told.shifted)), run))
    });
    // From the machine's status; after the end of a job, from its result.
    Memo::new(move |_| {
        let told = from(|status| WorkCount {
            holes: (status.holes_done, status.holes_total),
            toolpaths: (status.toolpaths_done, status.toolpaths_total),
        });
        let mut counted = told.or_ended(shown::made_at_end(), planned());
        let there = there.get();
        if let (0, Some(there)) = (told.holes.1, there) {
            counted.holes = there;
        }
        (counted, there.is_some())
    })
}

fn progress() -> impl IntoView {
    let counted = counted();
    // A running job is measured by time, because toolpaths take most of it; else by count.
    let running =
        |status: &Status| (status.holes_total + status.toolpaths_total > 0).then_some(status.done_share);
    let share = Memo::new(move |_| from(running).or_else(|| counted.get().0.share()));
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
        from(of_job).map(|(elapsed, left)| {
            say!("page.job.times", elapsed = sentence(&duration(elapsed)), left = sentence(&duration(left)))
        })
    };
    let part = part_in_work();
    let idle = move || {
        let (WorkCount { holes: (holes, _), toolpaths: (toolpaths, _) }, differs) = counted.get();
        let none_made = holes + toolpaths == 0 && !differs;
        let is_idle = none_made && from(|status| status.job.clone()).is_none();
        let planned = shared(|m| &m.start.shown).get().filter(|_| is_idle)?;
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

#[derive(Clone, PartialEq)]
struct Named {
    part: WorkPart,
    number: usize,
    of: usize,
    bit: String,
    operation: Option<String>,
}

/// The current part, and how many of its holes or toolpaths are done; none if no job is running.
fn part_in_work() -> Memo<Option<(Named, u32)>> {
    let operations = Memo::new(move |_| {
        let own = shared(|m| &m.board.job).with(|own| own.as_ref().map(|own| own.key.clone()));
        let shown = shared(|m| &m.start.shown).with(|job| job.as_ref().map(|job| job.key.clone()));
        let plan = shared(|m| &m.board.plan).get().filter(|_| own == shown);
        plan.map(|plan| plan.toolpath_operations.clone()).unwrap_or_default()
    });
    let all = Memo::new(move |_| {
        let of = |operations: &Vec<u16>| {
            shared(|m| &m.start.shown)
                .with(|job| job.as_ref().map(|job| parts::parts(&job.program, operations)))
        };
        operations.with(of).unwrap_or_default()
    });
    let leg = Memo::new(move |_| from(|status| status.job.as_ref().and(status.leg)));
    Memo::new(move |_| {
        let (leg, parts) = (leg.get()?, all.get());
        shared(|m| &m.start.shown).with(|job| {
            let program = &job.as_ref()?.program;
            let place = parts::place(program, &parts, leg)?;
            let part = *parts.get(place.at)?;
            let bit = part.bit.and_then(|bit| program.bits.get(bit as usize));
            let bit = bit.map(|bit| bit.title(&language())).unwrap_or_default();
            let work = shared(|m| &m.job.work).get();
            let operation =
                part.operation.and_then(|at| work.as_ref()?.operations.get(usize::from(at)).cloned());
            let operation = operation.map(|operation| crate::screens::cam::name_of(&operation));
            Some((Named { part, number: place.at + 1, of: parts.len(), bit, operation }, place.done))
        })
    })
}

fn sentence_of(named: &Named) -> String {
    let work = named.operation.clone().unwrap_or_else(|| {
        crate::i18n::text(
            if named.part.drills { key!("page.stage.drill") } else { key!("page.stage.mill") },
            &[],
        )
    });
    say!("page.job.part", number = named.number, of = named.of, work = work, bit = named.bit)
}

/// XY › approach › drilling › retract, with the current stage marked.
fn stages() -> impl IntoView {
    let now = Memo::new(move |_| from(|status| status.stage));
    let chips = move || {
        let chip = |(stage, word)| {
            span()
                .class("stage-chip")
                .attr("aria-current", move || (now.get() == Some(stage)).then_some("step"))
                .child(move || crate::i18n::text(word, &[]))
        };
        words::stages(words::mills()).map(chip).into_iter().collect::<Vec<_>>()
    };
    div().class("stages").attr("role", "group").attr("aria-label", t!("page.stage.title")).child(chips)
}

fn begin_or_resume(can_start: impl Fn() -> bool + Copy + Send + Sync + 'static) -> impl IntoView {
    let interrupted = offer::of_main_button();
    // After STOP the user most likely wants to resume: that button is first.
    let resume = move || {
        let offer = interrupted.get()?;
        let open = move |_| send(StartEvent::Resume { offer: offer.clone() });
        let words = t!("page.interrupted.resume");
        Some(push_guarded("button large primary wide", || "prepare", link::may_act, words, open))
    };
    let start = move || {
        let class =
            if interrupted.with(Option::is_some) { "button large wide" } else { "button large primary wide" };
        let open = |_| send(StartEvent::Open);
        push_guarded(class, || "prepare", can_start, t!("page.job.start"), open)
    };
    (resume, start)
}

fn controls() -> impl IntoView {
    let may =
        move |states: &[State]| link::may_act() && link::state().is_some_and(|state| states.contains(&state));
    let can_start = move || {
        link::ready() && read(|m| m.board.job.is_some()) && board::unseen().is_none() && board::cleared()
    };
    let hold = move || {
        if read(|m| m.link.state() == Some(State::Paused)) {
            push_guarded(
                "button large primary",
                || "resume",
                link::may_act,
                t!("page.job.resume"),
                |_| link::ask(Ask::Resume),
            )
            .into_any()
        } else {
            // Pause must act at once, so only Resume is guarded.
            push_if(
                "button large",
                move || may(&[State::Running]),
                t!("page.job.pause"),
                |_| link::ask(Ask::Pause),
            )
            .into_any()
        }
    };
    let can_lift = |m: &Model| {
        let is_on_path = m.link.status.as_ref().is_some_and(|status| status.paused_on_path == Some(false));
        is_on_path && m.machine.output != Output::Adapter
    };
    let lift = move || {
        let words = t!("page.job.lift_tool");
        let ask = |_| link::ask(Ask::LiftTool);
        let button = || push_guarded("button large wide", || "lift", link::may_act, words, ask);
        read(can_lift).then(button)
    };
    let why = Memo::new(move |_| (link::state() == Some(State::Ready)).then(reason).flatten());
    let cure = move |tab: Tab| {
        push("button small wide", move || top_bar::name_of(tab), move |_| send(FrameEvent::Show { tab }))
    };
    let said = move || why.get().map(|(text, there)| (p().class("quiet wide").child(text), there.map(cure)));
    div().class("buttons").child((
        begin_or_resume(can_start),
        said,
        hold,
        lift,
        push_if(
            "button large",
            move || may(&[State::Running, State::Pausing, State::Paused, State::ToolChange]),
            t!("page.job.stop_after_hole"),
            |_| link::ask(Ask::StopAfterHole),
        ),
        overrides(),
    ))
}

type Percents = &'static [(u8, &'static str)];

const HUNDREDS: Percents =
    &[(10, "10"), (25, "25"), (50, "50"), (75, "75"), (100, "100"), (125, "125"), (150, "150"), (200, "200")];
const RAPIDS: Percents = &[(25, "25"), (50, "50"), (100, "100")];

#[derive(Clone, Copy)]
struct Overridden {
    name: &'static str,
    percents: Percents,
    /// The current value; none if the machine doesn't have this override.
    is: fn(&Status) -> Option<u8>,
    ask: fn(u8) -> Ask,
}

/// Feed override in percent of the plan; for a controller also spindle and rapids.
fn overrides() -> impl IntoView {
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
    let has = move |one: Overridden| Memo::new(move |_| from(one.is).is_some());
    let (turns, hurries) = (has(spindle), has(rapid));
    (
        percent_menu(feed),
        move || turns.get().then(|| percent_menu(spindle)),
        move || hurries.get().then(|| percent_menu(rapid)),
    )
}

/// A menu of percentages. Also shows a value that isn't in the list, such as one set by another page.
fn percent_menu(one: Overridden) -> impl IntoView {
    let now = Memo::new(move |_| from(one.is).unwrap_or(100));
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
            .prop("disabled", move || !link::may_act())
            .on(ev::change, move |event| {
                if let Ok(percent) = event_target_value(&event).parse() {
                    link::ask((one.ask)(percent));
                }
            })
            .child((words.collect::<Vec<_>>(), other)),
    ))
}

/// Why Start is disabled, and the screen where the user can fix it.
fn reason() -> Option<(String, Option<Tab>)> {
    if !read(|m| m.link.control.yours) {
        return Some((say!("page.job.needs_control"), None));
    }
    let at_board = |text: String| Some((text, Some(Tab::Board)));
    if let Some(unseen) = board::unseen() {
        return at_board(match unseen {
            Unseen::Several => say!("page.job.several_unseen"),
            Unseen::Unread => say!("page.job.errors_unacknowledged"),
            Unseen::Board => say!("page.job.board_unseen"),
        });
    }
    if !read(|m| m.board.refused.is_empty()) {
        return at_board(say!("page.job.refused"));
    }
    if read(|m| m.board.job.is_none()) {
        return at_board(say!("page.job.no_plan"));
    }
    (!board::cleared()).then(|| (say!("page.job.problems_unread"), Some(Tab::Cam)))
}

fn facts() -> impl IntoView {
    let text = move |get: fn(&Status) -> Option<String>| move || from(get).unwrap_or_else(|| "–".to_owned());
    let bit = move || {
        let bit = from(|status| status.bit);
        let name = shared(|m| &m.start.shown)
            .with(|job| Some(job.as_ref()?.program.bits.get(bit? as usize)?.title(&language())));
        name.unwrap_or_else(|| "–".to_owned())
    };
    let worn = move || {
        let number = read(|m| m.link.tools.in_spindle);
        let tool = shared(|m| &m.machine).with(|machine| {
            let tool = machine.rack.iter().find(|tool| Some(tool.number) == number)?.clone();
            let wear =
                watch(|m| &m.link.tools).with(|report| ToolWear::of(&report.wear, &machine.name, &tool));
            Some(format!("T{}: {}", tool.number, words::wear_words(&tool, &wear)))
        });
        tool.unwrap_or_else(|| "–".to_owned())
    };
    let lowest = move || {
        let unit = read(|m| m.frame.unit);
        let mm = from(|status| status.lower_dead_point_mm);
        mm.map_or_else(
            || "–".to_owned(),
            |mm| format!("{} {}", crate::i18n::number(unit.coordinate(mm)), crate::i18n::unit_word()),
        )
    };
    let release = move || {
        shared(|m| &m.machine).with(|machine| {
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
        fact(t!("page.job.spindle"), move || say!("page.job.rpm", rpm = from(|status| status.spindle_rpm))),
        // For a controller that plans its own motion, the program alone decides these two.
        move || {
            let both =
                || (fact(t!("page.job.lower_dead_point"), lowest), fact(t!("page.job.release"), release));
            (!controller::plans()).then(both)
        },
        fact(t!("page.job.delay"), move || {
            read(|m| m.link.delay_ms)
                .map_or_else(|| "–".to_owned(), |ms| say!("page.job.ms", ms = format!("{ms:.0}")))
        }),
    ))
}
