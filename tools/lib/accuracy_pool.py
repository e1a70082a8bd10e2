"""Reads what `sheftool study` wrote and pools it over any choice of recordings."""

import json
import math
import os
import re

SIGNED_FROM_PERCENT = -50


def _counts(text):
    return [int(word) for word in text.split()]


def _add(into, counts):
    if not into:
        into.extend(counts)
    else:
        for i, count in enumerate(counts):
            into[i] += count


def _median(counts, step):
    """Where half of them lie below; infinite if that is past the last but one bin."""
    n, below = sum(counts), 0
    for i, count in enumerate(counts[:-1]):
        if 2 * (below + count) >= n and count:
            return (i + (n / 2 - below) / count) * step
        below += count
    return math.inf


class Part:
    """Pixels of some frames: all, the confident ones, or those of one direction."""

    def __init__(self):
        self.pixels = self.found = self.bad_1 = self.bad_2 = 0
        self.sizes, self.signed_sizes, self.step = [], [], 0.05

    def add(self, part):
        for name in ("pixels", "found", "bad_1", "bad_2"):
            setattr(self, name, getattr(self, name) + part[name])
        _add(self.sizes, _counts(part["sizes"]))
        _add(self.signed_sizes, _counts(part["signed_sizes"]))
        self.step = part["bin_percent"]

    def figures(self):
        if not self.pixels:
            return dict.fromkeys(("bad_1", "bad_2", "depth", "bias", "coverage"), math.nan)
        return {
            "bad_1": 100 * self.bad_1 / self.pixels,
            "bad_2": 100 * self.bad_2 / self.pixels,
            "depth": _median(self.sizes, self.step),
            "bias": _median(self.signed_sizes, self.step) + SIGNED_FROM_PERCENT,
            "coverage": 100 * self.found / self.pixels,
        }


class Pool:
    """One mode over some studies."""

    def __init__(self):
        self.all, self.confident, self.away = Part(), Part(), Part()
        self.directions = {}
        self.recordings = self.frames = self.moving = self.right = 0

    def add(self, mode):
        self.all.add(mode["all"])
        self.confident.add(mode["confident_75"])
        self.away.add(mode["away_from_jumps"])
        for name, part in mode["directions"].items():
            self.directions.setdefault(name, Part()).add(part)
        self.recordings += 1
        self.frames += mode["frames"]
        self.moving += mode["frames_with_motion"]
        self.right += mode["direction_within_10_deg"]

    def figures(self):
        figures = {"recordings": self.recordings, "frames": self.frames} | self.all.figures()
        for name, part in (("confident", self.confident), ("away", self.away)):
            figures |= {f"{name}_{key}": value for key, value in part.figures().items()}
        figures["direction_found"] = 100 * self.right / self.moving if self.moving else math.nan
        for name, part in self.directions.items():
            figures[f"bias_{name}"] = part.figures()["bias"]
        return figures


class Results:
    """All studies of a plan, with the conditions of their recordings."""

    def __init__(self, plan, folder):
        self.studies = []
        self.event_rates = {}
        for name, recording in plan.items():
            with open(os.path.join(folder, name, "render.txt"), encoding="utf-8") as file:
                self.event_rates[name] = float(re.search(r"([0-9.]+) Mev/s", file.read())[1])
            for tag, study in recording["studies"].items():
                self.studies.append(recording | study | {
                    "tag": tag, "file": os.path.join(folder, name, tag + ".json")})
        self.read = {}
        self.machine = {}

    def select(self, group, **conditions):
        """Studies of a group; a condition may be a value or a collection of values."""
        def fits(study, key, wanted):
            value = study.get(key)
            return value in wanted if isinstance(wanted, (tuple, list, set)) else value == wanted

        return [study for study in self.studies if group in study["groups"]
                and all(fits(study, key, wanted) for key, wanted in conditions.items())]

    def modes_of(self, study):
        if study["file"] not in self.read:
            with open(study["file"], encoding="utf-8") as file:
                root = json.load(file)
            self.machine = root["machine"]
            self.read[study["file"]] = root["recordings"][0]["modes"]
        return self.read[study["file"]]

    def pool(self, studies, mode):
        """NaN everywhere if there are none."""
        pool = Pool()
        for study in studies:
            pool.add(self.modes_of(study)[mode])
        return pool.figures()

    def milliseconds(self, studies, mode):
        """The least time that a frame took: the work is the same for each, disturbances are not."""
        times = [self.modes_of(study)[mode]["time"]["min_ms"] for study in studies]
        return min(times, default=math.nan)

    def event_rate(self, studies):
        rates = [self.event_rates[study["name"]] for study in studies]
        return sum(rates) / len(rates) if rates else math.nan
