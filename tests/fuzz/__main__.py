"""Many cases by one command, with a log that the same command goes on with.

python -m tests.fuzz --cases 100000 --log fuzz.log      # goes on where the log ends
python -m tests.fuzz --replay fuzz.log.failures/1.json  # one failure again

Each line of the log is a case: number, kind, "whole" or "reader", verdict, seconds, MiB, what was told. Cases
come in batches of one kind and one seed, so that the log tells which cases are left. For each fault, the
smallest case that shows the fault is kept in a folder beside the log.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.fuzz.case import Case
from tests.fuzz.engine import (
    KINDS,
    LEARNING,
    READERS_ALONE,
    WHOLE,
    Batch,
    Worker,
    run_batch,
    sign_of,
    smallest,
)
from tests.fuzz.worker import Outcome

OF_A_BATCH = 490
"""Cases of a batch by readers alone; ten whole commands follow, one case in `WHOLE`."""
SHARES = {"caches": 0.2}
"""Cases of a batch of a kind, as a share of `OF_A_BATCH`: a damaged cache is built anew, which takes time."""
TOLD = 200
"""Most characters of what was told in a line of the log."""


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--log", type=Path, help="file that each case is appended to")
    parser.add_argument("--seed", type=int, default=0, help="seed of all cases; the log belongs to one seed")
    parser.add_argument("--kind", choices=KINDS, action="append", help="only inputs of this kind")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="run a stored failure again")
    parser.add_argument("--table", action="store_true", help="print the table of the log, and run nothing")
    arguments = parser.parse_args(argv)
    if arguments.replay:
        return replay(arguments.replay)
    if arguments.log is None:
        parser.error("--log is needed")
    if not arguments.table:
        run(arguments.log, arguments.cases, arguments.seed, arguments.kind or [*KINDS])
    rows = read_log(arguments.log)
    print(table(rows))
    return int(any(row["verdict"] == "failed" for row in rows))


def replay(path: Path) -> int:
    """Run a stored failure again; returns 1 if it still fails."""
    case = Case.of_json(json.loads(path.read_text(encoding="utf-8"))["case"])
    with Worker() as worker:
        outcome = worker.run(case)
    print(f"{case!r}\n{outcome.verdict}, {outcome.seconds:.2f} s, {outcome.mib:.0f} MiB\n{outcome.told}")
    return int(outcome.verdict == "failed")


def batches(seed: int, kinds: list[str]) -> Iterator[Batch]:
    """All batches of a seed, without end: kind after kind, readers and then whole commands."""
    number = 0
    while True:
        for kind in kinds:
            for cases, whole in ((OF_A_BATCH, False), (OF_A_BATCH // (WHOLE - 1), True)):
                if not whole or kind not in READERS_ALONE:
                    yield Batch(kind, seed * 1_000_003 + number, round(cases * SHARES.get(kind, 1.0)), whole)
                number += 1


def run(log: Path, cases: int, seed: int, kinds: list[str]) -> None:
    """Run the cases that a log lacks.

    Args:
        log: The log.
        cases: Number of cases that the log has at the end.
        seed: Of all cases.
        kinds: Kinds of input.
    """
    head = {"seed": seed, "kinds": kinds}
    log.parent.mkdir(parents=True, exist_ok=True)
    if log.exists():
        if json.loads(log.read_text(encoding="utf-8").partition("\n")[0]) != head:
            raise SystemExit(f"{log}: belongs to another seed or other kinds")
        _drop_half_a_line(log)
    done = len(read_log(log)) if log.exists() else 0
    failures = Path(f"{log}.failures")
    signs = {json.loads(path.read_text(encoding="utf-8"))["sign"] for path in failures.glob("*.json")}
    began, first = time.monotonic(), done
    with Worker() as worker, log.open("a", encoding="utf-8", buffering=1) as file:
        if not done and not file.tell():
            file.write(json.dumps(head) + "\n")
        bases = worker.bases(learning=any(kind in LEARNING for kind in kinds))
        number = 0
        for batch in batches(seed, kinds):
            if number >= cases:
                break
            if number + batch.cases <= done:
                number += batch.cases
                continue
            skipped, found = max(0, done - number), dict[str, int]()

            def record(
                place: int, case: Case, outcome: Outcome, batch: Batch = batch, found: dict[str, int] = found
            ) -> None:
                file.write(_line(batch, outcome) + "\n")
                if outcome.verdict == "failed":
                    found.setdefault(sign_of(outcome), place)

            run_batch(batch, bases[batch.kind], worker, record, skipped)
            for sign, place in found.items():
                named = f"{batch.kind}: {sign}"
                if named not in signs:
                    signs.add(named)
                    store(failures, batch, bases[batch.kind], worker, place, sign)
            number += batch.cases
            done = number
            pace = (done - first) / (time.monotonic() - began)
            left = max(0, cases - done) / pace / 60.0
            print(
                f"{done} of {cases}, {len(signs)} faults, {pace:.0f} a second, {left:.0f} min left",
                flush=True,
            )


def _line(batch: Batch, outcome: Outcome) -> str:
    told = " ".join(outcome.told.split())[:TOLD]
    way = "whole" if batch.whole else "reader"
    return json.dumps([batch.kind, way, outcome.verdict, round(outcome.seconds, 3), round(outcome.mib), told])


def _drop_half_a_line(log: Path) -> None:
    """Take away the last line of a log if a kill has cut it short."""
    content = log.read_bytes()
    if not content.endswith(b"\n"):
        log.write_bytes(content[: content.rfind(b"\n") + 1])


def store(folder: Path, batch: Batch, base: dict[str, bytes], worker: Worker, place: int, sign: str) -> None:
    """Keep the smallest case that shows a fault."""
    failure = smallest(batch, base, worker, place, sign)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{len(list(folder.glob('*.json'))) + 1}.json"
    saved: dict[str, Any] = {"sign": f"{batch.kind}: {sign}", "batch": vars(batch), "place": place}
    if failure is not None:
        saved |= {"told": failure.outcome.told.splitlines(), "case": failure.case.as_json()}
    path.write_text(json.dumps(saved, indent=1), encoding="utf-8")
    print(f"fault: {saved['sign']}: {path}", flush=True)


def read_log(log: Path) -> list[dict[str, Any]]:
    """The cases of a log."""
    keys = ("kind", "way", "verdict", "seconds", "mib", "told")
    lines = log.read_text(encoding="utf-8").splitlines()[1:]
    return [dict(zip(keys, json.loads(line), strict=True)) for line in lines]


def table(rows: list[dict[str, Any]]) -> str:
    """One row a kind: numbers of cases, and the slowest and the largest."""
    kinds: dict[tuple[str, str], list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        kinds[row["kind"], row["way"]].append(row)
    head = "| input | way | cases | accepted | refused | failed | slowest, s | largest, MiB |"
    lines = [head, "|---|---|---|---|---|---|---|---|"]
    for (kind, way), of_kind in sorted(kinds.items()):
        verdicts = [row["verdict"] for row in of_kind]
        counts = [verdicts.count(verdict) for verdict in ("accepted", "refused", "failed")]
        worst = [max(row["seconds"] for row in of_kind), max(row["mib"] for row in of_kind)]
        cells = [kind, way, len(of_kind), *counts, f"{worst[0]:.2f}", f"{worst[1]:.0f}"]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
