//! Proves a planned side, and selects the problems that the user must read before an export.

use super::cache::Cache;
use super::messages::ToProve;
use super::planning::{Side, refuse_too_large};
use annulus_core::board::Board;
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Region;
use annulus_core::job::Program;
use annulus_core::proof::{self, Verdict};
use annulus_core::wire::program;

/// Proves the copper that the program leaves, against the placed board.
pub(super) fn prove(
    wanted: &ToProve,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Verdict, Vec<Diagnostic>> {
    let program = program::decode(&wanted.program).map_err(|diagnostic| vec![diagnostic])?;
    let last = cache.last(wanted.board_key)?;
    let key = key(&last.laid_key, &program, &wanted.work);
    let verdict = match cache.verdict(&key) {
        Some(known) => known,
        None => {
            let board = &cache.last(wanted.board_key)?.planned.board;
            refuse_too_large(board, std::slice::from_ref(&program))?;
            let made = verdict(board, &program, &wanted.work, progress);
            cache.keep_verdict(key, made)
        }
    };
    let last = cache.last(wanted.board_key)?;
    let mut verdict = Verdict::clone(&verdict);
    let ours = last.program == program::key(&wanted.program);
    for finding in verdict.findings.iter_mut().filter(|_| ours) {
        let index = finding.leg.and_then(|(_, leg)| last.planned.operation_at(&program, leg));
        finding.operation = index.and_then(|index| last.titles.get(index as usize).cloned());
    }
    Ok(verdict)
}

/// Names of a side's problems that the user must read. Uses a cached proof if there is one.
pub(super) fn to_be_read(
    side: &Side,
    work: &Work,
    cache: &mut Cache,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<String>, Vec<Diagnostic>> {
    let key = key(&side.laid_key, &side.program, work);
    let verdict = match cache.verdict(&key) {
        Some(known) => known,
        None => {
            refuse_too_large(&side.planned.board, std::slice::from_ref(&side.program))?;
            cache.keep_verdict(key, verdict(&side.planned.board, &side.program, work, progress))
        }
    };
    Ok(proof::to_be_read(&verdict.groups).map(|(_, id)| id.to_owned()).collect())
}

/// Digest of everything that a proof depends on: placement, cuts and promised limits. Speeds do not matter.
fn key(laid_key: &str, program: &Program, work: &Work) -> String {
    let face = work.setup.face;
    let mut bytes = program::encode(&proof::unhurried(program));
    bytes.extend(format!("{laid_key} {face:?} {:?}", work.promised(face)).into_bytes());
    program::key(&bytes)
}

/// Proves `program` against `board`. Drops the remaining copper, which is large.
fn verdict(board: &Board, program: &Program, work: &Work, progress: &mut dyn FnMut(u64, u64)) -> Verdict {
    let face = work.setup.face;
    let options = proof::ProofOptions::of(face, work.promised(face));
    let verdict = proof::prove_telling(board, std::slice::from_ref(program), &options, progress);
    Verdict { left: Region::default(), ..verdict }
}
