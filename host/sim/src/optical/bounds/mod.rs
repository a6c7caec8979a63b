//! What the effects' bounds are proved with: intervals, derivatives along a ray of slopes, and moments of the GGX distribution.

mod facet;
mod interval;
mod jet;
mod lobe;

pub(crate) use facet::MirrorBox;
pub(crate) use interval::Interval;
pub(crate) use jet::Jet;
pub(crate) use lobe::Lobe;
