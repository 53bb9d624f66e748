//! The machine's settings as they are typed, and the colours of the page, by rows.

use crate::keys::Tab;
use crate::model::{Effect, FrameEvent, Model, SettingsDraft, SettingsEvent, Theme, update};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::setting;

/// The settings screen, where this was typed.
fn typed(rows: &[(&'static str, &str)]) -> Model {
    let mut model = Model::default();
    update(&mut model, FrameEvent::Show { tab: Tab::Settings }.into());
    for (key, text) in rows {
        let event = SettingsEvent::Type { key, text: (*text).to_owned() };
        assert_eq!(update(&mut model, event.into()), [], "typing asks for nothing");
    }
    model
}

/// What was typed, what would change, and what is wrong with it.
#[test]
fn what_is_typed_is_compared_with_the_machine() {
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
fn a_draft_is_applied_at_once_discarded_or_left_behind() {
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
fn colours_are_shown_and_kept_and_known_again_by_their_word() {
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
