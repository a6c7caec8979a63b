//! What stands before the lens: the scene, brighter or darker; a cap; a uniform bright field.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The operator's hands. Shared: clones are the same light.
#[derive(Clone, Debug)]
pub struct Light(Arc<Mutex<View>>);

#[derive(Clone, Copy, Debug)]
pub(crate) enum View {
    /// The scene, times a factor.
    Scene(f32),
    Capped,
    /// Unpolarized s0 everywhere, DN at the reference exposure.
    Flat(f32),
}

impl Default for Light {
    fn default() -> Self {
        Self(Arc::new(Mutex::new(View::Scene(1.0))))
    }
}

impl Light {
    /// The scene as it is.
    pub fn scene(&self) {
        self.dimmed(1.0);
    }

    /// The scene in `factor` times its light.
    pub fn dimmed(&self, factor: f32) {
        *self.view() = View::Scene(factor);
    }

    /// The cap on the lens.
    pub fn cap(&self) {
        *self.view() = View::Capped;
    }

    /// A uniform unpolarized field of this s0, DN at [`crate::REFERENCE_EXPOSURE_US`].
    pub fn flat(&self, s0_dn: f32) {
        *self.view() = View::Flat(s0_dn);
    }

    pub(crate) fn view(&self) -> MutexGuard<'_, View> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
