"""Training curves as one HTML page: training loss and validation error by epoch."""

from collections.abc import Sequence

from retouch.pages.rendering import render_page
from retouch.pages.svg import Series, line_chart
from surrogate.nets.training import Epoch


def curves_page(kind: str, epochs: Sequence[Epoch]) -> bytes:
    """Return the page, which needs no other file.

    Args:
        kind: Kind of the net.
        epochs: Points of the curves, at least one.
    """
    best, last = min(epochs, key=lambda epoch: epoch.error), epochs[-1]
    numbers = [float(epoch.number) for epoch in epochs]
    chart = line_chart(
        "Relative errors, added",
        [
            Series("training", numbers, [epoch.loss for epoch in epochs], "before"),
            Series("validation", numbers, [epoch.error for epoch in epochs], "after"),
        ],
        "epoch",
    )
    caption = (
        f"{last.number} epochs of {last.steps // last.number} steps in {last.seconds:.0f} s; "
        f"best validation {best.error:.4g} after epoch {best.number}."
    )
    return render_page(
        "curves.html.j2", pair={"title": f"Training of the {kind} net"}, chart=chart, caption=caption
    )
