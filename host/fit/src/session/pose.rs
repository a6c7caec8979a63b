//! From what a file says of a view's geometry to its camera: a full pose, or points of the plane found in the picture.

use glam::{DMat3, DVec2, DVec3};

use super::SessionError;
use super::camera::{Camera, PoseFault};
use super::document::{CameraDocument, PlaneDocument};
use super::homography;

/// What a camera's pose was taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Where from.
    pub origin: PoseOrigin,
    /// Rms distance in pixels between the points of the plane as the camera sees them and as the file states them:
    /// corners, fiducials, or the corners by a stated homography. `None` where only a pose is stated. The test that the
    /// sample is plane, and that pose, K and points belong together.
    pub residual_px: Option<f64>,
}

/// Kinds of geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseOrigin {
    /// K, R, t.
    Pose,
    /// K and the sample's corners.
    Corners,
    /// K and the centers of fiducials.
    Fiducials,
}

/// A statement that is this far off the pose, in pixels, is of another camera.
const AGREEMENT_PX: f64 = 2.0;

const AXES: &str = "camera x right, y down, z forward (OpenCV)";
const PIXELS: &str = "u to the right, v down, centre of pixel (row 0, col 0) is u=v=0.5";
const CORNERS: [[f64; 2]; 4] = [[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]];

/// A matrix of rows.
pub(super) fn matrix(rows: &[[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(rows).transpose()
}

/// The camera of a picture of `size`.
pub(super) fn camera(
    document: &CameraDocument,
    plane: Option<&PlaneDocument>,
    size: [usize; 2],
    place: &str,
) -> Result<(Camera, Placement), SessionError> {
    let known = |key: &str, value: &Option<String>, known: &str, sound: bool| match value {
        Some(found) if !sound => Err(SessionError::Unsupported {
            place: place.to_owned(),
            key: format!("camera.{key}"),
            found: found.clone(),
            known: format!("{known:?} is"),
        }),
        _ => Ok(()),
    };
    let says = |value: &Option<String>, what: &str| value.as_deref().is_some_and(|v| v.contains(what));
    let model = "pinhole, no distortion";
    known("model", &document.model, model, says(&document.model, "pinhole") && says(&document.model, "no distortion"))?;
    known("axes", &document.axes, AXES, says(&document.axes, "OpenCV"))?;
    known("pixel_convention", &document.pixel_convention, PIXELS, says(&document.pixel_convention, "0.5"))?;
    let intrinsics = matrix(&document.K);
    let fault = |key: &'static str| move |fault: PoseFault| SessionError::Pose { place: place.to_owned(), key, fault };
    let corners = points(
        plane.and_then(|p| p.sample_corners_plane.as_deref()).or(Some(&CORNERS)),
        plane.and_then(|p| p.sample_corners_px.as_deref()),
    );
    let fiducials = points(
        plane.and_then(|p| p.fiducial_centres_plane.as_deref()),
        plane.and_then(|p| p.fiducial_centres_px.as_deref()),
    );
    match (&document.R_world_to_camera, document.t_world_to_camera, corners, fiducials) {
        (Some(r), Some(t), corners, fiducials) => {
            let made = Camera::new(size, intrinsics, matrix(r), DVec3::from_array(t));
            let camera = made.map_err(fault("camera.R_world_to_camera, t_world_to_camera"))?;
            let residual_px = agreement(&camera, plane, [corners, fiducials], place)?;
            Ok((camera, Placement { origin: PoseOrigin::Pose, residual_px }))
        }
        (None, None, Some((on_plane, in_picture)), _) => {
            let made = Camera::from_plane_points(size, intrinsics, &on_plane, &in_picture);
            let (camera, rms) = made.map_err(fault("plane.sample_corners_px"))?;
            Ok((camera, Placement { origin: PoseOrigin::Corners, residual_px: Some(rms) }))
        }
        (None, None, None, Some((on_plane, in_picture))) => {
            let made = Camera::from_plane_points(size, intrinsics, &on_plane, &in_picture);
            let (camera, rms) = made.map_err(fault("plane.fiducial_centres_px"))?;
            Ok((camera, Placement { origin: PoseOrigin::Fiducials, residual_px: Some(rms) }))
        }
        _ => Err(SessionError::Missing {
            place: place.to_owned(),
            what: "the view's geometry".to_owned(),
            remedy: "give camera.R_world_to_camera and camera.t_world_to_camera, or plane.sample_corners_px (four \
                     corners, in the order of plane.sample_corners_plane), or plane.fiducial_centres_plane and \
                     plane.fiducial_centres_px",
        }),
    }
}

/// Pairs of points, if both lists are there; a `null` is no point.
fn points(plane: Option<&[[f64; 2]]>, pixels: Option<&[Option<[f64; 2]>]>) -> Option<(Vec<DVec2>, Vec<DVec2>)> {
    let (plane, pixels) = (plane?, pixels?);
    let pairs = plane.iter().zip(pixels).filter_map(|(p, q)| Some((DVec2::from_array(*p), DVec2::from_array((*q)?))));
    // Lists of different lengths belong to nothing: no pairs at all, which determine no view.
    Some(if plane.len() == pixels.len() { pairs.unzip() } else { (Vec::new(), Vec::new()) })
}

/// The largest rms distance between the pose and whatever else the file says of where the plane is in the picture.
fn agreement(
    camera: &Camera,
    plane: Option<&PlaneDocument>,
    lists: [Option<(Vec<DVec2>, Vec<DVec2>)>; 2],
    place: &str,
) -> Result<Option<f64>, SessionError> {
    let stated = plane.and_then(|p| p.H_plane_to_pixel.as_ref()).map(|h| {
        let stated = plane.and_then(|p| p.sample_corners_plane.as_deref()).unwrap_or(&CORNERS);
        let (on_plane, h): (Vec<DVec2>, _) = (stated.iter().map(|p| DVec2::from_array(*p)).collect(), matrix(h));
        let at = |p: &DVec2| homography::project(&h, *p).unwrap_or(DVec2::splat(f64::INFINITY));
        let pixels: Vec<DVec2> = on_plane.iter().map(at).collect();
        ("plane.H_plane_to_pixel", on_plane, pixels)
    });
    let [corners, fiducials] = lists;
    let named = [("plane.sample_corners_px", corners), ("plane.fiducial_centres_px", fiducials)];
    let listed = named.into_iter().filter_map(|(key, pair)| pair.map(|(a, b)| (key, a, b)));
    let mut worst = None;
    for (key, on_plane, in_picture) in stated.into_iter().chain(listed) {
        // NaN where there is no point.
        let rms = camera.rms_distance(&on_plane, &in_picture);
        if rms > AGREEMENT_PX || rms.is_nan() {
            return Err(SessionError::Disagree {
                place: place.to_owned(),
                what: format!("where the plane is in the picture ({rms:.1} px rms apart)"),
                first: "camera.R_world_to_camera, t_world_to_camera".to_owned(),
                second: key.to_owned(),
            });
        }
        worst = Some(rms.max(worst.unwrap_or(0.0)));
    }
    Ok(worst)
}
