#!/usr/bin/env python3
"""Draws lenses, stores each with OpenCV's own writer, and projects rays with it.

    opencv_lenses.py COUNT OUT_DIR

writes for COUNT lenses of each model OUT_DIR/NAME.{yml,xml,json} and one table OUT_DIR/cases.json: rays, their pixels
(projectPoints, fisheye.projectPoints), and the rays that undistortPoints finds for these pixels (null where its
iteration does not return to the pixel within 1e-9 px).
"""
import json, os, sys
import cv2
import numpy as np

EXACT = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 1000, 1e-16)


def drawn(model, rng):
    f = 900 * rng.uniform(0.6, 1.5)
    k = np.array([[f, 0, 639.5 + rng.normal(0, 10)], [0, f * rng.uniform(0.99, 1.01), 359.5 + rng.normal(0, 10)], [0, 0, 1]])
    if model == "plumb_bob":
        d = [rng.uniform(-0.25, 0.2), rng.uniform(-0.03, 0.08), *rng.normal(0, 0.001, 2), rng.normal(0, 0.01)]
    elif model == "rational_polynomial":
        low = rng.uniform(-0.3, 0.3, 3) * [1, 0.3, 0.1]
        high = low + rng.uniform(-0.2, 0.2, 3) * [1, 0.3, 0.1]
        d = [high[0], high[1], *rng.normal(0, 0.001, 2), high[2], *low]
    else:
        d = list(rng.uniform(-0.1, 0.1, 4) * [1, 0.3, 0.1, 0.03])
    return k, np.array(d, float)


def project(model, rays, k, d):
    points, zero = np.column_stack([rays, np.ones(len(rays))])[:, None], np.zeros(3)
    call = cv2.fisheye.projectPoints if model == "equidistant" else cv2.projectPoints
    return call(points, zero, zero, k, d)[0].reshape(-1, 2)


def main():
    count, out = int(sys.argv[1]), sys.argv[2]
    os.makedirs(out, exist_ok=True)
    rng, cases = np.random.default_rng(7), []
    for model in ("plumb_bob", "rational_polynomial", "equidistant"):
        for n in range(count):
            k, d = drawn(model, rng)
            files = []
            for ending in ("yml", "xml", "json"):
                files.append(os.path.join(out, f"{model}_{n}.{ending}"))
                storage = cv2.FileStorage(files[-1], cv2.FILE_STORAGE_WRITE)
                storage.write("image_width", 1280); storage.write("image_height", 720)
                storage.write("camera_matrix", k); storage.write("distortion_coefficients", d.reshape(-1, 1))
                if model == "equidistant":
                    storage.write("fisheye_model", 1)
                storage.release()
            far = np.hypot(640 / k[0, 0], 360 / k[1, 1])  # the corner of an undistorted picture
            length, angle = far * np.sqrt(rng.uniform(0, 1, 100)), rng.uniform(0, 2 * np.pi, 100)
            rays = np.column_stack([length * np.cos(angle), length * np.sin(angle)])
            pixels = project(model, rays, k, d)
            if model == "equidistant":
                back = cv2.fisheye.undistortPoints(pixels[:, None], k, d, criteria=EXACT).reshape(-1, 2)
            else:
                back = cv2.undistortPoints(pixels[:, None], k, d, criteria=EXACT).reshape(-1, 2)
            again = np.abs(project(model, back, k, d) - pixels).max(1)
            inverse = [ray.tolist() if error < 1e-9 else None for ray, error in zip(back, again)]
            cases.append({"model": model, "files": files, "rays": rays.tolist(), "pixels": pixels.tolist(), "inverse": inverse})
    json.dump(cases, open(os.path.join(out, "cases.json"), "w"))


if __name__ == "__main__":
    main()
