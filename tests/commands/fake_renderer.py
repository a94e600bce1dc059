# A renderer for tests of `exec:`: grey noise about a ramp, as PFM, and faults on request. Words: MODE COUNTER-FILE, then, where it
# is started for each image, WIDTH HEIGHT SAMPLES SEED OUT. Without them it stays up and speaks lines of JSON.
import json
import os
import random
import struct
import subprocess
import sys
import time

mode, counter = sys.argv[1:3]


def count(what):
    with open(counter, "a") as file:
        file.write(what + "\n")
    with open(counter) as file:
        return sum(line.strip() == what for line in file)


def noise(seed, first, samples, pixels):
    """Means over samples of numbers in [0, 2): each is a function of (seed, sample, pixel)."""
    means = [0.0] * pixels
    for sample in range(first, first + samples):
        numbers = random.Random(seed * 1000003 + sample)
        means = [mean + 2.0 * numbers.random() for mean in means]
    return [mean / samples for mean in means]


def render(width, height, samples, seed, out, first=0):
    if mode == "wrong-size":
        width //= 2
    values = noise(0 if mode == "no-seed" else seed, first, samples, width * height)
    values = [(0.5 + i % width / width) * value for i, value in enumerate(values)]
    if mode == "drifts":  # a sky of 1, by sums in single precision: hardly any noise, and off by 4e-6
        values = [1.0 + 4e-6 + 5e-7 * (value - 1.0) for value in noise(seed, first, samples, width * height)]
    if mode == "bright":
        values = [1.1 * value for value in values]
    if mode.startswith("spectral"):  # noise of greater width than its mean
        values = [4.0 * value - 3.0 * (0.5 + i % width / width) for i, value in enumerate(values)]
    if mode == "nan":
        values[5] = float("nan")
    if mode == "sRGB":
        values = [1.055 * value ** (1 / 2.4) - 0.055 if value > 0.0031308 else 12.92 * value for value in values]
    if mode == "no-image":
        return
    with open(out, "wb") as file:
        if mode == "garbage":
            file.write(b"this is no image")
            return
        file.write(b"PF\n%d %d\n-1.0\n" % (width, height))
        for y in reversed(range(height)):
            for value in values[y * width:(y + 1) * width]:
                file.write(struct.pack("<3f", value, value, value))


def trouble():
    calls = count("image")
    if mode == "crash" and calls > 2 or mode == "crash-at-once":
        print("loading", file=sys.stderr)
        print("the sky has fallen", file=sys.stderr, flush=True)
        os.abort()
    if mode == "hang" and calls > 0:
        child = subprocess.Popen(["sleep", "600"])
        count(f"pid {os.getpid()}")
        count(f"pid {child.pid}")
        time.sleep(600)
    if mode == "slow":
        time.sleep(0.2)


def stay_up():
    count("start")
    time.sleep(0.1)
    print("loading the library")
    print("hello" if mode == "bad-hello" else json.dumps(
        {"tandem": 1, "name": "fake", "version": "7", "ending": "pfm", "follows_model": mode == "follows",
         "negative_colours": mode == "spectral"}), flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        if mode == "refuses":
            print(json.dumps({"error": "no glass here"}), flush=True)
            continue
        trouble()
        print("a line of chatter")
        print(json.dumps({"progress": 0.5}))
        render(request["width"], request["height"], request["samples"], request["seed"], request["out"], request["first_sample"])
        print(json.dumps({"done": True}), flush=True)


if len(sys.argv) == 3:
    stay_up()
else:
    trouble()
    render(*map(int, sys.argv[3:7]), sys.argv[7])
