"""Repacks a film as bags of ROS 2, with the packages `rosbags` and `mcap`.

    ros_bags.py FILM.json FOLDER              one bag for each coding and compression
    ros_bags.py FILM.json FOLDER --converted  a bag with the film's lens, and bags that are refused, converted by the command that the refusal names

FILM.json holds `size_px`, `times_s`, the name of a file with the luma of all frames (`luma`), and `focal_px`, `center_px` and `distortion`
(plumb_bob). FOLDER gets
`CODING-COMPRESSION.mcap`, and `h264.mp4`, the film that the H.264 of the bags was copied from (needs ffmpeg with x264).
"""
import json
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

COMPRESSIONS = {"plain": CompressionType.NONE, "zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4}
START_NS, DELAY_NS = 1_700_000_000_000_000_000, 20_000_000
VIDEO = "foxglove_msgs/msg/CompressedVideo"
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
INFO = "sensor_msgs/msg/CameraInfo"
JPEG_QUALITY = 95
TOPIC, INFO_TOPIC = "/camera/image", "/camera/camera_info"

store = get_typestore(Stores.ROS2_JAZZY)
store.register(get_types_from_msg("builtin_interfaces/Time timestamp\nstring frame_id\nuint8[] data\nstring format\n", VIDEO))
Time, Header = (store.types[name] for name in ("builtin_interfaces/msg/Time", "std_msgs/msg/Header"))


def header(taken_ns):
    return Header(stamp=Time(sec=taken_ns // 10**9, nanosec=taken_ns % 10**9), frame_id="camera")


def raw(taken_ns, encoding, pixels):
    height, step = pixels.shape[0], pixels[0].size
    fields = dict(height=height, width=pixels.shape[1], encoding=encoding, is_bigendian=0, step=step)
    return IMAGE, store.types[IMAGE](header=header(taken_ns), **fields, data=pixels.reshape(-1))


def coded(taken_ns, coding, format, pixels, *options):
    data = cv2.imencode(coding, pixels, options)[1].reshape(-1)
    return COMPRESSED, store.types[COMPRESSED](header=header(taken_ns), format=format, data=data)


def bgr(grey):
    return np.repeat(grey[:, :, None], 3, axis=2)


CODINGS = {
    "mono8": lambda t, grey: raw(t, "mono8", grey),
    "bgr8": lambda t, grey: raw(t, "bgr8", bgr(grey)),
    # The mosaic of a grey scene holds its grey levels.
    "bayer_rggb8": lambda t, grey: raw(t, "bayer_rggb8", grey),
    "png": lambda t, grey: coded(t, ".png", "mono8; png compressed ", grey, cv2.IMWRITE_PNG_COMPRESSION, 1),
    "jpeg": lambda t, grey: coded(t, ".jpg", "bgr8; jpeg compressed bgr8", bgr(grey), cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY),
}


def h264(frames, times_s, folder):
    """The access units of the film, coded without B frames and copied out of an MP4."""
    height, width = frames[0].shape
    rate = round((len(times_s) - 1) / (times_s[-1] - times_s[0]))
    film = folder / "h264.mp4"
    chroma = b"\x80" * (2 * ((width + 1) // 2) * ((height + 1) // 2))
    encode = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "yuv420p", "-s", f"{width}x{height}", "-r", str(rate)]
    encode += ["-i", "-", "-c:v", "libx264", "-crf", "12", "-preset", "veryfast", "-bf", "0", "-pix_fmt", "yuv420p", str(film)]
    subprocess.run(encode, input=b"".join(frame.tobytes() + chroma for frame in frames), check=True)
    copy = ["ffmpeg", "-v", "error", "-i", str(film), "-c", "copy", "-bsf:v", "h264_mp4toannexb,h264_metadata=aud=insert"]
    stream = subprocess.run(copy + ["-f", "h264", "-"], capture_output=True, check=True).stdout
    units = [b"\0\0\0\1\x09" + unit for unit in stream.split(b"\0\0\0\1\x09")[1:]]
    assert len(units) == len(frames), f"{len(units)} access units of {len(frames)} frames"
    return units


def video(taken_ns, unit):
    data = np.frombuffer(unit, np.uint8)
    stamp = header(taken_ns).stamp
    return VIDEO, store.types[VIDEO](timestamp=stamp, frame_id="camera", data=data, format="h264")


def write(path, compression, messages):
    """A bag by the package `mcap`."""
    with open(path, "wb") as file:
        writer = Writer(file, compression=compression)
        writer.start(profile="ros2")
        channel = None
        for taken_ns, (kind, message) in messages:
            if channel is None:
                definition = store.generate_msgdef(kind, ros_version=2)[0]
                schema = writer.register_schema(kind, "ros2msg", definition.encode())
                channel = writer.register_channel(TOPIC, "cdr", schema)
            time_ns = taken_ns + DELAY_NS
            writer.add_message(channel, time_ns, bytes(store.serialize_cdr(message, kind)), time_ns)
        writer.finish()


def pack(frames, times_s, folder):
    taken = [START_NS + round(1e9 * time_s) for time_s in times_s]
    units = h264(frames, times_s, folder)
    for name, compression in COMPRESSIONS.items():
        for coding, message in CODINGS.items():
            write(folder / f"{coding}-{name}.mcap", compression, ((t, message(t, frame)) for t, frame in zip(taken, frames)))
        write(folder / f"h264-{name}.mcap", compression, ((t, video(t, unit)) for t, unit in zip(taken, units)))


def camera_info(film):
    """The messages of a bag with the film's lens, by the time of the image."""
    (width, height), (fx, fy), (cx, cy) = (film[key] for key in ("size_px", "focal_px", "center_px"))
    roi = store.types["sensor_msgs/msg/RegionOfInterest"](x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    matrices = dict(k=[fx, 0, cx, 0, fy, cy, 0, 0, 1], r=[1, 0, 0, 0, 1, 0, 0, 0, 1], p=[fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0])
    fields = {name: np.array(values, float) for name, values in (matrices | dict(d=film["distortion"])).items()}
    fields |= dict(height=height, width=width, distortion_model="plumb_bob", binning_x=0, binning_y=0, roi=roi)
    return lambda t: store.types[INFO](header=header(t), **fields)


def written(path, frames, taken, storage, compression=None, info=None):
    """A bag by the package `rosbags`; with the messages that `info` gives for the times of the images."""
    writer = rosbag2.Writer(path, version=9, storage_plugin=storage)
    if compression:
        writer.set_compression(compression, rosbag2.CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection(TOPIC, IMAGE, typestore=store)
        for t, frame in zip(taken, frames):
            kind, message = raw(t, "mono8", frame)
            writer.write(connection, t + DELAY_NS, store.serialize_cdr(message, kind))
        if info:
            connection = writer.add_connection(INFO_TOPIC, INFO, typestore=store)
            for t in taken:
                writer.write(connection, t + DELAY_NS, store.serialize_cdr(info(t), INFO))


def converted(frames, film, folder):
    times_s = film["times_s"]
    taken = [START_NS + round(1e9 * time_s) for time_s in times_s]
    modes, storages = rosbag2.CompressionMode, rosbag2.StoragePlugin
    refused = folder / "refused"
    refused.mkdir(exist_ok=True)
    written(folder / "folder", frames, taken, storages.MCAP)
    written(folder / "folder_zstd", frames, taken, storages.MCAP, modes.STORAGE)
    written(folder / "camera_info", frames, taken, storages.MCAP, modes.STORAGE, camera_info(film))
    written(refused / "sqlite", frames, taken, storages.SQLITE3)
    written(refused / "files", frames, taken, storages.MCAP, modes.FILE)
    written(refused / "messages", frames, taken, storages.MCAP, modes.MESSAGE)
    ros1 = get_typestore(Stores.ROS1_NOETIC)
    with rosbag1.Writer(refused / "ros1.bag") as writer:
        connection = writer.add_connection(TOPIC, IMAGE, typestore=ros1)
        for n, (t, frame) in enumerate(zip(taken, frames)):
            stamp = Time(sec=t // 10**9, nanosec=t % 10**9)
            head = ros1.types["std_msgs/msg/Header"](seq=n, stamp=stamp, frame_id="camera")
            size = dict(height=frame.shape[0], width=frame.shape[1], step=frame.shape[1])
            message = ros1.types[IMAGE](header=head, **size, encoding="mono8", is_bigendian=0, data=frame.reshape(-1))
            writer.write(connection, t + DELAY_NS, ros1.serialize_ros1(message, IMAGE))
    convert = Path(sys.executable).with_name("rosbags-convert")
    for source in ("sqlite", "files", "messages", "ros1.bag"):
        target = folder / f"converted_{source.split('.')[0]}"
        command = [str(convert), "--src", str(refused / source), "--dst", str(target), "--dst-storage", "mcap"]
        subprocess.run(command, check=True)


def main():
    film, folder = json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2])
    width, height = film["size_px"]
    frames = np.fromfile(film["luma"], np.uint8).reshape(-1, height, width)
    if "--converted" in sys.argv:
        converted(frames, film, folder)
    else:
        pack(frames, film["times_s"], folder)


if __name__ == "__main__":
    main()
