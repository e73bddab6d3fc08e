"""The command `retouch` in a process in whose table of quantities one row was added: the mean gap."""

import sys

from tactile.quantities import QUANTITIES, GoalKey, Quantity

GAP = Quantity(
    name="mean_gap_mm",
    label="mean gap",
    symbol="G",
    unit="mm",
    decimals=4,
    value=lambda touch: touch.gap.mean((-2, -1)),
    goals=(
        GoalKey("mean_gap_mm", "MM", "mean gap, mm"),
        GoalKey(
            "mean_gap_scale",
            "X",
            "mean gap as a factor",
            goal=lambda number, own: own * number,
            relative=True,
        ),
    ),
    meaning="The mean distance of the skin from the plate.",
    mapped=True,
    feel_of="gap",
)
QUANTITIES[GAP.name] = GAP

if __name__ == "__main__":
    from retouch.commands.main import main

    sys.exit(main(sys.argv[1:]))
