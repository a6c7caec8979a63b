//! The session that the user means: one place, several views' folders, another light.

use std::path::{Path, PathBuf};

use host_fit::session::{Pictures, Session, SessionError};
use serde_json::{Map, Value, json};

use super::{Fit, failures};
use crate::exit::Exit;
use crate::failure::Failure;

/// What `capture.json` means where it says nothing of the axis; `views.json` has another habit.
const CAPTURE_AXIS: &str = "ray x up";

impl Fit {
    pub(super) fn session(&self) -> Result<Session, Failure> {
        let pictures = match self.frames.as_deref() {
            None => Pictures::Best,
            Some("stokes") => Pictures::Stokes,
            Some(name) => Pictures::Sequence(name.to_owned()),
        };
        let mut session = match (self.captures.as_slice(), &self.light) {
            ([one], None) if !one.join("capture.json").is_file() => {
                Session::open(one, &pictures).map_err(|e| failures::session(&e))
            }
            _ => self.combined(&pictures),
        }?;
        if let Some(chosen) = &self.views {
            let count = session.views.len();
            if let Some(view) = chosen.iter().find(|v| **v >= count) {
                let what = format!("--views {view}: there are {count}, counted from 0");
                return Err(Failure::new(Exit::Usage, what, "Leave the option out to use all."));
            }
            let mut number = 0..;
            session.views.retain(|_| number.next().is_some_and(|n| chosen.contains(&n)));
        }
        Ok(session)
    }

    /// All captures in one list that is written for the occasion, so that there is one reader.
    fn combined(&self, pictures: &Pictures) -> Result<Session, Failure> {
        let mut list = Map::new();
        let mut views = Vec::new();
        for capture in &self.captures {
            gather(capture, &mut views, &mut list)?;
        }
        if let Some(file) = &self.light {
            views.iter_mut().filter_map(Value::as_object_mut).for_each(|view| {
                view.remove("light");
            });
            list.insert("light".into(), light(file)?);
        }
        list.insert("version".into(), json!(1));
        list.insert("views".into(), Value::Array(views));
        let unwritable = |e: std::io::Error| {
            Failure::new(Exit::Output, format!("cannot write a temporary file: {e}"), "Check the temporary folder.")
        };
        let folder = tempfile::tempdir().map_err(unwritable)?;
        let path = folder.path().join("views.json");
        std::fs::write(&path, Value::Object(list).to_string()).map_err(unwritable)?;
        let names: Vec<String> = self.captures.iter().map(|p| p.display().to_string()).collect();
        Session::open(&path, pictures).map_err(|e| {
            let place = path.display().to_string();
            failures::session(&e).map_text(|text| text.replace(&place, &names.join(", ")))
        })
    }
}

/// Adds the views below `capture`, their paths made absolute.
fn gather(capture: &Path, views: &mut Vec<Value>, list: &mut Map<String, Value>) -> Result<(), Failure> {
    let own = capture.join("capture.json");
    let listed = if capture.is_file() { capture.to_owned() } else { capture.join("views.json") };
    if own.is_file() {
        views.push(view(read(&own)?, capture, Some(CAPTURE_AXIS)));
        return Ok(());
    }
    if listed.is_file() {
        let Value::Object(mut document) = read(&listed)? else { return Ok(()) };
        let folder = listed.parent().unwrap_or(Path::new("."));
        if let Some(Value::Array(found)) = document.remove("views") {
            views.extend(found.into_iter().map(|v| view(v, folder, None)));
        }
        document.get_mut("light").into_iter().for_each(|light| absolute(light, folder));
        ["light", "sample"].into_iter().for_each(|key| {
            if let Some(value) = document.remove(key) {
                list.insert(key.into(), value);
            }
        });
        return Ok(());
    }
    let entries = std::fs::read_dir(capture).map_err(|e| refused(capture, e))?;
    let mut folders: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    folders.retain(|f| f.join("capture.json").is_file());
    folders.sort();
    if folders.is_empty() {
        let what =
            format!("{} is no capture: it has no views.json, and no folders with capture.json", capture.display());
        return Err(Failure::new(
            Exit::BadInput,
            what,
            "Name a folder of views, a views.json, or several views' folders.",
        ));
    }
    folders.iter().try_for_each(|folder| gather(folder, views, list))
}

/// One view with absolute paths, and what its kind of file takes for granted.
fn view(mut view: Value, folder: &Path, axis: Option<&str>) -> Value {
    let Some(object) = view.as_object_mut() else { return view };
    let parts = ["sequences", "stokes", "light"];
    parts.into_iter().filter_map(|key| object.remove(key).map(|v| (key, v))).collect::<Vec<_>>().into_iter().for_each(
        |(key, mut part)| {
            absolute(&mut part, folder);
            if let (Value::String(file), "stokes") = (&part, key) {
                part = json!(whole(folder, file));
            }
            object.insert(key.into(), part);
        },
    );
    if let Some(axis) = axis {
        let polarizer = object.entry("polarizer").or_insert_with(|| json!({}));
        if let Some(polarizer) = polarizer.as_object_mut() {
            polarizer.entry("reference_axis").or_insert_with(|| json!(axis));
        }
    }
    view
}

/// Every `file` below, with the folder before it.
fn absolute(value: &mut Value, folder: &Path) {
    match value {
        Value::Object(object) => object.iter_mut().for_each(|(key, value)| match value {
            Value::String(file) if key == "file" => *file = whole(folder, file),
            other => absolute(other, folder),
        }),
        Value::Array(values) => values.iter_mut().for_each(|v| absolute(v, folder)),
        _ => {}
    }
}

fn whole(folder: &Path, file: &str) -> String {
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    folder.join(file).to_string_lossy().into_owned()
}

/// A light that the user names: a map, or the keys of a capture's light.
fn light(file: &Path) -> Result<Value, Failure> {
    if let Err(error) = std::fs::File::open(file) {
        return Err(refused(file, error));
    }
    let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        let document = read(file)?;
        let mut light = document.get("light").cloned().unwrap_or(document);
        absolute(&mut light, folder);
        return Ok(light);
    }
    let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(json!({ "type": "map", "file": whole(folder, &name) }))
}

fn read(path: &Path) -> Result<Value, Failure> {
    let text = std::fs::read_to_string(path).map_err(|e| refused(path, e))?;
    serde_json::from_str(&text).map_err(|source| failures::session(&SessionError::Json { path: path.into(), source }))
}

fn refused(path: &Path, source: std::io::Error) -> Failure {
    failures::session(&SessionError::Io { path: path.into(), source })
}
