"""Times Mitsuba 3 on a scene and measures its error against its own long reference, indirect light alone.

Usage: mitsuba_render.py VARIANT SCENE.xml SAMPLER REFERENCE.npy SPP...

The indirect image is path(max_depth = -1) - path(max_depth = 2) of the same seed: both integrators draw the same numbers
for the first two vertices, so direct light cancels sample by sample. Only the first of the two renders is timed.
Without REFERENCE.npy it renders one with the largest SPP (and other seeds) and saves it there. The scalar variants draw
their numbers block by block, so nothing cancels: they are only timed, and their rel_rmse is null (as estimators they equal
the compiled ones). Prints one JSON object; cpu_seconds is the running time of all threads.
"""

import json
import os
import sys
import time

import numpy as np

variant, scene_file, sampler, reference_file, *spps = sys.argv[1:]

import mitsuba as mi  # noqa: E402  (after the arguments, so that a usage error is quick)

mi.set_variant(variant)

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def load(depth, spp):
    return mi.load_file(scene_file, depth=str(depth), spp=str(spp), sampler=sampler)


def image(scene, spp, seed):
    start, cpu = time.perf_counter(), time.process_time()
    picture = np.array(mi.render(scene, spp=spp, seed=seed))  # the copy waits for the kernel
    return picture[..., :3].astype(np.float64), time.perf_counter() - start, time.process_time() - cpu


def indirect(spp, seed):
    return image(load(-1, spp), spp, seed)[0] - image(load(2, spp), spp, seed)[0]


compiled = variant.startswith("llvm")
if compiled and not os.path.exists(reference_file):
    # In parts, so that no wavefront outgrows the memory.
    spp = max(int(s) for s in spps)
    parts = [indirect(min(spp, 128), 1000 + i) for i in range(max(1, spp // 128))]
    np.save(reference_file, np.mean(parts, axis=0))
    spps = []

rows = []
for spp in map(int, spps):
    scene = load(-1, spp)
    if compiled:
        image(scene, spp, 7)  # compiles the kernel: warm caches, as for everyone
    got, seconds, cpu = image(scene, spp, 7)
    error = None
    if compiled:
        reference = np.load(reference_file) @ LUMINANCE
        surface = reference > 0
        difference = (indirect(spp, 7) @ LUMINANCE - reference)[surface]
        error = float(np.sqrt(np.mean(difference**2)) / np.mean(reference[surface]))
    rows.append({"spp": spp, "seconds": seconds, "cpu_seconds": cpu, "rel_rmse": error})
print(json.dumps({"variant": variant, "version": mi.__version__, "sampler": sampler, "rows": rows}))
