"""The joint fit of paper eq. 6 as one would write it with numpy and scipy: `fit_peer.py PROBLEM.json`.

PROBLEM.json is what `cargo bench -p host-fit --bench joint -- --dump PROBLEM.json` writes: pixels of two views, the start of
all programs, and brewster's answers and times. The model is that of `host_fit::direct` to rounding: same sky, same points.
It is vectorized over parameter sets, views and points; bands share everything but their radiance; diffuse light is integrated
once for both views. scipy.optimize.least_squares runs MINPACK ("lm") over (rho_d of 3 bands, ln(eta - 1), ln alpha, slopes),
once with its own 2-point differences and once with a Jacobian of ours: forward differences of the four nonlinear parameters in
one vectorized evaluation, the albedos' columns exact. One thread. It stops where brewster's fit does: a step of 1e-4 sigma is
a gain of 1e-8 in chi-squared, 1e-9 of it.

Prints JSON: versions, microseconds per pixel (median of 3 runs), evaluations, and the largest differences to brewster's answers
in sigma, over the pixels in which both found the same minimum.
"""

import json
import os
import sys
import time

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import numpy as np  # noqa: E402
import scipy  # noqa: E402
from scipy.optimize import least_squares  # noqa: E402

STEP = 1e-6


def dot(a, b):
    return np.einsum("...k,...k->...", a, b)


def unit(a):
    return a / np.sqrt(dot(a, a))[..., None]


def fejer(order):
    """Fejer's first rule on [0, 1]."""
    angle = np.pi * (np.arange(order) + 0.5) / order
    j = np.arange(1, order // 2 + 1)
    total = (np.cos(2.0 * j * angle[:, None]) / (4.0 * j * j - 1.0)).sum(axis=1)
    return 0.5 * (1.0 + np.cos(angle)), (1.0 - 2.0 * total) / order


class Model:
    """Values of a batch of parameter sets: arrays are (set, view, ray, point along it)."""

    def __init__(self, problem):
        sky = problem["sky"]
        self.sun = np.array(sky["sun"])
        self.horizon, self.width, self.max_dolp = sky["horizon"], sky["width"], sky["max_dolp"]
        self.base = np.array([b["base"] for b in sky["bands"]])
        self.aureole = np.array([b["aureole"] for b in sky["bands"]])
        self.x, self.w = fejer(problem["order"])
        self.cos, self.sin = np.cos(np.pi * self.x), np.sin(np.pi * self.x)
        self.azimuth_weight = np.concatenate([np.pi * self.w] * 2)
        self.x_axes = np.array(problem["x_axes"])

    def rays(self, center, normal):
        """Unit vectors across the centers, and the visible ends of theta along each."""
        corner = np.stack([normal[..., 1], -normal[..., 0], np.zeros_like(normal[..., 0])], axis=-1)
        level = dot(corner, corner) < 1e-300
        if level.any():
            corner[level] = [1.0, 0.0, 0.0]
        corner = unit(corner)
        x = unit(corner - center * dot(corner, center)[..., None])
        y = np.cross(center, x)
        e = x[..., None, :] * self.cos[:, None] + y[..., None, :] * self.sin[:, None]
        e = np.concatenate([e, -e], axis=-2)
        low, high = np.zeros(e.shape[:-1]), np.full(e.shape[:-1], np.pi)
        for up, along in ((center[..., 2], e[..., 2]), (dot(center, normal), np.einsum("...rk,...k->...r", e, normal))):
            phase = np.arctan2(up[..., None], along)
            low, high = np.maximum(low, -phase), np.minimum(high, np.pi - phase)
        return e, low, np.maximum(low, high)

    def radiance(self, w):
        """Of every band: (..., 3)."""
        low = 1.0 - np.maximum(w[..., 2], 0.0)
        chord = 2.0 - 2.0 * (w @ self.sun)
        shape = np.exp(-0.5 * chord / self.width**2)
        return (self.horizon * low * low)[..., None] + self.base + shape[..., None] * self.aureole

    def specular(self, eta, alpha, normal, wo, frame_x, frame_y):
        """(set, view, band, Stokes); eta, alpha: (set,), normal: (set, 3), the rest (view, 3)."""
        cosine = normal @ wo.T
        n = np.broadcast_to(normal[:, None, :], cosine.shape + (3,))
        mirrored = n * (2.0 * cosine)[..., None] - wo
        across = np.cross(n, wo) / cosine[..., None]
        e, low, high = self.rays(mirrored, n)
        a = alpha[:, None, None]
        narrow = a / np.hypot(1.0, np.einsum("svrk,svk->svr", e, across))

        def share(theta):
            x = np.tan(0.5 * theta)
            slant = np.hypot(narrow, x)
            return (x / slant) * (x / (slant + narrow))

        low, high = share(low), share(high)
        t = low[..., None] + (high - low)[..., None] * self.x
        rest = 1.0 - t
        narrow = narrow[..., None]
        x = narrow * np.sqrt(t * (2.0 - t)) / rest
        stretch = 1.0 + x * x
        area = self.azimuth_weight[:, None] * self.w * (high - low)[..., None] * (2.0 * narrow / (rest * stretch)) ** 2 / rest
        wi = mirrored[:, :, None, None, :] * ((1.0 - x) * (1.0 + x) / stretch)[..., None]
        wi += e[..., None, :] * (2.0 * x / stretch)[..., None]

        o = wo[:, None, None, :]
        total = wi + o
        length = np.sqrt(dot(total, total))
        c, s2 = 0.5 * length, 1.0 - 0.25 * length * length
        ci = np.einsum("svrpk,sk->svrp", wi, normal)
        co = cosine[:, :, None, None]
        ch = (ci + co) / length
        a = a[..., None]
        a2 = a * a
        d = a2 / (np.pi * (1.0 - ch * ch * (1.0 - a2)) ** 2)
        ri, ro = np.sqrt(a2 + ci * ci * (1.0 - a2)), np.sqrt(a2 + co * co * (1.0 - a2))
        weight = np.where(ci > 0.0, area * d * ci * 0.5 / (co * ri + ci * ro), 0.0)

        contrast = ((eta - 1.0) * (eta + 1.0))[:, None, None, None]
        q = np.sqrt(contrast + c * c)
        rs = (contrast / (c + q) ** 2) ** 2 * weight
        ratio = (c * q - s2) / (c * q + s2)
        mean, half, cross = 0.5 * rs * (1.0 + ratio * ratio), 0.5 * rs * (1.0 - ratio * ratio), -rs * ratio

        s = np.cross(wi, o)
        norm = dot(s, s)
        v = np.cross(wi, self.sun)
        pa, pb = dot(v, s), dot(v, np.cross(s, wi))
        scale = self.max_dolp / ((1.0 + (wi @ self.sun) ** 2) * norm)
        sky_q, sky_u = scale * (pa - pb) * (pa + pb), scale * 2.0 * pa * pb
        fa = np.einsum("svrpk,vk->svrp", s, frame_x)
        fb = np.einsum("svrpk,vk->svrp", s, frame_y)
        turn_cos, turn_sin = (fa - fb) * (fa + fb) / norm, 2.0 * fa * fb / norm
        out_q, out_u = half + mean * sky_q, cross * sky_u
        stokes = np.stack(
            [mean + half * sky_q, turn_cos * out_q - turn_sin * out_u, turn_sin * out_q + turn_cos * out_u], axis=-1
        )
        shape = cosine.shape + (-1, 3)
        return np.swapaxes(self.radiance(wi).reshape(shape), -1, -2) @ stokes.reshape(shape)

    def irradiance(self, normal):
        """E/pi of every band: (set, band)."""
        e, low, high = self.rays(normal, normal)
        theta = low[..., None] + (high - low)[..., None] * self.x
        sine, cosine = np.sin(theta), np.cos(theta)
        weight = self.azimuth_weight[:, None] * self.w * (high - low)[..., None] * sine * cosine
        w = normal[:, None, None, :] * cosine[..., None] + e[..., None, :] * sine[..., None]
        return np.einsum("srp,srpb->sb", weight, self.radiance(w)) / np.pi


class Pixel:
    """Residuals in sigma of two views, and their derivatives."""

    def __init__(self, model, views):
        self.model = model
        self.wo = np.array([v["direction"] for v in views])
        axes = model.x_axes
        self.frame_x = unit(axes - self.wo * dot(axes, self.wo)[:, None])
        self.frame_y = np.cross(self.wo, self.frame_x)
        self.data = np.array([v["stokes"] for v in views])
        self.sigma = np.array([v["sigma"] for v in views])[..., None]
        self.evaluations = 0

    def parts(self, theta):
        """Whitened specular part and diffuse part of albedo 1, for sets of (ln(eta - 1), ln alpha, slopes)."""
        self.evaluations += len(theta)
        normal = unit(np.column_stack([theta[:, 2:], np.ones(len(theta))]))
        eta, alpha = 1.0 + np.exp(theta[:, 0]), np.exp(theta[:, 1])
        specular = self.model.specular(eta, alpha, normal, self.wo, self.frame_x, self.frame_y)
        return specular / self.sigma, self.model.irradiance(normal)

    def residuals(self, p):
        specular, diffuse = self.parts(p[None, 3:])
        out = specular[0] - self.data / self.sigma
        out[..., 0] += p[:3] * diffuse[0] / self.sigma[..., 0]
        return out.ravel()

    def jacobian(self, p):
        theta = np.vstack([p[3:], p[3:] + STEP * np.eye(4)])
        specular, diffuse = self.parts(theta)
        value = specular
        value[..., 0] += p[:3] * diffuse[:, None, :] / self.sigma[..., 0]
        out = np.zeros(value.shape[1:] + (7,))
        out[..., 3:] = np.moveaxis((value[1:] - value[0]) / STEP, 0, -1)
        for band in range(3):
            out[:, band, 0, band] = diffuse[0, band] / self.sigma[:, band, 0]
        return out.reshape(-1, 7)


def parameters(p):
    n = unit(np.array([p[5], p[6], 1.0]))
    return np.array([*p[:3], 1.0 + np.exp(p[3]), np.exp(p[4]), n[0], n[1]])


def solve(model, views, start, own_jacobian):
    pixel = Pixel(model, views)
    jac = pixel.jacobian if own_jacobian else "2-point"
    found = least_squares(pixel.residuals, start, jac=jac, method="lm", ftol=1e-9, xtol=1e-12, gtol=1e-12)
    return parameters(found.x), 2.0 * found.cost, pixel.evaluations


def same_model(model, problem):
    """Largest difference of one response to brewster's, relative."""
    given = problem["response"]
    eta, alpha, x, y = given["facets"]
    normal = unit(np.array([[x, y, 1.0]]))
    wo = np.array([given["direction"]])
    frame_x = unit(model.x_axes[1:] - wo * dot(model.x_axes[1:], wo)[:, None])
    found = model.specular(np.array([eta]), np.array([alpha]), normal, wo, frame_x, np.cross(wo, frame_x)).ravel()
    diffuse = model.irradiance(normal)[0]
    expected, body = np.array(given["specular"]), np.array(given["diffuse"])[::3]
    return max(np.abs(found - expected).max() / expected.max(), np.abs(diffuse - body).max() / body.max())


def timed(model, problem, own_jacobian, count):
    a, b, c, eta, alpha, x, y = problem["start"]
    start = np.array([a, b, c, np.log(eta - 1.0), np.log(alpha), x, y])
    seconds, answers = [], []
    for _ in range(3):
        begin = time.perf_counter()
        answers = [solve(model, p["views"], start, own_jacobian) for p in problem["pixels"][:count]]
        seconds.append((time.perf_counter() - begin) / count)
    evaluations = sum(a[2] for a in answers) / count
    return {"us_per_pixel": 1e6 * sorted(seconds)[1], "evaluations": evaluations, "pixels": count}, answers


def agreement(answers, ours):
    """(pixels of the same minimum, median and largest difference in sigma)."""
    worst = []
    for (found, chi2, _), other in zip(answers, ours["answers"]):
        difference = np.abs(found - np.array(other["parameters"])) / np.array(other["sigma"])
        # Another minimum is many sigma away; a worse model of the same one is not.
        if abs(chi2 - other["chi2"]) < 1.0 and difference.max() < 3.0:
            worst.append(difference.max())
    return {"same_minimum": len(worst), "median_sigma": float(np.median(worst)), "worst_sigma": float(np.max(worst))}


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        problem = json.load(file)
    model = Model(problem)
    count = len(problem["pixels"])
    vectorized, answers = timed(model, problem, True, count)
    two_point, _ = timed(model, problem, False, max(1, count // 5))
    json.dump(
        {
            "numpy": np.__version__,
            "scipy": scipy.__version__,
            "points": 2 * problem["order"] ** 2,
            "model_difference": same_model(model, problem),
            "vectorized": vectorized,
            "two_point": two_point,
            "direct": agreement(answers, problem["direct"]),
            "tables": agreement(answers, problem["tables"]),
        },
        sys.stdout,
        indent=1,
    )


main()
