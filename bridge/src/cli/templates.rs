//! Postprocessors: lists their blocks and parameters, prints the built-in ones, and checks the user's.

use super::{Answer, Exit, Refusal, diagnostic_lines, diagnostic_objects, export};
use annulus_core::error;
use annulus_core::locale;
use annulus_core::post;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// Arguments of `annulus templates`.
#[derive(Debug, clap::Args)]
pub(crate) struct TemplatesArgs {
    /// Print this built-in postprocessor, or check a file of your own (FILE.toml) [default: list blocks and
    /// parameters].
    #[arg(value_name = "NAME|FILE")]
    pub(crate) dialect: Option<String>,
}

pub(crate) fn run(args: &TemplatesArgs) -> Result<Answer, Refusal> {
    let Some(name) = args.dialect.as_deref() else { return Ok(table()) };
    if let Some((_, text)) = post::shipped().find(|(known, _)| *known == name) {
        return Ok(Answer {
            object: json!({ "name": name, "text": text }),
            text: text.to_owned(),
            exit: Exit::Done,
        });
    }
    if !Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
        let known: Vec<&str> = post::shipped().map(|(name, _)| name).collect();
        let diagnostic = error!("post.unknown_target", name = name, ..);
        let diagnostic = diagnostic.with("nearest", post::nearest_target(name));
        return Err(Refusal::usage(diagnostic.with("known", known.join(", "))));
    }
    let text = export::read(Path::new(name))?;
    let faults = post::check(name, &text);
    if !faults.is_empty() {
        let told = locale::text("en", "post.fault_count", &[("count".to_owned(), faults.len().to_string())]);
        let object = json!({ "name": name, "diagnostics": diagnostic_objects(&faults) });
        let text = format!("{told}\n{}", diagnostic_lines(&faults));
        return Ok(Answer::refused(object, &text, export::faulty(name, &faults)));
    }
    let dialect = post::Dialect::parse(name, &text).map_err(Refusal::content)?;
    let warnings = post::warnings(&dialect);
    let words = [("file".to_owned(), name.to_owned()), ("dialect".to_owned(), dialect.name)];
    let text = locale::text("en", "post.sound", &words) + "\n" + &diagnostic_lines(&warnings);
    let object = json!({ "name": name, "diagnostics": diagnostic_objects(&warnings) });
    Ok(Answer { object, text, exit: Exit::Done })
}

fn hint(key: &str) -> String {
    locale::text("en", key, &[])
}

fn table() -> Answer {
    let (mut text, mut blocks, mut parameters) = (String::new(), Vec::new(), Vec::new());
    for part in post::TemplateKind::ALL {
        let _ = writeln!(text, "[{}] {}", part.key(), hint(&format!("post.part.{}", part.key())));
        for row in post::BLOCKS.iter().filter(|row| row.part == part) {
            let meaning = hint(&format!("post.block.{}.{}", part.key(), row.block.key()));
            let _ = writeln!(text, "  {:<10} {meaning}", row.block.key());
            blocks.push(json!({
                "template": part.key(), "block": row.block.key(), "required": row.required, "hint": meaning,
            }));
        }
    }
    for row in post::PARAMETERS {
        let meaning = hint(&format!("post.parameter.{}", row.name));
        let name = format!("@{}@", row.name);
        let _ = writeln!(text, "{name:<10} {:<7} {:<10} {meaning}", row.unit, row.example);
        let stands: Vec<&str> = row.blocks.iter().map(|block| block.key()).collect();
        parameters.push(json!({
            "name": row.name, "unit": row.unit, "example": row.example, "blocks": stands, "hint": meaning,
        }));
    }
    let shipped: Vec<&str> = post::shipped().map(|(name, _)| name).collect();
    let _ = writeln!(text, "{}", shipped.join(" "));
    let object: Value = json!({ "blocks": blocks, "parameters": parameters, "dialects": shipped });
    Answer { object, text, exit: Exit::Done }
}
