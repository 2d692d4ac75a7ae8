"""Measures Embree (package `embreex`) on geometry and rays that `ray_bench --dump DIR` wrote, on one thread.

    python embree_rays.py DIR [REPEATS]

Prints one JSON object with the keys of `ray_bench`: million rays per second (medians of running time) and hits. The few
microseconds that Python adds per million rays do not show.
"""

import json
import sys
import time

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh


def load(folder, name, *shape):
    return np.fromfile(f"{folder}/{name}.f32", "<f4").reshape(-1, *shape)


def main():
    folder = sys.argv[1]
    repeats = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    triangles = load(folder, "triangles", 3, 3)
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, triangles)
    out = {"tree": "Embree", "triangles": len(triangles)}
    for name in ("primary", "diffuse"):
        rays = load(folder, name, 2, 3)
        origins, directions = np.ascontiguousarray(rays[:, 0]), np.ascontiguousarray(rays[:, 1])
        hits = {}
        for key, query in (("closest", "INTERSECT"), ("any", "OCCLUDED")):
            # The first run builds the tree and warms the caches.
            result = scene.run(origins, directions, query=query)
            times = []
            for _ in range(repeats):
                start = time.process_time()
                result = scene.run(origins, directions, query=query)
                times.append(time.process_time() - start)
            out[f"{name}_{key}"] = round(len(rays) * 1e-6 / sorted(times)[repeats // 2], 3)
            # Closest hit answers with the triangle or -1, occlusion with -1 or 0.
            hits[key] = int((result >= 0).sum()) if key == "closest" else int((result == 0).sum())
        out[f"{name}_hits"] = [hits["closest"], hits["any"], len(rays)]
    print(json.dumps(out))


if __name__ == "__main__":
    main()
