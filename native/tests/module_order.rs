//! The crate's folders are layers: a file imports from its own folder and from lower ones only, and the
//! imports between files have no cycle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Folders of `src`, the lowest first.
const LAYERS: [&str; 18] = [
    "machine",
    "camera",
    "scene",
    "project",
    "order",
    "tile",
    "lanes",
    "blend",
    "render",
    "gradients",
    "train",
    "stereo",
    "track",
    "track/background",
    "track/fit",
    "track/appearance",
    "python",
    "python/track",
];

/// Files in a folder, `mod.rs` aside; with more, it should be split.
const MAX_FILES: usize = 12;

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// All modules but the roots of folders: "camera/lens" and so on.
fn modules() -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut folders = vec![source()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of the crate") {
            let path = entry.expect("an entry of it").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(source()).expect("a path below src");
            let name = name.with_extension("").display().to_string();
            let name = name.replace('\\', "/");
            if name != "lib" && !name.ends_with("/mod") {
                found.insert(name);
            }
        }
    }
    found
}

fn folder_of(module: &str) -> &str {
    module.rsplit_once('/').map_or("", |(folder, _)| folder)
}

/// All paths below `crate::` that a text mentions, with `{...}` opened.
fn crate_paths(text: &str) -> Vec<String> {
    let code = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or(""));
    let code: String = code.collect::<Vec<_>>().join(" ");
    let mut paths = Vec::new();
    for part in code.split("crate::").skip(1) {
        let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
        let stem: String = part.chars().take_while(|&c| is_path(c)).collect();
        let rest = &part[stem.len()..];
        if !rest.starts_with('{') {
            paths.push(stem);
            continue;
        }
        let inside = rest[1..].split('}').next().unwrap_or("");
        for name in inside.split(',') {
            let name: String = name.trim().chars().take_while(|&c| is_path(c)).collect();
            paths.push(format!("{stem}{name}"));
        }
    }
    paths
}

/// The module that a path leads into: the longest one that it starts with.
fn module_of(path: &str, modules: &BTreeSet<String>) -> Option<String> {
    let parts: Vec<&str> = path.split("::").filter(|part| !part.is_empty()).collect();
    (1..=parts.len())
        .rev()
        .map(|length| parts[..length].join("/"))
        .find(|name| modules.contains(name))
}

/// The modules that each module imports.
fn imports() -> BTreeMap<String, BTreeSet<String>> {
    let modules = modules();
    let imported_by = |name: &String| {
        let text = fs::read_to_string(source().join(name).with_extension("rs")).expect("a module");
        let paths = crate_paths(&text);
        let imported = paths.iter().map(|path| {
            module_of(path, &modules).unwrap_or_else(|| {
                panic!("{name}.rs imports crate::{path}, which names no file of the crate")
            })
        });
        imported.filter(|other| other != name).collect()
    };
    let edges = modules.iter().map(|name| (name.clone(), imported_by(name)));
    edges.collect()
}

#[test]
fn every_folder_has_a_layer() {
    for module in modules() {
        let folder = folder_of(&module);
        assert!(
            LAYERS.contains(&folder),
            "{module}.rs: {folder:?} is no layer"
        );
    }
}

#[test]
fn no_folder_imports_a_higher_one() {
    let layer = |module: &str| {
        LAYERS
            .iter()
            .position(|&folder| folder == folder_of(module))
    };
    for (module, imported) in imports() {
        for other in imported {
            assert!(
                layer(&other) <= layer(&module),
                "{module}.rs imports {other}.rs"
            );
        }
    }
}

#[test]
fn imports_between_files_have_no_cycle() {
    let mut left = imports();
    // Files that import nothing of what is left go first; a cycle never goes.
    loop {
        let kept: BTreeSet<String> = left.keys().cloned().collect();
        let before = left.len();
        left.retain(|_, imported| imported.iter().any(|other| kept.contains(other)));
        if left.len() == before {
            break;
        }
    }
    assert!(left.is_empty(), "in or above a cycle: {left:#?}");
}

#[test]
fn folders_stay_small() {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for module in modules() {
        *counts.entry(folder_of(&module).to_string()).or_default() += 1;
    }
    counts.retain(|_, count| *count > MAX_FILES);
    assert!(counts.is_empty(), "more than {MAX_FILES} files: {counts:?}");
}
