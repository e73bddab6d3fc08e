"""Run: what it would take, how far it is, its best so far, and the queue."""

from functools import partial

from nicegui import ui

from optimize.run_directory.finished_run import read_verification
from retouch.app.stages.controls import LineTable, button, details, fault_label, section
from retouch.app.stages.elements import StepChart
from retouch.app.stages.window import AppWindow, PageStage
from retouch.app.state.runs import QueuedRun, State, steps
from retouch.pages.sentences import change_by_printing

LINES = 12
"""Last lines of the command that are shown."""
ELSEWHERE = "only where it was started, by Ctrl-C: the app cannot find its process"


class RunStage(PageStage):
    """The stage on which runs are started and followed."""

    name = "Run"

    def __init__(self, window: AppWindow) -> None:
        super().__init__(window)
        self._listed: list[tuple[str, State, bool]] = []

    def build_work(self) -> None:
        """Put the relief into the present slot."""
        self._view = self.window.view("original", "best so far")
        self._caption = ui.label().classes("hint caption")

    def build_side(self) -> None:
        """Put the next run, the one under way and the queue into the present slot."""
        with section("Next run"):
            with ui.element("div").classes("row-of"):
                self._start = button("Run", self.session.start_run, "primary")
                self._ask = button("What would it take?", self.session.running.estimate)
            self._goal = ui.label().classes("hint")
            self._estimated = LineTable()
            self._fault = fault_label()
        with section("Under way"):
            self._state = ui.label("Nothing is running.").classes("state").props('role="status"')
            self._chart = StepChart()
            self._table = LineTable()
            with ui.element("div").classes("row-of"):
                self._stop = button("Stop", self.session.running.stop)
                self._compare = button("Compare", self._to_compare, "primary")
            with details("What the command says") as self._said:
                self._log = ui.label().classes("log")
        with section("Queue"):
            self._queue = ui.element("ul").classes("queue")
            self._empty = ui.label("No run yet.").classes("hint")

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session = self.session
        job = session.running.shown()
        best = None if job is None else session.running.best.answer
        self.window.light_up(self._view, *(best or (session.numbers.relief, None)))
        self._caption.set_text("Left the original, right the best so far." if best else "")
        self._goal.set_text(session.document.feel.sentence())
        self._estimated.show(session.running.forecast)
        self._fault.set_text(session.activity.faults.get("run", ""))
        ready = session.document.picture is not None and "run" not in session.activity.under_way
        self._start.set_enabled(ready)
        self._ask.set_enabled(ready)
        self._show_job(job)
        self._show_queue(job)

    def _show_job(self, job: QueuedRun | None) -> None:
        for element in (self._chart, self._table.element, self._said):
            element.set_visibility(job is not None)
        stoppable = job is not None and job.can_be_stopped
        self._stop.set_visibility(job is not None and job.state.busy and stoppable)
        self._compare.set_visibility(job is not None and job.state in (State.DONE, State.SHORT))
        if job is None:
            self._state.set_text("Nothing is running.")
            return
        self._state.set_text(f"{job.folder.name}: {job.state.value}")
        shown, said = [], job.lines()
        history = steps(job.folder)
        target = history[-1].target_roughness if history else None
        self._chart.give(values=[step.roughness for step in history], target=target, name="roughness")
        if history:
            last = history[-1]
            shown.append(("step", f"{last.step}, after {last.seconds:.0f} s"))
            shown.append(("roughness", f"{last.roughness:.4f}"))
            if target is not None:
                shown.append(("target", f"{target:.4f}"))
            change = f"changed by about {last.picture_mean_percent:.1f} % of the mean picture"
            shown.append(("pictures", change))
        if job.state.busy and not stoppable:
            shown.append(("stop", ELSEWHERE))
        result = None if job.state.busy else read_verification(job.folder)
        if result is not None:
            shown.append(("warning" if job.state is State.SHORT else "stop", result.stop.message))
            if (by_printing := change_by_printing(result)) is not None:
                shown.append(("printer", by_printing))
        if said and job.state.busy:
            shown.append(("now", said[-1]))
        elif said and (job.state is State.FAILED or job.died):
            shown.append(("warning", said[-1]))
        self._table.show(shown)
        self._log.set_text("\n".join(said[-LINES:]))

    def _show_queue(self, shown: QueuedRun | None) -> None:
        jobs = self.session.running.queue.jobs
        now = [(job.folder.name, job.state, job is shown) for job in jobs]
        self._empty.set_visibility(not now)
        if now == self._listed:
            return
        self._listed = now
        self._queue.clear()
        with self._queue:
            for job in reversed(jobs):
                self._entry(job, job is shown)

    def _entry(self, job: QueuedRun, shown: bool) -> None:
        with ui.element("li").classes("shown" if shown else ""):
            button(job.folder.name, partial(self.session.history.look_at, str(job.folder)), "quiet")
            ui.label(job.state.value).classes("hint")
            if job.state is State.STOPPED:
                button("Go on", partial(self.session.go_on, job), "quiet")
            if not job.state.busy:
                button("Remove from the list", partial(self.session.drop, job), "quiet")

    def _to_compare(self) -> None:
        job = self.session.running.shown()
        if job is not None:
            self.session.history.look_at(str(job.folder))
            self.window.show("Compare")
