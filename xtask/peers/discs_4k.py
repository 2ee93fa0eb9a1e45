"""A 4K film of eight dark discs that slide to rest on a grainy table, as a camcorder would code it.

    discs_4k.py FILM.mp4 FRAMES

H.264 High, two B-frames, 60 Mbit/s, 60 frames a second, by the `ffmpeg` on the path.
"""
import subprocess
import sys

import cv2
import numpy as np

WIDTH, HEIGHT, RADIUS, SHIFT = 3840, 2160, 40, 8


def main():
    film, frames = sys.argv[1], int(sys.argv[2])
    rng = np.random.default_rng(1)
    table = cv2.GaussianBlur(rng.normal(185, 12, (HEIGHT, WIDTH)).astype(np.float32), (0, 0), 2)
    noise = [rng.normal(0, 2, (HEIGHT, WIDTH)).astype(np.float32) for _ in range(4)]
    command = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{WIDTH}x{HEIGHT}", "-r", "60",
               "-i", "-", "-c:v", "libx264", "-profile:v", "high", "-preset", "medium", "-bf", "2", "-g", "30", "-b:v", "60M",
               "-pix_fmt", "yuv420p", film]
    coder = subprocess.Popen(command, stdin=subprocess.PIPE)
    for k in range(frames):
        picture = table.copy()
        for disc in range(8):
            time_s = max(0.0, k / 60 - 0.1 * disc)
            speed, slowing = 1500.0, 1200.0
            time_s = min(time_s, speed / slowing)
            x = 300 + 400 * (disc % 4) + speed * time_s - slowing / 2 * time_s**2
            y = 300 + 210 * disc
            centre = (round(x * 2**SHIFT), round(y * 2**SHIFT))
            cv2.circle(picture, centre, RADIUS << SHIFT, 25.0, -1, cv2.LINE_AA, SHIFT)
        picture = cv2.GaussianBlur(picture, (0, 0), 0.7) + noise[k % 4]
        coder.stdin.write(np.clip(picture + 0.5, 0, 255).astype(np.uint8).tobytes())
    coder.stdin.close()
    sys.exit(coder.wait())


if __name__ == "__main__":
    main()
