//! The link to the bridge: connecting, control, STOP, jogging, alarms, preflight.

use super::line::{Line, compare};

#[test]
fn page_pairs_and_connects() {
    compare(
        &[
            ("begin", "unpaired | "),
            ("begin-token", "connecting | pair"),
            ("begin-token paired", "connecting | connect"),
            ("begin-token not-paired", "unpaired | "),
            ("begin-kept", "connecting | connect"),
            ("begin-kept challenge", "connecting | hello"),
            ("begin challenge", "unpaired | "),
            ("begin-kept challenge welcome", "open | take_control ping"),
            ("begin-kept challenge welcome again", "open | "),
            ("begin again", "connecting | connect"),
            ("begin-kept again", "connecting | connect"),
        ],
        |line| format!("{} | {}", line.phase(), line.out()),
    );
}

#[test]
fn lost_link_is_retried_with_growing_delays() {
    compare(
        &[
            ("begin-kept closed", "connecting | wake:250"),
            ("begin-kept closed retry", "connecting | connect"),
            ("begin-kept closed retry closed", "connecting | wake:500"),
            ("begin-kept closed retry closed retry closed", "connecting | wake:1000"),
            ("linked closed", "lost | wake:250"),
            ("linked closed retry closed", "lost | wake:500"),
            ("linked closed retry closed again closed", "lost | wake:250"),
            ("linked closed retry challenge welcome closed", "lost | wake:250"),
            ("linked closed retry", "lost | connect"),
            ("linked closed retry challenge welcome", "open | take_control"),
            ("linked closed closed", "lost | wake:500"),
            ("linked retry", "open | "),
            // a restarted bridge does not know this page's session
            ("begin-kept unknown closed", "unpaired | forget-session"),
            ("begin-kept closed retry unknown closed", "unpaired | forget-session"),
            ("begin-kept unknown closed again", "connecting | connect"),
            ("linked unknown closed", "lost | wake:250"),
        ],
        |line| format!("{} | {}", line.phase(), line.out()),
    );
}

#[test]
fn old_status_becomes_stale_then_lost() {
    compare(
        &[
            ("linked", "Fresh"),
            ("linked +900 tick", "Fresh"),
            ("linked +1000 tick", "Stale"),
            ("linked +2999 tick", "Stale"),
            ("linked +3000 tick", "Lost"),
            ("linked +3000 tick status:Ready", "Fresh"),
            ("linked +3000 tick unread tick", "Fresh"),
            ("linked +1500 tick pong tick", "Fresh"),
            ("begin-kept +9000 tick", "Fresh"),
            ("linked closed +5000 tick", "Lost"),
        ],
        |line| format!("{:?}", line.model.link.freshness),
    );
}

#[test]
fn firmware_difference_is_shown_until_closed() {
    compare(
        &[
            ("linked status:Ready", "none"),
            ("linked other-firmware", "0000000a 0000000c"),
            ("linked other-firmware other-firmware", "0000000a 0000000c"),
            ("linked other-firmware close:firmware", "none"),
            ("linked other-firmware close:firmware other-firmware", "none"),
            ("linked other-firmware close:firmware newer-firmware", "0000000b 0000000c"),
            ("linked other-firmware status:Ready", "none"),
            ("linked other-firmware close:firmware status:Ready other-firmware", "0000000a 0000000c"),
        ],
        |line| {
            let other = line.model.link.other_firmware.map(|other| other.warning());
            other.map_or("none".to_owned(), |why| {
                why.args.into_iter().map(|(_, number)| number).collect::<Vec<_>>().join(" ")
            })
        },
    );
}

#[test]
fn open_link_is_pinged_every_800_ms() {
    compare(
        &[
            ("linked tick", ""),
            ("linked +799 tick", ""),
            ("linked +800 tick", "ping"),
            ("linked +800 tick tick", ""),
            ("linked +800 status:Ready", "ping"),
            ("linked +800 tick +800 tick", "ping"),
            ("linked closed +5000 tick", ""),
            ("begin-kept +5000 tick", ""),
        ],
        Line::out,
    );
}

#[test]
fn lapsed_control_is_requested_again_with_the_reason() {
    compare(
        &[
            ("linked", "no |  | take_control"),
            ("linked yours", "yours |  | keep-control"),
            ("linked yours yours", "yours |  | "),
            ("linked others", "no |  | "),
            // lost by three seconds of silence
            ("linked yours nobody", "no | Silent | take_control"),
            ("linked yours nobody yours", "yours |  | "),
            // another page took control
            ("linked yours others", "no | Taken | give-up-control"),
            ("linked yours others nobody", "no |  | "),
            ("linked yours others close:ousted", "no |  | "),
            // released on purpose
            ("linked yours release", "yours |  | release_control give-up-control"),
            ("linked yours release nobody", "no |  | "),
            ("linked yours release take nobody", "no | Silent | "),
            // an earlier connection of this page still has control
            ("linked yours closed", "no |  | wake:250"),
            ("linked yours closed retry challenge welcome others", "no |  | "),
            ("linked yours closed retry challenge welcome others nobody", "no |  | take_control"),
            ("begin-kept-control challenge welcome others nobody", "no |  | take_control"),
            ("begin-kept challenge welcome others nobody", "no |  | "),
        ],
        |line| {
            let yours = if line.model.link.control.yours { "yours" } else { "no" };
            let ousted = line.model.link.ousted.map_or_else(String::new, |why| format!("{why:?}"));
            format!("{yours} | {ousted} | {}", line.out().replace(" ping", ""))
        },
    );
}

#[test]
fn stop_is_sent_first_and_warned_about_if_unanswered() {
    compare(
        &[
            ("linked yours stop", "quiet | stop ping wake:255"),
            ("linked yours stop +255 looked", "shout | "),
            ("linked yours stop pong looked", "quiet | "),
            ("linked yours stop +255 looked pong", "quiet | "),
            ("linked yours stop pong-before +255 looked", "shout | "),
            ("linked yours stop status:Stopping +255 looked", "quiet | "),
            ("linked yours stop status:Running +255 looked", "shout | "),
            ("linked yours stop status:Running status:Ready +255 looked", "quiet | "),
            ("linked yours stop +100 looked", "quiet | "),
            // without a link STOP is stored and sent first on the next one
            ("begin stop", "shout | "),
            ("linked yours closed stop", "shout | "),
            ("linked yours closed stop retry", "shout | connect"),
            // among the tabs of a site, the one that owns the machine stops it
            ("closed stop", "shout | "),
            ("alone closed stop", "shout | stop-beside"),
            ("alone closed stop heard-beside", "quiet | "),
            ("alone closed stop-beside", "quiet | "),
            ("linked yours stop-beside", "quiet | stop ping wake:255 heard-beside"),
            ("linked yours stop heard-beside +255 looked", "shout | "),
            ("linked yours closed stop retry challenge welcome", "shout | stop ping wake:255 take_control"),
            ("linked yours closed stop retry challenge welcome pong", "quiet | "),
            // the link broke before the answer
            ("linked yours stop closed", "shout | wake:250"),
            ("linked yours stop closed retry challenge welcome", "shout | stop ping wake:255 take_control"),
            ("linked yours stop pong closed", "quiet | wake:250"),
            ("linked yours stop pong closed retry challenge welcome", "quiet | take_control"),
            // the socket is closed, but the event has not arrived yet
            ("linked yours stop not-sent", "shout | "),
            (
                "linked yours stop not-sent closed retry challenge welcome",
                "shout | stop ping wake:255 take_control",
            ),
            ("linked yours home not-sent", "quiet | "),
            ("linked stop +255 looked close:stop", "quiet | "),
            // STOP does not need control
            ("linked others stop", "quiet | stop ping wake:255"),
        ],
        |line| {
            let shout = if line.model.link.stop_unconfirmed { "shout" } else { "quiet" };
            format!("{shout} | {}", line.out())
        },
    );
}

#[test]
fn escape_pauses_first_and_then_stops() {
    compare(
        &[
            ("linked yours status:Ready escape", ""),
            ("linked yours status:Running escape", "pause"),
            ("linked yours status:Running escape +1500 escape", "stop ping wake:255"),
            ("linked yours status:Running escape +20 escape", "stop ping wake:255"),
            ("linked yours status:Running escape +1501 escape", "pause"),
            ("linked yours status:Running escape status:Pausing +9000 escape", "stop ping wake:255"),
            ("linked yours status:Running escape status:Paused +9000 escape", ""),
            ("linked yours status:Jogging escape", ""),
            ("linked yours status:Jogging escape escape", "stop ping wake:255"),
            ("linked others status:Running escape", ""),
            ("linked yours status:Running pause", "pause"),
            ("linked yours status:Paused pause", ""),
            ("linked others status:Running pause", ""),
        ],
        Line::out,
    );
}

#[test]
fn jog_continues_only_while_the_page_renews_it() {
    compare(
        &[
            ("ready step", "jog renew"),
            ("ready step step", "jog"),
            ("ready step renew", "jog_on"),
            ("ready step +499 renew", "jog_on"),
            ("ready step +500 renew", "no-renew"),
            ("ready step +500 renew renew", ""),
            ("ready step status:Jogging +500 renew", "jog_on"),
            ("ready step status:Jogging +500 status:Ready renew", "no-renew"),
            ("ready step renew-hidden", "no-renew"),
            ("ready down long", "jog renew"),
            ("ready down long up", "no-renew"),
            ("ready down long up renew", ""),
            ("ready down long up up", ""),
            ("ready down long closed renew", "no-renew"),
            ("ready down long up step", "jog renew"),
            ("renew", ""),
            ("up", ""),
        ],
        Line::out,
    );
}

#[test]
fn short_press_is_one_step_and_long_press_jogs() {
    compare(
        &[
            ("ready down", "wake:300"),
            ("ready down up", "jog renew"),
            ("ready down off", ""),
            ("ready down off long", ""),
            ("ready down gone", ""),
            ("ready down gone long", ""),
            ("ready down long off", "no-renew"),
            ("ready down long gone", "no-renew"),
            ("ready down long other-down", "no-renew"),
            ("ready down long same-down", ""),
            ("ready down long down-second", "no-renew"),
            ("ready down down-second up-second", ""),
            ("ready down up-second", ""),
            ("ready down long shown", "no-renew"),
            ("ready down off down long", "jog renew"),
            // no jog unless the machine is ready, its data fresh and control ours
            ("linked yours down", ""),
            ("linked yours step", ""),
            ("linked others status:Ready step", ""),
            ("linked yours status:Running step", ""),
            ("ready closed step", ""),
            ("ready +3000 tick step", ""),
            ("ready down status:Alarm up", ""),
        ],
        |line| line.out().replace("ping", "").trim().to_owned(),
    );
}

#[test]
fn keys_jog_only_while_armed() {
    compare(
        &[
            ("ready right", ""),
            ("ready arm", "wake:30000"),
            ("ready arm right", "wake:30000 wake:300"),
            ("ready arm right right-up", "jog renew"),
            ("ready arm right left-up", ""),
            ("ready arm right right-again", "wake:30000"),
            ("ready arm right long", "jog renew"),
            ("ready arm right long right-up", "no-renew"),
            ("ready arm right long other-key", "no-renew"),
            ("ready arm right long shift-up", "no-renew"),
            ("ready arm right long focus-left", "no-renew"),
            ("ready arm right long gone", "no-renew"),
            ("ready arm right other-key right-up", ""),
            ("ready arm arm right", ""),
            ("ready arm focus-left right", ""),
            ("ready arm idle right", ""),
            ("ready arm right right-up right-ten right-up", "jog"),
            ("ready arm down focus-left up", "jog renew"),
        ],
        Line::out,
    );
    let step_um = |words: &str| Line::told(words).model.link.hand.step_um;
    assert_eq!([step_um("finer"), step_um("finer finer finer"), step_um("finer shown")], [100, 10, 1_000]);
}

#[test]
fn link_events_are_logged() {
    compare(
        &[
            ("linked", "link asked"),
            ("linked yours", "link asked control"),
            ("linked yours yours", "link asked control"),
            ("linked status:Ready", "link asked machine"),
            ("linked status:Ready status:Ready", "link asked machine"),
            ("linked status:Ready status:Alarm", "link asked machine machine trouble"),
            ("linked status:Alarm status:Alarm", "link asked machine trouble"),
            ("linked closed", "link asked link"),
            ("linked closed closed", "link asked link"),
            ("linked refused", "link asked trouble"),
            ("linked nothing-to-do", "link asked"),
            ("linked machine", "link asked settings"),
            ("linked machine machine-same", "link asked settings"),
            ("linked home", "link asked asked"),
            ("linked ended", "link asked machine"),
            ("linked clear-log", ""),
            ("linked clear-log home", "asked"),
        ],
        Line::log,
    );
}

#[test]
fn notices_stay_until_closed() {
    let notices = |line: &Line| {
        let link = &line.model.link;
        let facts = [
            (link.refused.is_some(), "refused"),
            (link.ousted.is_some(), "ousted"),
            (link.ended.is_some(), "ended"),
            (link.ended.as_ref().is_some_and(|ended| ended.by_you), "by-you"),
            (link.interrupted.is_some(), "interrupted"),
        ];
        facts.iter().filter(|(on, _)| *on).map(|(_, word)| *word).collect::<Vec<_>>().join(" ")
    };
    compare(
        &[
            ("linked refused", "refused"),
            ("linked refused status:Ready", "refused"),
            ("linked refused close:refused", ""),
            ("linked refused home", ""),
            ("linked refused home refused", "refused"),
            ("linked status:Alarm refused", "refused"),
            ("linked status:Alarm refused status:Alarm", "refused"),
            ("linked status:Alarm refused status:Ready", ""),
            ("linked nothing-to-do", ""),
            ("linked taken", ""),
            ("linked ended", "ended"),
            ("linked ended close:ended", ""),
            ("linked stop stopped", "ended by-you"),
            ("linked stop +60000 stopped", "ended by-you"),
            ("linked stop +60001 stopped", "ended"),
            ("linked stopped", "ended"),
            ("linked stop ended", "ended"),
            ("linked interrupted", "interrupted"),
            ("linked interrupted ended", "ended"),
            ("linked interrupted forget", ""),
            ("linked yours others refused", "refused ousted"),
        ],
        notices,
    );
}

#[test]
fn job_starts_without_failures_and_with_confirmed_warnings() {
    let stands = |line: &Line| {
        let shown = if line.model.start.preflight.is_some() { "shown" } else { "" };
        format!("{shown} | {}", line.out())
    };
    compare(
        &[
            ("linked yours preflight", " | "),
            ("linked yours planned preflight", "shown | upload"),
            ("linked yours planned preflight uploaded", "shown | arm"),
            ("linked yours planned preflight not-uploaded", "shown | "),
            ("linked yours planned preflight uploaded start", "shown | "),
            ("linked yours planned preflight uploaded armed start", " | start"),
            ("linked yours planned preflight uploaded armed start start", " | "),
            ("linked yours planned preflight uploaded armed-other-steps start", "shown | "),
            // Digests are compared only after this page has applied the same height map.
            ("linked yours planned preflight uploaded map armed-levelled start", "shown | "),
            ("linked yours planned preflight uploaded map armed-levelled timed start", " | start"),
            ("linked yours planned preflight uploaded armed-levelled start", "shown | "),
            ("linked yours planned preflight uploaded armed-other-job start", "shown | "),
            ("linked yours planned preflight uploaded armed-fail start", "shown | "),
            ("linked yours planned preflight uploaded armed-warn start", "shown | "),
            ("linked yours planned preflight uploaded armed-warn tick-it start", " | start"),
            ("linked yours planned preflight uploaded armed-warn tick-it tick-it start", "shown | "),
            (
                "linked yours planned preflight uploaded armed-warn tick-it preflight uploaded armed-warn start",
                "shown | ",
            ),
            ("linked yours planned preflight close-it", " | "),
            ("linked yours planned preflight close-it uploaded", " | "),
            ("linked yours planned preflight close-it armed start", " | "),
            // an older upload is ignored
            ("linked yours planned preflight preflight old-uploaded", "shown | "),
            ("linked yours planned preflight preflight old-uploaded uploaded", "shown | arm"),
            // the result of an older preflight is dropped
            ("linked yours planned preflight uploaded armed preflight start", "shown | "),
        ],
        stands,
    );
}

#[test]
fn unknown_program_is_fetched_and_timed() {
    let stands = |line: &Line| {
        let start = &line.model.start;
        let shown = start.shown.as_ref().map_or("", |job| if job.key == "k" { "k" } else { "own" });
        let preflight =
            start.preflight.as_ref().map_or(String::new(), |one| format!("from {}", one.from_leg));
        format!("{shown} {preflight} | {}", line.out())
    };
    compare(
        &[
            ("linked status:Running:k", "  | fetch"),
            ("linked status:Running:k status:Running:k", "  | "),
            ("linked status:Running:k fetched", "  | time"),
            ("linked status:Running:k fetched timed", "k  | "),
            ("linked status:Running:k not-fetched", "  | "),
            ("linked status:Running:k fetched-broken", "  | "),
            ("linked status:Running:k fetched timed status:Ready", "  | "),
            // until its notice is closed
            ("linked status:Running:k fetched timed ended status:Ready", "k  | "),
            ("linked status:Running:k fetched timed ended status:Ready close:ended", "  | "),
            ("linked status:Running:k fetched timed status:Ready status:Running:k", "k  | "),
            ("linked planned status:Ready", "own  | "),
            ("linked planned status:Running:k", "  | fetch"),
            ("linked planned status:Running:k fetched timed", "k  | "),
            ("linked yours resume", "  | fetch"),
            ("linked yours resume fetched timed", " from 7 | upload"),
            ("linked yours resume fetched timed resume", " from 7 | upload"),
            ("linked yours resume not-fetched", "  | "),
            ("linked yours missing", "  | fetch"),
            ("linked yours missing fetched timed", "  | time"),
            ("linked yours missing fetched timed timed", " from 0 | upload"),
            ("linked yours resume fetched timed uploaded", " from 7 | arm"),
            ("linked yours status:Running:k resume fetched fetched", "  | "),
        ],
        stands,
    );
}

#[test]
fn planning_uses_the_machine_of_the_bridge() {
    let name = |words: &str| Line::told(words).model.machine.name.clone();
    assert_eq!(name("linked machine"), "Drill one");
    assert_eq!(name("linked machine closed"), "Drill one", "as it was known last");
    assert_ne!(name("linked"), "Drill one");
}
