//! Postprocessors: lists their blocks and parameters, prints the built-in ones, and checks the user's.

use super::{Answer, Refusal, diagnostic_lines, diagnostic_objects, export, sentence};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::post;
use serde_json::json;
use std::fmt::Write;

/// Arguments of `annulus templates`.
#[derive(Debug, clap::Args)]
pub(crate) struct TemplatesArgs {
    /// Print this built-in postprocessor, or check a file of your own (FILE.toml) [default: list blocks and
    /// parameters].
    #[arg(value_name = "NAME|FILE", value_parser = export::target_name)]
    pub(crate) dialect: Option<String>,
}

pub(crate) fn run(args: &TemplatesArgs) -> Result<Answer, Refusal> {
    let Some(name) = args.dialect.as_deref() else { return Ok(table()) };
    if let Some((_, text)) = post::shipped().find(|(known, _)| *known == name) {
        return Ok(Answer::new(&json!({ "name": name, "text": text }), text.to_owned()));
    }
    let text = export::own(name, &shipped())?;
    let checked = |told: String, found: &[Diagnostic]| {
        let object = json!({ "name": name, "diagnostics": diagnostic_objects(found) });
        Answer::new(&object, told + "\n" + &diagnostic_lines(found))
    };
    let faults = post::check(name, &text);
    if !faults.is_empty() {
        let told = sentence("post.fault_count", &[("count", &faults.len())]);
        return Ok(checked(told, &faults).with_error(export::faulty(name, &faults)));
    }
    let dialect = post::Dialect::parse(name, &text).map_err(Refusal::content)?;
    let told = sentence("post.sound", &[("file", &name), ("dialect", &dialect.name)]);
    Ok(checked(told, &post::warnings(&dialect)))
}

fn shipped() -> Vec<&'static str> {
    post::shipped().map(|(name, _)| name).collect()
}

fn table() -> Answer {
    let (mut text, mut blocks, mut parameters) = (String::new(), Vec::new(), Vec::new());
    for part in post::TemplateKind::ALL {
        let meaning = sentence(&format!("post.part.{}", part.key()), &[]);
        let _ = writeln!(text, "[{}] {meaning}", part.key());
        for row in post::BLOCKS.iter().filter(|row| row.part == part) {
            let meaning = sentence(&format!("post.block.{}.{}", part.key(), row.block.key()), &[]);
            let _ = writeln!(text, "  {:<10} {meaning}", row.block.key());
            blocks.push(json!({
                "template": part.key(), "block": row.block.key(), "required": row.required, "hint": meaning,
            }));
        }
    }
    for row in post::PARAMETERS {
        let meaning = sentence(&format!("post.parameter.{}", row.name), &[]);
        let name = format!("@{}@", row.name);
        let _ = writeln!(text, "{name:<10} {:<7} {:<10} {meaning}", row.unit, row.example);
        let stands: Vec<&str> = row.blocks.iter().map(|block| block.key()).collect();
        parameters.push(json!({
            "name": row.name, "unit": row.unit, "example": row.example, "blocks": stands, "hint": meaning,
        }));
    }
    let _ = writeln!(text, "{}", shipped().join(" "));
    Answer::new(&json!({ "blocks": blocks, "parameters": parameters, "dialects": shipped() }), text)
}
