"""The peer: what one writes with OpenCV to get marker tracks out of a strike video.

    opencv_tracks.py CLIP.mp4 [CLIP.mp4 ...]

Threshold, connectedComponentsWithStats, centroids weighted by darkness; one line a clip: frames and markers found.  At the
end the CPU time of all of it (s), the start of Python left out.
"""
import sys
import time

import cv2
import numpy as np

THRESHOLD, LEAST_AREA, LARGEST_AREA = 60, 150, 6000


def markers(grey):
    """Sub-pixel centroids of all dark blobs of marker size."""
    _, binary = cv2.threshold(grey, THRESHOLD, 255, cv2.THRESH_BINARY_INV)
    count, _, stats, _ = cv2.connectedComponentsWithStats(binary, connectivity=8)
    found = []
    for x, y, width, height, area in stats[1:count]:
        if not LEAST_AREA <= area <= LARGEST_AREA or area < 0.6 * width * height:
            continue
        pad = 4
        x0, y0 = max(x - pad, 0), max(y - pad, 0)
        box = grey[y0:y + height + pad, x0:x + width + pad].astype(np.float64)
        weight = np.clip(np.median(box[[0, -1]]) - box, 0, None)
        v, u = np.indices(box.shape)
        total = weight.sum()
        found.append((x0 + (u * weight).sum() / total, y0 + (v * weight).sum() / total))
    return found


def main():
    start = time.process_time()
    for path in sys.argv[1:]:
        video, frames, seen = cv2.VideoCapture(path), 0, 0
        while True:
            ok, picture = video.read()
            if not ok:
                break
            frames += 1
            seen += len(markers(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)))
        print(path.rsplit("/", 1)[-1], frames, seen)
    print(f"cpu_s={time.process_time() - start:.3f}")


if __name__ == "__main__":
    main()
