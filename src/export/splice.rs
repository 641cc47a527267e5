//! Insertions into JSON text that leave every other byte as it is: number spelling, white space,
//! order, duplicate members.
//!
//! The text has been through a JSON parser before, so the scanner need not judge it; on text that
//! is no JSON it finds nothing rather than failing.

use std::ops::Range;

/// One member of an object.
pub(super) struct Member {
    /// The name, escapes resolved.
    name: String,
    /// From the name's opening quote.
    start: usize,
    /// The bytes of the value.
    value: Range<usize>,
}

/// Changes of a JSON text whose root is an object, collected and then applied at once.
pub(super) struct Splice<'a> {
    text: &'a [u8],
    members: Vec<Member>,
    /// Bytes to replace, and by what. Ranges do not overlap.
    edits: Vec<(Range<usize>, String)>,
}

impl<'a> Splice<'a> {
    /// Looks for the members of the root object.
    pub(super) fn new(text: &'a [u8]) -> Self {
        let root = text.iter().position(|&b| b == b'{').unwrap_or(text.len());
        Self { text, members: members(text, root), edits: Vec::new() }
    }

    /// Appends elements, each given as JSON text, to an array of the root object; the array is
    /// made when it is absent. White space between elements is as before the array's first one.
    /// At most one call for each array.
    pub(super) fn append(&mut self, array: &str, elements: &[String]) {
        // Parsers take the last of duplicate members.
        let Some(member) = self.members.iter().rfind(|m| m.name == array) else {
            return self.add_member(array, &format!("[{}]", elements.join(",")));
        };
        let value = member.value.clone();
        let present = self::elements(self.text, value.start);
        let (at, separator) = match (present.first(), present.last()) {
            (Some(first), Some(last)) => {
                let space = String::from_utf8_lossy(&self.text[value.start + 1..first.start]);
                (last.end, format!(",{space}"))
            }
            _ => (value.start + 1, String::new()),
        };
        let inserted: Vec<String> = if separator.is_empty() {
            vec![elements.join(",")]
        } else {
            elements.iter().map(|e| format!("{separator}{e}")).collect()
        };
        self.edits.push((at..at, inserted.concat()));
    }

    /// Replaces the number `member` in element `index` of an array of the root object. Returns
    /// whether there is such a member.
    pub(super) fn replace(&mut self, array: &str, index: usize, member: &str, value: &str) -> bool {
        let found = self.members.iter().rfind(|m| m.name == array).and_then(|m| {
            let element = elements(self.text, m.value.start).into_iter().nth(index)?;
            members(self.text, element.start).into_iter().rfind(|m| m.name == member)
        });
        if let Some(found) = &found {
            self.edits.push((found.value.clone(), value.to_owned()));
        }
        found.is_some()
    }

    /// Adds a member behind the last one of the root object.
    fn add_member(&mut self, name: &str, value: &str) {
        let Some(last) = self.members.last() else { return };
        let before = self.text[..last.start].iter().rposition(|b| !b.is_ascii_whitespace());
        let space = &self.text[before.map_or(0, |b| b + 1)..last.start];
        let space = String::from_utf8_lossy(space);
        self.edits.push((last.value.end..last.value.end, format!(",{space}\"{name}\":{value}")));
    }

    /// The text with all changes; those at one place in the order they were asked for.
    pub(super) fn finish(mut self) -> Vec<u8> {
        self.edits.sort_by_key(|(range, _)| range.start);
        let mut out = Vec::with_capacity(self.text.len());
        let mut at = 0;
        for (range, replacement) in &self.edits {
            out.extend_from_slice(&self.text[at..range.start]);
            out.extend_from_slice(replacement.as_bytes());
            at = range.end;
        }
        out.extend_from_slice(&self.text[at..]);
        out
    }
}

/// The members of the object whose brace is at `start`; none when there is no object.
fn members(text: &[u8], start: usize) -> Vec<Member> {
    let mut found = Vec::new();
    if text.get(start) != Some(&b'{') {
        return found;
    }
    let mut at = start + 1;
    loop {
        at = past_space(text, at);
        if text.get(at) != Some(&b'"') {
            return found;
        }
        let name_end = past_value(text, at);
        let colon = past_space(text, name_end);
        let value_start = past_space(text, colon + 1);
        let value_end = past_value(text, value_start);
        if text.get(colon) != Some(&b':') || value_end == value_start {
            return found;
        }
        let name = serde_json::from_slice(&text[at..name_end]).unwrap_or_default();
        found.push(Member { name, start: at, value: value_start..value_end });
        at = past_space(text, value_end);
        if text.get(at) != Some(&b',') {
            return found;
        }
        at += 1;
    }
}

/// The elements of the array whose bracket is at `start`; none when there is no array.
fn elements(text: &[u8], start: usize) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    if text.get(start) != Some(&b'[') {
        return found;
    }
    let mut at = start;
    loop {
        let from = past_space(text, at + 1);
        let to = past_value(text, from);
        if to == from {
            return found;
        }
        found.push(from..to);
        at = past_space(text, to);
        if text.get(at) != Some(&b',') {
            return found;
        }
    }
}

fn past_space(text: &[u8], at: usize) -> usize {
    let rest = text.get(at..).unwrap_or(&[]);
    at + rest.iter().take_while(|b| b.is_ascii_whitespace()).count()
}

/// The end of the value that begins at `at`; `at` itself when none does.
fn past_value(text: &[u8], at: usize) -> usize {
    let mut depth = 0_usize;
    let mut i = at;
    while let Some(&b) = text.get(i) {
        match b {
            b'"' => i = past_string(text, i) - 1,
            b'{' | b'[' => depth += 1,
            b'}' | b']' if depth == 0 => return i,
            b'}' | b']' => depth -= 1,
            b',' | b':' | b' ' | b'\t' | b'\r' | b'\n' if depth == 0 => return i,
            _ => {}
        }
        i += 1;
        if depth == 0 && matches!(b, b'"' | b'}' | b']') {
            return i;
        }
    }
    i
}

/// The position behind the closing quote of the string that begins at `at`.
fn past_string(text: &[u8], at: usize) -> usize {
    let mut i = at + 1;
    while let Some(&b) = text.get(i) {
        match b {
            b'\\' => i += 2,
            b'"' => return i + 1,
            _ => i += 1,
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::{Value, json};

    use super::*;

    fn appended(text: &str, array: &str) -> String {
        let mut splice = Splice::new(text.as_bytes());
        splice.append(array, &["{\"n\":1}".to_owned(), "2".to_owned()]);
        String::from_utf8(splice.finish()).unwrap()
    }

    #[test]
    fn elements_follow_the_last_one_in_the_file_s_own_layout() {
        assert_eq!(
            appended(r#"{"a":[1.50,"]"],"b":{}}"#, "a"),
            r#"{"a":[1.50,"]",{"n":1},2],"b":{}}"#
        );
        assert_eq!(appended("{\"a\" : [ ]}", "a"), "{\"a\" : [{\"n\":1},2 ]}");
        assert_eq!(
            appended("{\n  \"a\": [\n    1e0\n  ]\n}\n", "a"),
            "{\n  \"a\": [\n    1e0,\n    {\"n\":1},\n    2\n  ]\n}\n"
        );
    }

    #[test]
    fn an_absent_array_is_made_at_the_end() {
        assert_eq!(appended(r#"{"b":{"a":[7]}}"#, "a"), r#"{"b":{"a":[7]},"a":[{"n":1},2]}"#);
        assert_eq!(appended("{\n\t\"b\": 1\n}", "a"), "{\n\t\"b\": 1,\n\t\"a\":[{\"n\":1},2]\n}");
    }

    #[test]
    fn names_are_compared_without_their_escapes_and_the_last_duplicate_counts() {
        assert_eq!(appended(r#"{"\u0061":[]}"#, "a"), r#"{"\u0061":[{"n":1},2]}"#);
        assert_eq!(appended(r#"{"a":[],"a":[3]}"#, "a"), r#"{"a":[],"a":[3,{"n":1},2]}"#);
        assert_eq!(
            appended(r#"{"x":"\\","y":"\"a\":[","a":[]}"#, "a"),
            r#"{"x":"\\","y":"\"a\":[","a":[{"n":1},2]}"#
        );
    }

    #[test]
    fn a_number_is_replaced_in_place() {
        let mut splice = Splice::new(br#"{"b":[{"n":1},{"x":{"n":5}, "n" : 2.0 }]}"#);
        assert!(splice.replace("b", 1, "n", "77"));
        assert!(!splice.replace("b", 2, "n", "77"));
        assert_eq!(splice.finish(), br#"{"b":[{"n":1},{"x":{"n":5}, "n" : 77 }]}"#);
    }

    fn any_json() -> impl Strategy<Value = Value> {
        let leaf = prop_oneof![
            Just(Value::Null),
            any::<bool>().prop_map(Value::from),
            any::<i32>().prop_map(Value::from),
            (-1e9..1e9_f64).prop_map(Value::from),
            "[ -~]{0,6}".prop_map(Value::from),
        ];
        leaf.prop_recursive(4, 40, 5, |inner| {
            prop_oneof![
                prop::collection::vec(inner.clone(), 0..5).prop_map(Value::from),
                prop::collection::btree_map("[ -~]{0,4}", inner, 0..5)
                    .prop_map(|m| Value::Object(m.into_iter().collect())),
            ]
        })
    }

    proptest! {
        #[test]
        fn the_splice_does_what_editing_the_value_does(
            values in prop::collection::vec(any_json(), 0..4),
            others in prop::collection::btree_map("[b-z\"\\\\]{1,3}", any_json(), 1..5),
            list in any::<bool>(), pretty in any::<bool>(),
        ) {
            let mut root: serde_json::Map<String, Value> = others.into_iter().collect();
            if list {
                root.insert("a".to_owned(), Value::from(values));
            }
            let mut root = Value::Object(root);
            let text = if pretty {
                serde_json::to_string_pretty(&root).unwrap()
            } else {
                serde_json::to_string(&root).unwrap()
            };
            let after: Value = serde_json::from_str(&appended(&text, "a")).unwrap();
            let target = root.as_object_mut().unwrap().entry("a").or_insert(json!([]));
            target.as_array_mut().unwrap().extend([json!({"n": 1}), json!(2)]);
            prop_assert_eq!(after, root);
        }

        #[test]
        fn any_bytes_are_scanned_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..60)) {
            let mut text = b"{\"a\":".to_vec();
            text.extend(bytes);
            let mut splice = Splice::new(&text);
            splice.append("a", &["1".to_owned()]);
            splice.finish();
        }
    }
}
