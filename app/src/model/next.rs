//! The line at the foot of the page: the proof of the open board in one sentence, and the next step.
//!
//! ```text
//! open ─▶ files ─▶ problems ─▶ toolpaths ─▶ simulate ─▶ export or run
//!         └ something to accept ┘  └ not seen yet ─┘
//! ```

use super::{Effect, Model};
use crate::keys::Tab;
use crate::said::{Text, key};
use annulus_core::proof::Proven;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NextStep {
    /// Check the files: the import review is open, or an error is not accepted.
    Files,
    /// Fix or accept problems of the job.
    Problems,
    Toolpaths,
    Simulate,
    /// Export the programs, or run them on the machine.
    Run,
}

/// The meaning of the sentence about the proof.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProofState {
    /// All nets are isolated, and every problem is accepted.
    Proved,
    /// Problems are not accepted.
    Open,
    /// There is nothing to prove.
    Nothing,
    /// Not proved yet.
    Waits,
    /// The job can't be planned.
    Refused,
}

/// The proof in the sentence that the command line prints, or why there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct ProofSentence {
    pub state: ProofState,
    pub text: Text,
}

/// The screens that the user has seen since the board was planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visited {
    /// The board that this is about.
    board_key: Option<u32>,
    toolpaths: bool,
    simulation: bool,
}

/// Records the screens that show the plan.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let board_key = model.board.document.as_ref().map(|document| document.reading.board_key);
    if model.visited.board_key != board_key {
        model.visited = Visited { board_key, ..Visited::default() };
    }
    if model.board.plan.is_some() && !model.board.reviewing {
        let tab = model.frame.tab;
        model.visited.toolpaths |= matches!(tab, Tab::Cam | Tab::Simulate);
        model.visited.simulation |= tab == Tab::Simulate;
    }
    Vec::new()
}

impl Model {
    /// `None` without a board.
    pub fn next_step(&self) -> Option<NextStep> {
        let board = &self.board;
        board.document.as_ref()?;
        Some(if board.reviewing || board.unseen().is_some() {
            NextStep::Files
        } else if !board.refused.is_empty() || board.unread(&self.job.read) > 0 {
            NextStep::Problems
        } else if !self.visited.toolpaths {
            NextStep::Toolpaths
        } else if !self.visited.simulation {
            NextStep::Simulate
        } else {
            NextStep::Run
        })
    }

    /// The screen that lists the first problem to solve.
    pub fn problems_tab(&self) -> Tab {
        let board = &self.board;
        let at_board = board.reviewing || !board.refused.is_empty() || board.unseen().is_some();
        if !at_board && board.has_job_problems() { Tab::Cam } else { Tab::Board }
    }

    /// `None` without a board.
    pub fn proof_sentence(&self) -> Option<ProofSentence> {
        let board = &self.board;
        let document = board.document.as_ref()?;
        let sentence = |state, text| Some(ProofSentence { state, text });
        if board.reviewing {
            return sentence(ProofState::Waits, Text::of(key!("page.next.in_review")));
        }
        if let Some(why) = board.refused.first() {
            return sentence(ProofState::Refused, Text::Found(why.clone()));
        }
        let in_files = document.unseen_errors(&board.accepted).count();
        if in_files > 0 {
            let args = vec![("count", in_files.to_string())];
            return sentence(ProofState::Open, Text::Key { key: key!("page.next.in_files"), args });
        }
        let Some(proved) = board.proved.as_ref().filter(|_| !board.stale) else {
            return sentence(ProofState::Waits, Text::of(key!("page.cam.not_proved")));
        };
        let unread = board.unread(&self.job.read);
        let state = match proved.outcome.proven {
            _ if unread > 0 => ProofState::Open,
            Proven::Copper if proved.outcome.isolates => ProofState::Proved,
            Proven::Copper | Proven::NoCopper | Proven::OtherSide => ProofState::Nothing,
        };
        let (key, args) = proved.outcome.sentence(unread);
        sentence(state, Text::Key { key, args })
    }
}
