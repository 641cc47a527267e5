//! The URIs of glTF: `data:` with base64, and relative paths with percent escapes.

/// What a URI points to.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// The bytes are in the URI itself.
    Data(Vec<u8>),
    /// A path relative to the file that has the URI, percent escapes resolved.
    Relative(String),
}

/// Reads a URI; the error says why it cannot be followed.
pub(super) fn resolve(uri: &str) -> Result<Target, &'static str> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, payload) = data.split_once(',').ok_or("a data URI without a comma")?;
        let bytes = if kind.ends_with(";base64") {
            from_base64(payload).ok_or("a data URI whose base64 is broken")?
        } else {
            percent_decoded(payload).ok_or("a data URI with a broken percent escape")?
        };
        return Ok(Target::Data(bytes));
    }
    // One letter before the colon would be a Windows drive; two or more are a scheme.
    if uri.split_once(':').is_some_and(|(scheme, _)| !scheme.contains('/')) || uri.starts_with('/')
    {
        return Err("a URI that is not relative to the file");
    }
    let path = percent_decoded(uri).and_then(|b| String::from_utf8(b).ok());
    path.map(Target::Relative).ok_or("a URI with a broken percent escape")
}

fn percent_decoded(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len());
    let mut bytes = text.bytes();
    while let Some(b) = bytes.next() {
        if b != b'%' {
            out.push(b);
            continue;
        }
        let high = char::from(bytes.next()?).to_digit(16)?;
        let low = char::from(bytes.next()?).to_digit(16)?;
        out.push((high * 16 + low) as u8);
    }
    Some(out)
}

/// RFC 4648 §4, padding optional.
fn from_base64(text: &str) -> Option<Vec<u8>> {
    let digits = text.trim_end_matches('=').as_bytes();
    if digits.len() % 4 == 1 {
        return None;
    }
    let mut out = Vec::with_capacity(digits.len() / 4 * 3 + 2);
    for group in digits.chunks(4) {
        let mut word = 0_u32;
        for &digit in group {
            word = word << 6 | u32::from(base64_value(digit)?);
        }
        word <<= 6 * (4 - group.len());
        out.extend_from_slice(&word.to_be_bytes()[1..group.len()]);
    }
    Some(out)
}

fn base64_value(digit: u8) -> Option<u8> {
    match digit {
        b'A'..=b'Z' => Some(digit - b'A'),
        b'a'..=b'z' => Some(digit - b'a' + 26),
        b'0'..=b'9' => Some(digit - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_vectors_of_rfc_4648() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmFy", "foobar"),
            ("Zm9vYg", "foob"),
        ] {
            assert_eq!(from_base64(text).unwrap(), bytes.as_bytes());
        }
        assert_eq!(from_base64("+/+/").unwrap(), [0xfb, 0xff, 0xbf]);
        assert_eq!(from_base64("Zm9vY"), None);
        assert_eq!(from_base64("Zm-v"), None);
    }

    #[test]
    fn relative_paths_lose_their_escapes() {
        assert_eq!(resolve("my%20rig.bin").unwrap(), Target::Relative("my rig.bin".to_owned()));
        assert_eq!(resolve("a/b:c.bin").unwrap(), Target::Relative("a/b:c.bin".to_owned()));
        assert_eq!(
            resolve("data:application/octet-stream;base64,AQI=").unwrap(),
            Target::Data(vec![1, 2])
        );
    }

    #[test]
    fn what_is_not_relative_is_refused() {
        for uri in ["https://x.org/a.bin", "file:///a", "/etc/passwd", "C:\\a.bin", "a%2", "data:x"]
        {
            assert!(resolve(uri).is_err(), "{uri}");
        }
    }
}
