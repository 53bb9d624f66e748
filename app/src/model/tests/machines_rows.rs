//! The machine that jobs are planned for: chosen, saved, named by the address, played by the virtual drill.

use super::line::Line;
use super::story::Story;
use crate::keys::Tab;
use crate::model::machines::{self, owner};
use crate::model::{
    ChoiceOrigin, Effect, FrameEvent, JobEvent, LinkEvent, MachineEvent, MachineOwner, Model, update,
};
use annulus_core::machine::{Machine, Value, played, preset, read, virtual_drill};
use annulus_core::wire::Tell;

fn choose(name: &str) -> MachineEvent {
    MachineEvent::Choose { name: name.to_owned() }
}

fn kept(effects: &[Effect]) -> Option<&String> {
    effects.iter().find_map(|effect| match effect {
        Effect::KeepMachines { text } => Some(text),
        _ => None,
    })
}

fn sent(effects: &[Effect]) -> Vec<&str> {
    let mut texts = Vec::new();
    for effect in effects {
        if let Effect::Send { text } = effect {
            texts.push(text.as_str());
        }
    }
    texts
}

fn described(machine: &Machine) -> LinkEvent {
    let tell = Tell::Machine { settings: read(machine), fingerprint: machine.fingerprint(), faults: None };
    LinkEvent::Heard { tell: Some(Box::new(tell)) }
}

/// A page without a bridge.
fn alone() -> Model {
    let mut model = Model::default();
    update(&mut model, FrameEvent::Alone.into());
    model
}

#[test]
fn chosen_machine_is_planned_for_and_undone() {
    let mut story = Story::told("open certain plan prove time");
    story.send(FrameEvent::Alone);
    assert_eq!((story.model.machines.chosen.clone(), owner(&story.model)), (None, MachineOwner::Page));
    story.send(choose("hobby"));
    assert_eq!((story.model.machine.name.as_str(), story.way()), ("3018 router", "planning"));
    assert_eq!(story.model.machines.chosen.as_deref(), Some("3018"));
    assert!(story.toasts().iter().any(|key| key == "page.machines.planned_for"), "{:?}", story.toasts());
    let changed = story.model.machines.changed.clone();
    assert!(!changed.is_empty() && changed.iter().all(|value| value.before != value.after), "{changed:?}");
    let undo = story.model.frame.toasts.last().unwrap().number;
    story.send(FrameEvent::Taken { number: undo });
    assert_eq!((story.model.machine.as_ref(), story.way()), (&virtual_drill(), "planning-again"));
    assert_eq!(story.model.machines.chosen, None);
}

#[test]
fn value_that_the_user_set_does_not_follow_the_machine() {
    let mut story = Story::told("open certain plan prove time");
    story.send(FrameEvent::Alone);
    let mut work = (**story.model.job.work.as_ref().unwrap()).clone();
    work.operations.iter_mut().for_each(|operation| operation.spindle_rpm = Some(9_000));
    story.send(JobEvent::Change { field: None, work: Box::new(work) });
    story.send(choose("3018"));
    let keys: Vec<_> = story.model.machines.changed.iter().map(|value| value.key).collect();
    assert!(keys.contains(&"operation.plunge") && !keys.contains(&"operation.speed"), "{keys:?}");
}

#[test]
fn choice_is_saved_and_the_address_is_not() {
    let mut model = alone();
    let effects = update(&mut model, choose("3018").into());
    let text = kept(&effects).unwrap().clone();
    let mut again = alone();
    update(&mut again, MachineEvent::Kept { text }.into());
    assert_eq!((again.machine.name.as_str(), again.machines.from), ("3018 router", ChoiceOrigin::Person));
    let effects = update(&mut again, MachineEvent::Linked { name: "six".to_owned() }.into());
    assert_eq!(kept(&effects), None);
    assert_eq!((again.machine.name.as_str(), again.machines.from), ("Six spindles", ChoiceOrigin::Address));
    update(&mut again, MachineEvent::Linked { name: "missing".to_owned() }.into());
    assert_eq!((again.machine.name.as_str(), again.frame.toasts.len()), ("Six spindles", 1));
    // A text that cannot be read is no choice.
    let mut broken = alone();
    update(&mut broken, MachineEvent::Kept { text: "{".to_owned() }.into());
    assert_eq!(broken.machines.chosen, None);
}

#[test]
fn machine_of_a_bridge_is_not_chosen_here() {
    let mut model = Model::default();
    for event in [choose("3018"), MachineEvent::Linked { name: "3018".to_owned() }, MachineEvent::Copy] {
        update(&mut model, event.into());
    }
    assert_eq!((owner(&model), model.machine.as_ref()), (MachineOwner::Bridge, &virtual_drill()));
    assert_eq!(model.machines.chosen, None);
}

#[test]
fn virtual_drill_plays_the_chosen_machine() {
    let router = played(&preset("3018").unwrap()).unwrap();
    let mut line = Line::told("alone linked yours status:Ready");
    let model = &mut line.model;
    // Before any choice it keeps its own settings, and nothing is saved.
    let own = Machine { rack_tolerance: annulus_core::units::Length::from_um(70), ..virtual_drill() };
    let effects = update(model, described(&own).into());
    assert_eq!((sent(&effects), kept(&effects), model.machine.as_ref()), (Vec::new(), None, &own));
    let effects = update(model, choose("3018").into());
    let asked = sent(&effects);
    assert!(
        asked.len() == 1 && asked[0].contains("configure") && asked[0].contains("3018 router"),
        "{asked:?}"
    );
    assert_eq!(model.machine.as_ref(), &router, "planned for at once");
    update(model, described(&router).into());
    // A later change is one of this machine.
    let mut changed = router.clone();
    changed.process.feed_mm_per_s = 3.0;
    let effects = update(model, described(&changed).into());
    assert!(kept(&effects).unwrap().contains("stroke.feed"), "{effects:?}");
    assert_eq!(model.machine.as_ref(), &changed);
    // The virtual drill's own settings come back with it.
    update(model, choose("virtual").into());
    assert_eq!(model.machine.as_ref(), &own);
    let name = "3018".to_owned();
    update(model, MachineEvent::Forget { name }.into());
    update(model, choose("3018").into());
    assert_eq!(model.machine.as_ref(), &router);
}

#[test]
fn undone_choice_gives_the_virtual_drill_its_settings_back() {
    let mut line = Line::told("alone linked yours status:Ready");
    let model = &mut line.model;
    let own = Machine { rack_tolerance: annulus_core::units::Length::from_um(70), ..virtual_drill() };
    update(model, described(&own).into());
    update(model, choose("3018").into());
    update(model, described(&played(&preset("3018").unwrap()).unwrap()).into());
    machines::taken_back(model);
    assert_eq!((model.machines.chosen.as_deref(), model.machine.as_ref()), (None, &own));
}

#[test]
fn drill_of_another_visit_gets_the_chosen_settings() {
    let mut line = Line::told("alone linked yours status:Ready");
    let text = r#"{"chosen":null,"played":"3018","machines":[]}"#.to_owned();
    update(&mut line.model, MachineEvent::Kept { text }.into());
    assert_eq!(line.model.machine.as_ref(), &virtual_drill());
    let router = played(&preset("3018").unwrap()).unwrap();
    let effects = update(&mut line.model, described(&router).into());
    assert!(sent(&effects).iter().any(|text| text.contains("configure")), "{effects:?}");
    assert_eq!(line.model.machine.as_ref(), &virtual_drill());
}

#[test]
fn machine_stays_while_a_job_runs() {
    let mut line = Line::told("alone linked yours status:Running");
    update(&mut line.model, described(&virtual_drill()).into());
    let effects = update(&mut line.model, choose("3018").into());
    assert_eq!((kept(&effects), line.model.machine.as_ref()), (None, &virtual_drill()));
}

#[test]
fn connected_controller_gets_the_model_and_can_be_imported() {
    let mut line = Line::told("alone mill");
    let mut of_controller = played(&preset("3018").unwrap()).unwrap();
    of_controller.name = "GRBL 1.1h".to_owned();
    of_controller.x.max_speed_mm_per_s = 11.0;
    update(&mut line.model, described(&of_controller).into());
    assert_eq!(owner(&line.model), MachineOwner::Controller);
    let effects = update(&mut line.model, choose("genmitsu-3018-pro").into());
    let asked = sent(&effects);
    assert!(asked.iter().any(|text| text.contains("controller.mill")), "{asked:?}");
    assert_eq!(line.model.machine.as_ref(), &of_controller, "the controller's settings count");
    update(&mut line.model, MachineEvent::Import.into());
    let machines = &line.model.machines;
    assert_eq!(machines.own_names(), ["own-1"]);
    assert_eq!(machines.machine("own-1").unwrap().x.max_speed_mm_per_s, 11.0);
}

#[test]
fn copy_is_chosen_and_its_settings_are_open() {
    let mut model = alone();
    update(&mut model, choose("3018").into());
    update(&mut model, MachineEvent::Copy.into());
    assert_eq!((model.machine.name.as_str(), model.frame.tab), ("3018 router, copy", Tab::Settings));
    assert_eq!(model.machines.chosen.as_deref(), Some("own-1"));
    assert_eq!(model.machines.preset("own-1"), "3018");
    update(&mut model, MachineEvent::Forget { name: "own-1".to_owned() }.into());
    assert_eq!((model.machine.name.as_str(), model.machines.own_names().len()), ("3018 router", 0));
    let undo = model.frame.toasts.last().unwrap().number;
    update(&mut model, FrameEvent::Taken { number: undo }.into());
    assert_eq!((model.machine.name.as_str(), model.machines.own_names().len()), ("3018 router, copy", 1));
    let kept = model.machines.own[0].changes.clone();
    assert!(
        kept.contains(&("machine.name".to_owned(), Value::Text("3018 router, copy".to_owned()))),
        "{kept:?}"
    );
}
