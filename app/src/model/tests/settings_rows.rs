//! Edits of the machine's settings, and the page's colours.

use crate::keys::Tab;
use crate::model::rack::{self, DIAMETER, FORM, NUMBER, RACK_KEY};
use crate::model::{Effect, FrameEvent, LinkEvent, Model, SettingsDraft, SettingsEvent, Theme, update};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{ToolWear, Value, apply, setting, virtual_drill};
use annulus_core::wire::{Tell, ToolsReport};

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
