"""Run: what it would take, how far it is, its best so far, and the queue."""

from functools import partial

from nicegui import ui

from retouch.app.stages.controls import Told, button, section
from retouch.app.stages.elements import ReliefView, StepChart
from retouch.app.stages.window import Window
from retouch.app.state.runs import Job, State, steps

LINES = 12
"""Last lines of the command that are shown."""


class RunStage:
    """The stage on which runs are started and followed."""

    name = "Run"

    def __init__(self, window: Window) -> None:
        self.window, self.session = window, window.session
        self._listed: list[tuple[str, State, bool]] = []

    def build(self) -> None:
        """Put its elements into the present slot."""
        with ui.element("div").classes("stage"):
            with ui.element("div").classes("work"):
                self._view = ReliefView(("original", "best so far"))
                self._view.on("lamp", self.window.lamp_moved).on("tilt", self.window.tilted)
                self._caption = ui.label().classes("hint caption")
            with ui.element("aside").classes("side"):
                self._starting()
                self._following()
                with section("Queue"):
                    self._queue = ui.element("ul").classes("queue")
                    self._empty = ui.label("No run yet.").classes("hint")

    def _starting(self) -> None:
        with section("Next run"):
            with ui.element("div").classes("row-of"):
                self._start = button("Run", self.session.start_run, "primary")
                self._ask = button("What would it take?", self.session.running.estimate)
            self._goal = ui.label().classes("hint")
            self._estimated = Told()
            self._fault = ui.label().classes("fault").props('role="alert"')

    def _following(self) -> None:
        with section("Under way"):
            self._state = ui.label("Nothing is running.").classes("state").props('role="status"')
            self._chart = StepChart()
            self._table = Told()
            with ui.element("div").classes("row-of"):
                self._stop = button("Stop", self.session.running.stop)
                self._compare = button("Compare", self._to_compare, "primary")
            with ui.element("details").classes("more") as self._said:
                with ui.element("summary"):
                    ui.label("What the command says")
                self._log = ui.label().classes("log")

    def commands(self) -> list[list[str]]:
        """The commands that do the same, without `retouch`."""
        return self.session.running.commands()

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session = self.session
        job = session.running.shown()
        best = session.running.best
        before = self.window.shapes.address(session.numbers.shape)
        after = self.window.shapes.address(best) if best is not None and job is not None else ""
        if after:
            before, after = self.window.shapes.address(session.running.original) or after, after
        self._view.give(before=before, after=after, lamp=self.window.lamp, tilt=self.window.tilt)
        self._caption.set_text("Left the original, right the best so far." if after else "")
        self._goal.set_text(session.document.feel.told())
        self._estimated.show(session.running.forecast)
        self._fault.set_text(session.activity.faults.get("run", ""))
        waiting = "run" in session.activity.under_way
        self._start.set_enabled(session.document.picture is not None and not waiting)
        self._ask.set_enabled(session.document.picture is not None and not waiting)
        self._show_job(job)
        self._show_queue()

    def _show_job(self, job: Job | None) -> None:
        for element in (self._chart, self._table.element, self._said):
            element.set_visibility(job is not None)
        self._stop.set_visibility(job is not None and job.state.busy)
        self._compare.set_visibility(job is not None and job.state in (State.DONE, State.SHORT))
        if job is None:
            self._state.set_text("Nothing is running.")
            return
        lines, made = job.lines(), steps(job.folder)
        self._state.set_text(f"{job.folder.name}: {job.state.value}")
        felt = [step.roughness for step in made]
        self._chart.give(values=felt, target=made[-1].target if made else None, name="roughness")
        told = []
        if made:
            last = made[-1]
            told += [
                ("step", f"{last.step}, after {last.seconds:.0f} s"),
                ("roughness", f"{last.roughness:.4f}"),
            ]
            if last.target is not None:
                told.append(("target", f"{last.target:.4f}"))
            told.append(("pictures", f"changed by about {last.picture_percent:.1f} % of the mean picture"))
        if job.state.busy and lines:
            told.append(("now", lines[-1]))
        if (job.state is State.FAILED or job.died) and lines:
            told.append(("warning", lines[-1]))
        self._table.show(told)
        self._log.set_text("\n".join(lines[-LINES:]))

    def _show_queue(self) -> None:
        shown = self.session.running.shown()
        now = [(job.folder.name, job.state, job is shown) for job in self.session.running.queue.jobs]
        self._empty.set_visibility(not now)
        if now == self._listed:
            return
        self._listed = now
        self._queue.clear()
        with self._queue:
            for job in reversed(self.session.running.queue.jobs):
                self._entry(job, job is shown)

    def _entry(self, job: Job, shown: bool) -> None:
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
