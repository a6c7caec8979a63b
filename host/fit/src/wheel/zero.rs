//! The common turn of all angles of a view, which no picture of an unknown scene shows: from a reference strip, flat in the
//! sample's plane and of a known index, under the known light.
//!
//! The strip's AoLP in the picture is known from eq. 6; what is measured is less by the turn δ of the wheel's zero. Roughness and
//! albedo of the strip are not known and are fitted along, over all views: they hardly turn its AoLP.

use protocol_polar::Radians;

use crate::material::{BANDS, Facets, Forward, Observation};
use crate::register::Tile;

/// What the strip says of one view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zero {
    /// δ, to be added to all angles of the view.
    pub turn: Radians,
    /// Its standard deviation from the noise alone.
    pub sigma: Radians,
}

impl Zero {
    /// With what was known of the turn before, 0 ± `prior`: the mean of both by their weights.
    #[must_use]
    pub fn with_prior(self, prior: Radians) -> Self {
        let (own, before) = (self.sigma.0.powi(-2), prior.0.powi(-2));
        Self { turn: Radians(self.turn.0 * own / (own + before)), sigma: Radians((own + before).powf(-0.5)) }
    }
}

/// Roughnesses tried.
const ALPHAS: [f64; 10] = [0.02, 0.03, 0.045, 0.07, 0.1, 0.14, 0.2, 0.28, 0.38, 0.5];

/// The turn of every view of a tile that shows nothing but the strip. `eta` is the strip's index. `None` for a view that sees no
/// polarized light of it.
#[must_use]
pub fn zeros<F: Forward + ?Sized>(forward: &F, strip: &Tile, views: usize, eta: f64) -> Vec<Option<Zero>> {
    let observations: Vec<&Observation> =
        (0..strip.len()).flat_map(|i| strip.node(i).iter().flatten()).filter(|o| is_complete(o)).collect();
    let candidates =
        ALPHAS.map(|alpha| Candidate::new(forward, &observations, views, Facets { eta, alpha, slope: [0.0; 2] }));
    let best = candidates.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
    best.map_or_else(|| vec![None; views], |best| best.sums.iter().map(Sums::zero).collect())
}

fn is_complete(o: &Observation) -> bool {
    o.covariance.iter().flatten().chain(o.stokes.iter().flatten()).all(|v| v.is_finite())
        && o.covariance.iter().all(|c| c[0] > 0.0 && c[3] + c[5] > 0.0)
}

/// One roughness of the strip.
struct Candidate {
    sums: Vec<Sums>,
    /// χ² with the best albedo and the best turns.
    cost: f64,
}

/// Weighted products of measured and expected s1 + i s2 of one view.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Re and Im of Σ w conj(measured) expected.
    product: [f64; 2],
    measured: f64,
    expected: f64,
}

impl Candidate {
    fn new<F: Forward + ?Sized>(forward: &F, observations: &[&Observation], views: usize, facets: Facets) -> Self {
        let responses: Vec<_> = observations.iter().map(|o| forward.response(o.view, o.direction, &facets)).collect();
        let mut albedo = [0.0; BANDS];
        for (band, albedo) in albedo.iter_mut().enumerate() {
            let (mut over, mut under) = (0.0, 0.0);
            for (o, r) in observations.iter().zip(&responses) {
                let (w, d) = (1.0 / f64::from(o.covariance[band][0]), r.diffuse[3 * band]);
                over += w * d * (f64::from(o.stokes[band][0]) - r.specular[3 * band]);
                under += w * d * d;
            }
            *albedo = if under > 0.0 { (over / under).max(0.0) } else { 0.0 };
        }
        let mut sums = vec![Sums::default(); views];
        let mut cost = 0.0;
        for (o, r) in observations.iter().zip(&responses) {
            let Some(sums) = sums.get_mut(o.view) else { continue };
            for (band, albedo) in albedo.iter().enumerate() {
                let [s0, s1, s2] = o.stokes[band].map(f64::from);
                let model = |k: usize| r.specular[3 * band + k] + albedo * r.diffuse[3 * band + k];
                let covariance = o.covariance[band].map(f64::from);
                cost += (s0 - model(0)).powi(2) / covariance[0];
                let w = 2.0 / (covariance[3] + covariance[5]);
                let (m1, m2) = (model(1), model(2));
                sums.product[0] += w * (s1 * m1 + s2 * m2);
                sums.product[1] += w * (s1 * m2 - s2 * m1);
                sums.measured += w * (s1 * s1 + s2 * s2);
                sums.expected += w * (m1 * m1 + m2 * m2);
            }
        }
        // |measured turned − expected|² at the best turn.
        cost += sums.iter().map(|s| s.measured + s.expected - 2.0 * s.product[0].hypot(s.product[1])).sum::<f64>();
        Self { sums, cost }
    }
}

impl Sums {
    fn zero(&self) -> Option<Zero> {
        let [re, im] = self.product;
        let length = re.hypot(im);
        // One component across the AoLP, which turns by twice δ.
        (length > 0.0 && self.expected > 0.0)
            .then(|| Zero { turn: Radians(0.5 * im.atan2(re)), sigma: Radians(0.5 / length.sqrt()) })
    }
}
