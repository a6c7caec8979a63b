//! `brewster fit`: maps of material from pictures of a sample from a few sides under known light.

mod choices;
mod failures;
mod results;
mod source;
mod words;
mod work;

use std::path::PathBuf;

use clap::Args;
use host_fit::tiles::Share;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::OutputArgs;
use crate::terminal::{Outcome, Terminal};
use choices::{Body, Loss, Masking, Mode, Pair, Regions, Starts, metal, positive, share};

/// Fit a planar sample: index, roughness, albedo and normal of every point, with their uncertainty
///
/// Takes views of one planar sample from two sides or more, through a turning polarizer, under known light: a folder of
/// captures (capture.json in each view's folder), a views.json, or what brewster simulate wrote. Writes material.exr, previews,
/// a page to look at (report.html) and the record brewster.json. A run that is stopped goes on where it was when the same
/// command is given again.
#[derive(Args)]
pub(crate) struct Fit {
    /// A folder of views, a views.json, or the folders of several views
    #[arg(value_name = "CAPTURE", required_unless_present = "merge")]
    captures: Vec<PathBuf>,
    /// How a pixel is fitted
    #[arg(long, value_enum, default_value_t = Mode::Joint)]
    mode: Mode,
    /// Use these views only, counted from 0
    #[arg(long, value_name = "N,N,...", value_delimiter = ',')]
    views: Option<Vec<usize>>,
    /// The light, instead of the captures' own: an OpenEXR map, or JSON with the keys of a capture's light
    #[arg(long, value_name = "FILE")]
    light: Option<PathBuf>,
    /// Cells along the sample's longer side [default: as fine as the sharpest view]
    #[arg(long, value_name = "N")]
    resolution: Option<usize>,
    /// Sequence of frames to use, or stokes for the Stokes images [default: the longest sequence]
    #[arg(long, value_name = "NAME")]
    frames: Option<String>,
    /// What lies below the surface; auto takes what explains a sample of pixels better
    #[arg(long, value_enum, default_value_t = Body::Auto, help_heading = "Model")]
    body: Body,
    /// How facets shadow each other
    #[arg(long, value_enum, default_value_t = Masking::HeightCorrelated, help_heading = "Model")]
    masking: Masking,
    /// Metals to try where no dielectric fits
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = metal, help_heading = "Model")]
    metal: Vec<host_fit::pipeline::Metal>,
    /// What shares index and roughness in joint-shared: clusters, one, or a picture with a value for each region (0: none)
    #[arg(long, value_name = "clusters|one|FILE", default_value = "clusters", help_heading = "Model")]
    regions: Regions,
    /// Range of the index [default: 1.2,2.2]
    #[arg(long, value_name = "LOW,HIGH", help_heading = "Model")]
    eta: Option<Pair>,
    /// Range of the roughness [default: .02,.7]
    #[arg(long, value_name = "LOW,HIGH", help_heading = "Model")]
    alpha: Option<Pair>,
    /// Error of s0 aimed at in the tables of the model, a share of s0
    #[arg(long, value_name = "T", default_value_t = 3e-3, value_parser = positive, help_heading = "Model")]
    tolerance: f64,
    /// What the model is likely to miss beside that, a share of s0
    #[arg(long, value_name = "S", default_value_t = 0.0, help_heading = "Uncertainty")]
    model_sigma: f64,
    /// Uncertainty of the light's scale, a share [default: what the light says of itself]
    #[arg(long, value_name = "S", help_heading = "Uncertainty")]
    light_sigma: Option<f64>,
    /// Uncertainty of each angle of the polarizer wheel in degrees, before the pictures correct it; 0: exact
    #[arg(long, value_name = "DEG", default_value_t = 1.0, help_heading = "Uncertainty")]
    wheel_sigma: f64,
    /// Uncertainty of the polarizer's zero in degrees [default: what the correction of the wheel leaves]
    #[arg(long, value_name = "DEG", help_heading = "Uncertainty")]
    rotation_sigma: Option<f64>,
    /// Also write the covariance of each sample
    #[arg(long, help_heading = "Uncertainty")]
    covariance: bool,
    /// How residuals count
    #[arg(long, value_name = "squares|huber:K|tukey:C", default_value = "squares", help_heading = "Search")]
    loss: Loss,
    /// From where to search: neighbors, also elsewhere where nothing fits, or everywhere (finds second minima; slow)
    #[arg(long, value_enum, default_value_t = Starts::Auto, help_heading = "Search")]
    starts: Starts,
    /// Repair poses from the pictures: for poses that are off by a pixel or more; good ones become worse by some 0.3 pixels
    #[arg(long, help_heading = "Search")]
    refine: bool,
    /// Samples of a tile's side
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=4096), help_heading = "Large fits")]
    tile: u32,
    /// Only every N-th tile from the I-th on (0/3, 1/3, 2/3), and only its tiles, into the folder -o
    #[arg(long, value_name = "I/N", value_parser = share, requires = "output", conflicts_with = "merge", help_heading = "Large fits")]
    tiles: Option<Share>,
    /// Put the tiles in these folders together, instead of computing any
    #[arg(long, value_name = "DIR", num_args = 1.., help_heading = "Large fits")]
    merge: Vec<PathBuf>,
    /// Threads [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Large fits")]
    threads: Option<u16>,
    #[command(flatten)]
    output: OutputArgs,
}

impl Fit {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        if let Some(threads) = self.threads {
            let built = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
            built.map_err(|e| Failure::new(Exit::Usage, format!("cannot start {threads} threads: {e}"), ""))?;
        }
        match (self.captures.is_empty(), self.tiles) {
            (true, _) => work::merged(self, terminal),
            (false, Some(share)) => work::tiles(self, share, terminal),
            (false, None) => work::whole(self, terminal),
        }
    }

    /// A name for the output folder: the first input's.
    fn name(&self) -> String {
        let first = self.captures.first().or(self.merge.first());
        let real = first.and_then(|p| p.canonicalize().ok());
        let folder = real.as_deref().map(|p| if p.is_file() { p.parent().unwrap_or(p) } else { p });
        let name = folder.and_then(|p| Some(p.file_name()?.to_string_lossy().into_owned()));
        name.filter(|n| !n.starts_with('.')).map_or_else(|| "fit".to_owned(), |n| format!("{n}-fit"))
    }
}
