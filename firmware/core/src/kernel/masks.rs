//! Weights for each set of dropped frames, computed when the set first occurs.
//!
//! With up to six frames every one of the 2^N sets has a place of its own; with more, sets share places and the later one
//! wins. Computing is deterministic, so the planes do not depend on what is kept.

use protocol_polar::fixed::{StokesPlan, Weights};

const PLACES: usize = 64;

/// A small cache from a mask of dropped frames to its weights; `None` where too few frames are left.
#[derive(Debug)]
pub struct WeightTable {
    places: [Option<(u16, Option<Weights>)>; PLACES],
}

impl WeightTable {
    /// An empty table. It belongs to one plan: start a new one for the next.
    #[must_use]
    pub fn new() -> Self {
        Self { places: [const { None }; PLACES] }
    }

    /// Weights of `plan` without the frames in `dropped`.
    pub fn weights(&mut self, plan: &StokesPlan, dropped: u16) -> Option<&Weights> {
        let folded = usize::from(dropped ^ dropped >> 6 ^ dropped >> 12) % PLACES;
        let place = self.places.get_mut(folded)?;
        if !matches!(place, Some((mask, _)) if *mask == dropped) {
            *place = Some((dropped, plan.weights(dropped).ok()));
        }
        place.as_ref().and_then(|(_, weights)| weights.as_ref())
    }

    /// Forgets everything, for a new plan.
    pub fn clear(&mut self) {
        self.places = [const { None }; PLACES];
    }
}

impl Default for WeightTable {
    fn default() -> Self {
        Self::new()
    }
}
