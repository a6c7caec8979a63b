//! What the effects' bounds are proved with: intervals, derivatives along a ray of slopes, and moments of the GGX distribution.

mod body;
mod cells;
mod facet;
mod fresnel;
mod interval;
mod jet;
mod lobe;
mod profile;

pub(crate) use body::{Body, Emitted};
pub(crate) use cells::{Cells, Slice, Sums};
pub(crate) use facet::MirrorBox;
pub(crate) use fresnel::Fresnel;
pub(crate) use interval::Interval;
pub(crate) use jet::Jet;
pub(crate) use lobe::Lobe;
pub(crate) use profile::Profile;
