//! Stokes images as a folder of npy files, for NumPy.

use std::io::Write;
use std::path::Path;

use serde::Serialize;

use super::{FRAME_CONVENTION, StokesImage, StokesMetadata};
use crate::ImageError;
use crate::atomic::{make_folder_atomically, write_atomically};
use crate::error::io_error;
use crate::npy;

/// What `metadata.json` holds.
#[derive(Serialize)]
struct Description<'a> {
    schema: u32,
    frame: &'static str,
    width: usize,
    height: usize,
    planes: Vec<String>,
    #[serde(flatten)]
    metadata: &'a StokesMetadata,
}

pub(super) fn save(image: &StokesImage, folder: &Path) -> Result<(), ImageError> {
    let shape = [image.height, image.width];
    make_folder_atomically(folder, |folder| {
        let mut planes = Vec::new();
        let mut next = |plane: &str, color: &str| {
            let name = format!("{plane}.{color}.npy");
            let path = folder.join(&name);
            planes.push(name);
            path
        };
        for color in &image.colors {
            let name = color.color.name();
            for (plane, samples) in color.float_planes() {
                npy::write(&next(plane, name), &shape, samples)?;
            }
            if let Some(flags) = &color.flags {
                npy::write(&next("FLAGS", name), &shape, flags)?;
            }
        }
        let path = folder.join("metadata.json");
        let description = Description {
            schema: 1,
            frame: FRAME_CONVENTION,
            width: image.width,
            height: image.height,
            planes,
            metadata: &image.metadata,
        };
        let json = serde_json::to_vec_pretty(&description).map_err(|e| io_error(&path, e.into()))?;
        write_atomically(&path, |out| out.write_all(&json).map_err(|e| io_error(&path, e)))
    })
}
