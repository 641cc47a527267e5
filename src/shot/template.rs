//! Writing `shot.toml`: every setting with its value and a comment, and changing single values
//! later without touching what the user wrote around them.

use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, Value};

use super::settings::{COMMENTS, ShotFile, TABLES};

/// The text of a shot file with a comment above every table and key. Keys without a value stand
/// commented out, so that they can be found.
pub(super) fn text(shot: &ShotFile, name: &str) -> String {
    let document = document(shot).unwrap_or_default();
    let mut text = format!(
        "# The shot «{}» of muybridge: every setting with its default. Edit at will; `muybridge run` redoes what changes.\n",
        name.replace(['\n', '\r'], " ")
    );
    for (table, about) in TABLES {
        text.push_str(&format!("\n# {}\n[{table}]\n", about.replace('\n', "\n# ")));
        for (path, about) in COMMENTS {
            let own = path.strip_prefix(table).and_then(|k| k.strip_prefix('.'));
            let Some(key) = own.filter(|k| !k.contains('.')) else { continue };
            text.push_str(&match value_at(&document, path) {
                Some(value) => format!("# {about}\n{key} = {value}\n"),
                None => format!("# {about}\n# {key} =\n"),
            });
        }
    }
    for pose in &shot.pose_of_key {
        text.push_str(&pose_text(pose));
    }
    text
}

/// The settings as a document of plain tables.
fn document(shot: &ShotFile) -> Option<DocumentMut> {
    toml::to_string(shot).ok()?.parse().ok()
}

fn pose_text(pose: &super::settings::PoseOfKey) -> String {
    let at = match (pose.frame, pose.time) {
        (Some(frame), _) => format!("frame = {frame}\n"),
        (None, Some(time)) => format!("time = {}\n", plain(Value::from(time))),
        (None, None) => String::new(),
    };
    format!(
        "\n[[pose]]\nkey = {}\nclip = {}\n{at}",
        pose.key,
        plain(Value::from(pose.clip.as_str()))
    )
}

fn plain(mut value: Value) -> String {
    value.decor_mut().clear();
    value.to_string()
}

fn value_at(document: &DocumentMut, path: &str) -> Option<String> {
    let mut item = document.as_item();
    for key in path.split('.') {
        item = item.get(key)?;
    }
    item.as_value().map(|v| plain(v.clone()))
}

/// Brings the text of a shot file to the values of `wanted`: a value that differs is replaced in
/// place, comments and order stay.
pub(super) fn updated(text: &str, wanted: &ShotFile) -> Option<String> {
    let mut document: DocumentMut = text.parse().ok()?;
    let target = self::document(wanted)?;
    for (path, _) in COMMENTS {
        let keys: Vec<&str> = path.split('.').collect();
        let value = value_item(&target, &keys);
        set(document.as_table_mut(), &keys, value);
    }
    let poses_differ = document.get("pose").map(|p| p.to_string().trim().to_owned())
        != target.get("pose").map(|p| p.to_string().trim().to_owned());
    if poses_differ {
        document.remove("pose");
    }
    let mut text = document.to_string();
    if poses_differ {
        for pose in &wanted.pose_of_key {
            text.push_str(&pose_text(pose));
        }
    }
    Some(text)
}

fn value_item(document: &DocumentMut, keys: &[&str]) -> Option<Value> {
    let mut item = document.as_item();
    for key in keys {
        item = item.get(key)?;
    }
    item.as_value().cloned()
}

fn set(table: &mut Table, keys: &[&str], value: Option<Value>) {
    let [first, rest @ ..] = keys else { return };
    if rest.is_empty() {
        match (table.get_mut(first).and_then(Item::as_value_mut), value) {
            (Some(old), Some(new)) => {
                if plain(old.clone()) != plain(new.clone()) && !same(old, &new) {
                    let decor = old.decor().clone();
                    *old = new;
                    *old.decor_mut() = decor;
                }
            }
            (Some(_), None) => {
                table.remove(first);
            }
            (None, Some(new)) => {
                table.insert(first, Item::Value(new));
            }
            (None, None) => {}
        }
        return;
    }
    let inner = table.entry(first).or_insert_with(|| Item::Table(Table::new()));
    if let Some(inner) = inner.as_table_mut() {
        set(inner, rest, value);
    }
}

/// Whether two values mean the same however they are spelled (`1e1` and `10.0`, spaced arrays).
fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => same_arrays(a, b),
        (Value::InlineTable(a), Value::InlineTable(b)) => same_tables(a, b),
        _ => match (number(a), number(b)) {
            (Some(x), Some(y)) => x == y,
            _ => a.as_str().is_some() && a.as_str() == b.as_str(),
        },
    }
}

fn same_arrays(a: &Array, b: &Array) -> bool {
    a.len() == b.len() && a.iter().zip(b.iter()).all(|(x, y)| same(x, y))
}

fn same_tables(a: &InlineTable, b: &InlineTable) -> bool {
    a.len() == b.len() && a.iter().all(|(k, v)| b.get(k).is_some_and(|w| same(v, w)))
}

fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|i| i as f64))
}

#[cfg(test)]
mod tests {
    use super::super::settings::PoseOfKey;
    use super::*;

    fn filled() -> ShotFile {
        let mut shot = ShotFile::default();
        shot.source.from = Some("../a \"b\".mp4".to_owned());
        shot.source.fps = Some(25.0);
        shot.source.foreground = Some([1, 2, 30, 40]);
        shot.keys.exclude = vec![3, 4];
        shot.pose_of_key = vec![PoseOfKey {
            key: 1,
            clip: "Key \"Poses\"".to_owned(),
            frame: Some(1),
            time: None,
        }];
        shot
    }

    #[test]
    fn the_written_file_reads_back_and_names_every_setting() {
        for shot in [ShotFile::default(), filled()] {
            let text = text(&shot, "cheetah\nx");
            let back: ShotFile = toml::from_str(&text).unwrap();
            assert_eq!(back, shot);
        }
    }

    #[test]
    fn every_setting_has_a_comment_and_every_comment_a_setting() {
        let mut all = filled();
        all.source.mattes = Some(String::new());
        all.source.strokes = Some(String::new());
        all.source.frames = Some(String::new());
        all.source.background = Some([0; 4]);
        all.poses.rig = Some(String::new());
        let document = document(&all).unwrap();
        let mut leaves = Vec::new();
        let mut walk = vec![(String::new(), document.as_table())];
        while let Some((prefix, table)) = walk.pop() {
            for (key, item) in table.iter() {
                let path =
                    if prefix.is_empty() { key.to_owned() } else { format!("{prefix}.{key}") };
                match item {
                    Item::Table(inner) => walk.push((path, inner)),
                    Item::Value(Value::InlineTable(_)) | Item::ArrayOfTables(_) => {}
                    _ if path != "pose" => leaves.push(path),
                    _ => {}
                }
            }
        }
        leaves.sort();
        let mut commented: Vec<String> = COMMENTS.iter().map(|(p, _)| (*p).to_owned()).collect();
        commented.sort();
        assert_eq!(leaves, commented);
        for path in commented {
            let table = path.rsplit_once('.').unwrap().0.to_owned();
            assert!(TABLES.iter().any(|(t, _)| *t == table), "{path}");
        }
    }

    #[test]
    fn an_update_changes_one_value_and_keeps_the_users_own_words() {
        let before =
            text(&filled(), "x").replace("count = 4", "count = 4   # four, says the director");
        let mut wanted = filled();
        wanted.keys.count = 6;
        wanted.source.frames = Some("3-90".to_owned());
        let after = updated(&before, &wanted).unwrap();
        assert!(after.contains("count = 6   # four, says the director"), "{after}");
        assert_eq!(toml::from_str::<ShotFile>(&after).unwrap(), wanted);
        wanted.pose_of_key.push(PoseOfKey {
            key: 2,
            clip: "W".into(),
            frame: None,
            time: Some(0.5),
        });
        let again = updated(&after, &wanted).unwrap();
        assert_eq!(toml::from_str::<ShotFile>(&again).unwrap(), wanted);
        assert_eq!(updated(&again, &wanted).unwrap(), again);
    }
}
