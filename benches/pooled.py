#!/usr/bin/env python3
"""Time to equal relative squared error from files of `etendue bench`, by the mean error of all seeds.

`etendue chart` compares seed by seed and quotes the median. Where few samples decide, most seeds lack them, and their
errors say little; the mean over seeds is what relMSE estimates. For each scene and contender: its seconds over those of
BASE to the larger of both errors at the most samples, curves straight in logarithms as in the chart, with the 5th and
95th percentile over 1000 choices of seeds with repetition.

    benches/pooled.py bench.jsonl [more.jsonl] [--base "etendue full"]
"""

import argparse
import collections
import json
import math
import random
import statistics


def curve(runs, seeds):
    """(median seconds, mean relMSE) at each number of samples."""
    points = []
    for spp in sorted({r["spp"] for r in runs}):
        own = {r["seed"]: r for r in runs if r["spp"] == spp}
        some = [own[s] for s in seeds if s in own]
        points.append((statistics.median(r["seconds"] for r in some), statistics.fmean(r["relmse"] for r in some)))
    return points


def seconds(points, target):
    """To an error; where even the first point is better, error × time is constant."""
    if points[0][1] <= target:
        return points[0][0] * points[0][1] / target
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if e1 <= target:
            return math.exp(math.log(t0) + math.log(t1 / t0) * math.log(target / e0) / math.log(e1 / e0))
    return math.nan


def ratio(base, other):
    target = max(base[-1][1], other[-1][1])
    return seconds(other, target) / seconds(base, target)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+")
    parser.add_argument("--base", default="etendue full")
    args = parser.parse_args()
    scenes = collections.defaultdict(lambda: collections.defaultdict(list))
    for name in args.files:
        with open(name, encoding="utf-8") as file:
            for line in map(json.loads, file):
                if line.get("kind") == "run":
                    scenes[line["scene"]][line["contender"]].append(line)
    draw = random.Random(1)
    for scene, contenders in scenes.items():
        base = contenders.pop(args.base)
        seeds = sorted({r["seed"] for r in base})
        for name, runs in sorted(contenders.items()):
            value = ratio(curve(base, seeds), curve(runs, seeds))
            choices = [draw.choices(seeds, k=len(seeds)) for _ in range(1000)]
            drawn = sorted(ratio(curve(base, c), curve(runs, c)) for c in choices)
            print(f"{scene:12} {name:44} {value:6.2f} ({drawn[50]:.2f} to {drawn[949]:.2f})")


if __name__ == "__main__":
    main()
