"""Chromium without a window, driven over its DevTools protocol.

The protocol goes through two pipes (--remote-debugging-pipe, JSON ended by a zero byte), so that
nothing listens and no package is needed beside the browser.
"""

import base64
import contextlib
import json
import os
import shutil
import subprocess
import tempfile
import threading
import time

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync",
         "--disable-extensions", "--hide-scrollbars", "--mute-audio", "--remote-debugging-pipe")


class Browser:
    """One process; pages are made in it."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="bounced-web-")
        to_read, self.to_browser = os.pipe()
        self.from_browser, to_write = os.pipe()
        # The browser wants its pipes as descriptors 3 and 4.
        command = ("exec", CHROMIUM, *FLAGS, "--user-data-dir=" + self.folder, "about:blank")
        words = " ".join(f"'{word}'" if word != "exec" else word for word in command)
        self.process = subprocess.Popen(
            ["/bin/bash", "-c", f"{words} 3<&{to_read} 4>&{to_write}"], pass_fds=(to_read, to_write),
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_read)
        os.close(to_write)
        self.lock = threading.Condition()
        self.answers, self.listeners, self.last_id = {}, [], 0
        self.is_closed = False
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        held = b""
        while piece := os.read(self.from_browser, 1 << 16):
            *whole, held = (held + piece).split(b"\0")
            for text in whole:
                self._take(json.loads(text))
        with self.lock:
            self.is_closed = True
            self.lock.notify_all()

    def _take(self, message):
        with self.lock:
            if "id" in message:
                self.answers[message["id"]] = message
                self.lock.notify_all()
            else:
                for listener in self.listeners:
                    listener(message)

    def ask(self, method, session=None, timeout_s=30, **params):
        with self.lock:
            self.last_id += 1
            wanted = self.last_id
        message = {"id": wanted, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        os.write(self.to_browser, json.dumps(message).encode() + b"\0")
        with self.lock:
            if not self.lock.wait_for(lambda: wanted in self.answers or self.is_closed, timeout_s):
                raise TimeoutError(method)
            answer = self.answers.pop(wanted, {"error": {"message": "the browser is gone"}})
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def close(self):
        with contextlib.suppress(Exception):
            self.ask("Browser.close", timeout_s=5)
        try:
            self.process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


class Page:
    """A tab, with cookies of its own and all that it complained of."""

    def __init__(self, browser, width=1280, height=800, scale=1, is_dark=True, is_touch=False):
        self.browser = browser
        self.faults = []  # console errors, exceptions, violations of the policy
        self.allowed = ()  # words of those that a test brings about on purpose
        self.context = browser.ask("Target.createBrowserContext")["browserContextId"]
        target = browser.ask("Target.createTarget", url="about:blank", browserContextId=self.context)
        self.target = target["targetId"]
        attached = browser.ask("Target.attachToTarget", targetId=self.target, flatten=True)
        self.session = attached["sessionId"]
        browser.listeners.append(self._on_event)
        for domain in ("Page", "Runtime", "Log", "Network", "DOM"):
            self.ask(domain + ".enable")
        self.scale, self.is_touch = scale, is_touch
        self.resize(width, height)
        if is_touch:
            self.ask("Emulation.setTouchEmulationEnabled", enabled=True)
        self.ask("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if is_dark else "light"}])

    def _on_event(self, message):
        if message.get("sessionId") != self.session:
            return
        method, params = message["method"], message["params"]
        if method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.faults.append(details.get("exception", {}).get("description") or details["text"])
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.faults.append(" ".join(str(arg.get("value")) for arg in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.faults.append(params["entry"]["text"] + " " + params["entry"].get("url", ""))

    def ask(self, method, **params):
        return self.browser.ask(method, session=self.session, **params)

    def resize(self, width, height):
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=height,
                 deviceScaleFactor=self.scale, mobile=self.is_touch)

    def open(self, url):
        self.ask("Page.navigate", url=url)
        self.until("document.readyState === 'complete' && location.href !== 'about:blank'")

    def run(self, expression):
        """The value of an expression; a promise is waited for."""
        answer = self.ask("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"]["exception"].get("description", expression))
        return answer["result"].get("value")

    def until(self, expression, timeout_s=60):
        """Waits until the expression is true, and returns what it is."""
        end = time.monotonic() + timeout_s
        value = None
        while time.monotonic() < end:
            with contextlib.suppress(RuntimeError):  # in the middle of a navigation
                value = self.run(expression)
                if value:
                    return value
            time.sleep(0.05)
        raise AssertionError(f"not within {timeout_s} s: {expression} ({value}); faults: {self.faults}; "
                             f"toasts: {self.run('document.getElementById(`toasts`)?.textContent')}")

    def centre(self, selector):
        return self.run(f"(() => {{ const b = document.querySelector({json.dumps(selector)})"
                        ".getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()")

    def mouse(self, kind, x, y, button="left", **more):
        buttons = {"mouseReleased": 0}.get(kind, {"left": 1, "right": 2, "none": 0}[button])
        self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=buttons,
                 clickCount=1 if kind != "mouseMoved" else 0, **more)

    def drag(self, start, end, steps=8, button="left", pause_s=0.02):
        self.mouse("mouseMoved", *start, button="none")
        self.mouse("mousePressed", *start, button=button)
        for i in range(1, steps + 1):
            share = i / steps
            self.mouse("mouseMoved", start[0] + (end[0] - start[0]) * share,
                       start[1] + (end[1] - start[1]) * share, button=button)
            time.sleep(pause_s)
        self.mouse("mouseReleased", *end, button=button)

    def swipe(self, start, end, steps=12):
        """One finger."""
        for i in range(steps + 1):
            points = [{"x": start[0] + (end[0] - start[0]) * i / steps, "y": start[1] + (end[1] - start[1]) * i / steps}]
            self.ask("Input.dispatchTouchEvent", type="touchMove" if i else "touchStart", touchPoints=points)
            time.sleep(0.02)
        self.ask("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def click(self, selector):
        self.run(f"document.querySelector({json.dumps(selector)}).scrollIntoView({{block: 'nearest'}})")
        x, y = self.centre(selector)
        self.mouse("mouseMoved", x, y, button="none")
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def key(self, key, modifiers=0, code=None):
        for kind in ("keyDown", "keyUp"):
            more = {"text": key} if kind == "keyDown" and len(key) == 1 else {}
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, modifiers=modifiers,
                     code=code or key, **more)

    def choose_files(self, selector, paths):
        root = self.ask("DOM.getDocument")["root"]["nodeId"]
        node = self.ask("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
        self.ask("DOM.setFileInputFiles", nodeId=node, files=[str(path) for path in paths])

    def downloads_to(self, folder):
        self.browser.ask("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder),
                         browserContextId=self.context)

    def drop_files(self, selector, paths):
        """The browser loses a synthetic drag now and then, before the page hears of it: then again."""
        x, y = self.centre(selector)
        data = {"items": [], "files": [str(path) for path in paths], "dragOperationsMask": 1}
        self.run("(() => { window.dropsHeard = 0; "
                 "addEventListener('drop', () => window.dropsHeard++, {capture: true, once: true}); })()")
        for _ in range(5):
            for kind in ("dragEnter", "dragOver", "drop"):
                self.ask("Input.dispatchDragEvent", type=kind, x=x, y=y, data=data)
            if self.run("window.dropsHeard"):
                return
        raise AssertionError("the browser delivers no drop")

    def set(self, selector, value, event="change"):
        """Of a select, to an option that it has by then."""
        self.until(f"(() => {{ const e = document.querySelector({json.dumps(selector)}); "
                   f"return !e.options || [...e.options].some(one => one.value === {json.dumps(str(value))}); }})()")
        self.run(f"(() => {{ const e = document.querySelector({json.dumps(selector)}); "
                 f"e.value = {json.dumps(value)}; "
                 f"e.dispatchEvent(new Event({json.dumps(event)}, {{bubbles: true}})); }})()")

    def pixels(self):
        """The picture's pixels by a grid of 32 by 32: [[r, g, b], ...]."""
        return self.run("""(() => {
            const from = document.getElementById('picture');
            const to = document.createElement('canvas');
            to.width = to.height = 32;
            const context = to.getContext('2d');
            context.drawImage(from, 0, 0, 32, 32);
            const data = context.getImageData(0, 0, 32, 32).data;
            return Array.from({length: 1024}, (_, i) => [...data.slice(4 * i, 4 * i + 3)]);
        })()""")

    def screenshot(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"]))

    def close(self):
        self.browser.listeners.remove(self._on_event)
        self.browser.ask("Target.disposeBrowserContext", browserContextId=self.context)


def difference(a, b):
    """Mean of the absolute differences of two lists of pixels, 0 to 255."""
    total = sum(abs(x - y) for p, q in zip(a, b) for x, y in zip(p, q))
    return total / (3 * len(a))
