//! Addresses: the view that each one opens, and the address of each view.

use super::story::{Story, work};
use crate::keys::{Stride, Tab};
use crate::lab::LabPanel;
use crate::model::{FrameEvent, JobEvent, Model, PlayEvent, address, update};
use annulus_core::board::Face;
use annulus_core::machine::Group;

fn go(model: &mut Model, address: &str) -> String {
    update(model, FrameEvent::Go { address: address.to_owned() }.into());
    address::of(model)
}

#[test]
fn address_opens_its_screen_and_is_normalized() {
    let mut model = Model::default();
    let rows = [
        ("#/draw", "#/draw", Tab::Draw),
        ("#/board", "#/board", Tab::Board),
        ("#/settings", "#/settings/machine", Tab::Settings),
        ("#/settings/data", "#/settings/data", Tab::Settings),
        ("#/settings/page", "#/settings/page", Tab::Settings),
        ("#/settings/probing", "#/settings/probing", Tab::Settings),
        ("#/settings/rack", "#/settings/rack", Tab::Settings),
        ("#/settings/nothing", "#/settings/rack", Tab::Settings),
        ("#/lab/servo", "#/lab/servo", Tab::Lab),
        ("#/lab", "#/lab/servo", Tab::Lab),
        ("#/machine?view=operator", "#/machine?view=operator", Tab::Machine),
        ("#/machine", "#/machine", Tab::Machine),
        ("#/cam", "#/cam", Tab::Cam),
        ("#/cam/op/3", "#/cam/op/3", Tab::Cam),
        ("#/simulate?t=2.5", "#/simulate?t=2.5", Tab::Simulate),
        ("#/simulate", "#/simulate", Tab::Simulate),
        ("#nowhere", "#/simulate", Tab::Simulate),
    ];
    for (wanted, expected, tab) in rows {
        assert_eq!((go(&mut model, wanted).as_str(), model.frame.tab), (expected, tab), "{wanted}");
    }
    assert_eq!((model.lab.sheet, model.frame.section), (LabPanel::Servo, "rack"));
}

#[test]
fn settings_address_names_a_group_by_itself_or_by_a_section() {
    let rows = [
        ("machine", Some(Group::Machine)),
        ("x", Some(Group::Machine)),
        ("motion", Some(Group::Motion)),
        ("stroke", Some(Group::Motion)),
        ("tools", Some(Group::Tools)),
        ("rack", Some(Group::Tools)),
        ("card", Some(Group::Wiring)),
        ("probing", Some(Group::Probing)),
        ("page", None),
        ("data", None),
    ];
    for (section, group) in rows {
        assert_eq!(address::group_of(section), group, "{section}");
    }
}

#[test]
fn operation_address_uses_its_listed_number() {
    let mut model = Model::default();
    let mut job = work();
    job.operations[0].face = Face::Bottom;
    model.job.open(job);
    assert_eq!(go(&mut model, "#/cam"), "#/cam/op/1");
    assert_eq!(model.job.chosen, 1, "the first of the side that is up");
    assert_eq!(go(&mut model, "#/cam/op/2"), "#/cam/op/2");
    assert_eq!(model.job.chosen, 2);
    assert_eq!(go(&mut model, "#/cam/op/9"), "#/cam/op/2", "there is no such one");
    update(&mut model, JobEvent::Choose { at: 1 }.into());
    assert_eq!(address::of(&model), "#/cam/op/1");
}

#[test]
fn addressed_operation_is_shown_once_loaded() {
    let mut story = Story::default();
    go(&mut story.model, "#/cam/op/3");
    story.tell("open");
    story.tell("certain");
    assert_eq!((story.model.frame.tab, story.model.job.chosen), (Tab::Cam, 2));
    assert_eq!(address::of(&story.model), "#/cam/op/3");
    // Without a named part, or if the user went elsewhere meanwhile, the Board screen opens.
    for elsewhere in [false, true] {
        let mut story = Story::default();
        if elsewhere {
            go(&mut story.model, "#/cam/op/3");
            update(&mut story.model, FrameEvent::Show { tab: Tab::Simulate }.into());
        }
        story.tell("open");
        story.tell("certain");
        assert_eq!((story.model.frame.tab, story.model.job.chosen), (Tab::Board, 0), "{elsewhere}");
    }
}

#[test]
fn addressed_second_is_shown_once_planned() {
    let mut model = super::play_rows::playing(0.0, 1.0);
    let playback = model.play.playback.take();
    assert_eq!(go(&mut model, "#/simulate?t=2.5"), "#/simulate?t=2.5");
    assert!(model.play.at_s.abs() < 1e-9);
    model.play.playback = playback;
    update(&mut model, FrameEvent::Grid.into());
    let total_s = model.play.total_s();
    assert!((model.play.at_s - total_s.min(2.5)).abs() < 1e-9 && model.frame.named.is_none());
    model.play.at_s = 3.456_7;
    assert_eq!(address::of(&model), "#/simulate?t=3.46");
    model.play.running = true;
    assert_eq!(address::of(&model), "#/simulate");
    update(&mut model, PlayEvent::Step { stride: Stride::Hole { onwards: true } }.into());
    assert!(!model.play.running);
    update(&mut model, PlayEvent::Hold { at_s: 0.0 }.into());
    assert_eq!(address::of(&model), "#/simulate");
}
