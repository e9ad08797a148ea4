"""A headless browser, controlled through a pipe with the DevTools protocol."""

import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Self

from sweeps.limits import scaled

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
LOADED = 'document.readyState == "complete" || new Promise((go) => addEventListener("load", go))'


class PageError(Exception):
    """A page raised an exception, broke its security policy or crashed."""


def find() -> str | None:
    """Return the path of a browser, None if there is none."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


class Browser:
    """A running browser, without network.

    Parameters
    ----------
    program : str
    profile : Path
        New folder of its files.
    limit : float
        Time [s] that one command may take.
    """

    def __init__(self, program: str, profile: Path, limit: float = 300.0) -> None:
        self.limit, self._last, self._held = limit, 0, b""
        self._log = profile.with_name(f"{profile.name}.log")
        flags = [
            *("--headless", "--no-sandbox", "--disable-gpu", "--disable-extensions"),
            *("--proxy-server=127.0.0.1:9", f"--user-data-dir={profile}", "--window-size=1280,900"),
            *("--remote-debugging-pipe", "about:blank"),
        ]
        to_browser, from_browser = os.pipe(), os.pipe()
        script = f'exec "$0" "$@" 3<&{to_browser[0]} 4>&{from_browser[1]}'
        with self._log.open("wb") as log:
            self._child = subprocess.Popen(
                ["bash", "-c", script, program, *flags],
                pass_fds=(to_browser[0], from_browser[1]), stdout=log, stderr=log,
            )  # fmt: skip
        os.close(to_browser[0])
        os.close(from_browser[1])
        self._out, self._back = os.fdopen(to_browser[1], "wb"), os.fdopen(from_browser[0], "rb")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._child.terminate()
        try:
            self._child.wait(scaled(20.0))
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        self._back.close()
        with suppress(BrokenPipeError):
            self._out.close()

    @contextmanager
    def page(self, address: str) -> Iterator["Page"]:
        """Load a page, and close it at the end."""
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        try:
            made = Page(self, session)
            for domain in ("Inspector", "Log", "Page", "Runtime"):
                made.ask(f"{domain}.enable")
            made.ask("Page.navigate", url=address)
            made.evaluate(LOADED)
            yield made
        finally:
            self.ask("Target.closeTarget", targetId=target)

    def ask(self, method: str, session: str | None = None, **parameters: Any) -> Any:
        """Return the answer to a command.

        Raises
        ------
        PageError
            As soon as the page of this session fails.
        TimeoutError
            If there is no answer within the limit.
        OSError
            If the browser has ended.
        """
        self._last += 1
        message = {"id": self._last, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        try:
            self._out.write(json.dumps(message).encode() + b"\0")
            self._out.flush()
        except BrokenPipeError:
            raise OSError(self._ended()) from None
        limit = scaled(self.limit)
        end = time.monotonic() + limit
        while True:
            answer = json.loads(self._read(end, method))
            if answer.get("sessionId") == session and (fault := _fault(answer)):
                raise PageError(fault)
            if answer.get("id") == self._last:
                if "error" in answer:
                    raise ValueError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def _ended(self) -> str:
        """Return the end of what the browser has printed."""
        return f"the browser has ended:\n{self._log.read_text()[-2000:]}"

    def _read(self, end: float, method: str) -> bytes:
        """Return the next message."""
        while b"\0" not in self._held:
            left = max(0.0, end - time.monotonic())
            if not select.select([self._back], [], [], left)[0]:
                raise TimeoutError(f"{method} has no answer after {self.limit:g} s")
            found = os.read(self._back.fileno(), 1 << 20)
            if not found:
                raise OSError(self._ended())
            self._held += found
        text, _, self._held = self._held.partition(b"\0")
        return text


class Page:
    """A page in a browser."""

    def __init__(self, browser: Browser, session: str) -> None:
        self.browser, self.session = browser, session

    def ask(self, method: str, **parameters: Any) -> Any:
        """Return the answer to a command."""
        return self.browser.ask(method, self.session, **parameters)

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression; a promise is awaited."""
        answer = self.ask(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        if "exceptionDetails" in answer:
            raise PageError(_described(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def resize(self, width: int, height: int) -> None:
        """Give the page the size of a screen, in CSS pixels."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=True,
        )  # fmt: skip


def _described(details: Any) -> str:
    thrown = details.get("exception", {})
    return str(thrown.get("description") or thrown.get("value") or details["text"])


def _fault(message: Any) -> str | None:
    """Return the text of a failure of a page, None for other messages."""
    match message.get("method"):
        case "Runtime.exceptionThrown":
            return _described(message["params"]["exceptionDetails"])
        case "Log.entryAdded" if message["params"]["entry"]["level"] == "error":
            return str(message["params"]["entry"]["text"])
        case "Runtime.consoleAPICalled" if message["params"]["type"] == "error":
            return " ".join(str(argument.get("value")) for argument in message["params"]["args"])
        case "Inspector.targetCrashed":
            return "the page has crashed"
    return None
