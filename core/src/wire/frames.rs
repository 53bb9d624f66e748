//! Parses incoming text frames.

use super::Ask;
use crate::diagnostic::Diagnostic;
use crate::error;

/// Parses one frame, and explains why it can't be understood.
pub fn understand(text: &str) -> Result<Ask, Diagnostic> {
    if let Ok(ask) = serde_json::from_str(text) {
        return Ok(ask);
    }
    let value: serde_json::Value = serde_json::from_str(text).map_err(|_| error!("socket.malformed"))?;
    let name = value.get("t").and_then(serde_json::Value::as_str).unwrap_or("?");
    let name: String = name.chars().filter(|c| c.is_ascii_graphic()).take(40).collect();
    Err(error!("socket.unknown", name = name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_frames_have_an_error_code() {
        let rows = [
            ("", "socket.malformed"),
            ("{", "socket.malformed"),
            ("\u{0}", "socket.malformed"),
            ("[]", "socket.unknown"),
            ("7", "socket.unknown"),
            (r#"{"t":"open_port"}"#, "socket.unknown"),
            (r#"{"t":"jog","axis":0}"#, "socket.unknown"),
            (r#"{"t":"jog","axis":0,"distance_um":1e300}"#, "socket.unknown"),
            (r#"{"t":"jog","axis":-1,"distance_um":5}"#, "socket.unknown"),
            (r#"{"t":"start"}"#, "socket.unknown"),
        ];
        for (text, code) in rows {
            assert_eq!(understand(text).unwrap_err().code, code, "{text}");
        }
        assert_eq!(understand(r#"{"t":"stop"}"#), Ok(Ask::Stop));
        let deep = "[".repeat(10_000);
        assert_eq!(understand(&deep).unwrap_err().code, "socket.malformed");
    }
}
