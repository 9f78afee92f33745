"""Who asks: a token wherever it is shown, an address for strangers; proxies; tokens that change."""
import contextlib
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import time

import bounced_pb2
import pytest
from conftest import ANSWER_S, Daemon, read_all, reload
from ws_client import WebSocket

ONE, OTHER = "one-one-one-one-one", "other-other-other-o"
TOKENS = f"{ONE} name=one\n{OTHER} name=other role=edit\n"
STATS = bounced_pb2.Envelope(techniques=bounced_pb2.Techniques())


def bearer(token):
    return {"Authorization": "Bearer " + token}


def write(path, text):
    path.write_text(text)
    path.chmod(0o600)
    return str(path)


@pytest.fixture
def begin(start, tmp_path):
    """A daemon with these tokens, and its token file."""
    def go(*options, tokens=TOKENS, **keywords):
        file = tmp_path / "tokens"
        return start("--token-file", write(file, tokens), *options, **keywords), file
    return go


def statuses(daemon, count, headers, path="/v1/techniques"):
    return [daemon.request("GET", path, headers=headers)[0] for _ in range(count)]


# --- whose requests they are ------------------------------------------------------------------


def test_a_token_has_its_own_rate_whatever_else_its_address_does(begin):
    daemon, _ = begin("--limit", "requests_per_second=3")
    assert set(statuses(daemon, 20, {})) == {401, 429}  # a stranger
    assert statuses(daemon, 4, bearer(ONE)) == [200] * 4
    assert 429 in statuses(daemon, 20, bearer(ONE))
    assert statuses(daemon, 4, bearer(OTHER)) == [200] * 4


def test_a_token_is_one_client_on_every_face(begin):
    daemon, _ = begin("--limit", "requests_per_second=5")
    client = daemon.framed(tcp=True, hello=False)
    client.hello(ONE)
    assert 429 in statuses(daemon, 20, bearer(ONE))
    assert client.ask(STATS)[0].error.details.field == "requests_per_second"
    client.close()


def test_guesses_have_a_bucket_of_their_own(begin):
    daemon, _ = begin("--limit", "requests_per_second=3", "--limit", "failed_logins_per_minute=6")
    for path in ("/v1/techniques", "/readyz"):  # by whatever door
        got = statuses(daemon, 10, bearer("wrong-wrong-wrong-w"), path)
        assert got.count(401) == (3 if path == "/v1/techniques" else 0) and set(got) <= {401, 429}
    status, _, text = daemon.request("GET", "/readyz", headers=bearer("x"))
    assert json.loads(text)["details"]["field"] == "failed_logins_per_minute"
    client = daemon.framed(tcp=True, hello=False)
    assert client.hello("wrong").error.details.field == "failed_logins_per_minute"
    # Neither who has a token nor who asks without one pays for it.
    assert statuses(daemon, 4, bearer(ONE)) == [200] * 4
    assert statuses(daemon, 4, {}) == [401] * 4


def test_connections_count_for_the_token(begin):
    daemon, _ = begin("--limit", "connections_per_client=2")
    held = []
    for token in (ONE, ONE, OTHER, OTHER):  # of one address
        client = daemon.framed(tcp=True, hello=False)
        assert client.hello(token).HasField("hello_reply")
        held.append(client)
    client = daemon.framed(tcp=True, hello=False)
    assert client.hello(ONE).error.details.field == "connections_per_client"
    assert daemon.request("GET", "/v1/techniques", headers=bearer(ONE))[0] == 429
    held.pop(0).close()
    time.sleep(0.2)
    assert daemon.request("GET", "/v1/techniques", headers=bearer(ONE))[0] == 200
    for client in held:
        client.close()


def test_strangers_of_one_address_share_it(begin):
    daemon, _ = begin("--limit", "connections_per_client=2")
    with contextlib.ExitStack() as held:
        for _ in range(2):
            held.enter_context(contextlib.closing(daemon.framed(tcp=True, hello=False)))
        time.sleep(0.1)
        with contextlib.closing(daemon.framed(tcp=True, hello=False)) as third:
            assert read_all(third.sock) == b""


def test_one_connection_of_several_tokens(begin):
    """As a proxy reuses it: each request is its token's."""
    daemon, _ = begin("--limit", "requests_per_second=2")
    ask = b"GET /v1/techniques HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer %s\r\n\r\n"
    with socket.create_connection(("127.0.0.1", daemon.port), ANSWER_S) as sock:
        sock.sendall((ask % ONE.encode()) * 20 + (ask % OTHER.encode()) * 3 + get(OTHER))
        got = re.findall(rb"HTTP/1.1 (\d+)", read_all(sock))
    assert len(got) == 24 and b"429" in got[:20] and got[20:] == [b"200"] * 4


# --- proxies ------------------------------------------------------------------------------------

SIGNATURE = b"\r\n\r\n\0\r\nQUIT\n"


def header(source="192.0.2.7", command=0x21, family=None, extra=b"", length=None, signature=SIGNATURE):
    kind = socket.AF_INET6 if ":" in source else socket.AF_INET
    addresses = socket.inet_pton(kind, source) + socket.inet_pton(kind, "::1" if ":" in source else "127.0.0.1")
    body = addresses + struct.pack(">HH", 1234, 80) + extra
    family = family if family is not None else 0x21 if ":" in source else 0x11
    return signature + struct.pack(">BBH", command, family, len(body) if length is None else length) + body


def get(token=ONE):
    return (b"GET /v1/techniques HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer " + token.encode()
            + b"\r\nConnection: close\r\n\r\n")


def status(daemon, data):
    return daemon.raw(data)[9:12]


@pytest.fixture
def proxied(tmp_path):
    """A daemon whose proxies are all of this machine; asked for its health by nobody."""
    daemons = []

    def go(*options, proxy="127.0.0.0/8"):
        (tmp_path / "d").mkdir()
        tokens = write(tmp_path / "tokens", TOKENS)
        daemons.append(Daemon(tmp_path / "d", "--token-file", tokens, "--proxy", proxy, *options))
        return daemons[-1]
    yield go
    for daemon in daemons:
        daemon.stop()


@pytest.mark.parametrize("first", [
    header(), header("2001:db8::1"), header(extra=b"\x04\x00\x03abc"), header(extra=b"x" * 4000),
    header(command=0x20), header(command=0x20, family=0), header(family=0),
    header(family=0x31, extra=b"x" * 204),
], ids=["v4", "v6", "tlv", "long_tlv", "local", "local_unspec", "unspec", "unix"])
def test_headers_that_are_read(proxied, first):
    daemon = proxied()
    assert status(daemon, first + get()) == b"200"
    with socket.create_connection(("127.0.0.1", daemon.port), ANSWER_S) as sock:  # byte by byte
        for byte in first[:60]:
            sock.sendall(bytes([byte]))
        sock.sendall(first[60:] + get())
        assert read_all(sock)[9:12] == b"200"


@pytest.mark.parametrize("first", [
    b"", b"PROXY TCP4 192.0.2.7 127.0.0.1 1 2\r\n", header(command=0x11), header(command=0x22),
    header(family=0x12), header(family=0x41), header(family=0x10), header(length=11), header("::2", length=35),
    header(length=4097), header(signature=SIGNATURE[:-1] + b"X"),
], ids=["none", "v1", "version", "command", "datagram", "family", "no_transport", "short", "short_v6", "long",
        "signature"])
def test_headers_that_are_not(proxied, first):
    daemon = proxied()
    assert daemon.raw(first + get()) == b""
    log = daemon.log_path.read_text()
    assert "proxy:127.0.0.1: a proxy's connection" in log and "closed" in log
    assert status(daemon, header() + get()) == b"200"


def test_a_header_that_does_not_come(proxied):
    daemon = proxied("--limit", "header_seconds=1")
    with socket.create_connection(("127.0.0.1", daemon.port), 10) as sock:
        sock.sendall(header()[:20])
        assert read_all(sock) == b""
    assert "header_seconds" in daemon.log_path.read_text()


def test_strangers_are_told_apart_behind_a_proxy(proxied):
    daemon = proxied("--limit", "requests_per_second=3", "--limit", "connections_per_client=2")
    ask = get().replace(b"Authorization", b"X").replace(b"Connection: close\r\n", b"")
    # One net of IPv6 is one stranger, another is another; IPv4 in IPv6 is IPv4.
    for source, same, other in (("192.0.2.7", "::ffff:192.0.2.7", "192.0.2.8"),
                                ("2001:db8:0:1::1", "2001:db8:0:1:ffff::9", "2001:db8:0:2::1")):
        got = re.findall(rb"HTTP/1.1 (\d+)", daemon.raw(header(source) + ask * 20 + get()))
        assert got[0] == b"401" and b"429" in got, source
        got = [re.findall(rb"HTTP/1.1 (\d+)", daemon.raw(header(address) + ask * 3 + get()))
               for address in (same, other)]
        assert b"429" in got[0] and b"429" not in got[1], source
    assert status(daemon, header("192.0.2.7") + get(OTHER)) == b"200"
    held = [socket.create_connection(("127.0.0.1", daemon.port), ANSWER_S) for _ in range(2)]
    for sock in held:
        sock.sendall(header("192.0.2.9"))
    time.sleep(0.2)
    assert daemon.raw(header("192.0.2.9") + get()) == b""
    assert status(daemon, header("192.0.2.10") + get(OTHER)) == b"200"
    for sock in held:
        sock.close()


def test_framed_connections_too(proxied):
    daemon = proxied()
    with contextlib.closing(daemon.framed(tcp=True, hello=False)) as client:
        client.sock.sendall(header())
        assert client.hello(ONE).HasField("hello_reply")


def test_a_unix_socket_of_a_proxy(tmp_path):
    (tmp_path / "d").mkdir()
    daemon = Daemon(tmp_path / "d", "--token-file", write(tmp_path / "tokens", TOKENS), "--proxy",
                    f"unix:{tmp_path}/d/s.sock")
    client = daemon.framed(hello=False)
    client.sock.sendall(header(command=0x20))
    # The socket's user is the proxy, whom nobody asked: rights come by token alone.
    assert client.hello().error.code == "unauthorized"
    client = daemon.framed(hello=False)
    client.sock.sendall(header())
    assert client.hello(ONE).HasField("hello_reply")
    client.close()
    assert status(daemon, get()) == b"200"  # TCP is not named
    daemon.stop()


def test_nobody_else_has_a_header(begin):
    daemon, _ = begin("--proxy", "192.0.2.1", "--proxy", "2001:db8::/32")
    assert status(daemon, header() + get()) == b"400"
    client = daemon.framed(tcp=True, hello=False)
    client.sock.sendall(header())
    assert client.receive()[0].error.code == "limit"


@pytest.mark.parametrize("words, needle", [
    (["--proxy", "127.0.0.1"], "--token-file"), (["--proxy", "nowhere"], "nowhere"), (["--proxy", "1.2.3.4/33"], "33"),
    (["--proxy", "::/129"], "129"), (["--proxy", "1.2.3.4/"], "1.2.3.4/"), (["--proxy", "unix:"], "unix:"),
    (["--proxxy", "1"], 'did you mean "proxy"'),
])
def test_proxies_that_make_no_sense(tmp_path, words, needle):
    result = subprocess.run([os.environ["BD_BOUNCED"], "--http", "127.0.0.1:0", "--data", str(tmp_path / "d"), *words],
                            capture_output=True, text=True, timeout=30)
    assert result.returncode == 2 and needle in result.stderr, result.stderr


# --- SIGHUP -------------------------------------------------------------------------------------


def test_a_token_that_is_gone_ends_what_is_its(begin):
    daemon, file = begin()
    clients = {token: daemon.framed(tcp=True, hello=False) for token in (ONE, OTHER)}
    for token, client in clients.items():
        client.hello(token)
    socks = {token: WebSocket(daemon, headers=bearer(token)) for token in (ONE, OTHER)}
    idle = socket.create_connection(("127.0.0.1", daemon.port), ANSWER_S)
    idle.sendall(get(OTHER).replace(b"Connection: close\r\n", b""))
    assert idle.recv(4096).startswith(b"HTTP/1.1 200")
    cookie = daemon.request("POST", "/v1/session", "{}", {**bearer(OTHER), "Content-Type": "application/json"})[1]
    cookie = {"Cookie": cookie["Set-Cookie"].split(";")[0]}
    assert daemon.request("GET", "/v1/techniques", headers=cookie)[0] == 200

    new = "third-third-third-third"
    write(file, f"# shorter\n{ONE} name=one\n{new}\n")
    assert "3 connections closed" in reload(daemon)
    assert clients[OTHER].receive()[0].error.code == "unauthorized"
    assert clients[OTHER].sock.recv(1) == b""
    read_all(idle)  # to its end
    assert socks[OTHER].receive()[0].error.code == "unauthorized"
    assert statuses(daemon, 1, cookie) == statuses(daemon, 1, bearer(OTHER)) == [401]
    assert statuses(daemon, 1, bearer(new)) == statuses(daemon, 1, bearer(ONE)) == [200]
    assert clients[ONE].ask(STATS)[0].HasField("techniques_reply")
    assert socks[ONE].ask(STATS)[0].HasField("techniques_reply")
    idle.close()
    for client in (clients[ONE], socks[ONE]):
        client.close()


def test_a_session_that_waits_is_gone_with_its_token(begin):
    daemon, file = begin()
    sock = WebSocket(daemon, headers=bearer(OTHER), hello=False)
    ask = bounced_pb2.Envelope(hello=bounced_pb2.Hello(resume=""))
    token = sock.ask(ask)[0].hello_reply.session
    sock.socket.transport.abort()
    time.sleep(0.2)
    write(file, f"{ONE} name=one\n")
    reload(daemon)
    write(file, TOKENS)
    reload(daemon)
    sock = WebSocket(daemon, headers=bearer(OTHER), hello=False)
    assert not sock.ask(bounced_pb2.Envelope(hello=bounced_pb2.Hello(resume=token)))[0].hello_reply.resumed
    sock.close()


def test_other_rights_begin_anew(begin):
    daemon, file = begin()
    client = daemon.framed(tcp=True, hello=False)
    client.hello(OTHER)
    write(file, TOKENS.replace("role=edit", "role=read"))
    assert "1 connections closed" in reload(daemon)
    assert client.receive()[0].error.code == "unauthorized"
    client = daemon.framed(tcp=True, hello=False)
    client.hello(OTHER)
    write(file, TOKENS.replace("role=edit", "role=read max_jobs=3"))  # a quota is no other right
    assert "0 connections closed" in reload(daemon)
    assert client.ask(STATS)[0].HasField("techniques_reply")
    client.close()


@pytest.mark.parametrize("text, needle", [
    (f"{ONE} name=one\n{OTHER} role=emperor\n", "line 2"), ("", "no entry"), ("short\n", "line 1"),
    (f"{ONE}\n\n{ONE}\n", "line 3"),
])
def test_a_bad_token_file_changes_nothing(begin, text, needle):
    daemon, file = begin()
    client = daemon.framed(tcp=True, hello=False)
    client.hello(ONE)
    write(file, text)
    log = reload(daemon, "nothing is changed")
    assert needle in log and log.count("\n") == 1
    file.unlink()
    assert "tokens" in reload(daemon, "nothing is changed")
    assert client.ask(STATS)[0].HasField("techniques_reply")
    assert statuses(daemon, 1, bearer(OTHER)) == [200]
    client.close()


def test_a_config_file_is_read_again(begin, tmp_path):
    config = tmp_path / "conf"
    config.write_text("limit requests_per_second=100\npublic-name first.example\n")
    daemon, _ = begin("--config", str(config))
    config.write_text("limit requests_per_second=2\nlimit scenes=7\npublic-name second.example\ndevice egl:3\n")
    log = reload(daemon)
    assert "limit scenes" in log and "device is another, which needs a restart" in log
    hello = daemon.framed().hello()
    limits = {pair.key: pair.value for pair in hello.hello_reply.limits}
    assert limits["requests_per_second"] == "2" and limits["scenes"] == "256"
    hosts = [daemon.request("GET", "/healthz", headers={"Host": f"{name}.example"})[0] for name in ("first", "second")]
    assert hosts == [403, 200]
    assert 429 in statuses(daemon, 20, bearer(ONE))
    config.write_text("limit idle_seconds=5\n\nlimit requests_per_second=0\n")
    log = reload(daemon, "nothing is changed")
    assert f"{config}, line 3: limit requests_per_second" in log and log.count("\n") == 1


def test_a_reload_lets_no_proxy_in_where_there_are_no_tokens(start, tmp_path):
    config = tmp_path / "conf"
    config.write_text("")
    daemon = start("--config", str(config))
    config.write_text("proxy 127.0.0.1\n")
    assert "--token-file" in reload(daemon, "nothing is changed")
    config.write_text("listen tcp:127.0.0.1:0\nlimit blob_seconds=999\n")
    log = reload(daemon)
    assert "listen is another" in log and "blob_seconds" not in log


def test_sighups_in_a_row(begin):
    daemon, file = begin()
    for number in range(20):
        write(file, TOKENS + f"more-more-more-more-{number}\n")
        daemon.process.send_signal(signal.SIGHUP)
        assert statuses(daemon, 1, bearer(ONE)) == [200]
    reload(daemon)
    assert statuses(daemon, 1, bearer("more-more-more-more-19")) == [200]
    assert statuses(daemon, 1, bearer("more-more-more-more-18")) == [401]


# --- a real proxy ---------------------------------------------------------------------------------

CONFIG = os.path.join(os.path.dirname(__file__), "../../deploy/haproxy.cfg")


@pytest.mark.skipif(not shutil.which("haproxy") or not shutil.which("openssl"), reason="there is no haproxy here")
def test_haproxy_as_we_deliver_it(start, tmp_path):
    tokens = write(tmp_path / "tokens", TOKENS)
    daemon = start("--token-file", tokens, "--proxy", "127.0.0.2", "--public-name", "bounced.example")
    pem = tmp_path / "bounced.pem"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj",
                    "/CN=bounced.example", "-keyout", str(tmp_path / "key"), "-out", str(tmp_path / "crt")],
                   check=True, capture_output=True)
    pem.write_bytes((tmp_path / "crt").read_bytes() + (tmp_path / "key").read_bytes())
    with socket.socket() as a, socket.socket() as b:
        a.bind(("127.0.0.1", 0)), b.bind(("127.0.0.1", 0))
        plain, tls = a.getsockname()[1], b.getsockname()[1]
    text = open(CONFIG).read().replace("bind :80", f"bind 127.0.0.1:{plain}").replace(
        "bind :443", f"bind 127.0.0.1:{tls}").replace("/etc/haproxy/bounced.pem", str(pem)).replace(
        "127.0.0.1:7480", f"127.0.0.1:{daemon.port}")
    (tmp_path / "cfg").write_text(text)
    check = subprocess.run(["haproxy", "-c", "-f", str(tmp_path / "cfg")], capture_output=True, text=True)
    assert check.returncode == 0, check.stdout + check.stderr
    assert "WARNING" not in check.stderr + check.stdout, check.stderr + check.stdout
    import http.client
    import ssl
    context = ssl._create_unverified_context()

    def ask(**headers):
        connection = http.client.HTTPSConnection("127.0.0.1", tls, timeout=ANSWER_S, context=context)
        with contextlib.closing(connection):
            connection.request("GET", "/v1/techniques", headers={"Host": "bounced.example", **headers})
            return connection.getresponse().status

    proxy = subprocess.Popen(["haproxy", "-f", str(tmp_path / "cfg")], stderr=subprocess.DEVNULL)
    try:
        until = time.time() + ANSWER_S
        while time.time() < until:
            with contextlib.suppress(OSError):
                if ask() == 401:
                    break
            time.sleep(0.05)
        assert ask() == 401 and ask(**bearer(ONE)) == 200
        got = [ask(**bearer("wrong-wrong-wrong")) for _ in range(40)]
        assert got[0] == 401 and got[-1] == 429
        assert daemon.request("GET", "/v1/techniques", headers=bearer(ONE))[0] == 200  # without a proxy, as before
    finally:
        proxy.terminate()
        proxy.wait(10)
