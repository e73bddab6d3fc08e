"""What the front says was verified agrees with the results of the benchmarks."""

from benchmarks.shared.common import load
from retouch.pages.meanings import VERIFIED


def test_the_front_counts_the_published_findings_as_the_results_do() -> None:
    counted = next(
        one
        for one in load("published")["agreement"]
        if (one["finger"], one["read_out"], one["group"]) == ("paper", "V", "new")
    )
    assert f"of {counted['rows']} that nothing was fitted to" in VERIFIED["published findings"]
    assert VERIFIED["published findings"].endswith(f"predicts {counted['right']}")
