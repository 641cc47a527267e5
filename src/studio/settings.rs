//! Settings as JSON, and changing some of them: a change is checked like a `shot.toml` edited by
//! hand and written so that comments and order stay.

use serde::Deserialize;
use serde_json::{Map, Value};

use super::desk::Desk;
use super::refusal::{Refusal, Result};
use super::root::Root;
use super::{rigs, versions};
use crate::shot::{SYNTHETIC_PREFIX, Shot, ShotFile, paths, relative_to};

/// Settings that have no value by default; the page sees them as null.
const OPTIONAL: [(&str, &str); 8] = [
    ("source", "from"),
    ("source", "mattes"),
    ("source", "strokes"),
    ("source", "fps"),
    ("source", "frames"),
    ("source", "foreground"),
    ("source", "background"),
    ("poses", "rig"),
];

/// Settings that are paths relative to the shot.
const PATHS: [&str; 4] = ["source.from", "source.mattes", "source.strokes", "poses.rig"];

/// What `PATCH /api/shot` asks for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Change {
    version: String,
    #[serde(default)]
    set: Map<String, Value>,
    /// The rig, relative to the root.
    #[serde(default)]
    rig: Option<String>,
}

/// Every table and key; the poses of the keys stand in `poses.pose`.
pub(super) fn as_json(settings: &ShotFile) -> Value {
    let mut all = serde_json::to_value(settings).unwrap_or_default();
    for (table, key) in OPTIONAL {
        if let Some(members) = all.get_mut(table).and_then(Value::as_object_mut) {
            members.entry(key).or_insert(Value::Null);
        }
    }
    if let Some(members) = all.as_object_mut() {
        let poses = members.shift_remove("pose").unwrap_or_else(|| Value::Array(Vec::new()));
        if let Some(table) = members.get_mut("poses").and_then(Value::as_object_mut) {
            table.insert("pose".to_owned(), poses);
        }
    }
    all
}

/// Carries out a change.
pub(super) fn change(root: &Root, desk: &Desk, change: &Change) -> Result<()> {
    let _writing = desk.write()?;
    let mut shot = desk.shot()?;
    let now = versions::now(&shot.path(paths::SETTINGS))?;
    if now != change.version {
        return Err(Refusal::changed(now));
    }
    let mut set = change.set.clone();
    if let Some(rig) = &change.rig {
        let path = root.existing(rig)?;
        let inside = relative_to(shot.folder(), root.folder(), &path.to_string_lossy());
        set.insert("poses.rig".to_owned(), inside.into());
    }
    for (name, value) in &set {
        if PATHS.contains(&name.as_str()) {
            check_path(root, &shot, name, value)?;
        }
    }
    shot.settings = with(&shot.settings, &set)?;
    shot.save_settings()?;
    Ok(())
}

/// A path set by the page stays below the root, even where a path written by hand need not.
fn check_path(root: &Root, shot: &Shot, name: &str, value: &Value) -> Result<()> {
    let Some(path) = value.as_str() else { return Ok(()) };
    if name == "source.from" && path.starts_with(SYNTHETIC_PREFIX) {
        return Ok(());
    }
    let target = root.inside(shot.path(path))?;
    let target = root.any(&root.name(&target))?;
    if name == "poses.rig" { rigs::check(root, &target) } else { root.check_source(&target) }
}

/// The settings with some values replaced; null takes a value away, which leaves its default.
fn with(settings: &ShotFile, set: &Map<String, Value>) -> Result<ShotFile> {
    let mut all = serde_json::to_value(settings).map_err(|_| Refusal::defect())?;
    for (name, value) in set {
        // In the file the poses are a list of tables of their own.
        let name = if name == "poses.pose" { "pose" } else { name };
        put(&mut all, name, value)?;
    }
    serde_json::from_value(all).map_err(|e| Refusal::unusable(format!("the settings: {e}")))
}

fn put(all: &mut Value, name: &str, value: &Value) -> Result<()> {
    let unknown = || Refusal::unusable(format!("there is no setting \"{name}\""));
    let (tables, key) = name.rsplit_once('.').unwrap_or(("", name));
    let mut table = all;
    for part in tables.split('.').filter(|t| !t.is_empty()) {
        table = table.get_mut(part).ok_or_else(unknown)?;
    }
    let members = table.as_object_mut().ok_or_else(unknown)?;
    if members.get(key).is_some_and(Value::is_object) {
        return Err(Refusal::unusable(format!("\"{name}\" is a table; name its keys")));
    }
    if value.is_null() {
        members.shift_remove(key);
    } else {
        members.insert(key.to_owned(), value.clone());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use axum::http::StatusCode;
    use serde_json::json;

    use super::*;

    fn set(value: Value) -> Result<ShotFile> {
        with(&ShotFile::default(), value.as_object().unwrap())
    }

    #[test]
    fn values_are_set_by_their_dotted_names_and_taken_away_by_null() {
        let new = set(json!({
            "keys.count": 6, "silhouette.colour.seed": 7, "source.foreground": [1, 2, 3, 4],
            "poses.pose": [{"key": 1, "clip": "Walk", "time": 0.25}],
        }))
        .unwrap();
        assert_eq!((new.keys.count, new.source.foreground), (6, Some([1, 2, 3, 4])));
        assert_eq!(new.pose_of_key[0].time, Some(0.25));
        let back =
            with(&new, json!({"keys.count": null, "source.foreground": null}).as_object().unwrap());
        let back = back.unwrap();
        assert_eq!(
            (back.keys.count, back.source.foreground),
            (ShotFile::default().keys.count, None)
        );
    }

    #[test]
    fn what_is_no_setting_is_refused() {
        for wrong in [
            json!({"keys.cuont": 6}),
            json!({"keys": {"count": 6}}),
            json!({"keys.count": "six"}),
            json!({"keys.count": -1}),
            json!({"a.b.c": 1}),
            json!({"": 1}),
            json!({"keys.count.x": 1}),
        ] {
            assert_eq!(
                set(wrong.clone()).unwrap_err().status,
                StatusCode::UNPROCESSABLE_ENTITY,
                "{wrong}"
            );
        }
    }

    #[test]
    fn every_optional_setting_is_shown() {
        let all = as_json(&ShotFile::default());
        assert_eq!(all["source"]["foreground"], Value::Null);
        assert!(all["source"].as_object().unwrap().contains_key("from"));
        assert_eq!(all["poses"], json!({"rig": null, "pose": []}));
        assert_eq!(all["keys"]["count"], 4);
    }
}
