#!/usr/bin/env python3
"""Segmentation beside what an afternoon with OpenCV gives: milliseconds a frame and peak memory, taking turns.

Usage: segmentation_beside.py PEERS DAVIS BINARY [repetitions]
PEERS holds segmentation.py; DAVIS holds frames/CLIP/*.jpg and rectangles.json; BINARY is the release build. Needs OpenCV 4
(cv2.ml). Each clip is taken as it is (854×480) and enlarged to 1920×1080. Ours is the whole command, decoding twice and
writing the masks included; theirs is the segmentation alone, on frames in memory. One JSON line a clip and size: medians.
"""
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import cv2

PEERS, DAVIS, BINARY = sys.argv[1:4]
REPETITIONS = int(sys.argv[4]) if len(sys.argv) > 4 else 3
FRAMES = 40
sys.path.insert(0, PEERS)
import segmentation as peer  # noqa: E402


def waited(command):
    """Seconds and peak MiB of a command."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    most = 0
    # Not ru_maxrss: a child inherits its parent's.
    while process.poll() is None:
        try:
            status = open(f"/proc/{process.pid}/status").read()
            most = max([most] + [int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")])
        except (OSError, ValueError):
            pass
        time.sleep(0.01)
    if process.returncode:
        sys.exit("failed: " + " ".join(command))
    return time.perf_counter() - start, most / 1024


def scaled(rectangle, x, y):
    return [int(rectangle[0] * x), int(rectangle[1] * y), int(rectangle[2] * x), int(rectangle[3] * y)]


def main():
    rectangles = json.load(open(os.path.join(DAVIS, "rectangles.json")))
    for clip, both in rectangles.items():
        for size in (None, (1920, 1080)):
            with tempfile.TemporaryDirectory() as folder:
                run(clip, both, size, folder)


def run(clip, both, size, folder):
    source = os.path.join(DAVIS, "frames", clip)
    names = sorted(os.listdir(source))[:FRAMES]
    frames = [cv2.imread(os.path.join(source, name)) for name in names]
    height, width = frames[0].shape[:2]
    x, y = (1, 1) if size is None else (size[0] / width, size[1] / height)
    if size:
        frames = [cv2.resize(frame, size, interpolation=cv2.INTER_CUBIC) for frame in frames]
    stills = os.path.join(folder, "stills")
    os.mkdir(stills)
    for name, frame in zip(names, frames):
        cv2.imwrite(os.path.join(stills, name), frame, [cv2.IMWRITE_JPEG_QUALITY, 95])
    rectangle = {k: scaled(both[k], x, y) for k in ("foreground", "background")}
    ours, theirs, memory = [], [], 0
    shot = os.path.join(folder, "shot")
    command = [BINARY, "-q", "new", shot, "--from", stills, "--fps", "24"]
    for which, sides in rectangle.items():
        command += ["--" + which, ",".join(map(str, sides))]
    waited(command)
    for _ in range(REPETITIONS):
        seconds, mib = waited([BINARY, "-q", "segment", shot, "--force"])
        ours.append(1000 * seconds / len(frames))
        memory = max(memory, mib)
        start = time.perf_counter()
        for _ in peer.segment(frames, rectangle["foreground"], rectangle["background"]):
            pass
        theirs.append(1000 * (time.perf_counter() - start) / len(frames))
    mine, other = statistics.median(ours), statistics.median(theirs)
    print(json.dumps({
        "clip": clip, "size": [frames[0].shape[1], frames[0].shape[0]], "frames": len(frames),
        "ours_ms_per_frame": round(mine, 1), "peer_ms_per_frame": round(other, 1), "ratio": round(other / mine, 1),
        "ours_mib": round(memory), "peer_mib_so_far": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
    }), flush=True)


main()
