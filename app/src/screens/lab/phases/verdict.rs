//! The errors of the table, as sentences.

use crate::i18n::{advice, message, t};
use crate::widgets::{Icon, icon};
use annulus_core::diagnostic::Diagnostic;
use leptos::html::{h3, li, p, section, span, strong, ul};
use leptos::prelude::*;

pub(super) fn verdict(findings: Memo<Vec<Diagnostic>>) -> impl IntoView {
    let count = move || findings.with(Vec::len);
    section().class("block findings").attr("aria-label", t!("page.lab.phases.findings")).child((
        h3().child(t!("page.lab.phases.findings")),
        p().class("row").attr("role", "status").child(move || {
            if count() == 0 {
                (icon(Icon::Check).into_any(), span().child(t!("page.lab.phases.sound")).into_any())
            } else {
                let many = t!("page.lab.phases.wrong", count = count());
                (icon(Icon::Warning).into_any(), span().child(many).into_any())
            }
        }),
        ul().child(move || {
            findings.get().into_iter().map(|finding| line(finding).into_any()).collect::<Vec<_>>()
        }),
    ))
}

fn line(finding: Diagnostic) -> impl IntoView {
    let cure = finding.clone();
    li().child((strong().child(move || message(&finding)), p().class("quiet").child(move || advice(&cure))))
}
