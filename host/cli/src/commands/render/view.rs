//! Where a rendering is seen from, on the command line.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use host_fit::maps::MaterialMaps;
use host_fit::relight::{RelightError, frame};
use host_fit::session::Camera;

use super::arguments::list;
use super::{failed, light};
use crate::exit::Exit;
use crate::failure::Failure;

/// A view by angles, or the camera of a capture.
#[derive(Args)]
#[command(next_help_heading = "View")]
pub(crate) struct ViewArgs {
    /// frontal, oblique (45 degrees from the front), or zenith angle and azimuth in degrees and a distance
    #[arg(long, value_name = "VIEW|THETA,PHI[,D]", default_value = "oblique", allow_hyphen_values = true)]
    view: Angles,
    /// Columns of the picture
    #[arg(long, value_name = "PX", default_value_t = 640)]
    width: usize,
    /// The camera of a capture: capture.json of a view, or views.json or a folder with --camera-view
    #[arg(long, value_name = "CAPTURE", conflicts_with_all = ["view", "width"])]
    camera: Option<PathBuf>,
    /// Which view of that capture, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0, requires = "camera")]
    camera_view: usize,
}

/// θ, φ in degrees; distance.
#[derive(Clone, Copy)]
struct Angles {
    theta_deg: f64,
    phi_deg: f64,
    distance: Option<f64>,
}

impl FromStr for Angles {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (theta_deg, phi_deg, distance) = match text {
            "frontal" => (0.0, -90.0, None),
            "oblique" => (45.0, -90.0, None),
            _ => match list(text, 2, 3, "frontal, oblique, theta,phi or theta,phi,distance")?.as_slice() {
                [theta, phi, rest @ ..] => (*theta, *phi, rest.first().copied()),
                _ => return Err("expected theta,phi".to_owned()),
            },
        };
        Ok(Self { theta_deg, phi_deg, distance })
    }
}

impl ViewArgs {
    /// The camera, and what to call it.
    pub(super) fn camera(&self, maps: &MaterialMaps) -> Result<(Camera, String), Failure> {
        let Some(capture) = &self.camera else {
            let Angles { theta_deg, phi_deg, distance } = self.view;
            let camera = frame(&maps.grid.plane, theta_deg, phi_deg, distance, self.width)
                .map_err(|fault| failed(&RelightError::View(fault)))?;
            return Ok((camera, format!("{theta_deg}\u{b0} from the normal, azimuth {phi_deg}\u{b0}")));
        };
        let session = light::open(capture)?;
        let index = own_index(capture).unwrap_or(self.camera_view);
        let count = session.views.len();
        let view = session.views.get(index).ok_or_else(|| {
            let what = format!("{} has {count} views, and none of number {index}", capture.display());
            Failure::new(Exit::Usage, what, format!("Choose --camera-view from 0 to {}.", count.saturating_sub(1)))
        })?;
        Ok((view.camera, format!("the camera of {}, {}", capture.display(), view.name)))
    }
}

/// The place of a view's own `capture.json` among those of its capture, in the order in which sessions count.
fn own_index(path: &Path) -> Option<usize> {
    let own = path.file_name().filter(|name| *name == "capture.json").and(path.parent())?;
    let capture = own.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(capture).ok()?;
    let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path().join("capture.json"))).collect();
    files.retain(|f| f.is_file());
    files.sort();
    files.iter().position(|f| f.parent().and_then(Path::file_name) == own.file_name())
}
