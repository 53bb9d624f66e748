//! Edits of the machine's settings, and the page's colours.

use crate::keys::Tab;
use crate::model::rack::{self, DIAMETER, FORM, NUMBER, RACK_KEY};
use crate::model::settings::{is_found, parts};
use crate::model::{
    Effect, FrameEvent, LinkEvent, Model, SettingsDraft, SettingsEvent, Theme, ToastAct, update,
};
use crate::said::{Text, key};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{CHANGER_KEY, LENGTH_KEY, ResetOnOpen, SETTER_KEY, ToolLengths, ToolSetter};
use annulus_core::machine::{
    Group, MILL_KEY, Machine, ToolWear, Value, apply, read, setting, six_spindles, virtual_drill,
};
use annulus_core::wire::{ControllerReport, Tell, ToolsReport};

fn typed(rows: &[(&'static str, &str)]) -> Model {
    let mut model = Model::default();
    update(&mut model, FrameEvent::Show { tab: Tab::Settings }.into());
    for (key, text) in rows {
        let event = SettingsEvent::Type { key, text: (*text).to_owned() };
        assert_eq!(update(&mut model, event.into()), [], "typing asks for nothing");
    }
    model
}

/// The typed text, the expected change, and the expected refusal.
#[test]
fn typed_settings_are_compared_with_the_machine() {
    let own = setting("x.max_speed").unwrap().value(&Model::default().machine).to_string();
    type Row<'a> = (&'a [(&'static str, &'a str)], &'a str, &'a str);
    let rows: [Row<'_>; 8] = [
        (&[], "", ""),
        (&[("x.max_speed", "41")], "x.max_speed=41", ""),
        (&[("x.max_speed", &own)], "", ""),
        (&[("x.max_speed", "41"), ("x.max_speed", "42")], "x.max_speed=42", ""),
        (&[("x.max_speed", "41"), ("machine.name", "mine")], "machine.name=mine x.max_speed=41", ""),
        (&[("x.max_speed", "fast")], "x.max_speed=fast", "machine.setting_kind"),
        (&[("x.max_speed", "-1")], "x.max_speed=-1", "machine.setting_range"),
        (&[("x.home_end", "left")], "x.home_end=left", "machine.setting_choice"),
    ];
    for (rows, changes, refused) in rows {
        let model = typed(rows);
        let changed = model.settings.changes(&model.machine);
        let words: Vec<_> = changed.iter().map(|(key, value)| format!("{key}={value}")).collect();
        assert_eq!(words.join(" "), changes, "{rows:?}");
        let codes: Vec<_> = model.settings.refusals(&model.machine).into_iter().map(|why| why.code).collect();
        assert_eq!(codes.join(" "), refused, "{rows:?}");
    }
}

#[test]
fn draft_settings_are_applied_discarded_or_dropped() {
    let rows = [("x.max_speed", "41"), ("machine.name", "mine")];
    let mut model = typed(&rows);
    model.link.refused = Some(Diagnostic::error("control.moving"));
    let effects = update(&mut model, SettingsEvent::Apply.into());
    let sent: Vec<_> = effects
        .iter()
        .filter_map(|effect| if let Effect::Send { text } = effect { Some(text) } else { None })
        .collect();
    assert!(
        matches!(sent[..], [text] if text.contains("configure") && text.contains("x.max_speed") && text.contains("mine")),
        "{sent:?}"
    );
    assert_eq!((&model.settings, &model.link.refused), (&SettingsDraft::default(), &None));

    let mut model = typed(&rows);
    assert_eq!(update(&mut model, SettingsEvent::Discard.into()), []);
    assert_eq!(model.settings, SettingsDraft::default());

    let mut model = typed(&rows);
    update(&mut model, FrameEvent::Show { tab: Tab::Settings }.into());
    assert_eq!(model.settings.typed.len(), 2, "nobody left");
    update(&mut model, FrameEvent::Show { tab: Tab::Board }.into());
    assert_eq!(model.settings, SettingsDraft::default());
}

fn hear(model: &mut Model, tell: Tell) {
    update(model, LinkEvent::Heard { tell: Some(Box::new(tell)) }.into());
}

fn describe(model: &mut Model, machine: &Machine) {
    let (settings, fingerprint) = (read(machine), machine.fingerprint());
    hear(model, Tell::Machine { settings, fingerprint, faults: None });
}

/// The text of the last request in `effects`.
fn asked(effects: &[Effect]) -> String {
    let sent = effects.iter().rev().find_map(|effect| match effect {
        Effect::Send { text } => Some(text.clone()),
        _ => None,
    });
    sent.unwrap_or_default()
}

fn toasts(model: &Model) -> Vec<(Text, Option<ToastAct>)> {
    model.frame.toasts.iter().map(|toast| (toast.text.clone(), toast.act)).collect()
}

/// A page that has applied a speed of 41 mm/s, and the machine before and after it.
fn applied() -> (Model, Machine, Machine) {
    let before = virtual_drill();
    let speed = ("x.max_speed".to_owned(), Value::Number(41.0));
    let after = apply(&before, &[speed]).unwrap();
    let mut model = typed(&[]);
    describe(&mut model, &before);
    update(&mut model, SettingsEvent::Type { key: "x.max_speed", text: "41".to_owned() }.into());
    let effects = update(&mut model, SettingsEvent::Apply.into());
    assert!(asked(&effects).contains("[[\"x.max_speed\",41"), "{effects:?}");
    (model, before, after)
}

#[test]
fn applied_settings_can_be_undone_once_the_machine_has_them() {
    let (mut model, before, after) = applied();
    assert_eq!(toasts(&model), [], "the machine has not answered");
    describe(&mut model, &after);
    let offer = (Text::of(key!("page.settings.applied")), Some(ToastAct::UndoSettings));
    assert_eq!(toasts(&model), [offer]);
    let number = model.frame.toasts[0].number;
    let effects = update(&mut model, FrameEvent::Taken { number }.into());
    let own = setting("x.max_speed").unwrap().value(&before);
    assert!(asked(&effects).contains(&format!("[[\"x.max_speed\",{own}")), "{effects:?}");
    describe(&mut model, &before);
    assert_eq!(toasts(&model), [(Text::of(key!("page.settings.restored")), None)]);
}

#[test]
fn refused_settings_are_typed_again() {
    let (mut model, _, after) = applied();
    hear(&mut model, Tell::Refused { why: Diagnostic::error("control.moving") });
    let typed: Vec<_> = model.settings.typed.iter().map(|(key, text)| format!("{key}={text}")).collect();
    assert_eq!(typed, ["x.max_speed=41"]);
    describe(&mut model, &after);
    assert_eq!(toasts(&model), [], "another page applied it");
}

#[test]
fn undo_of_settings_ends_with_their_screen_and_connection() {
    let (mut model, _, after) = applied();
    describe(&mut model, &after);
    update(&mut model, FrameEvent::Show { tab: Tab::Board }.into());
    assert_eq!(toasts(&model), []);

    let (mut model, _, after) = applied();
    model.link.tries += 1;
    describe(&mut model, &after);
    assert_eq!(toasts(&model), [], "the answer is of another connection");
}

fn report() -> ControllerReport {
    ControllerReport {
        flavour: "GRBL".to_owned(),
        version: "1.1h".to_owned(),
        values: Vec::new(),
        mill: None,
        lengths: ToolLengths::default(),
        reset_on_open: ResetOnOpen::Usual,
        changer: vec!["M6 T{tool}".to_owned()],
    }
}

#[test]
fn settings_of_a_controller_wait_for_apply_too() {
    let number = |text: &str| format!("1\n2\n-3\n{text}\n150\n25");
    let (good, bad, decimal) = (number("40"), number("nothing"), number("40,5"));
    type Row<'a> = (&'static str, &'a str, &'a str, &'a str);
    let rows: [Row<'_>; 8] = [
        (MILL_KEY, "shapeoko-3", "controller.mill=shapeoko-3", ""),
        (MILL_KEY, "", "", ""),
        (LENGTH_KEY, "setter", "controller.length=setter", ""),
        (LENGTH_KEY, "board", "", ""),
        (SETTER_KEY, &good, "controller.setter=1 2 -3 40 150 25", ""),
        (SETTER_KEY, &decimal, "controller.setter=1 2 -3 40.5 150 25", ""),
        (SETTER_KEY, &bad, "controller.setter=1\n2\n-3\nnothing\n150\n25", "setter.bad"),
        (CHANGER_KEY, "M6 T{tool}\n\n", "", ""),
    ];
    let who = report();
    for (key, text, changes, refused) in rows {
        let model = typed(&[(key, text)]);
        let all = model.settings.all_changes(&model.machine, Some(&who));
        let words: Vec<_> = all.iter().map(|(key, value)| format!("{key}={value}")).collect();
        assert_eq!(words.join(" "), changes, "{key} {text}");
        let codes: Vec<_> = model.settings.refusals(&model.machine).into_iter().map(|why| why.code).collect();
        assert_eq!(codes.join(" "), refused, "{key} {text}");
        assert_eq!(model.settings.all_changes(&model.machine, None), [], "no controller");
    }
}

#[test]
fn undo_restores_a_controller_but_for_a_setter_that_had_no_position() {
    let mut model = typed(&[(MILL_KEY, "shapeoko-3"), (SETTER_KEY, "1\n2\n-3\n40\n150\n25")]);
    hear(&mut model, Tell::Controller(report()));
    update(&mut model, SettingsEvent::Apply.into());
    describe(&mut model, &virtual_drill());
    let number = model.frame.toasts[0].number;
    let effects = update(&mut model, FrameEvent::Taken { number }.into());
    let sent = asked(&effects);
    assert!(sent.contains("[[\"controller.mill\",\"\"]]"), "{sent}");

    let mut who = report();
    who.lengths.setter = Some(ToolSetter::usual([5.0, 6.0], -1.0));
    let draft = SettingsDraft::default();
    assert_eq!(draft.own_text(Some(&who), SETTER_KEY), "5\n6\n-1\n40\n150\n25");
    assert_eq!(draft.own_text(None, SETTER_KEY), "");
}

#[test]
fn groups_show_what_the_machine_has_and_fold_the_rest() {
    let shown = |group: Group, machine: &Machine, plans: bool| {
        let word = |part: &crate::model::settings::Part| {
            let mark = if part.is_used { "" } else { "-" };
            format!("{mark}{}:{}+{}", part.section, part.rows.len(), part.advanced.len())
        };
        parts(group, machine, plans).iter().map(word).collect::<Vec<_>>().join(" ")
    };
    let (one, six) = (virtual_drill(), six_spindles());
    assert_eq!(shown(Group::Machine, &one, false), "machine:4+1 x:8+9 y:8+9 z:8+9 park:4+0");
    assert_eq!(shown(Group::Probing, &one, false), "stroke:3+0 change:5+0");
    assert_eq!(shown(Group::Probing, &one, true), "stroke:1+0");
    assert_eq!(shown(Group::Machine, &one, true), "machine:3+0 x:8+9 y:8+9 z:8+9 park:4+0");
    assert_eq!(shown(Group::Spindle, &one, false), "-converter:4+3 spindle:3+0 -foot:3+0");
    assert_eq!(shown(Group::Spindle, &six, false), "-converter:4+3 spindle:4+3 -foot:3+0");
    assert_eq!(shown(Group::Tools, &one, false), "rack:2+0 -magazine:4+4 change:2+0");
    assert_eq!(shown(Group::Motion, &one, false), "drive:2+6 motion:5+4 overlap:2+3 stroke:7+3");
    assert_eq!(shown(Group::Motion, &one, true), "-drive:2+6 motion:5+4 -overlap:2+3 stroke:7+3");
}

#[test]
fn search_finds_every_word_in_any_text() {
    let texts = ["Greatest speed", "x.max_speed", "If it is too high, the motor loses steps.", "Łuk"];
    let texts = texts.map(str::to_owned);
    let rows = [
        ("speed", true),
        ("SPEED greatest", true),
        ("x.max", true),
        ("motor speed", true),
        ("łUK", true),
        ("  ", true),
        ("speed spindle", false),
    ];
    for (sought, found) in rows {
        assert_eq!(is_found(sought, &texts), found, "{sought}");
    }
    let mut model = typed(&[("x.max_speed", "41")]);
    update(&mut model, SettingsEvent::Seek { text: "speed".to_owned() }.into());
    update(&mut model, SettingsEvent::Discard.into());
    assert_eq!(model.settings.sought, "speed", "only the changes are discarded");
}

#[test]
fn change_or_refusal_opens_what_is_folded() {
    let model = typed(&[("x.max_speed", "41"), ("x.backlash", "-1")]);
    let refused = model.settings.refusals(&model.machine);
    for (keys, wanted) in [
        (["x.max_speed", "x.phases"], true),
        (["x.backlash", "x.index"], true),
        (["x.phases", "x.index"], false),
    ] {
        assert_eq!(model.settings.concerns(&refused, &keys), wanted, "{keys:?}");
    }
    assert!(SettingsDraft::default().concerns(&refused, &["x.backlash"]), "by its refusal alone");
}

#[test]
fn theme_is_shown_and_restored_by_its_word() {
    for theme in Theme::ALL {
        let mut model = Model::default();
        assert_eq!(
            update(&mut model, FrameEvent::Colours { theme }.into()),
            [Effect::Colours { word: theme.word() }]
        );
        assert_eq!((model.frame.theme, Theme::called(theme.word())), (theme, theme));
    }
    assert_eq!(Theme::called("pink"), Theme::Auto);
}

fn with_rack() -> Model {
    let mut model = typed(&[]);
    let lines = ["T1 drill 0.8", "T7 vee 3.175 tip 0.1 angle 30 life 50"].map(str::to_owned).to_vec();
    let changes = [(RACK_KEY.to_owned(), Value::Texts(lines))];
    model.machine = std::sync::Arc::new(apply(&virtual_drill(), &changes).unwrap());
    model
}

#[test]
fn tool_cells_are_typed_separately_and_invalid_ones_refused() {
    type Row<'a> = (&'a [(usize, &'static str, &'a str)], &'a str, &'a str);
    let second = "T7 vee 3.175 tip 0.1 angle 30 life 50";
    let rows: [Row<'_>; 9] = [
        (&[(0, "life", "2000")], "T1 drill 0.8 life 2000", ""),
        (&[(0, "down", "12,5"), (0, "place", "3")], "T1 drill 0.8 down 12.5 place 3", ""),
        (&[(0, "life", "2000"), (0, "life", "")], "T1 drill 0.8", ""),
        (&[(0, NUMBER, "4"), (0, DIAMETER, "0,90")], "T4 drill 0.9", ""),
        (&[(0, FORM, "vee")], "T1 vee 0.8 tip 0.1 angle 30", ""),
        (&[(0, FORM, "vee"), (0, FORM, "mill")], "T1 mill 0.8", ""),
        (&[(0, "life", "many holes")], "T1 drill 0.8 life manyholes", "machine.tool_range"),
        (&[(0, DIAMETER, "")], "T1 drill ?", "machine.tool_range"),
        (&[(0, NUMBER, "7")], "T7 drill 0.8", "machine.tool_twice"),
    ];
    for (cells, line, refused) in rows {
        let mut model = with_rack();
        for (row, column, text) in cells {
            let event = SettingsEvent::TypeTool { row: *row, column, text: (*text).to_owned() };
            assert_eq!(update(&mut model, event.into()), []);
        }
        let lines = model.settings.rack(&model.machine);
        assert_eq!(lines, [line, second], "{cells:?}");
        let codes: Vec<_> = model.settings.refusals(&model.machine).into_iter().map(|why| why.code).collect();
        assert_eq!(codes.join(" "), refused, "{cells:?}");
    }
}

#[test]
fn tools_can_be_added_and_removed_and_show_their_wear() {
    let mut model = with_rack();
    update(&mut model, SettingsEvent::AddTool.into());
    update(&mut model, SettingsEvent::RemoveTool { row: 0 }.into());
    update(&mut model, SettingsEvent::RemoveTool { row: 9 }.into());
    let lines = model.settings.rack(&model.machine);
    assert_eq!(lines, ["T7 vee 3.175 tip 0.1 angle 30 life 50", "T8 drill 1"]);
    assert_eq!(rack::cell(&lines[0], "life"), "50");
    assert_eq!([rack::cell(&lines[0], "rpm"), rack::cell(&lines[1], NUMBER)], ["", "8"]);
    let effects = update(&mut model, SettingsEvent::Apply.into());
    let sent = effects.iter().any(
        |effect| matches!(effect, Effect::Send { text } if text.contains("rack.tools") && text.contains("T8 drill 1")),
    );
    assert!(sent, "{effects:?}");
    let mut wear = ToolWear::new("mine", &model.machine.rack[0]);
    wear.hits = 12;
    let report = ToolsReport { wear: vec![wear], in_spindle: Some(1), wanted: None };
    let tell = Some(Box::new(Tell::Tools(report.clone())));
    update(&mut model, LinkEvent::Heard { tell }.into());
    assert_eq!(model.link.tools, report);
}
