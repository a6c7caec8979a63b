//! Why a fit was refused.

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The frames do not determine three Stokes components, or only with noise amplified beyond use.
    #[error("not identifiable: {axes} different polarizer axes modulo 180 degrees, condition number {condition:.3e}")]
    NotIdentifiable {
        /// Different polarizer axes modulo 180°, to 0.01°.
        axes: usize,
        /// Condition number of the whitened analyzer matrix; infinite if its rank is below three.
        condition: f64,
    },
    /// More frames than one fit takes.
    #[error("{frames} frames; at most {} are taken", protocol_polar::MAX_FRAMES)]
    TooManyFrames {
        /// How many were given.
        frames: usize,
    },
    /// A throughput, efficiency, angle or σ that is not finite, or not positive where it must be.
    #[error("frame {frame} has an angle, throughput, efficiency or sigma that makes no sense")]
    BadFrame {
        /// Index of the frame.
        frame: usize,
    },
    /// A flat field that is not brighter than the dark one.
    #[error("the flat field is not above the dark level at sample {index} (row-major)")]
    FlatNotAboveDark {
        /// Index of the sample in its row-major plane.
        index: usize,
    },
    /// Data that do not belong together.
    #[error("{what}: {found} where {expected} were expected")]
    Size {
        /// What was counted.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
}
