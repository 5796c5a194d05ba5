#!/usr/bin/env python3
"""Simulates a frame on a farm: what goes through the shared disk, and when it is done.

    examples/farm/simulate.py [MACHINES]

Each machine reads the scene, compiles, renders one shard with checkpoints, may fail and begin
again from its last checkpoint, and writes its shard; then shards are merged, all by one machine or
first in groups where they were rendered. Transfers share the bandwidth of the disk evenly, none
faster than a network card. The result is compared with the formulas of docs/scale.md.
"""
import heapq
import random
import sys

DISK = 500e6  # bytes a second
CARD = 1.25e9  # bytes a second of one machine
PIXELS = 1920 * 1080
SHARD = 24 * PIXELS  # one node
SCENE = 1e6  # bytes
COMPILE = 10.0  # seconds
RENDER = 3600.0  # seconds, median
SPREAD = 0.2  # of the logarithm
FAILURES = 1 / (100 * 3600)  # a second and machine
GROUP = 100


class Disk:
    """Transfers that share a bandwidth evenly: all advance alike, so their order is fixed by the
    amount that each has had when it is complete."""

    def __init__(self):
        self.now = self.amount = self.bytes = 0.0
        self.active, self.number = [], 0

    def rate(self):
        return min(CARD, DISK / len(self.active))

    def advance(self, time):
        if self.active:
            self.amount += (time - self.now) * self.rate()
        self.now = time

    def start(self, size, then):
        self.bytes += size
        self.number += 1
        heapq.heappush(self.active, (self.amount + size, self.number, then))

    def next(self):
        if not self.active:
            return float("inf")
        return self.now + max(0.0, self.active[0][0] - self.amount) / self.rate()


class Farm:
    def __init__(self, machines, interval, is_local, is_tree, seed=1):
        self.random = random.Random(seed)
        self.disk, self.later, self.number = Disk(), [], 0
        self.machines, self.interval, self.is_local, self.is_tree = machines, interval, is_local, is_tree
        self.lost, self.failures, self.rendered, self.merged = 0.0, 0, 0, 0
        self.in_group = {}
        for machine in range(machines):
            work = RENDER * self.random.lognormvariate(0, SPREAD)
            self.begin(machine, work)

    def after(self, seconds, then):
        self.number += 1
        heapq.heappush(self.later, (self.disk.now + seconds, self.number, then))

    def begin(self, machine, left):
        self.disk.start(SCENE, lambda: self.after(COMPILE, lambda: self.render(machine, left)))

    def render(self, machine, left):
        """Until the next checkpoint, the end or a failure."""
        step = min(left, self.interval)
        failure = self.random.expovariate(FAILURES)
        if failure < step:
            self.failures += 1
            self.lost += failure
            self.after(failure, lambda: self.begin(machine, left))
        elif step == left:
            self.after(step, lambda: self.disk.start(SHARD, lambda: self.finish(machine)))
        elif self.is_local:
            self.after(step, lambda: self.render(machine, left - step))
        else:
            # the render waits until its checkpoint is written
            go_on = lambda: self.render(machine, left - step)
            self.after(step, lambda: self.disk.start(SHARD, go_on))

    def finish(self, machine):
        self.rendered += 1
        if self.rendered == self.machines:
            self.last_shard = self.disk.now
        if self.is_tree:
            group = machine // GROUP
            self.in_group[group] = self.in_group.get(group, 0) + 1
            if self.in_group[group] == min(GROUP, self.machines - group * GROUP):
                # aligned groups are one node again
                size = self.in_group[group] * SHARD
                self.disk.start(size, lambda: self.disk.start(SHARD, self.finish_group))
        elif self.rendered == self.machines:
            self.disk.start(self.machines * SHARD, lambda: self.disk.start(SHARD, self.end))

    def finish_group(self):
        self.merged += 1
        if self.merged == -(-self.machines // GROUP):
            self.disk.start(self.merged * SHARD, lambda: self.disk.start(SHARD, self.end))

    def end(self):
        self.done = self.disk.now

    def run(self):
        self.done = None
        while self.done is None:
            timer = self.later[0][0] if self.later else float("inf")
            time = self.disk.next()
            if timer < time:
                self.disk.advance(timer)
                heapq.heappop(self.later)[2]()
            else:
                self.disk.advance(time)
                self.disk.amount, _, then = heapq.heappop(self.disk.active)
                then()
        return self


def near(what, value, paper, tolerance):
    verdict = "as on paper" if abs(value - paper) <= tolerance * paper else "NOT AS ON PAPER"
    print(f"  {what}: {value:.4g}, on paper {paper:.4g}: {verdict}")
    return verdict == "as on paper"


def main():
    machines = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    print(f"{machines} machines, shards of {SHARD / 1e6:.0f} MB, {RENDER:.0f} s each, disk {DISK / 1e6:.0f} MB/s")
    is_right = True
    ends = {}
    for name, interval, is_local, is_tree in [
        ("checkpoints on local disks, one merge", 60, True, False),
        ("checkpoints on local disks, groups of 100", 60, True, True),
        ("no checkpoints, groups of 100", 1e9, True, True),
    ]:
        farm = Farm(machines, interval, is_local, is_tree).run()
        ends[name] = farm
        merge = farm.done - farm.last_shard
        print(f"{name}: last shard {farm.last_shard / 3600:.2f} h, picture {merge:.0f} s later, "
              f"{farm.disk.bytes / 1e12:.2f} TB, {farm.failures} failures lost {farm.lost / 3600:.1f} h of work")
    one, tree, bare = ends.values()
    shards = machines * SHARD
    is_right &= near("bytes with one merge, shards written and read", one.disk.bytes, 2 * shards + machines * SCENE, 0.02)
    is_right &= near("seconds of one merge", one.done - one.last_shard, shards / DISK, 0.02)
    final = -(-machines // GROUP) * SHARD / DISK
    print(f"  seconds that the last merge of a tree takes at least: {final:.1f}")
    is_right &= near("hours lost with checkpoints", one.lost / 3600, one.failures * 30 / 3600, 0.2)
    # a shared disk takes so many machines before renders wait for it
    for count in [100, 500, 1000, 2000]:
        local, shared = (Farm(count, 60, is_local, True).run() for is_local in (True, False))
        print(f"  {count} machines with checkpoints on the shared disk: {shared.last_shard / local.last_shard:.2f} times as long "
              f"({count * SHARD / 60 / DISK:.2f} of its bandwidth wanted)")
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main())
