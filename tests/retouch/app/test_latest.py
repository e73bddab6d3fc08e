"""Only answers that are still wanted are kept, in whatever order they come."""

import asyncio
from collections.abc import Awaitable, Callable

from relief.ground.errors import InputError
from retouch.app.computing.worker import Superseded
from retouch.app.state.activity import Activity
from retouch.app.state.latest import Latest

SUBJECT = "numbers"


class Ordered:
    """Work that ends when its key is allowed to: with the key in capitals, or with an error.

    Attributes:
        begun: keys, in the order in which their work began.
    """

    def __init__(self) -> None:
        self.begun: list[str] = []
        self._answers: dict[str, asyncio.Future[str]] = {}

    async def __call__(self, key: str) -> str:
        self.begun.append(key)
        self._answers[key] = asyncio.get_running_loop().create_future()
        return await self._answers[key]

    async def end(self, key: str) -> None:
        """Let the work for a key end, and what follows from its end begin."""
        self._answers[key].set_result(key.upper())
        await settle()

    async def fail(self, key: str, error: Exception) -> None:
        """Let the work for a key raise an error."""
        self._answers[key].set_exception(error)
        await settle()


async def settle() -> None:
    """Let everything happen that can."""
    for _ in range(10):
        await asyncio.sleep(0)


class Asked:
    """A `Latest` with its work and its activity."""

    def __init__(self, stop: Callable[[], None] | None = None) -> None:
        self.work, self.activity = Ordered(), Activity()
        self.latest = Latest(self.activity, SUBJECT, self.work, stop)

    async def want(self, key: str | None, topic: object = None) -> None:
        self.latest.want(key, "pressing", topic)
        await settle()

    def answer(self) -> str | None:
        return self.latest.answer

    def fault(self) -> str | None:
        return self.activity.faults.get(SUBJECT)


def run(doing: Callable[[], Awaitable[None]]) -> None:
    async def within() -> None:
        await asyncio.wait_for(doing(), 10.0)

    asyncio.run(within())


def test_an_answer_is_kept_and_the_work_is_listed_meanwhile() -> None:
    async def doing() -> None:
        asked = Asked()
        await asked.want("a")
        assert asked.latest.busy and asked.activity.under_way == {SUBJECT: "pressing"}
        assert asked.answer() is None
        await asked.work.end("a")
        assert asked.answer() == "A" and asked.activity.idle

    run(doing)


def test_a_key_that_is_wanted_twice_is_computed_once() -> None:
    async def doing() -> None:
        asked = Asked()
        for _ in range(2):
            await asked.want("a")
        await asked.work.end("a")
        await asked.want("a")
        assert asked.work.begun == ["a"] and asked.answer() == "A"

    run(doing)


def test_an_outdated_answer_is_dropped_and_keys_between_are_never_computed() -> None:
    async def doing() -> None:
        asked = Asked()
        for key in ("a", "b", "c"):
            await asked.want(key)
        await asked.work.end("a")
        assert asked.work.begun == ["a", "c"] and asked.answer() is None
        await asked.work.end("c")
        assert asked.answer() == "C" and not asked.latest.busy

    run(doing)


def test_a_key_that_is_wanted_again_in_time_gets_the_answer_under_way() -> None:
    async def doing() -> None:
        asked = Asked()
        for key in ("a", "b", "a"):
            await asked.want(key)
        await asked.work.end("a")
        assert asked.work.begun == ["a"] and asked.answer() == "A" and not asked.latest.busy

    run(doing)


def test_an_answer_of_the_same_topic_stays_until_the_next_one_comes() -> None:
    async def doing() -> None:
        asked = Asked()
        await asked.want("a", topic="picture")
        await asked.want("b", topic="picture")
        await asked.work.end("a")
        assert asked.answer() == "A" and asked.work.begun == ["a", "b"]
        await asked.work.end("b")
        assert asked.answer() == "B"
        await asked.want("c", topic="another picture")
        assert asked.answer() is None
        await asked.work.end("c")

    run(doing)


def test_an_error_is_a_fault_until_the_next_answer_of_its_topic() -> None:
    async def doing() -> None:
        asked = Asked()
        await asked.want("a", topic="picture")
        await asked.work.fail("a", InputError("too steep"))
        assert asked.fault() == "too steep" and asked.activity.idle
        await asked.want("a", topic="picture")  # not computed again by itself
        await asked.want("b", topic="picture")
        assert asked.work.begun == ["a", "b"] and asked.fault() == "too steep"
        await asked.work.end("b")
        assert asked.fault() is None and asked.answer() == "B"

    run(doing)


def test_an_error_of_an_outdated_key_is_not_shown() -> None:
    async def doing() -> None:
        asked = Asked()
        await asked.want("a", topic="picture")
        await asked.want("b", topic="picture")
        await asked.work.fail("a", InputError("too steep"))
        assert asked.fault() is None
        await asked.work.fail("b", RuntimeError("unforeseen"))
        assert asked.fault() == "RuntimeError: unforeseen"
        await asked.want("c")
        assert asked.fault() is None  # nothing is known of this topic
        await asked.work.end("c")

    run(doing)


def test_what_is_wanted_no_more_is_dropped_and_computed_again_when_it_is() -> None:
    async def doing() -> None:
        asked = Asked()
        await asked.want("a")
        await asked.want(None)
        await asked.work.end("a")
        assert asked.answer() is None and asked.activity.idle
        await asked.want("a")
        assert asked.work.begun == ["a", "a"]
        await asked.work.end("a")
        assert asked.answer() == "A"

    run(doing)


def test_work_that_is_stopped_is_begun_again_for_the_key_that_is_wanted_then() -> None:
    async def doing() -> None:
        under_way: list[asyncio.Future[str]] = []
        begun: list[str] = []

        async def work(key: str) -> str:
            begun.append(key)
            under_way.append(asyncio.get_running_loop().create_future())
            return await under_way[-1]

        def stop() -> None:
            if not under_way[-1].done():
                under_way[-1].set_exception(Superseded())

        activity = Activity()
        latest = Latest(activity, SUBJECT, work, stop)
        latest.want("a")
        await settle()
        latest.want(None)
        latest.want("a")
        await settle()
        assert begun == ["a", "a"] and activity.faults == {}
        latest.want("b")
        await settle()
        assert begun == ["a", "a", "b"]
        under_way[-1].set_result("B")
        await latest.finished()
        assert latest.answer == "B" and activity.idle and begun == ["a", "a", "b"]

    run(doing)


def test_work_in_parts_ends_at_its_next_check() -> None:
    async def doing() -> None:
        parts: list[str] = []
        go_on = asyncio.Event()

        async def work(key: str) -> None:
            for number in range(2):
                latest.check()
                parts.append(f"{key}{number}")
                await go_on.wait()

        latest = Latest(Activity(), SUBJECT, work)
        latest.want("a")
        await settle()
        latest.want("b")
        go_on.set()
        await latest.finished()
        assert parts == ["a0", "b0", "b1"]

    run(doing)


def test_a_listener_may_want_the_next_key() -> None:
    async def doing() -> None:
        asked = Asked()
        asked.activity.listen(lambda: asked.latest.want("b") if asked.answer() == "A" else None)
        await asked.want("a")
        await asked.work.end("a")
        assert asked.work.begun == ["a", "b"]
        await asked.work.end("b")
        assert asked.answer() == "B" and asked.activity.idle

    run(doing)


def test_cancelled_work_leaves_nothing_under_way() -> None:
    async def doing() -> None:
        asked = Asked()
        for settled in (False, True):
            asked.latest.want("a", "pressing")
            if settled:
                await settle()
            (task,) = asked.activity._tasks
            task.cancel()
            await settle()
            assert asked.activity.idle and asked.activity.faults == {}
            asked.latest.want(None)
        await asked.want("b")
        await asked.work.end("b")
        assert asked.answer() == "B"

    run(doing)
