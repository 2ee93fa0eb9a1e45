#!/usr/bin/env python3
"""Calibrates with OpenCV from given corners.

    opencv_boards.py CORNERS.json

reads {"image_size_px": [w, h], "views": [{"points_m": [[x, y], ...], "pixels": [[u, v], ...]}, ...]} and prints as JSON what
cv2.calibrateCamera finds with five coefficients: focal_px, center_px, distortion and the rms error of a coordinate.
"""
import json, sys
import cv2
import numpy as np


def main():
    given = json.load(open(sys.argv[1]))
    points = [np.column_stack([v["points_m"], np.zeros(len(v["points_m"]))]).astype(np.float32) for v in given["views"]]
    pixels = [np.array(v["pixels"], np.float32)[:, None] for v in given["views"]]
    rms, k, d, *_ = cv2.calibrateCamera(points, pixels, tuple(given["image_size_px"]), None, None)
    d = np.ravel(d)[:5].tolist()
    print(json.dumps({"focal_px": [k[0, 0], k[1, 1]], "center_px": [k[0, 2], k[1, 2]], "distortion": d, "rms_px": rms / 2 ** 0.5}))


if __name__ == "__main__":
    main()
