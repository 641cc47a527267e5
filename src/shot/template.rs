//! Writing `shot.toml`: every setting with its value and a comment, and changing single values
//! later without touching what the user wrote around them.

use toml_edit::{DocumentMut, Item, Table, Value};

/// The comments of `shot.toml`, by table and key; a test holds them complete.
pub(super) struct Comments {
    /// (name of the table, what it is for).
    pub(super) tables: &'static [(&'static str, &'static str)],
    /// ("table.key", what it does, its range and unit).
    pub(super) keys: &'static [(&'static str, &'static str)],
}

/// The text of a shot file: `document` with a comment above every table and key, and optional
/// keys without a value shown commented out so that they can be found.
pub(super) fn with_comments(document: &mut DocumentMut, comments: &Comments, title: &str) -> String {
    let mut text = title.to_owned();
    for (name, about) in comments.tables {
        text.push_str(&format!("\n# {}\n[{name}]\n", about.replace('\n', "\n# ")));
        let table = document.get(name).and_then(Item::as_table);
        for (path, about) in comments.keys {
            let Some(key) = path.strip_prefix(name).and_then(|k| k.strip_prefix('.')) else {
                continue;
            };
            let value = table.and_then(|t| t.get(key)).and_then(Item::as_value);
            text.push_str(&key_lines(key, about, value));
        }
    }
    text
}

fn key_lines(key: &str, about: &str, value: Option<&Value>) -> String {
    let comment = about.replace('\n', "\n# ");
    match value {
        Some(value) => {
            let mut plain = value.clone();
            plain.decor_mut().clear();
            format!("# {comment}\n{key} = {plain}\n")
        }
        None => format!("# {comment}\n# {key} =\n"),
    }
}

/// Sets `table.key` in the text of a shot file; comments and order stay. A key that stands
/// commented out (`# key =`) is put where its comment is.
pub(super) fn set_value(document: &mut DocumentMut, table: &str, key: &str, value: Option<Value>) {
    let entry = document.entry(table).or_insert(Item::Table(Table::new()));
    let Some(table) = entry.as_table_mut() else { return };
    match value {
        Some(value) => match table.get_mut(key) {
            Some(item) => {
                let decor = item.as_value().map(|v| v.decor().clone());
                let mut value = value;
                if let Some(decor) = decor {
                    *value.decor_mut() = decor;
                }
                *item = Item::Value(value);
            }
            None => {
                table.insert(key, Item::Value(value));
            }
        },
        None => {
            table.remove(key);
        }
    }
}
