#!/bin/sh
# Makes the small films of this folder and `luma.txt`, which holds what ffmpeg decodes from them.  Only needed to
# change them; ffmpeg with x264 and x265, and python3.
set -e
cd "$(dirname "$0")"
make() { ffmpeg -v error -nostdin -y "$@"; }
# Width, height, frames a second, seconds: a panned and grainy test picture.
scene() {
    printf 'testsrc2=size=320x240:rate=%s:duration=%s,crop=%s:%s:3*n:2*n,noise=alls=6:allf=t:all_seed=1' "$3" "$4" "$1" "$2"
}
film="-c:v libx264 -pix_fmt yuv420p -bsf:v filter_units=remove_types=6 -fflags +bitexact"

make -f lavfi -i "$(scene 64 48 60 0.2)" $film -bf 3 -x264-params b-pyramid=normal:ref=3 b_frames.mp4
make -f lavfi -i "$(scene 64 48 60 0.2)" $film -profile:v baseline -x264-params slices=2 baseline.mov
make -f lavfi -i "$(scene 64 48 60 0.2)" $film -x264-params cabac=0:weightp=2 -vf fade=out:2:8 faded.mp4
make -f lavfi -i "$(scene 64 48 60 0.2)" $film -bf 2 -g 5 -movflags frag_keyframe+empty_moov fragmented.mp4
make -f lavfi -i "$(scene 64 48 60 0.2)" $film -bf 2 -movflags negative_cts_offsets+faststart negative_delays.mp4
make -f lavfi -i "$(scene 62 46 60 0.1)" $film -bf 2 cropped.mp4
make -f lavfi -i "$(scene 64 48 60 0.3)" $film -bf 2 -vf "select='not(eq(mod(n\,5)\,3))'" -vsync vfr gaps.mp4
make -f lavfi -i "$(scene 64 48 30000/1001 0.2)" $film -bf 1 ntsc.mp4
make -f lavfi -i "$(scene 64 48 30 0.4)" $film -vf fps=60 retimed.mp4
for angle in 90 180 270; do
    make -i cropped.mp4 -c copy -metadata:s:v rotate=$angle -fflags +bitexact turned_$angle.mp4
done
make -ss 0.05 -i b_frames.mp4 -c copy -fflags +bitexact edit_list.mp4
make -i cropped.mp4 -c copy -bsf:v h264_metadata=crop_left=6:crop_top=4:crop_right=10:crop_bottom=8 cropped_left.mp4

# What the tests of bags repack: H.264 with start codes and delimiters.
make -i baseline.mov -c copy -bsf:v h264_mp4toannexb,h264_metadata=aud=insert -fflags +bitexact baseline.h264

# Refused by name.
make -f lavfi -i "$(scene 64 48 60 0.05)" -c:v libx265 -x265-params log-level=none -pix_fmt yuv420p h265.mp4
make -f lavfi -i "$(scene 64 48 60 0.05)" -c:v libx264 -pix_fmt yuv420p10le ten_bit.mp4
make -f lavfi -i "$(scene 64 48 60 0.05)" -c:v libx264 -pix_fmt yuv444p full_colour.mp4
make -f lavfi -i "$(scene 64 48 60 0.05)" -c:v libx264 -pix_fmt yuv420p -qp 0 lossless.mp4
make -f lavfi -i "$(scene 64 64 60 0.05)" -c:v libx264 -pix_fmt yuv420p -flags +ilme+ildct interlaced.mp4
make -f lavfi -i "$(scene 64 48 60 0.05)" -c:v mjpeg -pix_fmt yuvj420p motion_jpeg.mov
# The luma of its first picture, for the tests of bags
make -i motion_jpeg.mov -frames:v 1 -vf extractplanes=y -f rawvideo -pix_fmt gray motion_jpeg.gray
make -f lavfi -i sine=duration=0.1 -fflags +bitexact sound.mp4

python3 - <<'PYTHON' > luma.txt
import glob, subprocess
refused = "h265 ten_bit full_colour lossless interlaced motion_jpeg sound".split()
def run(*command): return subprocess.run(command, capture_output=True, check=True).stdout
print("# file, size, then for each frame: time (s), FNV-1a of its luma as ffmpeg decodes it")
for film in sorted(glob.glob("*.m[po][4v]")):
    if film.rsplit(".")[0] in refused: continue
    ffmpeg = ["ffmpeg", "-v", "error", "-nostdin", "-flags", "unaligned", "-i", film, "-vsync", "passthrough"]
    listing = run(*ffmpeg, "-f", "framehash", "-hash", "md5", "-").decode().splitlines()
    base = next(l for l in listing if l.startswith("#tb 0:")).split()[-1].split("/")
    width, height = map(int, next(l for l in listing if l.startswith("#dimensions 0:")).split()[-1].split("x"))
    ticks = [int(l.split(",")[2]) for l in listing if not l.startswith("#")]
    luma = run(*ffmpeg, "-vf", "extractplanes=y", "-f", "rawvideo", "-pix_fmt", "gray", "-")
    frames = [luma[k:k + width * height] for k in range(0, len(luma), width * height)]
    assert len(frames) == len(ticks), film
    print(f"{film} {width}x{height}")
    for tick, frame in zip(ticks, frames):
        code = 0xcbf29ce484222325
        for level in frame: code = (code ^ level) * 0x100000001b3 % 2**64
        print(f"{(tick - ticks[0]) * int(base[0]) / int(base[1]):.6f} {code:016x}")
PYTHON
