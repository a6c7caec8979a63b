//! The crate dependency arrows of docs/ARCHITECTURE.md: every arrow points at `protocol/`.
//!
//! Dependencies of tests and build scripts count like any other.

use crate::metadata::{Metadata, Package};
use anyhow::{Result, bail};

const PROTOCOL: &[&str] = &["protocol-polar", "protocol-wire"];

/// What a crate of ours may use of ours, by its name; `None` is a crate without a place in the architecture.
fn allowed(from: &str, to: &str) -> Option<bool> {
    let never = matches!(to, "host-cli" | "host-xtask" | "hil-tests");
    Some(match from {
        "protocol-polar" => false,
        "protocol-wire" | "firmware-drivers" | "boards" => to == "protocol-polar",
        "firmware-core" => PROTOCOL.contains(&to),
        "firmware-emulator" | "firmware-pi" => {
            PROTOCOL.contains(&to) || matches!(to, "firmware-core" | "firmware-drivers" | "boards")
        }
        "host-cli" => !never && matches_any(to, &["protocol-", "host-", "boards", "firmware-emulator"]),
        "hil-tests" => !never,
        _ if from.starts_with("host-") => !never && matches_any(to, &["protocol-", "host-", "boards"]),
        _ => return None,
    })
}

fn matches_any(name: &str, prefixes: &[&str]) -> bool {
    prefixes.iter().any(|prefix| name.starts_with(prefix))
}

/// Crate name = its path with a dash.
fn expected_name(package: &Package, metadata: &Metadata) -> String {
    let folder = package.manifest_path.parent().unwrap_or(&package.manifest_path);
    let relative = folder.strip_prefix(&metadata.workspace_root).unwrap_or(folder);
    relative.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("-")
}

/// Checks every manifest of the workspace.
pub(crate) fn check() -> Result<String> {
    let metadata = Metadata::load()?;
    let names: Vec<&str> = metadata.members().map(|package| package.name.as_str()).collect();
    let mut wrong = Vec::new();
    let mut arrows = 0;
    for package in metadata.members() {
        let expected = expected_name(package, &metadata);
        if package.name != expected {
            wrong.push(format!(
                "{} lies where {expected} belongs: a crate's name is its path with a dash",
                package.name
            ));
        }
        for dependency in package.dependencies.iter().filter(|d| names.contains(&d.name.as_str())) {
            arrows += 1;
            let kind = dependency.kind.as_deref().map_or(String::new(), |kind| format!(" ({kind})"));
            match allowed(&package.name, &dependency.name) {
                Some(true) => {}
                Some(false) => wrong.push(format!("{} must not use {}{kind}", package.name, dependency.name)),
                None => wrong.push(format!("{} has no rule in host/xtask/src/arrows.rs", package.name)),
            }
        }
    }
    if !wrong.is_empty() {
        bail!("docs/ARCHITECTURE.md says otherwise:\n  {}", wrong.join("\n  "));
    }
    Ok(format!("{arrows} arrows among {} crates", names.len()))
}

#[cfg(test)]
mod tests {
    use super::allowed;

    #[test]
    fn every_arrow_points_at_protocol() {
        for from in
            ["protocol-wire", "firmware-core", "firmware-drivers", "boards", "host-fit", "host-cli", "hil-tests"]
        {
            assert_eq!(allowed(from, "protocol-polar"), Some(true), "{from}");
            assert_eq!(allowed("protocol-polar", from), Some(false), "{from}");
        }
    }

    #[test]
    fn only_the_program_and_the_stories_know_the_emulator() {
        for from in ["host-link", "host-fit", "host-image", "host-optics", "host-xtask", "boards", "firmware-core"] {
            for to in ["firmware-emulator", "firmware-core", "firmware-drivers", "host-cli"] {
                assert_eq!(allowed(from, to), Some(false), "{from} -> {to}");
            }
        }
        assert_eq!(allowed("host-cli", "firmware-emulator"), Some(true));
        assert_eq!(allowed("host-cli", "firmware-core"), Some(false));
        assert_eq!(allowed("hil-tests", "firmware-emulator"), Some(true));
        assert_eq!(allowed("hil-tests", "host-cli"), Some(false));
        assert_eq!(allowed("gadgets", "protocol-polar"), None);
    }
}
