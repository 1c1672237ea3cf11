"""A film in the browser: a page, for this machine only, that shows frames as soon as they are drawn, in a loop."""

from __future__ import annotations

import re
import sys
import threading
from collections.abc import Generator
from contextlib import closing
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.errors import ConfigError

HOST = "127.0.0.1"
PATIENCE = 60.0
"""Seconds that a browser waits for a frame before it is told that there is none."""
_PAGE = """<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>exneat watch</title>
<style>
:root { color-scheme: light dark; }
body { margin: 1em; font: 16px sans-serif; }
#stage img { max-width: 100%; display: block; }
#controls { display: flex; gap: 1em; align-items: center; margin-top: 0.5em; max-width: 80em; }
#where { flex: 1; }
</style>
<div id="stage"></div>
<div id="controls">
<button id="play">Pause</button>
<input id="where" type="range" min="0" max="LAST" value="0" aria-label="frame">
<span id="words"></span>
</div>
<script>
const [stage, play, where, words] = ["stage", "play", "where", "words"].map(name => document.getElementById(name));
const last = LAST, period = PERIOD;
let next = 0, playing = true, moved = () => {};
const pause = milliseconds => new Promise(done => setTimeout(done, milliseconds));
play.onclick = () => { playing = !playing; play.textContent = playing ? "Pause" : "Play"; };
where.oninput = () => { next = +where.value; moved(); };
async function run() {
  for (let shown = -1; ; ) {
    if (next === shown) { await pause(30); continue; }
    const begun = performance.now(), k = next, picture = new Image();
    const slow = setTimeout(() => { words.textContent = `frame ${k + 1} of ${last + 1} is being drawn`; }, 500);
    picture.src = `frames/${k}.jpg`;
    try { await Promise.race([picture.decode(), new Promise(done => { moved = done; })]); } catch {
      words.textContent = "no answer: exneat watch has ended or is still drawing";
      await pause(1000);
      continue;
    } finally { clearTimeout(slow); }
    if (next !== k || !picture.complete) { picture.src = ""; continue; }
    stage.replaceChildren(picture);
    shown = k;
    words.textContent = `frame ${k + 1} of ${last + 1}`;
    await pause(Math.max(0, period - (performance.now() - begun)));
    while (!playing && next === k) await pause(30);
    if (next === k) { next = k < last ? k + 1 : 0; where.value = next; }
  }
}
run();
</script>
</html>
"""


class _Film:
    """Frames as JPEG files, which one thread draws and others wait for."""

    def __init__(self, count: int, fps: float) -> None:
        self.page = _PAGE.replace("LAST", str(count - 1)).replace("PERIOD", f"{1000.0 / fps:g}").encode()
        self.count, self._frames, self._changed = count, list[bytes](), threading.Condition()

    def add(self, frame: bytes) -> None:
        """Add the next frame."""
        with self._changed:
            self._frames.append(frame)
            self._changed.notify_all()

    def frame(self, k: int) -> bytes | None:
        """Frame `k` once it is drawn, None if that takes too long."""
        with self._changed:
            is_there = self._changed.wait_for(lambda: k < len(self._frames), PATIENCE)
            return self._frames[k] if is_there else None


def show(frames: Generator[NDArray[np.uint8]], count: int, fps: float, port: int) -> None:
    """Serve `count` frames to browsers on this machine until interrupted.

    Args:
        frames: in order, (height, width, 3) each.
        count: how many there are.
        fps: frames per second.
        port: of `HOST`; 0 for any free port.

    Raises:
        ConfigError: the port is taken.
        ExneatError: a frame could not be drawn.
    """
    from exneat_cli.analysis.film import as_jpeg

    film = _Film(count, fps)
    try:
        server = _Server((HOST, port), _handler_of(film))
    except OSError as error:
        raise ConfigError("port", f"one that is free ({error.strerror})", port, "port=0 picks a free one") from error
    threading.Thread(target=server.serve_forever, daemon=True).start()
    print(f"http://{HOST}:{server.server_address[1]} shows the film until Ctrl-C", flush=True)
    try:
        with closing(frames):
            for frame in frames:
                film.add(as_jpeg(frame))
        threading.Event().wait()
    except KeyboardInterrupt:  # the intended way to stop
        print("exneat: the page was closed", flush=True)
    finally:
        server.shutdown()
        server.server_close()


class _Server(ThreadingHTTPServer):
    def handle_error(self, request: Any, client_address: Any) -> None:
        """Do not report a browser that closed the connection."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


def _handler_of(film: _Film) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked = re.fullmatch("/frames/([0-9]{1,7})[.]jpg", self.path)
            if self.path == "/":
                self._answer(film.page, "text/html; charset=utf-8")
            elif asked and int(asked[1]) < film.count and (frame := film.frame(int(asked[1]))):
                self._answer(frame, "image/jpeg")
            else:
                self.send_error(404)

        def _answer(self, content: bytes, kind: str) -> None:
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *words: Any) -> None:
            """Do not log requests."""

    return Handler
