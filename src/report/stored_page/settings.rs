//! The settings as a table.

use crate::report::page::Setting;
use crate::shot::ShotFile;

/// Every setting in the order of the file, marked where it differs from its default.
pub(super) fn settings(now: &ShotFile) -> Vec<Setting> {
    let table = |file: &ShotFile| toml::Table::try_from(file).unwrap_or_default();
    let mut defaults = Vec::new();
    flatten("", &table(&ShotFile::default()), &mut defaults);
    let mut values = Vec::new();
    flatten("", &table(now), &mut values);
    values
        .into_iter()
        .map(|(name, value)| {
            let changed = !defaults.contains(&(name.clone(), value.clone()));
            Setting { name, value, changed }
        })
        .collect()
}

fn flatten(prefix: &str, table: &toml::Table, into: &mut Vec<(String, String)>) {
    for (key, value) in table {
        let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            toml::Value::Table(inner) => flatten(&name, inner, into),
            // The poses of the keys stand in the table of keys.
            toml::Value::Array(_) if key == "pose" => {}
            other => {
                into.push((name, other.to_string()));
            }
        }
    }
}
