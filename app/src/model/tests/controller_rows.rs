//! A controller at a serial port: connecting, losing and releasing it, and the confirmation before the page
//! is left.

use super::line::{Line, compare};
use crate::model::start::{may_start, rows_now, ticked_as};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::{PreflightRow, RowVerdict};

#[test]
fn controller_is_chosen_by_the_user_and_replaces_the_bridge() {
    compare(
        &[
            // nothing happens without Web Serial
            ("begin want", "unpaired | "),
            ("no-serial begin-kept", "connecting | connect"),
            ("no-serial begin-kept want", "connecting | "),
            ("serial begin want", "unpaired | choose-port"),
            ("serial begin chosen", "connecting | keep-controller:true connect-controller"),
            ("serial begin want-known", "connecting | keep-controller:true connect-controller"),
            // replaces the bridge or the page's virtual drill
            (
                "serial begin-kept challenge welcome chosen",
                "connecting | keep-controller:true connect-controller",
            ),
            ("serial begin chosen challenge", "connecting | hello"),
            ("serial begin chosen challenge welcome", "open | take_control ping"),
            // across a reload
            ("serial-kept begin", "connecting | connect-controller"),
            ("serial-kept begin-kept", "connecting | connect-controller"),
            ("serial-kept begin-token", "connecting | pair"),
            ("serial-kept begin-token paired", "connecting | connect-controller"),
            ("serial-kept begin-token not-paired", "connecting | connect-controller"),
            // the next baud rate is tried at once
            ("serial begin chosen other-speed", "connecting | connect-controller"),
            ("serial begin chosen challenge welcome other-speed", "connecting | connect-controller"),
            ("serial begin other-speed", "unpaired | "),
            // lost, retried, plugged in
            ("mill closed", "lost | wake:250"),
            ("mill closed retry", "lost | connect-controller"),
            ("mill closed plugged", "lost | connect-controller"),
            ("mill closed plugged retry-before", "lost | "),
            ("mill plugged", "open | "),
            ("serial begin plugged", "unpaired | "),
            ("serial begin chosen port-failed", "connecting | wake:250"),
            ("serial begin port-failed", "unpaired | "),
            // released
            ("mill let-go", "connecting | keep-controller:false leave-port connect"),
            ("serial begin chosen let-go", "unpaired | keep-controller:false leave-port"),
            ("serial begin let-go", "unpaired | "),
            ("mill status:Running let-go", "open | "),
            ("ready serial status:Running want", "open | "),
        ],
        |line| format!("{} | {}", line.phase(), line.out()),
    );
}

#[test]
fn machine_data_belongs_to_the_connected_machine() {
    compare(
        &[
            ("mill", "true Some(Ready) true"),
            ("ready", "false Some(Ready) true"),
            ("ready serial chosen", "true None false"),
            ("mill let-go", "false None false"),
            ("mill interrupted let-go", "false None false"),
            ("mill closed", "true Some(Ready) true"),
            // the device at the port has not identified itself: no requests
            ("mill closed plugged challenge welcome", "true None true"),
            ("mill closed plugged challenge welcome status:Ready", "true Some(Ready) true"),
            ("ready closed retry challenge welcome", "false Some(Ready) true"),
        ],
        |line| {
            let link = &line.model.link;
            format!("{} {:?} {}", link.controller.chosen, link.state(), link.ever)
        },
    );
    compare(
        &[
            ("mill", "GRBL 1.1h"),
            ("ready", ""),
            ("mill let-go", ""),
            ("mill let-go chosen", ""),
            // at the port of the bridge
            ("linked who", "GRBL 1.1h"),
            ("linked who who-else", "GRBL 1.1h"),
            ("linked who closed retry challenge welcome", ""),
        ],
        |line| {
            let who = line.model.link.controller.who.as_ref();
            who.map_or_else(String::new, |who| format!("{} {}", who.flavour, who.version))
        },
    );
    compare(
        &[
            ("serial begin", "false"),
            ("serial begin port-known", "true"),
            ("serial begin chosen let-go", "true"),
            ("serial begin plugged", "true"),
        ],
        |line| line.model.link.controller.known.to_string(),
    );
}

#[test]
fn known_port_connects_only_to_the_known_controller() {
    let said = |line: &Line| {
        let refused = line.model.link.refused.as_ref().map_or("", |why| why.code.as_str());
        format!("{} | {} | {refused}", line.phase(), line.out())
    };
    let left = "keep-controller:false leave-port";
    compare(
        &[
            ("mill closed plugged opened-like-it challenge welcome who", "open |  | "),
            (
                "mill closed plugged opened-like-it challenge welcome who-else",
                &format!("connecting | {left} connect | serial.other_board"),
            ),
            // The user chose the port: every controller is accepted.
            ("mill closed plugged opened challenge welcome who-else", "open | keep-board | "),
            ("mill let-go chosen opened challenge welcome who-else", "open | keep-board | "),
            // After a reload only the known controller.
            ("serial-kept begin opened-like-it challenge welcome who", "open | keep-board | "),
            (
                "serial-other-kept begin opened-like-it challenge welcome who",
                &format!("unpaired | {left} | serial.other_board"),
            ),
            ("serial begin chosen several", &format!("unpaired | {left} | serial.several")),
            ("serial begin several", "unpaired |  | "),
        ],
        said,
    );
}

#[test]
fn disturbed_line_is_reported_once_and_counted() {
    compare(
        &[
            ("mill opened disturbed", "1"),
            ("mill opened disturbed disturbed-again", "2"),
            ("mill opened disturbed close:refused disturbed-again", ""),
            ("mill opened disturbed close:refused closed plugged opened disturbed", "1"),
            // At a wrong baud rate, before a controller has answered.
            ("serial begin chosen opened disturbed", ""),
            ("serial begin chosen adapter disturbed", "1"),
        ],
        |line| {
            let why = line.model.link.refused.as_ref().filter(|why| why.code == "serial.disturbed");
            why.map_or_else(String::new, |why| why.argument(&["times"]).unwrap_or_default().to_owned())
        },
    );
}

#[test]
fn page_that_feeds_a_job_guards_closing_and_holds() {
    compare(
        &[
            ("mill status:Running", "guard:true"),
            ("mill status:Running status:Running", ""),
            ("mill status:Running status:Ready", "guard:false"),
            ("mill status:Jogging", "guard:true"),
            ("ready status:Running", ""),
            ("mill page-left", ""),
            ("mill status:Running page-left", "hold-port"),
            // An adapter stops without a hold.
            ("mill adapter status:Running page-left", ""),
            ("ready status:Running page-left", ""),
            // A bridge continues the job without the page.
            ("ready who status:Running", ""),
            ("ready who status:Running page-left", ""),
            // On a site without a bridge the virtual drill and its job live in the page.
            ("alone ready status:Running:a", "fetch guard:true"),
            ("alone ready status:Running:a status:Paused:a", ""),
            ("alone ready status:Running:a status:Ready", "guard:false"),
            ("alone ready status:Jogging", ""),
            ("ready status:Running:a", "fetch"),
        ],
        Line::out,
    );
}

#[test]
fn screen_stays_on_from_preflight_to_job_end() {
    compare(
        &[
            ("ready planned preflight", "lit"),
            ("ready planned preflight close-it", "dark"),
            ("ready status:Running", "lit"),
            ("ready status:Running status:Paused", ""),
            ("ready status:Running status:Ready", "dark"),
            ("ready planned", ""),
        ],
        Line::awake,
    );
    let may_with = |awake: Option<bool>, ticked: &[&str]| {
        let line = Line::told("ready planned preflight uploaded armed");
        let rows = rows_now(line.model.start.preflight.as_ref(), line.model.link.armed.as_ref(), awake);
        may_start(&rows.unwrap(), &ticked.iter().map(|code| (*code).to_owned()).collect())
    };
    assert!(may_with(Some(true), &[]));
    assert!(!may_with(Some(false), &[]));
    assert!(may_with(Some(false), &["page.preflight.may_sleep"]));
}

#[test]
fn equal_warnings_of_two_tools_are_confirmed_separately() {
    let bit = |name: &str| PreflightRow {
        finding: Diagnostic::error("job.bit_breaks").with("bit", name),
        verdict: RowVerdict::Warn,
    };
    let rows = [bit("drill 0.4"), bit("drill 0.8")];
    let ticked = |names: &[&str]| names.iter().map(|name| ticked_as(&bit(name).finding)).collect();
    assert!(!may_start(&rows, &ticked(&["drill 0.4"])));
    assert!(may_start(&rows, &ticked(&["drill 0.4", "drill 0.8"])));
}

#[test]
fn job_starts_without_fingerprint_only_on_a_controller() {
    let may = |line: &Line| {
        let rows = rows_now(line.model.start.preflight.as_ref(), line.model.link.armed.as_ref(), None);
        rows.map_or_else(String::new, |rows| {
            format!("{} {}", rows.len(), may_start(&rows, &line.model.start.ticked))
        })
    };
    compare(
        &[
            ("mill planned preflight uploaded armed-mill", "0 true"),
            ("mill planned preflight uploaded armed-warn", "1 false"),
            ("ready planned preflight uploaded armed-mill", "1 false"),
            // The controller at the port of the bridge plans its own motion too.
            ("ready who planned preflight uploaded armed-mill", "0 true"),
            ("ready planned preflight uploaded armed", "1 true"),
        ],
        may,
    );
    compare(
        &[
            ("mill planned preflight uploaded armed-mill start", "start"),
            ("mill planned preflight", "upload"),
        ],
        Line::out,
    );
}

#[test]
fn tool_change_allows_jogging_only_on_a_controller() {
    compare(
        &[
            ("mill step", "jog renew"),
            ("mill status:ToolChange step", "jog renew"),
            ("ready status:ToolChange step", ""),
            ("mill status:Running step", ""),
        ],
        Line::out,
    );
}
