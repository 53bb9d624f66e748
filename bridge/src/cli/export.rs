//! Writes a program in another controller's words (S6, S8, N24).
//!
//! Comes in: a JOB and the name of a controller. Goes out: a file, whole or not at all. Does not know any controller.

use super::{Answer, Exit, Refusal, remark_lines, remark_objects};
use crate::job;
use annulus_core::locale;
use annulus_core::post;
use annulus_core::remark::{Remark, Weight};
use annulus_core::wire::program;
use serde_json::json;

/// Arguments of `annulus export`.
#[derive(Debug, clap::Args)]
pub(crate) struct ExportArgs {
    #[command(flatten)]
    pub(crate) job: super::JobArgs,
    /// Controller: excellon or grbl.
    #[arg(long, value_name = "NAME")]
    pub(crate) to: String,
    /// Where to write: a file, or a folder.
    #[arg(short, long, value_name = "FILE|DIR")]
    pub(crate) output: std::path::PathBuf,
}

/// Runs the command.
pub(crate) fn run(args: &ExportArgs) -> Result<Answer, Refusal> {
    let unknown = || {
        let known = post::targets().join(", ");
        Refusal::usage(
            Remark::new(Weight::Loss, "post.unknown_target").with("name", &args.to).with("known", known),
        )
    };
    if !post::targets().contains(&args.to.as_str()) {
        return Err(unknown());
    }
    let job = job::open(&args.job)?;
    let (text, extension) =
        post::write(&args.to, &job.program).ok_or_else(unknown)?.map_err(Refusal::content)?;
    let file = if args.output.is_dir() {
        args.output.join(job::stem(&args.job.job)).with_extension(extension)
    } else {
        args.output.clone()
    };
    job::write_output(&file, text.as_bytes())?;
    let (name, holes) = (file.display().to_string(), job.program.hole_count());
    let words = [("holes".to_owned(), holes.to_string()), ("file".to_owned(), name.clone())];
    let said = locale::text("en", "post.report", &words) + "\n" + &remark_lines(&job.remarks);
    let object = json!({
        "to": args.to,
        "file": name,
        "bytes": text.len(),
        "sha256": program::key(text.as_bytes()),
        "holes": holes,
        "tools": job.program.bits.len(),
        "remarks": remark_objects(&job.remarks),
    });
    Ok(Answer { object, text: said, exit: Exit::Done })
}
