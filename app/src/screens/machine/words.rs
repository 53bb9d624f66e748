//! Texts, tones and icons for what the machine does.

use crate::health::Freshness;
use crate::i18n::{key, say};
use crate::model::link::LinkPhase;
use crate::model::link::rest::{pause_words, rest_words};
use crate::page::{link, read, shared};
use crate::widgets::Icon;
use annulus_core::control::{Ending, State};
use annulus_core::grbl::SetterStep;
use annulus_core::job::Input;
use annulus_core::machine::{RackTool, ToolWear};
use annulus_core::steps::Stage;
use annulus_core::wire::RowVerdict;
use leptos::prelude::With;

#[derive(Clone, Copy, PartialEq)]
pub struct Look {
    pub word: &'static str,
    pub meaning: &'static str,
    pub tone: &'static str,
    pub icon: Icon,
}

const fn look(word: &'static str, meaning: &'static str, tone: &'static str, icon: Icon) -> Look {
    Look { word, meaning, tone, icon }
}

pub fn state(state: State) -> Look {
    match state {
        State::NotHomed => {
            look(key!("page.state.not_homed"), key!("page.state.not_homed_is"), "tone-pause", Icon::Home)
        }
        State::Homing => {
            look(key!("page.state.homing"), key!("page.state.homing_is"), "tone-homing", Icon::Home)
        }
        State::Ready => {
            look(key!("page.state.ready"), key!("page.state.ready_is"), "tone-quiet", Icon::Check)
        }
        State::Jogging => {
            look(key!("page.state.jogging"), key!("page.state.jogging_is"), "tone-run", Icon::Arrow)
        }
        State::Checking => {
            look(key!("page.state.checking"), key!("page.state.checking_is"), "tone-quiet", Icon::Check)
        }
        State::Running => {
            look(key!("page.state.running"), key!("page.state.running_is"), "tone-run", Icon::Play)
        }
        State::Pausing => {
            look(key!("page.state.pausing"), key!("page.state.pausing_is"), "tone-pause", Icon::Pause)
        }
        State::Paused => {
            look(key!("page.state.paused"), key!("page.state.paused_is"), "tone-pause", Icon::Pause)
        }
        State::ToolChange => {
            look(key!("page.state.tool_change"), key!("page.state.tool_change_is"), "tone-change", Icon::Bit)
        }
        State::Stopping => {
            look(key!("page.state.stopping"), key!("page.state.stopping_is"), "tone-alarm", Icon::Alarm)
        }
        State::Parking => {
            look(key!("page.state.parking"), key!("page.state.parking_is"), "tone-run", Icon::Arrow)
        }
        State::Alarm => {
            look(key!("page.state.alarm"), key!("page.state.alarm_is"), "tone-alarm", Icon::Alarm)
        }
    }
}

/// How a connection that is not open is shown.
pub fn phase(phase: LinkPhase) -> Look {
    match phase {
        LinkPhase::Unpaired => {
            look(key!("page.state.no_bridge"), key!("page.state.no_bridge_is"), "tone-none", Icon::Plug)
        }
        LinkPhase::Connecting | LinkPhase::Open => {
            look(key!("page.state.connecting"), key!("page.state.connecting_is"), "tone-none", Icon::Plug)
        }
        LinkPhase::Lost => {
            look(key!("page.state.link_lost"), key!("page.state.link_lost_is"), "tone-alarm", Icon::Warning)
        }
    }
}

/// How a lost connection is shown; differs if a job was running.
fn lost() -> Look {
    let worked = read(|m| m.link.status.as_ref().is_some_and(|status| status.job.is_some()));
    let meaning = if worked { key!("page.state.link_lost_is") } else { key!("page.state.link_lost_idle") };
    Look { meaning, ..phase(LinkPhase::Lost) }
}

/// True if the machine was connected and no longer responds.
pub fn is_lost() -> bool {
    read(|m| m.link.ever && (m.link.phase != LinkPhase::Open || m.link.freshness == Freshness::Lost))
}

/// True if this page itself drives the machine: its own drill, or a controller at its port.
fn here() -> bool {
    read(|m| m.frame.alone || m.link.controller.chosen)
}

/// True while the machine fetches a tool itself. False while it waits for the user to replace a worn one.
fn fetches() -> bool {
    read(|m| m.link.magazine.as_ref().is_some_and(|report| report.changes))
}

/// How the machine's state, or its absence, is shown.
pub fn of() -> Look {
    if read(|m| m.link.phase != LinkPhase::Open || m.link.freshness == Freshness::Lost) {
        if read(|m| m.link.ever) {
            return lost();
        }
        let now = phase(read(|m| m.link.phase));
        let meaning = if here() { key!("page.state.connecting_here") } else { now.meaning };
        return Look { meaning, ..now };
    }
    match link::state() {
        Some(State::Running) => {
            let word = if mills() { key!("page.state.milling") } else { key!("page.state.running") };
            let meaning =
                if here() { key!("page.state.running_here") } else { key!("page.state.running_is") };
            Look { word, meaning, ..state(State::Running) }
        }
        Some(now @ (State::Pausing | State::Paused)) => {
            let plans = read(|m| m.link.controller.plans());
            let meaning = shared(|m| &m.link.status).with(|status| pause_words(status.as_deref()?, plans));
            let own = state(now);
            Look { meaning: meaning.unwrap_or(own.meaning), ..own }
        }
        Some(State::ToolChange) if measuring().is_some() => {
            Look { meaning: key!("page.measure.meaning"), ..state(State::ToolChange) }
        }
        Some(State::ToolChange) if changing().is_some() => {
            Look { meaning: key!("page.changer.meaning"), ..state(State::ToolChange) }
        }
        Some(State::ToolChange) if fetches() => {
            Look { meaning: key!("page.magazine.changing"), ..state(State::ToolChange) }
        }
        Some(now) => {
            let known = shared(|m| &m.link.status)
                .with(|status| rest_words(status.as_deref()?, read(|m| m.link.homes())));
            let own = state(now);
            known.map_or(own, |[word, meaning]| {
                let is_own = word == own.word;
                let (tone, icon) = if is_own { (own.tone, own.icon) } else { ("tone-pause", Icon::Warning) };
                Look { word, meaning, tone, icon }
            })
        }
        None => phase(LinkPhase::Connecting),
    }
}

/// True if the machine is on a toolpath, false on a hole.
pub fn mills() -> bool {
    read(|m| m.link.status.as_ref().is_some_and(|status| status.toolpath.is_some()))
}

pub const fn stages(mills: bool) -> [(Stage, &'static str); 4] {
    let work =
        if mills { (Stage::Mill, key!("page.stage.mill")) } else { (Stage::Drill, key!("page.stage.drill")) };
    [
        (Stage::Travel, key!("page.stage.travel")),
        (Stage::Approach, key!("page.stage.approach")),
        work,
        (Stage::Retract, key!("page.stage.retract")),
    ]
}

pub fn stage(stage: Stage) -> &'static str {
    match stage {
        Stage::Travel => key!("page.stage.travel"),
        Stage::Approach => key!("page.stage.approach"),
        Stage::Drill => key!("page.stage.drill"),
        Stage::NextHole => key!("page.stage.next_hole"),
        Stage::Mill => key!("page.stage.mill"),
        Stage::Retract => key!("page.stage.retract"),
        Stage::Dwell => key!("page.stage.dwell"),
        Stage::AwaitBit => key!("page.stage.await_bit"),
        Stage::Seek => key!("page.stage.seek"),
        Stage::BackOff => key!("page.stage.back_off"),
        Stage::Locate => key!("page.stage.locate"),
        Stage::Index => key!("page.stage.index"),
        Stage::Offset => key!("page.stage.offset"),
        Stage::Jog => key!("page.stage.jog"),
        Stage::Touch => key!("page.stage.touch"),
    }
}

/// The steps of measuring a tool on the tool setter.
pub const MEASUREMENT: [&str; 6] = [
    key!("page.measure.up"),
    key!("page.measure.over"),
    key!("page.measure.down"),
    key!("page.measure.again"),
    key!("page.measure.lift"),
    key!("page.measure.zero"),
];

/// Index of the current step in [`MEASUREMENT`]; none if no tool is being measured.
pub fn measuring() -> Option<usize> {
    let step = read(|m| m.link.status.as_ref()?.measuring)?;
    Some(match step {
        SetterStep::Ready | SetterStep::Up => 0,
        SetterStep::Over => 1,
        SetterStep::Near | SetterStep::Touch => 2,
        SetterStep::Back | SetterStep::Again | SetterStep::Same => 3,
        SetterStep::Lift => 4,
        SetterStep::Zero => 5,
    })
}

/// Current line of the controller's tool changer macro, and their number; none if none is running.
pub fn changing() -> Option<[u32; 2]> {
    read(|m| m.link.status.as_ref()?.changing)
}

pub fn sensor(input: Input) -> &'static str {
    match input {
        Input::XMin => key!("page.sensor.x_min"),
        Input::XMax => key!("page.sensor.x_max"),
        Input::YMin => key!("page.sensor.y_min"),
        Input::YMax => key!("page.sensor.y_max"),
        Input::ZTop => key!("page.sensor.z_top"),
        Input::ZBottom => key!("page.sensor.z_bottom"),
        Input::Contact => key!("page.sensor.contact"),
        Input::FootDown => key!("page.sensor.foot_down"),
        Input::ClampOpen => key!("page.sensor.clamp_open"),
        Input::ToolHeld => key!("page.sensor.tool_held"),
        Input::PlaceTaken => key!("page.sensor.place_taken"),
        Input::CoverOpen => key!("page.sensor.cover_open"),
        Input::Air => key!("page.sensor.air"),
        Input::XIndex => key!("page.sensor.x_index"),
        Input::YIndex => key!("page.sensor.y_index"),
        Input::ZIndex => key!("page.sensor.z_index"),
    }
}

pub fn ending(ending: Ending) -> &'static str {
    match ending {
        Ending::Done => key!("page.ended.done"),
        Ending::StoppedAfterHole => key!("page.ended.after_hole"),
        Ending::Stopped => key!("page.ended.stopped"),
        Ending::Alarm => key!("page.ended.alarm"),
    }
}

/// How a pre-flight result is shown.
pub fn verdict(verdict: RowVerdict) -> Look {
    match verdict {
        RowVerdict::Pass => {
            look(key!("page.verdict.pass"), key!("page.verdict.pass"), "tone-run", Icon::Check)
        }
        RowVerdict::Note => {
            look(key!("page.verdict.note"), key!("page.verdict.note"), "tone-quiet", Icon::Warning)
        }
        RowVerdict::Warn => {
            look(key!("page.verdict.warn"), key!("page.verdict.warn"), "tone-pause", Icon::Warning)
        }
        RowVerdict::Fail => {
            look(key!("page.verdict.fail"), key!("page.verdict.fail"), "tone-alarm", Icon::Cross)
        }
    }
}

/// How much of a tool's life is used, in words.
pub(crate) fn wear_words(tool: &RackTool, wear: &ToolWear) -> String {
    let (done, life) = (wear.done(), tool.life);
    match (tool.wears_by_way(), life) {
        (false, 0) => say!("page.tools.holes", done = done),
        (false, _) => say!("page.tools.holes_of", done = done, life = life),
        (true, 0) => say!("page.tools.way", done = done),
        (true, _) => say!("page.tools.way_of", done = done, life = life),
    }
}
