//! Paths in a shot file are relative to the shot's folder, so that the folder can move together
//! with its footage.

use std::path::{Component, Path, PathBuf};

/// `path`, given relative to `from`, as seen from `folder`: relative when both share a root,
/// with `/` between folders. No file need exist; patterns pass through.
#[must_use]
pub fn relative_to(folder: &Path, from: &Path, path: &str) -> String {
    let target = plain(&from.join(path));
    let base = plain(&from.join(folder));
    let shared = target.iter().zip(&base).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return path.to_owned();
    }
    let ups = std::iter::repeat_n("..".to_owned(), base.len() - shared);
    let parts: Vec<String> = ups.chain(target[shared..].iter().cloned()).collect();
    if parts.is_empty() { ".".to_owned() } else { parts.join("/") }
}

/// `inside` as seen from `folder`, with `..` resolved by name; an absolute path stays.
pub(super) fn joined(folder: &Path, inside: &str) -> PathBuf {
    let mut path = folder.to_owned();
    for component in Path::new(inside).components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir => {
                // What ends in no name (nothing, or `..`) cannot be shortened.
                let named = matches!(path.components().next_back(), Some(Component::Normal(_)));
                if named {
                    path.pop();
                } else {
                    path.push("..");
                }
            }
            other => path.push(other.as_os_str()),
        }
    }
    if path.as_os_str().is_empty() { PathBuf::from(".") } else { path }
}

/// Components with `.` dropped and `..` resolved by name; a root counts as a component.
fn plain(path: &Path) -> Vec<String> {
    let mut parts = Vec::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir => {
                parts.pop();
            }
            other => parts.push(PathBuf::from(other.as_os_str()).to_string_lossy().into_owned()),
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_neighbour_is_reached_through_the_parent() {
        let from = Path::new("/home/a/project");
        assert_eq!(relative_to(Path::new("shots/a"), from, "clips/a.mp4"), "../../clips/a.mp4");
        assert_eq!(relative_to(Path::new("a"), from, "a/masks"), "masks");
        assert_eq!(relative_to(Path::new("a"), from, "../x/%04d.png"), "../../x/%04d.png");
        assert_eq!(joined(Path::new("shots/a"), "../../clips/a.mp4"), Path::new("clips/a.mp4"));
        assert_eq!(joined(Path::new("a"), "../../x/%04d.png"), Path::new("../x/%04d.png"));
        assert_eq!(joined(Path::new("a"), ".."), Path::new("."));
        assert_eq!(joined(Path::new("/s/a"), "/x/y"), Path::new("/x/y"));
        assert_eq!(relative_to(Path::new("/home/b"), from, "/home/c.avi"), "../c.avi");
    }
}
