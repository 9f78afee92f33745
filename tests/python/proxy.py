"""A connection that can be cut: a small proxy between a client and a daemon's TCP port."""
import re
import socket
import threading


class Proxy:
    """`address` leads to `target` ("tcp:HOST:PORT" or "http://HOST:PORT").

    cut()      both sides of every connection are gone, without a goodbye; new ones are taken, or
               refused while `is_shut`
    deaf       what the client sends is thrown away: it is lost on its way
    mute       what the daemon sends is
    cut_after  cuts once so many more bytes came from the client; None: never
    """

    def __init__(self, target):
        scheme, host, port = re.fullmatch(r"(tcp:|http://)(.*):(\d+)", target).groups()
        self._target = host, int(port)
        self._server = socket.create_server((host, 0))
        self.address = f"{scheme}{host}:{self._server.getsockname()[1]}"
        self.deaf = self.mute = self.is_shut = False
        self.cut_after = None
        self.taken = 0
        self._open = []
        self._lock = threading.Lock()
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._server.close()
        self.cut()

    def cut(self):
        with self._lock:
            self.deaf = self.mute = False
            gone, self._open = self._open, []
        for sock in gone:
            try:
                sock.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
            sock.close()

    def _accept(self):
        while True:
            try:
                client, _ = self._server.accept()
            except OSError:
                return
            if self.is_shut:
                client.close()
                continue
            self.taken += 1
            daemon = socket.create_connection(self._target)
            with self._lock:
                self._open += [client, daemon]
            for words in ((client, daemon, True), (daemon, client, False)):
                threading.Thread(target=self._pump, args=words, daemon=True).start()

    def _pump(self, source, sink, is_client):
        try:
            while data := source.recv(1 << 16):
                if is_client and self.cut_after is not None:
                    self.cut_after -= len(data)
                    if self.cut_after < 0:
                        self.cut_after = None
                        break
                if not (self.deaf if is_client else self.mute):
                    sink.sendall(data)
        except OSError:
            pass
        self._end(source, sink)

    def _end(self, *socks):
        """One side ended: so does the other."""
        with self._lock:
            mine = [sock for sock in socks if sock in self._open]
            self._open = [sock for sock in self._open if sock not in mine]
        for sock in mine:
            try:
                sock.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
            sock.close()
