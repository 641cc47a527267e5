//! The lock files of what is fetched from npm: any registry will do, and what it sends is checked.

use serde_json::Value;

#[test]
fn lock_files_name_no_registry_and_hash_every_package() {
    for folder in ["studio", "tests/browser", "tests/validator"] {
        let path = format!("{folder}/package-lock.json");
        let text = std::fs::read_to_string(&path).unwrap();
        let lock: Value = serde_json::from_str(&text).unwrap();
        let packages = lock["packages"].as_object().unwrap();
        assert!(packages.len() > 1, "{path}");
        for (name, package) in packages.iter().filter(|(name, _)| !name.is_empty()) {
            assert_eq!(package["resolved"], Value::Null, "{path}: {name}");
            let hash = package["integrity"].as_str().unwrap_or_default();
            assert!(hash.starts_with("sha512-"), "{path}: {name}");
        }
    }
}
