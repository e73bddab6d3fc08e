"""Reasons why a descent stops, in words; nothing heavy is imported."""

from enum import Enum


class StopReason(Enum):
    """Why a descent stopped; the value is the sentence shown."""

    CONVERGED = "The target is met and the pictures no longer get closer to the original."
    WITHIN_BOUNDS = "Targets and pictures are within the bounds of the paper's stopping rule."
    STEP_LIMIT = "The step limit was reached with the target met; more steps may bring the pictures closer."
    SHORT_OF_TARGET = "The step limit was reached before the target was met."
    NOT_CONFIRMED = "The model that steered met the target, but the verification found it missed."
    UNREACHABLE = "The target seems out of reach: the last steps came no closer to it."
    SWINGING = (
        "The last steps swing around the target and come no closer to it; exact models in place of --fast, "
        "or a printer with thinner layers, may meet it."
    )
    NON_FINITE = "A value was not finite; the best relief before it is kept."
    CONTACT_FAILED = "The contact of a step did not converge; the best relief before it is kept."
    INTERRUPTED = "Interrupted; the best relief so far is kept."

    @property
    def met(self) -> bool:
        """Whether the target was met."""
        return self in (StopReason.CONVERGED, StopReason.WITHIN_BOUNDS, StopReason.STEP_LIMIT)
