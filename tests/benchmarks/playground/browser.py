"""A headless browser, steered through a pipe with the DevTools protocol."""

import json
import os
import subprocess
import time
from pathlib import Path
from typing import Any


def value_of(browser: str, address: str, expression: str, profile: Path, seconds: float) -> Any:
    """Return the value of an expression in a page, once it is neither null nor undefined.

    The browser has no way out of this machine.
    """
    to_browser, from_browser = os.pipe(), os.pipe()
    flags = [
        *("--headless", "--no-sandbox", "--disable-gpu", "--disable-extensions"),
        *("--proxy-server=127.0.0.1:9", f"--user-data-dir={profile}", "--window-size=1280,900"),
        *("--remote-debugging-pipe", "about:blank"),
    ]
    fds = to_browser[0], from_browser[1]
    script = f'exec "$0" "$@" 3<&{fds[0]} 4>&{fds[1]}'
    child = subprocess.Popen(
        ["bash", "-c", script, browser, *flags], pass_fds=fds, stderr=subprocess.DEVNULL
    )
    for fd in fds:
        os.close(fd)
    with os.fdopen(to_browser[1], "wb") as out, os.fdopen(from_browser[0], "rb") as back:
        held, last = b"", 0

        def ask(method: str, session: str | None = None, **parameters: Any) -> Any:
            nonlocal held, last
            last += 1
            message = {"id": last, "method": method, "params": parameters}
            if session:
                message["sessionId"] = session
            out.write(json.dumps(message).encode() + b"\0")
            out.flush()
            while True:
                while b"\0" not in held:
                    found = os.read(back.fileno(), 1 << 20)
                    assert found, "the browser has ended"
                    held += found
                text, _, held = held.partition(b"\0")
                answer = json.loads(text)
                if answer.get("id") == last:
                    return answer["result"]

        try:
            target = ask("Target.createTarget", url=address)["targetId"]
            session = ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                result = ask("Runtime.evaluate", session, expression=expression, returnByValue=True)
                if result["result"].get("value") is not None:
                    return result["result"]["value"]
                time.sleep(0.2)
            raise TimeoutError(f"{expression} has no value after {seconds:g} s")
        finally:
            child.terminate()
            child.wait(20)
