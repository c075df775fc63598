"""A headless Chromium for tests, driven by chromedriver over WebDriver (W3C), with nothing but the standard library."""

from __future__ import annotations

import base64
import json
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request
from contextlib import contextmanager

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
DRIVER = shutil.which("chromedriver")
MISSING = "" if CHROMIUM and DRIVER else "needs chromium and chromedriver (Debian: chromium, chromium-driver)"
START_S = 30.0
_LOCAL = urllib.request.build_opener(urllib.request.ProxyHandler({}))


class Browser:
    """One window."""

    def __init__(self, base):
        self._base = base

    def call(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self._base + path, data, {"Content-Type": "application/json"}, method=method)
        with _LOCAL.open(request, timeout=60) as answer:
            return json.load(answer)["value"]

    def open(self, path):
        """Open a file and wait until its script has finished."""
        self.call("POST", "/url", {"url": path.resolve().as_uri()})
        self.wait("document.body.dataset.ready === 'yes'")

    def run(self, expression):
        return self.call("POST", "/execute/sync", {"script": f"return {expression};", "args": []})

    def wait(self, expression, most_s=30.0):
        deadline = time.monotonic() + most_s
        while not self.run(expression):
            assert time.monotonic() < deadline, f"never true: {expression}; console: {self.log('browser')}"
            time.sleep(0.05)

    def log(self, kind):
        return self.call("POST", "/se/log", {"type": kind})

    def screenshot(self, path):
        path.write_bytes(base64.b64decode(self.call("GET", "/screenshot")))

    def mouse(self, *steps):
        """Move the mouse through points (x, y) of the window; "down" and "up" press and release its button."""
        actions = []
        for step in steps:
            if isinstance(step, str):
                actions.append({"type": f"pointer{step.capitalize()}", "button": 0})
            else:
                x, y = map(round, step)
                actions.append({"type": "pointerMove", "duration": 60, "x": x, "y": y, "origin": "viewport"})
        pointer = {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions}
        self.call("POST", "/actions", {"actions": [pointer]})


@contextmanager
def chromium(width=1400, height=1000):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    driver = subprocess.Popen([DRIVER, f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    root = Browser(f"http://127.0.0.1:{port}")
    try:
        options = {
            "binary": CHROMIUM,
            "args": ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", f"--window-size={width},{height}"],
        }
        always = {
            "browserName": "chrome",
            "goog:chromeOptions": options,
            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"},
        }
        deadline = time.monotonic() + START_S
        while True:
            try:
                session = root.call("POST", "/session", {"capabilities": {"alwaysMatch": always}})
                break
            except (urllib.error.URLError, ConnectionError):
                if time.monotonic() > deadline or driver.poll() is not None:
                    raise
                time.sleep(0.1)
        browser = Browser(f"http://127.0.0.1:{port}/session/{session['sessionId']}")
        try:
            yield browser
        finally:
            browser.call("DELETE", "")
    finally:
        driver.terminate()
        driver.wait(10)
