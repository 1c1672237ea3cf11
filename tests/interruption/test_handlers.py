"""What becomes of Ctrl-C and SIGTERM in the main thread."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from exneat_cli.interruption import Interrupted, heeding, listening
from tests.interruption.processes import in_process


@pytest.fixture(name="listening")
def _listening() -> Iterator[None]:
    with listening():
        yield


@pytest.mark.usefixtures("listening")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_raised_with_its_number(number: int) -> None:
    with pytest.raises(Interrupted) as caught:
        signal.raise_signal(number)
    assert caught.value.number == number


def test_a_second_signal_ends_the_process_at_once_even_in_the_midst_of_a_write() -> None:
    done = in_process("""
        with finishing():
            os.kill(os.getpid(), signal.SIGINT)
            print("still writing", flush=True)
            time.sleep(0.3)
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(60)
            print("never", flush=True)
    """)
    assert done.stdout == "still writing\n"
    assert done.returncode == 130


def test_an_echo_of_the_signal_is_no_second_one() -> None:
    done = in_process("""
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(60)
        except KeyboardInterrupt:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.5)
            print("tidied up", flush=True)
    """)
    assert (done.stdout, done.returncode) == ("tidied up\n", 0)


DROPPED = """
import os, signal, time, weakref
from exneat_cli import interruption
from exneat_cli.interruption import watch

class Thing:
    pass

interruption.listen()
thing = Thing()
watched = weakref.ref(thing, lambda _: [os.kill(os.getpid(), signal.SIGTERM), time.sleep(0.01)])
try:
    del thing
    time.sleep(60)
except interruption.Interrupted as interrupted:
    print("heard", interrupted.number == signal.SIGTERM)
"""


def test_a_signal_in_the_callback_of_a_weak_reference_is_heard_after_it() -> None:
    done = in_process(DROPPED)
    assert (done.stdout, done.stderr) == ("heard True\n", "")


@pytest.mark.usefixtures("listening")
def test_an_error_that_a_library_made_of_the_interruption_is_the_interruption_again() -> None:
    def library() -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            raise ValueError("Invalid bounding box") from None

    with pytest.raises(Interrupted) as caught, heeding():
        library()
    assert caught.value.number == signal.SIGTERM


@pytest.mark.usefixtures("listening")
def test_an_error_without_a_signal_stays_what_it_is() -> None:
    with pytest.raises(ValueError, match="its own"), heeding():
        raise ValueError("its own")


def test_a_process_that_is_done_ends_with_its_own_exit_code_whatever_comes_late() -> None:
    done = in_process("""
        from exneat_cli.interruption import stop_listening
        stop_listening()
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)
        raise SystemExit(7)
    """)
    assert done.returncode == 7


@pytest.mark.parametrize("block", ["listening", "nothing"])
def test_after_the_block_signals_and_errors_are_as_before(block: str) -> None:
    done = in_process(f"""
        from exneat_cli import interruption
        from exneat_cli.interruption import handlers, watch
        handlers._Now.watch.call_off()
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        watch.PATIENCE = 0.1
        sys.unraisablehook = hook = lambda lost: None
        if {block!r} == "listening":
            try:
                with interruption.listening():
                    os.kill(os.getpid(), signal.SIGTERM)
                    time.sleep(60)
            except KeyboardInterrupt:
                pass
        print(signal.getsignal(signal.SIGINT) is signal.default_int_handler, sys.unraisablehook is hook)
        print(signal.getsignal(signal.SIGTERM) == signal.SIG_DFL, signal.set_wakeup_fd(-1))
        try:
            with interruption.heeding():
                raise ValueError
        except ValueError:
            time.sleep(0.3)
    """)
    assert (done.stdout, done.returncode) == ("True True\nTrue -1\n", 0)
