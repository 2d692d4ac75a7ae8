"""Nanoseconds per direction of `sphericart` (pip install sphericart numpy), one thread.

Same directions and batch size as `crates/sh-math/benches/sh.rs`. Prints one JSON object:
{"f32": {"1": ns, ...}, "f64": {...}, "f32_gradient": {...}} by the highest band. The least of many repetitions counts.
"""

import json
import os
import time

os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np  # noqa: E402  (after the thread count)
import sphericart  # noqa: E402

DIRECTIONS = 1024
BANDS = [1, 2, 3, 4, 10]


def directions(dtype):
    i = np.arange(DIRECTIONS)
    z = 1.0 - (2 * i + 1) / DIRECTIONS
    r = np.sqrt(1.0 - z * z)
    phi = np.pi * (3.0 - np.sqrt(5.0)) * i
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1).astype(dtype)


def nanoseconds(call, xyz):
    # A batch of a thousand hides the call's own cost only in part: subtract that of a single direction.
    def least(batch):
        best = float("inf")
        for _ in range(2000):
            start = time.perf_counter_ns()
            call(batch)
            best = min(best, time.perf_counter_ns() - start)
        return best

    return (least(xyz) - least(xyz[:1].copy())) / (len(xyz) - 1)


def main():
    result = {"f32": {}, "f64": {}, "f32_gradient": {}}
    for l in BANDS:
        harmonics = sphericart.SphericalHarmonics(l)
        for name, dtype in (("f32", np.float32), ("f64", np.float64)):
            result[name][str(l)] = round(nanoseconds(harmonics.compute, directions(dtype)), 2)
        gradient = nanoseconds(harmonics.compute_with_gradients, directions(np.float32))
        result["f32_gradient"][str(l)] = round(gradient, 2)
    print(json.dumps(result))


if __name__ == "__main__":
    main()
