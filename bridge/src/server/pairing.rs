//! Authentication: exchanges single-use tokens for sessions.
//!
//! ```text
//! token (128 bit, once, 10 min) ── POST /api/pair ──▶ session id + key (256 bit, in memory only)
//! ```
//!
//! Nothing here is ever written to disk or to the log.

use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::{Paired, Scope, auth};
use std::net::IpAddr;

pub(crate) const TOKEN_LIFE_MS: u64 = 10 * 60 * 1000;
/// Most unused tokens; a further one replaces the oldest.
const TOKENS: usize = 8;
/// Most sessions; a further one replaces the least recently used.
const SESSIONS: usize = 256;
/// Most peers whose wrong tokens are counted; a further one replaces the oldest.
const PEERS: usize = 64;
/// Wrong tokens in a row without a wait; every further one doubles the wait, starting with one second.
const FREE_ATTEMPTS: u32 = 5;
const LONGEST_WAIT_MS: u64 = 60_000;

pub(crate) fn secret<const N: usize>() -> Result<String, Diagnostic> {
    let mut bytes = [0; N];
    match getrandom::fill(&mut bytes) {
        Ok(()) => Ok(auth::hex(&bytes)),
        Err(error) => Err(error!("door.no_chance", reason = error)),
    }
}

struct Token {
    text: String,
    scope: Scope,
    end_ms: u64,
}

/// An authenticated page.
#[derive(Clone)]
pub(crate) struct Session {
    id: String,
    /// Its key, in hexadecimal.
    pub(crate) key: String,
    pub(crate) scope: Scope,
}

#[derive(Default)]
pub(crate) struct Pairing {
    tokens: Vec<Token>,
    sessions: Vec<Session>,
    peers: Vec<Peer>,
}

struct Peer {
    address: IpAddr,
    wrong: u32,
    waits_until_ms: u64,
}

#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Rejection {
    /// Wrong, used or too old.
    Token,
    /// Too many wrong ones; try again after this many seconds.
    Wait(u64),
    /// The system provided no random bytes.
    NoSecret(Diagnostic),
}

impl Session {
    pub(crate) fn id(&self) -> &str {
        &self.id
    }
}

impl Pairing {
    pub(crate) fn token(&mut self, scope: Scope, now_ms: u64) -> Result<String, Diagnostic> {
        let text = secret::<16>()?;
        if self.tokens.len() == TOKENS {
            self.tokens.remove(0);
        }
        self.tokens.push(Token { text: text.clone(), scope, end_ms: now_ms + TOKEN_LIFE_MS });
        Ok(text)
    }

    /// Exchanges `claimed` for a session. Compares every token in constant time, so that the time reveals
    /// nothing. A right token is accepted despite earlier wrong ones: on this computer all peers look
    /// alike, and 128 bits cannot be guessed. Only senders of wrong tokens must wait, for longer each time.
    pub(crate) fn pair(&mut self, claimed: &str, peer: IpAddr, now_ms: u64) -> Result<Paired, Rejection> {
        self.tokens.retain(|token| now_ms < token.end_ms);
        // Compares with all tokens, so the time tells nothing about a match.
        let found = self.tokens.iter().enumerate().fold(None, |found, (index, token)| {
            if auth::same(token.text.as_bytes(), claimed.as_bytes()) { Some(index) } else { found }
        });
        // A correct token is accepted even while its address has to wait.
        let Some(index) = found else { return Err(self.wrong(peer, now_ms)) };
        let id = secret::<16>().map_err(Rejection::NoSecret)?;
        let key = secret::<32>().map_err(Rejection::NoSecret)?;
        let scope = self.tokens.remove(index).scope;
        self.peers.retain(|known| known.address != peer);
        if self.sessions.len() == SESSIONS {
            self.sessions.remove(0);
        }
        self.sessions.push(Session { id: id.clone(), key: key.clone(), scope });
        Ok(Paired { ok: true, session: id, key })
    }

    fn wrong(&mut self, peer: IpAddr, now_ms: u64) -> Rejection {
        let known = self.peers.iter().position(|known| known.address == peer);
        let index = known.unwrap_or_else(|| {
            if self.peers.len() == PEERS {
                self.peers.remove(0);
            }
            self.peers.push(Peer { address: peer, wrong: 0, waits_until_ms: 0 });
            self.peers.len() - 1
        });
        let peer = &mut self.peers[index];
        if now_ms < peer.waits_until_ms {
            return Rejection::Wait((peer.waits_until_ms - now_ms).div_ceil(1000));
        }
        peer.wrong = peer.wrong.saturating_add(1);
        if let Some(beyond) = peer.wrong.checked_sub(FREE_ATTEMPTS) {
            let wait_ms = 1000_u64.saturating_mul(1 << beyond.min(16)).min(LONGEST_WAIT_MS);
            peer.waits_until_ms = now_ms + wait_ms;
        }
        Rejection::Token
    }

    /// The session `id`; marks it as used now.
    pub(crate) fn session(&mut self, id: &str) -> Option<Session> {
        let index = self.sessions.iter().position(|session| session.id == id)?;
        // Moved to the end: the least recently used session is dropped first.
        let session = self.sessions.remove(index);
        self.sessions.push(session.clone());
        Some(session)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);

    #[test]
    fn token_works_once_and_expires() {
        let mut pairing = Pairing::default();
        let (one, two) = (pairing.token(Scope::Run, 0).unwrap(), pairing.token(Scope::View, 1_000).unwrap());
        assert_eq!(one.len(), 32);
        assert_ne!(one, two);
        let paired = pairing.pair(&one, HERE, 1_000).unwrap();
        let session = pairing.session(&paired.session).unwrap();
        assert_eq!((session.key, session.scope), (paired.key.clone(), Scope::Run));
        assert_eq!(paired.key.len(), 64);
        assert_eq!(pairing.pair(&one, HERE, 1_000), Err(Rejection::Token));
        assert_eq!(pairing.pair(&two, HERE, 1_000 + TOKEN_LIFE_MS), Err(Rejection::Token));
        assert!(pairing.session("no such session").is_none());
    }

    #[test]
    fn wrong_tokens_increase_the_wait() {
        let mut pairing = Pairing::default();
        let token = pairing.token(Scope::Run, 0).unwrap();
        for _ in 0..FREE_ATTEMPTS {
            assert_eq!(pairing.pair("", HERE, 0), Err(Rejection::Token));
        }
        assert_eq!(pairing.pair("guess", HERE, 0), Err(Rejection::Wait(1)));
        assert_eq!(pairing.pair("guess", HERE, 1_000), Err(Rejection::Token));
        assert_eq!(pairing.pair("guess", HERE, 1_001), Err(Rejection::Wait(2)));
        let other = IpAddr::from([127, 0, 0, 2]);
        assert_eq!(
            pairing.pair("guess", other, 1_001),
            Err(Rejection::Token),
            "it guessed for the first time"
        );
        assert!(pairing.pair(&token, HERE, 1_002).is_ok(), "a right one is right all the same");
        assert_eq!(pairing.pair("guess", HERE, 3_000), Err(Rejection::Token));
        let mut now_ms = 3_000;
        for _ in 0..100 {
            now_ms += LONGEST_WAIT_MS;
            assert_eq!(pairing.pair("guess", HERE, now_ms), Err(Rejection::Token));
        }
    }

    #[test]
    fn tokens_and_sessions_are_limited() {
        let mut pairing = Pairing::default();
        let tokens: Vec<_> = (0..TOKENS + 1).map(|_| pairing.token(Scope::Run, 0).unwrap()).collect();
        assert_eq!(pairing.pair(&tokens[0], HERE, 0), Err(Rejection::Token));
        assert!(pairing.pair(&tokens[TOKENS], HERE, 0).is_ok());
        let first = pairing.sessions[0].id.clone();
        for _ in 0..SESSIONS {
            let token = pairing.token(Scope::Run, 0).unwrap();
            pairing.pair(&token, HERE, 0).unwrap();
        }
        assert!(pairing.session(&first).is_none());
        assert_eq!(pairing.sessions.len(), SESSIONS);
    }
}
