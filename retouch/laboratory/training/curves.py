"""Training curves as one HTML page: training loss and validation error by epoch."""

from collections.abc import Sequence
from importlib.resources import files

from markupsafe import Markup

from retouch.pages.svg import Series, line_chart
from surrogate.nets.training import Epoch

_PAGE = Markup("""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><style>{style}</style></head>
<body><main><h1>{title}</h1>
{chart}
<p>{caption}</p>
</main></body></html>
""")


def curves_page(kind: str, epochs: Sequence[Epoch]) -> str:
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
    style = Markup(files("retouch.pages").joinpath("templates/page.css").read_text(encoding="utf-8"))
    return str(_PAGE.format(title=f"Training of the {kind} net", style=style, chart=chart, caption=caption))
