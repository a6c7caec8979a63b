//! What must hold of every picture.

use glam::DVec3;
use host_optics::sky::StokesMap;
use host_optics::{Ggx, Ior, Masking};
use host_sim::optical::{
    Body, Evaluation, Method, Pixel, PixelMap, Radiance, Renderer, SceneLight, SkyPattern, Surface,
};
use host_sim::{Effect, EffectSet};

/// A wavy plane under a spotted, polarized sky.
fn picture(threads: usize, effects: EffectSet) -> (Vec<[[f32; 3]; 3]>, Method) {
    let texels = (0..128 * 64_u16).map(|k| [0.2 + f32::from(k % 61) / 61.0, 0.0, 0.0]).collect();
    let map = Radiance::Map(StokesMap::new(128, 64, texels).unwrap());
    let light = SceneLight {
        radiance: [map.clone(), map.clone(), map],
        pattern: Some(SkyPattern::Berry { sun: DVec3::new(0.6, 0.3, 0.5), splitting_deg: 30.0, max_dolp: 0.7 }),
        sun: None,
    };
    let ggx = Ggx::new(0.25, Masking::HeightCorrelated).unwrap();
    let surfaces = [Surface { ior: [1.5, 1.51, 1.52].map(|n| Ior::new(n, 0.0).unwrap()), ggx, body: Body::Interface }];
    let pixels: Vec<Pixel> = (0..64 * 64_u16)
        .map(|k| {
            let (u, v) = (f64::from(k % 64) / 64.0 - 0.5, f64::from(k / 64) / 64.0 - 0.5);
            Pixel {
                normal: DVec3::new(0.1 * (9.0 * u).sin(), 0.1 * (7.0 * v).cos(), 1.0).normalize().as_vec3().into(),
                to_camera: DVec3::new(0.8 - 0.1 * v, 0.1 * u, 0.6).normalize().as_vec3().into(),
                albedo: [0.3, 0.2, 0.1],
                surface: 0,
            }
        })
        .collect();
    let view = PixelMap { width: 64, camera_x: DVec3::Y, pixels: &pixels };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let evaluation = Evaluation::Prefiltered { tolerance: 3e-3 };
        let rendering = Renderer::new(&light, &surfaces, effects, evaluation).unwrap().render(&view);
        (rendering.stokes, rendering.surfaces[0].method)
    })
}

#[test]
fn pictures_do_not_depend_on_the_number_of_threads() {
    let (one, method) = picture(1, EffectSet::ALL);
    assert!(matches!(method, Method::Table { .. }), "{method:?}");
    for threads in [2, 5] {
        assert!(picture(threads, EffectSet::ALL).0 == one, "{threads} threads");
    }
}

#[test]
fn light_stays_physical_whatever_is_left_out() {
    for effect in Effect::OPTICAL {
        let (stokes, _) = picture(2, EffectSet::ALL.without(effect));
        for [s0, s1, s2] in stokes.into_iter().flatten() {
            assert!(s0 > 0.0 && s1.hypot(s2) <= s0 * 1.001, "{}: {s0} {s1} {s2}", effect.name());
        }
    }
}
