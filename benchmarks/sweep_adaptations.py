"""Recorded clips adapted to other bodies and places: how many are proved, and why the others are not.

``python benchmarks/sweep_adaptations.py FOLDER CLIPS.csv OUT.jsonl [FIRST STOP]`` takes the clips of a table
(columns ``class``, ``file``, ``first_frame0``, ``end_frame0``, ``fps``) below FOLDER, without those that run,
in parts. Every part is made as recorded, by a person a fifth heavier, by one 10 cm taller or shorter, and
where one foot stands 3 cm higher, or the seat is 5 cm lower; at the first of three paces that is proved, as
``manikin adapt`` does it. Each result is one line of OUT.jsonl; what is
there already is not made again. ``python benchmarks/sweep_adaptations.py OUT.jsonl`` prints shares and
reasons of what is there.
"""

import csv
import json
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from manikin.analysis.adaptation import adapt_recording, recorded_on_contacts
from manikin.analysis.adaptation_changes import AdaptationLimits, changes_of
from manikin.analysis.contact_adaptation import scene_under
from manikin.analysis.motion_transfer import body_like, with_places
from manikin.errors import ManikinError
from manikin.pipeline.adapt import PACES
from manikin.recordings import read_recording, reconstruct, supports_of

SHORTEST, LONGEST = 1.0, 1.5
"""Lengths of the parts into which clips are cut [s]."""
FLYING = ("run", "leap", "jump", "quick")
CHANGES = ("same", "heavier", "stature", "place")


def clips_of(table):
    """Names with frames of the parts of a table's clips, in a random order that is always the same.

    What runs or leaps is left out: between two contacts there has to be one.
    """
    found = {}
    with Path(table).open(newline="") as file:
        for row in csv.DictReader(file):
            length = int(LONGEST * float(row["fps"]))
            first, end = int(row["first_frame0"]), int(row["end_frame0"])
            if any(word in f"{row['class']} {row['file']}".lower() for word in FLYING):
                continue
            for start in range(first, end - int(SHORTEST * float(row["fps"])) + 1, length):
                found[row["file"], start] = min(end, start + length)
    clips = [(name, (start, end)) for (name, start), end in sorted(found.items())]
    order = np.random.default_rng(0).permutation(len(clips))
    return [clips[number] for number in order]


def changed(found, supports, change, number):
    """Arguments of the adaptation for a change."""
    body = found.body
    if change == "heavier":
        return {"body": body_like(body, mass=1.2 * body.own_mass)}
    if change == "stature":
        return {"body": body_like(body, stature=body.stature + (0.1 if number % 2 else -0.1))}
    if change == "same":
        return {}
    source = recorded_on_contacts(found, supports)
    seats = [hold for hold in source.holds if hold.effector == "buttocks"]
    feet = [hold for hold in source.holds if hold.effector.endswith("foot")]
    landed = [hold for hold in feet if hold.first > 0] or feet
    moved = dict.fromkeys(seats, -0.05) or {landed[0]: 0.03}
    places = {hold: hold.contact.position + np.array([0.0, 0.0, rise]) for hold, rise in moved.items()}
    return {"scene": scene_under(with_places(source, places), source.floor)}


def outcome(found, supports, change, number):
    """Verdict, reason and numbers of the first pace that is proved, or else of the recorded one."""
    first = None
    for pace in PACES:
        result = outcome_at(found, supports, change, number, pace) | {"pace": pace}
        if result["proved"]:
            return result
        first = first or result
    return first


def outcome_at(found, supports, change, number, pace):
    """Verdict, reason and numbers of one adaptation."""
    try:
        given = changed(found, supports, change, number)
        result = adapt_recording(found, supports, execute=True, pace=pace, **given)
    except ManikinError as error:
        return {"proved": False, "reason": f"refused: {error}"}
    table = AdaptationLimits().table(result)
    if table is None:
        return {"proved": False, "reason": f"no plan: {result.com.failure.reason}"}
    broken = [row.key for row in table if not row.held]
    made = changes_of(result)
    del made["body"], made["contacts"]
    values = {row.key: row.measured for row in table}
    return {"proved": table.held, "reason": " ".join(broken), "values": values} | made


def report(path):
    """Shares of what is proved, by change, and the reasons of the rest."""
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    for change in CHANGES:
        those = [row for row in rows if row["change"] == change]
        proved = sum(row["proved"] for row in those)
        slower = sum(row["proved"] and row["pace"] > 1.0 for row in those)
        print(f"{change:8} {proved} of {len(those)} proved, {slower} of them slower")
        for reason, count in Counter(row["reason"][:90] for row in those if not row["proved"]).most_common():
            print(f"    {count:3} x {reason}")
    print(f"{sum(row['proved'] for row in rows)} of {len(rows)} in all")


def main():
    """Make what is missing, or report."""
    if len(sys.argv) == 2:
        report(Path(sys.argv[1]))
        return
    folder, table, out = map(Path, sys.argv[1:4])
    first, stop = map(int, sys.argv[4:6]) if len(sys.argv) > 4 else (0, None)
    done = set()
    if out.exists():
        done = {(r["clip"], r["start"], r["change"]) for r in map(json.loads, out.read_text().splitlines())}
    for number, (name, frames) in list(enumerate(clips_of(table)))[first:stop]:
        missing = [change for change in CHANGES if (name, frames[0], change) not in done]
        if not missing:
            continue
        head = {"clip": name, "start": frames[0]}
        try:
            found = reconstruct(read_recording(folder / name, frames))
            supports = supports_of(found)
        except ManikinError as error:
            results = {change: {"proved": False, "reason": f"refused: {error}"} for change in missing}
        else:
            results = None
        for change in missing:
            began = time.perf_counter()
            result = results[change] if results else outcome(found, supports, change, number)
            line = head | {"change": change} | result | {"wall_s": round(time.perf_counter() - began, 1)}
            with out.open("a") as file:
                file.write(json.dumps(line) + "\n")
            print(name, change, "proved" if result["proved"] else result["reason"], flush=True)


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
