//! The proof of a planned side, and what of it must be read before anything is made of it.
//!
//! Comes in: a board as it lies, its program, the job. Goes out: [`Proved`]; names of findings. Does not know workers.

use super::cache::Cache;
use super::messages::{Proved, ToProve};
use super::planning::Side;
use annulus_core::board::Board;
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Region;
use annulus_core::job::Program;
use annulus_core::proof::{self, Verdict};
use annulus_core::wire::program;

/// What copper the program leaves, against the board as it lies. `progress` is told how far it is.
pub(super) fn prove(
    wanted: &ToProve,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Proved, Vec<Diagnostic>> {
    let program = program::decode(&wanted.program).map_err(|diagnostic| vec![diagnostic])?;
    let last = cache.last(wanted.board_key)?;
    let key = key(&last.laid_key, &program, &wanted.work);
    let verdict = match cache.verdict(&key) {
        Some(known) => known,
        None => {
            let board = &cache.last(wanted.board_key)?.planned.board;
            let made = verdict(board, &program, &wanted.work, progress);
            cache.keep_verdict(key, made)
        }
    };
    let last = cache.last(wanted.board_key)?;
    let mut findings = verdict.findings.clone();
    let ours = last.program == program::key(&wanted.program);
    for finding in findings.iter_mut().filter(|_| ours) {
        let index = finding.leg.and_then(|(_, leg)| last.planned.operation_at(&program, leg));
        finding.operation = index.and_then(|index| last.titles.get(index as usize).cloned());
    }
    Ok(Proved {
        findings,
        more: verdict.more,
        groups: verdict.groups.clone(),
        whole: verdict.whole.clone(),
        islands: verdict.islands,
        nets: verdict.nets,
    })
}

/// Names of the findings of the program of a side that a person must have read. What was proved is not proved again; `progress`
/// is told how far it is.
pub(super) fn to_be_read(
    side: &Side,
    work: &Work,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Vec<String> {
    let key = key(&side.laid_key, &side.program, work);
    let verdict = match cache.verdict(&key) {
        Some(known) => known,
        None => cache.keep_verdict(key, verdict(&side.planned.board, &side.program, work, progress)),
    };
    proof::to_be_read(&verdict.groups).map(|(_, id)| id.to_owned()).collect()
}

/// A digest of all that a proof depends on: how the board lies, what is cut where, what the job promises. How fast is no part of it.
fn key(laid_key: &str, program: &Program, work: &Work) -> String {
    let face = work.setup.face;
    let mut bytes = program::encode(&proof::unhurried(program));
    bytes.extend(format!("{laid_key} {face:?} {:?}", work.promised(face)).into_bytes());
    program::key(&bytes)
}

/// What copper `program` leaves on `board`. The copper left itself is not kept.
fn verdict(board: &Board, program: &Program, work: &Work, progress: &mut dyn FnMut(u64, u64)) -> Verdict {
    let face = work.setup.face;
    let options = proof::ProofOptions::of(face, work.promised(face));
    let verdict = proof::prove_telling(board, std::slice::from_ref(program), &options, progress);
    Verdict { left: Region::default(), ..verdict }
}
