//! What `cargo metadata` says about the workspace and everything it depends on.

use crate::process;
use anyhow::{Context, Result};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// The parts of the metadata that the checks read.
#[derive(Deserialize)]
pub(crate) struct Metadata {
    pub packages: Vec<Package>,
    pub workspace_members: BTreeSet<String>,
    pub workspace_root: PathBuf,
    pub target_directory: PathBuf,
    resolve: Resolve,
}

/// One package, ours or not.
#[derive(Deserialize)]
pub(crate) struct Package {
    pub id: String,
    pub name: String,
    pub version: String,
    /// SPDX expression.
    pub license: Option<String>,
    pub manifest_path: PathBuf,
    pub dependencies: Vec<Dependency>,
}

/// A dependency as a manifest states it.
#[derive(Deserialize)]
pub(crate) struct Dependency {
    pub name: String,
    /// `None` for a normal one, else `dev` or `build`.
    pub kind: Option<String>,
}

#[derive(Deserialize)]
struct Resolve {
    nodes: Vec<Node>,
}

#[derive(Deserialize)]
struct Node {
    id: String,
    deps: Vec<Edge>,
}

#[derive(Deserialize)]
struct Edge {
    pkg: String,
    dep_kinds: Vec<EdgeKind>,
}

#[derive(Deserialize)]
struct EdgeKind {
    kind: Option<String>,
}

impl Metadata {
    /// Asks cargo; features and targets are all taken in.
    pub(crate) fn load() -> Result<Self> {
        let arguments = ["metadata", "--format-version", "1", "--all-features"];
        let text = process::output(process::command(&process::cargo_program()).args(arguments), "cargo metadata")?;
        serde_json::from_str(&text).context("cargo metadata is not what it used to be")
    }

    /// Our own packages.
    pub(crate) fn members(&self) -> impl Iterator<Item = &Package> {
        self.packages.iter().filter(|package| self.workspace_members.contains(&package.id))
    }

    /// Ids of `roots` and everything that is compiled for them: normal and build dependencies, not those of tests.
    pub(crate) fn shipped_with<'a>(&'a self, roots: &[&'a Package]) -> BTreeSet<&'a str> {
        let edges: BTreeMap<&str, &Vec<Edge>> =
            self.resolve.nodes.iter().map(|node| (node.id.as_str(), &node.deps)).collect();
        let mut seen = BTreeSet::new();
        let mut open: Vec<&str> = roots.iter().map(|package| package.id.as_str()).collect();
        while let Some(id) = open.pop() {
            if seen.insert(id) {
                let deps = edges.get(id).into_iter().flat_map(|deps| deps.iter());
                let shipped = deps.filter(|edge| edge.dep_kinds.iter().any(|k| k.kind.as_deref() != Some("dev")));
                open.extend(shipped.map(|edge| edge.pkg.as_str()));
            }
        }
        seen
    }
}
