//! Proves knowledge of the session key without sending it.

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

/// True if `claimed` is the proof of `message` under `key`. The comparison takes constant time.
pub fn verify(key: &[u8], message: &[u8], claimed: &str) -> bool {
    same(proof(key, message).as_bytes(), claimed.as_bytes())
}

/// Compares two secrets in constant time, so that timing reveals no position of a difference. Two empty
/// secrets never match.
pub fn same(a: &[u8], b: &[u8]) -> bool {
    !a.is_empty()
        && a.len() == b.len()
        && a.iter().zip(b).fold(0, |difference, (a, b)| difference | (a ^ b)) == 0
}

/// Proof for `Hello`: HMAC of the challenge's nonce, as the text that was sent. `key` is in hexadecimal, as
/// pairing returned it.
pub fn hello(key: &str, nonce: &str) -> String {
    proof(&unhex(key).unwrap_or_default(), nonce.as_bytes())
}

/// Proof for a request: HMAC of its first line, for example `PUT /api/jobs/0123…`.
pub fn request(key: &str, method: &str, path: &str) -> String {
    proof(&unhex(key).unwrap_or_default(), format!("{method} {path}").as_bytes())
}

/// SHA-256 of `bytes`, hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Decodes hexadecimal; none if `text` isn't hexadecimal.
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
    fn secrets_compare_by_content_and_empty_ones_never_match() {
        for (a, b, equal) in
            [("", "", false), ("a", "a", true), ("a", "b", false), ("a", "ab", false), ("ab", "a", false)]
        {
            assert_eq!(same(a.as_bytes(), b.as_bytes()), equal, "{a} {b}");
        }
    }

    #[test]
    fn proof_is_bound_to_its_request() {
        let key = "00ff";
        assert_eq!(request(key, "PUT", "/api/jobs/1"), proof(&[0, 255], b"PUT /api/jobs/1"));
        assert_ne!(request(key, "PUT", "/api/jobs/1"), request(key, "GET", "/api/jobs/1"));
        assert_ne!(hello(key, "01"), hello(key, "02"));
        assert_ne!(hello("00", "01"), hello(key, "01"));
    }

    #[test]
    fn hexadecimal_survives_a_round_trip_or_is_refused() {
        assert_eq!(unhex(&hex(&[0, 255, 16])), Some(vec![0, 255, 16]));
        assert_eq!(unhex("abc"), None);
        assert_eq!(unhex("zz"), None);
        assert_eq!(unhex("é"), None);
    }
}
