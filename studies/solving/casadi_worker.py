"""Solvers of CasADi's on problems of the set, in a process that has CasADi alone: a line of JSON for each problem.

    python casadi_worker.py DIRECTORY PLUGIN OPTIONS SECONDS NAME…

DIRECTORY: where load.py of the problem set lies; OPTIONS: of the plugin, in JSON; SECONDS: of CPU for a problem, after
which the system ends the process, where it has such clocks.
"""

import json
import os
import signal
import sys
from importlib import import_module
from time import process_time


def main(directory: str, plugin: str, options: str, seconds: str, *names: str) -> None:
    # What solvers print goes nowhere; what is said here goes to a copy of standard output.
    told = os.fdopen(os.dup(1), "w")
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    sys.path.insert(0, directory)
    load = import_module("load")

    load.read(f"{names[0]}.casadi")  # unpacks the archive, before anything is timed
    for name in names:
        print(json.dumps({"began": name}), file=told, flush=True)
        row = {"name": name, "claimed": False, "said": "", "x": None, "multipliers": None, "evaluations": 0}
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_PROF, float(seconds))
        began = process_time()
        try:
            x, multipliers, stats = load.load(name).solve(plugin, json.loads(options))
            row |= {"claimed": bool(stats["success"]), "said": str(stats.get("return_status", ""))}
            row |= {"x": x.tolist(), "multipliers": multipliers.tolist()}
            row["evaluations"] = sum(
                int(v) for k, v in stats.items() if k.startswith("n_call_nlp_") and k != "n_call_total"
            )
        except Exception as error:  # whatever a plugin raises is what it fails with
            row["said"] = " ".join(str(error).split())[-200:]
        row["seconds"] = process_time() - began
        print(json.dumps(row), file=told, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
