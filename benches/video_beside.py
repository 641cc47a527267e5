#!/usr/bin/env python3
"""`segment` on a video beside `ffmpeg -i clip -f null -`, both in turns: medians, ratios, peak memory.

Usage: video_beside.py BINARY CLIP FOREGROUND BACKGROUND [repetitions [method ...]]
Rectangles as x,y,w,h; methods "colour" and "plate" (the default). Prints one JSON line a method.
"""
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time


def timed(command):
    """Wall seconds, processor seconds of all its processes, and its own peak memory in MiB."""
    before = os.times()
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    if status != 0:
        sys.exit(f"{command} failed")
    after = os.times()
    processor = after.children_user + after.children_system - before.children_user - before.children_system
    return wall, processor, usage.ru_maxrss / 1024


def shot(binary, folder, clip, rectangles, method):
    """A shot of the clip that is segmented by `method`."""
    path = os.path.join(folder, method)
    foreground, background = rectangles
    subprocess.run([binary, "-q", "new", path, "--from", clip, "--foreground", foreground,
                    "--background", background], check=True, stdout=subprocess.DEVNULL)
    settings = os.path.join(path, "shot.toml")
    with open(settings, encoding="utf-8") as file:
        text = file.read()
    with open(settings, "w", encoding="utf-8") as file:
        file.write(re.sub(r'^method = "(plate|colour)"', f'method = "{method}"', text, flags=re.M))
    return path


def main():
    binary, clip, *rectangles = sys.argv[1:5]
    repetitions = int(sys.argv[5]) if len(sys.argv) > 5 else 5
    methods = sys.argv[6:] or ["colour", "plate"]
    binary, clip = os.path.abspath(binary), os.path.abspath(clip)
    with tempfile.TemporaryDirectory() as folder:
        for method in methods:
            path = shot(binary, folder, clip, rectangles, method)
            theirs, ours = [], []
            for _ in range(repetitions):
                theirs.append(timed(["ffmpeg", "-nostdin", "-v", "error", "-i", clip, "-f", "null", "-"]))
                ours.append(timed([binary, "-q", "segment", path, "--force"]))
            middle = lambda side, what: statistics.median(turn[what] for turn in side)
            print(json.dumps({
                "method": method,
                "ffmpeg_wall_s": round(middle(theirs, 0), 2),
                "ffmpeg_processor_s": round(middle(theirs, 1), 2),
                "segment_wall_s": round(middle(ours, 0), 2),
                "segment_processor_s": round(middle(ours, 1), 2),
                "ratio": round(middle(ours, 0) / middle(theirs, 0), 2),
                "peak_mib": round(middle(ours, 2)),
            }), flush=True)


if __name__ == "__main__":
    main()
