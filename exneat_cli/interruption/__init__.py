"""Ctrl-C and SIGTERM: a write in hand is finished first, then everything ends within seconds."""

from exneat_cli.interruption.handlers import heeding, listen, listening, stop_listening, tell_how_to_go_on
from exneat_cli.interruption.last_acts import before_the_end
from exneat_cli.interruption.launching import as_worker, unheard_by_children
from exneat_cli.interruption.scratch import scratch_directory
from exneat_cli.interruption.signals import Interrupted
from exneat_cli.interruption.writes import finishing, uninterrupted

__all__ = [
    "Interrupted",
    "as_worker",
    "before_the_end",
    "finishing",
    "heeding",
    "listen",
    "listening",
    "scratch_directory",
    "stop_listening",
    "tell_how_to_go_on",
    "unheard_by_children",
    "uninterrupted",
]
