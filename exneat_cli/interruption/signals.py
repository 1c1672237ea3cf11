"""What a signal becomes, and what is known of signals so far."""

from __future__ import annotations

import signal


class Interrupted(KeyboardInterrupt):
    """Raised in the main thread when the process is asked to end.

    Attributes:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number

    def __reduce__(self) -> tuple[type[Interrupted], tuple[int]]:
        return Interrupted, (self.number,)


class Heard:
    """The signals of this process, of which there is one set; handlers run in the main thread alone.

    Attributes:
        raised: number of the signal that `Interrupted` was raised for; None before.
        put_off: how many blocks the main thread is in that must not be interrupted.
        waiting: number of the one that waits for their end.
        through_others: whether the main thread blocks Ctrl-C, so that another thread hears it.
    """

    raised: int | None = None
    put_off = 0
    waiting: int | None = None
    through_others = False

    @classmethod
    def anything(cls) -> bool:
        """Whether a signal was heard."""
        return cls.raised is not None or cls.waiting is not None

    @classmethod
    def forget(cls) -> None:
        """Begin anew."""
        cls.raised = cls.waiting = None
