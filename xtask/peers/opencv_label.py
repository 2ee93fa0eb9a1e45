"""The peer: one frame labelled as one does it with OpenCV, CPU time of the whole process a call (ms).

    opencv_label.py FRAME WIDTH HEIGHT THRESHOLD REPEATS LEAST_AREA

FRAME holds WIDTH x HEIGHT grey levels and nothing else.  Printed: threshold and connectedComponentsWithStats as users
call it, the same with the fastest algorithm (BBDT, one thread), the threshold alone; and of what was found, from
LEAST_AREA pixels on, how many components, their area, the sums of their boxes' first columns and last rows.
"""
import sys
import time

import cv2
import numpy as np


def labelled(grey, level, algorithm=None):
    _, binary = cv2.threshold(grey, level - 1, 255, cv2.THRESH_BINARY_INV)
    if algorithm is None:
        return cv2.connectedComponentsWithStats(binary, connectivity=8)
    return cv2.connectedComponentsWithStatsWithAlgorithm(binary, 8, cv2.CV_32S, algorithm)


def cpu_ms(call, repeats):
    call()
    start = time.process_time()
    for _ in range(repeats):
        call()
    return 1e3 * (time.process_time() - start) / repeats


def main():
    path, width, height, level, repeats, least = sys.argv[1], *map(int, sys.argv[2:7])
    grey = np.fromfile(path, np.uint8).reshape(height, width)
    usual = cpu_ms(lambda: labelled(grey, level), repeats)
    cv2.setNumThreads(1)
    best = cpu_ms(lambda: labelled(grey, level, cv2.CCL_BBDT), repeats)
    threshold = cpu_ms(lambda: cv2.threshold(grey, level - 1, 255, cv2.THRESH_BINARY_INV), 50 * repeats)
    _, _, stats, _ = labelled(grey, level)
    kept = stats[1:][stats[1:, cv2.CC_STAT_AREA] >= least]
    x, y, _, h, area = kept.astype(np.int64).T
    print(usual, best, threshold, len(kept), area.sum(), x.sum(), (y + h - 1).sum())


if __name__ == "__main__":
    main()
