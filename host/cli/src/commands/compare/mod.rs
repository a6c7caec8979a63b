//! `brewster compare`: maps against maps or the truth, pictures against pictures.

mod maps;
mod pictures;

use std::path::{Path, PathBuf};

use clap::Args;
use host_fit::maps::{MapsError, MaterialMaps, PlaneRect};
use host_image::{ImageError, Layers};

use super::render::arguments::positive;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::OutputArgs;
use crate::terminal::{Outcome, Terminal};
pub(super) use maps::{against, class_json, figures, table};

/// Compare fitted maps with the truth or other maps, or a rendering with a photograph
///
/// Of maps (material.exr; the reference may be a truth file with channels albedo, eta, alpha, normal and mask): errors of
/// normals, index, roughness and albedo: median, 95 %, rms, and how many lie within the stated uncertainty. Of pictures (PNG,
/// TIFF, OpenEXR, npy, or s0 of two Stokes images): PSNR and SSIM. Writes maps of the errors (PNG) and a page to look at.
#[derive(Args)]
pub(crate) struct Compare {
    /// What is judged: material.exr, or a picture
    file: PathBuf,
    /// What it is judged by: a truth file or material.exr, or a picture
    reference: PathBuf,
    /// Part of the plane from the truth's first to its last sample [default: the plane of the maps]
    #[arg(long, value_name = "X0,X1,Y0,Y1", allow_hyphen_values = true, value_parser = rectangle)]
    truth_plane: Option<Rect>,
    /// Score samples that have reasons against them too
    #[arg(long)]
    all: bool,
    /// Range of the pictures' values, for PSNR and SSIM [default: that of the integer type; the largest value of floats]
    #[arg(long, value_name = "PEAK", value_parser = positive)]
    peak: Option<f64>,
    /// First scale the picture to the reference, by the factor that fits best
    #[arg(long)]
    align_scale: bool,
    #[command(flatten)]
    output: OutputArgs,
}

/// left, right, bottom, top.
#[derive(Clone, Copy)]
struct Rect(PlaneRect);

fn rectangle(text: &str) -> Result<Rect, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|t| t.trim().parse().ok()).collect();
    match *numbers.as_slice() {
        [left, right, bottom, top] if left < right && bottom < top => Ok(Rect(PlaneRect { left, right, bottom, top })),
        _ => Err("expected left,right,bottom,top with left < right and bottom < top".to_owned()),
    }
}

/// What a file holds.
enum Kind {
    Material,
    Truth,
    Picture,
}

impl Compare {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        match (kind(&self.file)?, kind(&self.reference)?) {
            (Kind::Material, Kind::Material) => self.maps(false, terminal),
            (Kind::Material, Kind::Truth) => self.maps(true, terminal),
            (Kind::Picture, Kind::Picture) => self.pictures(terminal),
            (Kind::Truth, _) => Err(Failure::new(
                Exit::BadInput,
                format!("{} is a truth, not a result", self.file.display()),
                "Name the material.exr first and the truth second.",
            )),
            _ => Err(Failure::new(
                Exit::BadInput,
                format!(
                    "{} and {}: one is a map of material, the other a picture",
                    self.file.display(),
                    self.reference.display()
                ),
                "Compare maps with maps or a truth file, and pictures with pictures.",
            )),
        }
    }
}

/// By the bytes and channels of the file, not by its name.
fn kind(path: &Path) -> Result<Kind, Failure> {
    let mut magic = [0; 4];
    let read = std::fs::File::open(path).and_then(|mut f| std::io::Read::read_exact(&mut f, &mut magic));
    if let Err(source) = read
        && source.kind() != std::io::ErrorKind::UnexpectedEof
    {
        return Err(Failure::reading(&ImageError::Io { path: path.into(), source }));
    }
    if magic != [0x76, 0x2f, 0x31, 0x01] {
        return Ok(Kind::Picture);
    }
    let layers = Layers::load(path).map_err(|e| Failure::reading(&e))?;
    let has = |name: &str| layers.channels.contains_key(name);
    Ok(match has("eta") && has("alpha") && has("normal.X") {
        false => Kind::Picture,
        true if layers.attributes.contains_key("schema") => Kind::Material,
        true => Kind::Truth,
    })
}

fn load(path: &Path) -> Result<MaterialMaps, Failure> {
    MaterialMaps::load_exr(path).map_err(|e| super::render::not_maps(&e))
}

/// Maps or pictures that cannot be compared.
fn refused(error: &MapsError) -> Failure {
    match error {
        MapsError::Image(image) => Failure::reading(image),
        MapsError::GridMismatch { .. } => Failure::new(Exit::BadInput, error.to_string(), "Fit both on the same grid."),
        other => Failure::new(
            Exit::BadInput,
            other.to_string(),
            "Compare pictures of one size and type; crop or state --peak.",
        ),
    }
}
