#!/usr/bin/env python3
"""Ratios of medians, both sides in the same run: what a user would otherwise run, and ours.

Usage: side_by_side.py PEERS [repetitions]   (PEERS: the folder with pca.py, bit_gram.py and setup.sh)
Needs $PEER_DATA as set up by PEERS/setup.sh (default: muybridge-peers in the temporary folder) and
`cargo bench --no-run` before. The two sides take turns, so that both meet the same load.
Prints one JSON line a comparison, times in seconds, wall; then peak memory.
"""
import glob
import json
import os
import statistics
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
DATA = os.environ.get("PEER_DATA") or os.path.join(tempfile.gettempdir(), "muybridge-peers")
PYTHON = os.path.join(DATA, "venv", "bin", "python")


def ours():
    """The bench `beside_peers` as cargo built it last, or $BESIDE_PEERS."""
    given = os.environ.get("BESIDE_PEERS")
    built = glob.glob(os.path.join(HERE, "..", "target", "release", "deps", "beside_peers-*"))
    built = [b for b in built if os.access(b, os.X_OK)]
    return given or max(built, key=os.path.getmtime)


def lines(command):
    """JSON lines that a command prints, and its peak memory in MiB."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                               env={**os.environ, "PEER_DATA": DATA})
    text = process.stdout.read()
    _, _, usage = os.wait4(process.pid, 0)
    return [json.loads(line) for line in text.splitlines() if line.startswith("{")], usage.ru_maxrss / 1024


def main():
    peers, repetitions = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 5
    masks = os.path.join(DATA, "masks.npy")
    times, memory = {}, {}

    def note(name, seconds, mib=None):
        times.setdefault(name, []).append(seconds)
        if mib:
            memory[name] = max(memory.get(name, 0), mib)

    for _ in range(repetitions):
        for job in ("gram", "gram-avx2", "gram-plain", "gram-cropped", "pca"):
            for line, mib in ((line, mib) for found, mib in [lines([ours(), masks, job])] for line in found):
                note("ours " + job, line["wall_s"], mib)
        for method in os.environ.get("METHODS", "numpy_gram_f32 numpy_gram_f32_bbox numkong_gram").split():
            for line in lines([PYTHON, os.path.join(peers, "pca.py"), method])[0]:
                if "wall_s" in line:
                    note("pca " + method, line["wall_s"], 1024 * line["peak_gib"])
                    if line["gram_s"]:
                        note("gram " + method, line["gram_s"])
        for line in lines([PYTHON, os.path.join(peers, "bit_gram.py")])[0]:
            if "all" in line:
                note("bits " + line["method"], statistics.median(line["all"]))
    middle = {name: statistics.median(t) for name, t in times.items()}
    for name, seconds in middle.items():
        if name.startswith("ours"):
            print(json.dumps({"ours": name, "median_s": seconds, "all": times[name], "mib": memory.get(name)}))
            continue
        sides = ["ours pca"] if name.startswith("pca") else ["ours gram", "ours gram-avx2", "ours gram-plain", "ours gram-cropped"]
        ratios = {side: round(seconds / middle[side], 1) for side in sides if side in middle}
        print(json.dumps({"peer": name, "median_s": seconds, "all": times[name], "mib": memory.get(name), "ratio": ratios}))


main()
