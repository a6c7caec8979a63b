"""The simulator's job in Mitsuba 3: a rough dielectric plane under an environment map, as a Stokes picture of one band.

`mitsuba_peer.py MAP OUT` renders it with the `stokes` integrator (one bounce, `llvm_ad_mono_polarized`) and prints JSON:
{version, runs: [{alpha, spp, cpu_s, noise}]}. `cpu_s` is processor time of all threads for one picture of 1024 x 1024, the median
of three after a warm-up that compiles the kernel. `noise` is the rms difference of two pictures of different seeds over sqrt 2,
worst component, in units of the mean s0: the error of one picture. For another program to be compared with:

OUT/map.f32            1024 x 2048 radiance as the emitter answers: row i has polar angle (i + .5)/1024 pi from +z, column j azimuth
                       (j + .5)/2048 2 pi from +x towards +y; 0 below the horizon
OUT/alpha_A.f32        128 x 128 x 3: s0, s1, s2 averaged over 8 x 8 pixels of the picture, of many more samples
All little-endian f32, row-major.

The camera is 6 units from the origin, 56 degrees from the normal +z of the plane, in the plane y = 0, z up in the picture; the
picture is 1.2 units wide at that distance. Material: GGX with the separable Smith term, index 1.5, no diffuse part.
"""

import json
import pathlib
import sys
import time

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_mono_polarized")
SIZE, COARSE = 1024, 128
ALPHAS = (0.1, 0.25)
SPP = (16, 64)
REFERENCE_SPP, REFERENCE_RUNS = 1024, 8


def emitter(path):
    # Green is the band. Black below the horizon, as the sky of the other program is.
    rgb = np.array(mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False))
    rgb = np.repeat(rgb[:, :, 1:2], 3, axis=2)
    rgb[rgb.shape[0] // 2 :] = 0.0
    up = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
    return {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(rgb)), "to_world": up}


def scene(alpha, light, size):
    theta = np.deg2rad(56.0)
    origin = [6 * np.sin(theta), 0.0, 6 * np.cos(theta)]
    film = {
        "type": "hdrfilm",
        "width": size,
        "height": size,
        "pixel_format": "luminance",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    sensor = {
        "type": "perspective",
        "fov": float(2 * np.rad2deg(np.arctan(0.1))),
        "to_world": mi.ScalarTransform4f().look_at(origin=origin, target=[0, 0, 0], up=[0, 0, 1]),
        "film": film,
    }
    bsdf = {
        "type": "pplastic",
        "distribution": "ggx",
        "alpha": alpha,
        "int_ior": 1.5,
        "ext_ior": 1.0,
        "diffuse_reflectance": {"type": "uniform", "value": 0.0},
    }
    plane = {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale([3, 3, 1]), "bsdf": bsdf}
    integrator = {"type": "stokes", "path": {"type": "path", "max_depth": 2}}
    return mi.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, "plane": plane, "light": light})


def picture(scene, spp, seed):
    """(H, W, 3): s0, s1, s2. The film holds luminance and then every Stokes component three times (R, G, B)."""
    return np.array(mi.render(scene, spp=spp, seed=seed))[..., [1, 4, 7]]


def radiance(light):
    """The map as the emitter answers, 1024 x 2048."""
    height, width = 1024, 2048
    theta = (np.arange(height) + 0.5) / height * np.pi
    phi = (np.arange(width) + 0.5) / width * 2 * np.pi
    x, y = (np.sin(theta)[:, None] * f(phi)[None, :] for f in (np.cos, np.sin))
    z = np.cos(theta)[:, None] * np.ones_like(phi)[None, :]
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(*(mi.Float(-v.ravel()) for v in (x, y, z)))
    value = np.array(mi.load_dict(light).eval(si))
    # A Mueller matrix of a Spectrum in this variant: its first entry is the radiance.
    return value.reshape(-1, height, width)[0] * (z > 0)


def main(path, out):
    out = pathlib.Path(out)
    out.mkdir(parents=True, exist_ok=True)
    light = emitter(path)
    radiance(light).astype("<f4").tofile(out / "map.f32")
    runs = []
    for alpha in ALPHAS:
        full, coarse = scene(alpha, light, SIZE), scene(alpha, light, COARSE)
        mean = sum(picture(coarse, REFERENCE_SPP, seed) / REFERENCE_RUNS for seed in range(REFERENCE_RUNS))
        mean.astype("<f4").tofile(out / f"alpha_{alpha}.f32")
        for spp in SPP:
            picture(full, spp, 0)
            seconds, pictures = [], []
            for seed in (1, 2, 3):
                start = time.process_time()
                pictures.append(picture(full, spp, seed))
                seconds.append(time.process_time() - start)
            difference = np.sqrt(np.mean((pictures[0] - pictures[1]) ** 2, axis=(0, 1)) / 2)
            noise = float(difference.max() / mean[..., 0].mean())
            runs.append({"alpha": alpha, "spp": spp, "cpu_s": float(np.median(seconds)), "noise": noise})
    print(json.dumps({"version": mi.__version__, "runs": runs}))


if __name__ == "__main__":
    main(*sys.argv[1:])
