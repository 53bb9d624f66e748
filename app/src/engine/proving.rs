//! The proof of a planned side, and what of it must be read before anything is made of it.
//!
//! Comes in: a board as it lies, its program, the job. Goes out: [`Proved`]; names of findings. Does not know workers.

use super::cache::Cache;
use super::messages::{Proved, ToProve};
use annulus_core::board::Board;
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Program;
use annulus_core::proof::{self, Group, Verdict};
use annulus_core::wire::program;

/// What copper the program leaves, against the board as it lies.
pub(super) fn prove(wanted: &ToProve, cache: &mut Cache) -> Result<Proved, Vec<Diagnostic>> {
    let last = cache.last(wanted.board_key)?;
    let program = program::decode(&wanted.program).map_err(|diagnostic| vec![diagnostic])?;
    let key = program::key(&wanted.program);
    let mut verdict = verdict(&last.planned.board, &program, &wanted.work);
    let ours = last.program == key;
    for finding in verdict.findings.iter_mut().filter(|_| ours) {
        let index = finding.leg.and_then(|(_, leg)| last.planned.operation_at(&program, leg));
        finding.operation = index.and_then(|index| last.titles.get(index as usize).cloned());
    }
    cache.keep_proof(key, must_be_read(&verdict.groups));
    Ok(Proved {
        findings: verdict.findings,
        more: verdict.more,
        groups: verdict.groups,
        whole: verdict.whole,
        islands: verdict.islands,
        nets: verdict.nets,
    })
}

/// Names of the findings of `program` on `board` that a person must have read. A program that was proved is not proved again.
pub(super) fn to_be_read(board: &Board, program: &Program, work: &Work, cache: &mut Cache) -> Vec<String> {
    let key = program::key(&program::encode(program));
    if let Some(known) = cache.proof(&key) {
        return known;
    }
    let names = must_be_read(&verdict(board, program, work).groups);
    cache.keep_proof(key, names.clone());
    names
}

fn verdict(board: &Board, program: &Program, work: &Work) -> Verdict {
    let face = work.setup.face;
    let options = proof::ProofOptions::of(face, work.promised(face));
    proof::prove(board, std::slice::from_ref(program), &options)
}

fn must_be_read(groups: &[Group]) -> Vec<String> {
    proof::to_be_read(groups).map(|(_, id)| id.to_owned()).collect()
}
