//! Sky frames, the clear-sky formula, Rayleigh and Berry patterns at the sun, the antisun, the neutral points and the zenith.

use crate::data::{Worst, cases, number, table, unit, vector};
use glam::DVec3;
use host_optics::sky::{Berry, ClearSky, Pattern, Rayleigh};
use host_optics::{Frame, Light};

/// The sky of the tables.
pub(crate) fn clear(sun: DVec3) -> ClearSky {
    ClearSky { base: 0.6, horizon: 0.5, aureole: 2.0, width: 0.25, sun }
}

#[test]
fn every_sky_case_to_1e_12() {
    let Some(table) = table("analytic/sky.json") else { return };
    let (mut radiance, mut rayleigh, mut berry, mut frame) =
        (Worst::default(), Worst::default(), Worst::default(), Worst::default());
    for case in cases(&table) {
        let name = format!("case {} {}", case["index"], case["tag"]);
        let field = |name: &str| number(&case[name]);
        let (sun, w) = (unit(&case["sun"]), unit(&case["w"]));
        let x = vector(&case["frame_x"]) - Frame::sky(w).x;
        frame.see(x.length(), 0.0, 1.0, &name);
        let [l, ..] = clear(sun).stokes(w);
        radiance.see(l, field("L"), field("L"), &name);
        let [q, u] = Rayleigh::new(sun, 1.0).unwrap().fraction(w);
        rayleigh.see(q, field("rayleigh_q"), 1.0, &name);
        rayleigh.see(u, field("rayleigh_u"), 1.0, &name);
        let [q, u] = Berry::new(sun, field("berry_split_deg"), 1.0).unwrap().fraction(w);
        berry.see(q, field("berry_q"), 1.0, &name);
        berry.see(u, field("berry_u"), 1.0, &name);
    }
    frame.below(1e-12, "sky frame");
    radiance.below(1e-12, "clear sky radiance");
    rayleigh.below(1e-12, "Rayleigh (q, u)");
    berry.below(1e-12, "Berry (q, u)");
}
