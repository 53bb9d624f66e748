//! Proof that one has the session key without sending it.
//!
//! Comes in: key and challenge. Goes out: HMAC-SHA256 in hexadecimal. Does not know where keys are kept.

use hmac::{Hmac, Mac};
use sha2::{Digest, Sha256};

/// HMAC-SHA256 of `message` under `key`, hexadecimal. Keys of any length are allowed.
pub fn proof(key: &[u8], message: &[u8]) -> String {
    match Hmac::<Sha256>::new_from_slice(key) {
        Ok(mut mac) => {
            mac.update(message);
            hex(&mac.finalize().into_bytes())
        }
        Err(_) => String::new(),
    }
}

/// Whether `claimed` is the proof of `message` under `key`, compared in constant time.
pub fn verify(key: &[u8], message: &[u8], claimed: &str) -> bool {
    let expected = proof(key, message);
    if expected.len() != claimed.len() || expected.is_empty() {
        return false;
    }
    expected.bytes().zip(claimed.bytes()).fold(0, |difference, (a, b)| difference | (a ^ b)) == 0
}

/// SHA-256 of `bytes`, hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Lower-case hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Bytes from hexadecimal; none if it is not.
pub fn unhex(text: &str) -> Option<Vec<u8>> {
    if !text.is_ascii() || !text.len().is_multiple_of(2) {
        return None;
    }
    (0..text.len()).step_by(2).map(|at| u8::from_str_radix(&text[at..at + 2], 16).ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn proofs_follow_rfc_4231_case_2() {
        let expected = "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843";
        assert_eq!(proof(b"Jefe", b"what do ya want for nothing?"), expected);
        assert!(verify(b"Jefe", b"what do ya want for nothing?", expected));
        assert!(!verify(b"Jefe", b"what do ya want for nothing!", expected));
        assert!(!verify(b"Jefe", b"what do ya want for nothing?", ""));
    }

    #[test]
    fn hexadecimal_round_trip_and_refusals() {
        assert_eq!(unhex(&hex(&[0, 255, 16])), Some(vec![0, 255, 16]));
        assert_eq!(unhex("abc"), None);
        assert_eq!(unhex("zz"), None);
        assert_eq!(unhex("é"), None);
    }
}
