"""The camera's job in the programs people use today: 4 frames of 2448 x 2048 u16 to Stokes, then DoLP and AoLP.

Single thread, everything in memory, results in each program's own type. The programs take turns, round by round, so that
a slow moment of the machine hits all of them. "Stokes, flags" subtracts a dark level and flags saturated samples and samples
below black; none drops saturated samples, gives a residual or knows a misfit. Prints JSON: a list of {program, version, job, ms}, ms being one number per round.
"""

import json
import os
import time

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")

import cv2  # noqa: E402  (the number of threads is read on import)
import numpy as np  # noqa: E402
import polanalyser  # noqa: E402

cv2.setNumThreads(1)

HEIGHT, WIDTH, ROUNDS = 2048, 2448, 11
DARK, WHITE = 256.0, 4095.0
# The kernel's benchmark takes these too: nobody may assume 0/45/90/135.
ANGLES = np.deg2rad(0.7 + 45.0 * np.arange(4))


def frames():
    """(4, H, W) u16: s0 from 300 to 1500 DN across the picture, a degree of polarization of 0.3, 20 DN of noise."""
    random = np.random.default_rng(1)
    s0 = np.linspace(300, 1500, WIDTH)[None, :] * np.ones((HEIGHT, 1))
    ideal = [0.5 * s0 * (1 + 0.3 * np.cos(2 * (angle - 0.5))) for angle in ANGLES]
    return np.stack([np.rint(x + random.uniform(0, 20, x.shape)).astype(np.uint16) for x in ideal])


ROWS = 0.5 * np.stack([np.ones(4), np.cos(2 * ANGLES), np.sin(2 * ANGLES)], axis=1)
INVERSE = np.linalg.pinv(ROWS).astype(np.float32)


def numpy_stokes(images):
    return (INVERSE @ images.reshape(4, -1).astype(np.float32)).reshape(3, HEIGHT, WIDTH)


def numpy_flags(images):
    stokes = numpy_stokes(images) - (DARK * INVERSE.sum(axis=1))[:, None, None]
    flags = (images.max(axis=0) >= WHITE).view(np.uint8) | ((images.min(axis=0) < DARK).view(np.uint8) << 1)
    return stokes, flags


def numpy_polar(images):
    s0, s1, s2 = numpy_stokes(images)
    return np.hypot(s1, s2) / s0, np.mod(0.5 * np.arctan2(s2, s1), np.pi)


def opencv_stokes(images, dark=0.0):
    # Twice as fast as cv2.transform on merged frames, which a user might write first.
    def component(weights):
        a, b, c, d = (float(w) for w in weights)
        first = cv2.addWeighted(images[0], a, images[1], b, -dark * (a + b + c + d), dtype=cv2.CV_32F)
        second = cv2.addWeighted(images[2], c, images[3], d, 0, dtype=cv2.CV_32F)
        return cv2.add(first, second, dst=first)

    return [component(weights) for weights in INVERSE]


def opencv_flags(images):
    a, b, c, d = images
    high = cv2.max(cv2.max(a, b), cv2.max(c, d))
    low = cv2.min(cv2.min(a, b), cv2.min(c, d))
    saturated = cv2.bitwise_and(cv2.compare(high, WHITE, cv2.CMP_GE), 1)
    below = cv2.bitwise_and(cv2.compare(low, DARK, cv2.CMP_LT), 2)
    return opencv_stokes(images, DARK), cv2.bitwise_or(saturated, below)


def opencv_polar(images):
    s0, s1, s2 = opencv_stokes(images)
    magnitude, angle = cv2.cartToPolar(s1, s2)
    return cv2.divide(magnitude, s0), cv2.multiply(angle, 0.5)


def polanalyser_stokes(images):
    return polanalyser.calcStokes(images, ANGLES)


def polanalyser_polar(images):
    stokes = polanalyser_stokes(images)
    return polanalyser.cvtStokesToDoLP(stokes), polanalyser.cvtStokesToAoLP(stokes)


def main():
    from importlib.metadata import version

    programs = {
        "numpy": ("numpy", numpy_stokes, numpy_flags, numpy_polar),
        "OpenCV": ("opencv-python-headless", opencv_stokes, opencv_flags, opencv_polar),
        "polanalyser": ("polanalyser", polanalyser_stokes, None, polanalyser_polar),
    }
    images = frames()
    # The same job means the same answer.
    reference = numpy_polar(images)
    for name, (_, _, _, polar) in programs.items():
        for mine, theirs in zip(reference, polar(images)):
            assert np.allclose(mine, theirs, atol=2e-3), f"{name} computes something else"
    for mine, theirs in zip(numpy_flags(images), opencv_flags(images)):
        assert np.allclose(mine, theirs, atol=0.1), "OpenCV computes something else"
    results = {}
    for _ in range(ROUNDS):
        for name, (package, stokes, flags, polar) in programs.items():
            for job, work in (("Stokes", stokes), ("Stokes, flags", flags), ("Stokes, DoLP, AoLP", polar)):
                if work is None:
                    continue
                start = time.perf_counter()
                work(images)
                results.setdefault((name, version(package), job), []).append((time.perf_counter() - start) * 1e3)
    print(json.dumps([{"program": p, "version": v, "job": j, "ms": ms} for (p, v, j), ms in results.items()]))


if __name__ == "__main__":
    main()
