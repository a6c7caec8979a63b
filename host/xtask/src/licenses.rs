//! License policy by side: nothing copyleft goes into the device; the host may link what its users can replace.

use crate::metadata::{Metadata, Package};
use anyhow::{Result, anyhow, bail};

/// Licenses that ask for a notice at most: everything compiled into `protocol-*` and `firmware-*`.
const PERMISSIVE: &[&str] = &[
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// What host programs and tests may have besides: copyleft that stays within its own files.
const HOST_TOO: &[&str] = &["MPL-2.0"];

/// Packages that carry somebody else's code under another license than their manifest's; known, and named here with the
/// reason why it is fine on the host. On the device's side none is.
const CARRIED: &[(&str, &str, &str)] = &[(
    "libusb1-sys",
    "LGPL-2.1-or-later",
    "libusb, built from the source in the package; whoever has this workspace can relink it with another one",
)];

const OURS: &str = "MIT OR Apache-2.0";

/// Checks every package of the lock file.
pub(crate) fn check() -> Result<String> {
    let metadata = Metadata::load()?;
    let device: Vec<&Package> = metadata
        .members()
        .filter(|package| package.name.starts_with("protocol-") || package.name.starts_with("firmware-"))
        .collect();
    let on_device = metadata.shipped_with(&device);
    let host: Vec<&str> = PERMISSIVE.iter().chain(HOST_TOO).copied().collect();
    let mut wrong = Vec::new();
    for package in &metadata.packages {
        let name = format!("{} {}", package.name, package.version);
        let ours = metadata.workspace_members.contains(&package.id);
        let (side, list) =
            if on_device.contains(package.id.as_str()) { ("the device", PERMISSIVE) } else { ("the host", &host[..]) };
        match &package.license {
            None => wrong.push(format!("{name} states no license")),
            Some(license) if ours && license != OURS => wrong.push(format!("{name} is ours and says {license:?}")),
            Some(license) => match satisfied(license, list) {
                Ok(true) => {}
                Ok(false) => wrong.push(format!("{name}: {license:?} is not allowed on the side of {side}")),
                Err(error) => wrong.push(format!("{name}: {error:#}")),
            },
        }
        for (_, license, reason) in CARRIED.iter().filter(|(carrier, ..)| *carrier == package.name) {
            println!("  {name} carries {license} code: {reason}");
            if side == "the device" {
                wrong.push(format!("{name} carries {license} code into the device"));
            }
        }
    }
    if !wrong.is_empty() {
        bail!("host/xtask/src/licenses.rs has the policy:\n  {}", wrong.join("\n  "));
    }
    Ok(format!("{} packages, {} of them on the device's side", metadata.packages.len(), on_device.len()))
}

/// Whether an SPDX expression can be met with the licenses in `list`. The old form `MIT/Apache-2.0` is an OR.
fn satisfied(expression: &str, list: &[&str]) -> Result<bool> {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = &words[..];
    let result = either(&mut rest, list)?;
    if rest.is_empty() { Ok(result) } else { Err(anyhow!("{expression:?} is no SPDX expression")) }
}

fn either(words: &mut &[&str], list: &[&str]) -> Result<bool> {
    let mut result = both(words, list)?;
    while let ["OR", rest @ ..] = *words {
        *words = rest;
        result |= both(words, list)?;
    }
    Ok(result)
}

fn both(words: &mut &[&str], list: &[&str]) -> Result<bool> {
    let mut result = one(words, list)?;
    while let ["AND", rest @ ..] = *words {
        *words = rest;
        result &= one(words, list)?;
    }
    Ok(result)
}

fn one(words: &mut &[&str], list: &[&str]) -> Result<bool> {
    match *words {
        ["(", rest @ ..] => {
            *words = rest;
            let result = either(words, list)?;
            let [")", rest @ ..] = *words else { bail!("a license expression without its closing parenthesis") };
            *words = rest;
            Ok(result)
        }
        // An exception gives more rights, never fewer.
        [license, "WITH", _, rest @ ..] => {
            *words = rest;
            Ok(list.contains(license))
        }
        [license, rest @ ..] if !matches!(*license, ")" | "OR" | "AND" | "WITH") => {
            *words = rest;
            Ok(list.contains(license))
        }
        _ => bail!("a license expression that breaks off"),
    }
}

#[cfg(test)]
mod tests {
    use super::{PERMISSIVE, satisfied};

    #[test]
    fn expressions_mean_what_spdx_says() {
        let holds = |expression| satisfied(expression, PERMISSIVE).unwrap();
        assert!(holds("MIT") && holds("MIT/Apache-2.0") && holds("GPL-3.0-only OR MIT"));
        assert!(holds("(MIT OR Apache-2.0) AND Unicode-3.0"));
        assert!(holds("Apache-2.0 WITH LLVM-exception OR MIT"));
        assert!(!holds("LGPL-2.1-or-later") && !holds("MIT AND GPL-3.0-only") && !holds("MPL-2.0"));
        // AND binds tighter than OR.
        assert!(holds("MIT OR GPL-3.0-only AND GPL-2.0-only"));
    }

    #[test]
    fn what_is_no_expression_is_refused() {
        for broken in ["", "(MIT", "MIT OR", "MIT Apache-2.0", ")", "AND MIT"] {
            assert!(satisfied(broken, PERMISSIVE).is_err(), "{broken:?}");
        }
    }
}
