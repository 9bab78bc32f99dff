"""Headless Chromium over its debugging pipe: no driver, no package, no port."""

import base64
import json
import os
import select
import shutil
import subprocess
import time
from pathlib import Path

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
ANSWER = 120.0  # what the browser may take to say anything [s]
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage",
    "--remote-debugging-pipe",
)


class Browser:
    """One page of a Chromium of its own.

    Messages are JSON that ends with a zero byte: it reads them at descriptor 3 and writes at 4.
    """

    def __init__(self, profile: Path, width: int = 1300, height: int = 900) -> None:
        assert CHROMIUM is not None
        to_read, self._to = os.pipe()
        self._from, to_write = os.pipe()
        # a shell moves the two ends to 3 and 4, whatever they are called here
        command = f'exec "$0" "$@" 3<&{to_read} 4>&{to_write}'
        flags = (*FLAGS, f"--user-data-dir={profile}", f"--window-size={width},{height}")
        self.process = subprocess.Popen(
            ["/bin/bash", "-c", command, CHROMIUM, *flags, "about:blank"], pass_fds=(to_read, to_write),
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        os.close(to_read)
        os.close(to_write)
        self._left, self._number, self._session = b"", 0, None
        targets = self.send("Target.getTargets")["targetInfos"]
        page = next(t for t in targets if t["type"] == "page")
        self._session = self.send("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
        self.size(width, height)

    def send(self, method, **parameters):
        """Send a command and return its answer."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]

    def _read(self):
        while b"\0" not in self._left:
            assert select.select([self._from], [], [], ANSWER)[0], f"the browser says nothing for {ANSWER:g} s"
            data = os.read(self._from, 1 << 20)
            assert data, "the browser ended"
            self._left += data
        message, _, self._left = self._left.partition(b"\0")
        return json.loads(message)

    def size(self, width, height, *, mobile=False):
        """Size of the window [px]."""
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=mobile)

    def open(self, address):
        """Go to an address."""
        self.send("Page.navigate", url=address)

    def run(self, script):
        """Value of an expression in the page."""
        found = self.send("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def until(self, script, seconds=60.0):
        """Value of an expression as soon as it is true."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            # an element has no value to send back: that it is there is what counts
            value = self.run(f"(() => {{ const v = {script}; return v instanceof Node || v }})()")
            if value:
                return value
            time.sleep(0.1)
        raise AssertionError(f"after {seconds} s still not: {script}\n{self.run('document.body.innerText')}")

    def type(self, selector, text):
        """Put a text into a field as a user does: its listeners hear of it."""
        told = "".join(f"f.dispatchEvent(new Event('{event}', {{bubbles: true}}));" for event in ("input", "change"))
        field = f"document.querySelector({json.dumps(selector)})"
        self.run(f"(() => {{ const f = {field}; f.value = {json.dumps(text)}; {told} }})()")

    def picture(self, path, *, full=False):
        """Screenshot."""
        found = self.send("Page.captureScreenshot", format="png", captureBeyondViewport=full)
        Path(path).write_bytes(base64.b64decode(found["data"]))

    def close(self):
        """End the browser."""
        os.close(self._to)
        os.close(self._from)
        self.process.terminate()
        self.process.wait(20)
