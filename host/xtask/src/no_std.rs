//! no_std, proved by building: the device's library crates for a target that has no std at all.

use crate::metadata::Metadata;
use crate::process;
use anyhow::Result;

const TARGET: &str = "thumbv7em-none-eabihf";
const CRATES: [&str; 4] = ["protocol-polar", "protocol-wire", "firmware-core", "firmware-drivers"];

/// Builds core and alloc from source where the toolchain does not have the target; the source comes from Debian, since a
/// build machine need not reach rustup's server. Both live in the target folder.
pub(crate) fn check() -> Result<String> {
    let target_directory = Metadata::load()?.target_directory.join("no-std");
    let installed = process::output(process::command("rustc").args(["--print", "sysroot"]), "rustc --print sysroot")?;
    let has_target = std::path::Path::new(installed.trim()).join("lib/rustlib").join(TARGET).is_dir();
    // Its own folder: another compiler would throw away everything built for the host.
    let mut build = process::command(&process::cargo_program());
    build.args(["build", "--target", TARGET, "--target-dir"]).arg(&target_directory);
    for name in CRATES {
        build.args(["-p", name]);
    }
    if !has_target {
        let source = target_directory.join("rust-src");
        println!("  the toolchain has no {TARGET}: taking the source of core and alloc from Debian");
        process::run(
            process::command("bash").arg("host/xtask/scripts/rust-src.sh").arg(&source),
            "host/xtask/scripts/rust-src.sh",
        )?;
        build.arg("-Zbuild-std=core,alloc").env("RUSTC", source.join("rustc")).env("RUSTC_BOOTSTRAP", "1");
    }
    process::run(&mut build, &format!("cargo build --target {TARGET} -p {}", CRATES.join(" -p ")))?;
    Ok(format!("{} crates built for {TARGET} without std", CRATES.len()))
}
