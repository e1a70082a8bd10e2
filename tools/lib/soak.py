"""Puts the samples of tools/soak together: soak.py SAMPLES TOP KERNELS prints one JSON object."""

import json
import sys


def objects(path):
    """All JSON objects of a file, one after the other."""
    text = open(path, encoding="utf-8").read()
    decoder = json.JSONDecoder()
    at = 0
    while at < len(text.rstrip()):
        value, end = decoder.raw_decode(text, at)
        yield value
        at = end + len(text[end:]) - len(text[end:].lstrip())


def main():
    samples = list(objects(sys.argv[1]))
    top = list(objects(sys.argv[2]))[-1]
    kernels = list(objects(sys.argv[3]))[-1]
    first, last = samples[0], samples[-1]
    frames = last["frames"]
    span_s = last["uptime_s"] - first["uptime_s"]
    # The first samples are left out: by then every page has been touched.
    memory = [sample["memory_bytes"] for sample in samples]
    settled = memory[min(2, len(memory) - 1)]
    json.dump(
        {
            "cpu": kernels["cpu"],
            "isa": kernels["isa"],
            "mode": last["mode"],
            "seconds": round(span_s, 1),
            "frames": {
                "n_in": frames["n_in"],
                "n_published": frames["n_published"],
                "n_under_way": frames["n_under_way"],
                "lost_by": frames["lost_by"],
                "shed_by": frames["shed_by"],
                "published_share": frames["n_published"]
                / max(1, frames["n_in"] - frames["n_under_way"]),
                "is_accounted": frames["n_in"]
                == frames["n_published"] + frames["n_lost"] + frames["n_under_way"],
            },
            "events_mev_s": sum(s["events"]["rate_mev_s"] for s in samples[1:])
            / max(1, len(samples) - 1),
            "lost_buffers": last["events"]["n_lost_buffers"],
            "latency": last["latency"],
            "cpu_cores": (last["cpu_s"] - first["cpu_s"]) / span_s if span_s else None,
            "threads": {t["name"]: round(t["cpu_share"], 3) for t in top["threads"]},
            "memory_mb": round(last["memory_bytes"] / 1e6, 1),
            "memory_growth_mb": round((memory[-1] - settled) / 1e6, 2),
            "warnings": last["warnings"],
        },
        sys.stdout,
        indent=2,
    )
    print()


main()
