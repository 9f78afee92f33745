"""The stress test's client of the HTTP transport."""
import random
import socket
import threading
import traceback

from stress_clients import PATIENCE_S, SEED


class HttpClient(threading.Thread):
    """One request a connection, some of them left before their end."""

    def __init__(self, world, daemon):
        super().__init__(daemon=True)
        self.world, self.bounced = world, daemon
        self.random = random.Random(f"{SEED}/{world.phase}/http")

    def run(self):
        try:
            while not self.world.is_over:
                scene = self.random.choice(list(self.world.pasts))
                getattr(self, self.random.choice(["picture", "edit", "look_away"]))(scene)
        except AssertionError:
            self.world.fail(f"http: {traceback.format_exc()}")
        except Exception:
            if not self.world.is_ending:
                self.world.fail(f"http: {traceback.format_exc()}")

    def picture(self, scene):
        path = f"/v1/scenes/{scene}/frame.png?size=16x16&deadline_ms=200"
        status, _, image = self.bounced.request("GET", path, timeout=PATIENCE_S)
        assert status in (200, 429, 504) or self.world.is_ending, (status, image)
        assert (status == 200) == image.startswith(b"\x89PNG")

    def edit(self, scene):
        number = self.world.next_edit()
        edit_id = f"http-{number}"
        status, reply = self.bounced.json("POST", f"/v1/scenes/{scene}/edits", {
            "ops": [{"set_light": {"light": 0, "intensity": number}}], "client_edit_id": edit_id,
            "message": str(number)})
        assert status == 200 or self.world.is_ending, (status, reply)
        if status == 200:
            self.world.pasts[scene].tell(int(reply["revision"]), reply["hash"], edit_id)

    def look_away(self, scene):
        what = self.random.choice(["stream.mjpeg?size=16x16", "events", "frame.png?size=64x64"])
        with socket.create_connection(("127.0.0.1", self.bounced.port), PATIENCE_S) as sock:
            sock.sendall(f"GET /v1/scenes/{scene}/{what} HTTP/1.1\r\n"
                         "Host: 127.0.0.1\r\n\r\n".encode())
            if self.random.random() < .7:
                sock.recv(2000)
