"""The page that runs an experiment: the trials are shown, and answers by the keyboard are kept."""

from pathlib import Path

from relief.ground.files import write_atomically
from retouch.laboratory.people.plan import FOLDER, TrialPlan
from retouch.pages.rendering import render_page

PAGE = "index.html"
"""The page, in the folder of the plan."""
PLAN_BEGINS, PLAN_ENDS = b'<script type="application/json" id="plan">', b"</script>"
"""What stands before and behind the plan in the page; the plan itself has no `<`."""


def write_experiment_page(folder: Path, plan: TrialPlan, title: str) -> Path:
    """Write the page of a plan into the folder of its set.

    Args:
        folder: of the set.
        plan: of the trials.
        title: of the page.
    """
    page = folder / FOLDER / PAGE
    content = render_page(
        "experiment.html.j2",
        scripts=("experiment_answers.js", "experiment.js"),
        connect=" connect-src 'self';",
        pair={"title": title},
        plan=plan,
        data=plan.as_json(),
    )
    write_atomically(page, content)
    return page
