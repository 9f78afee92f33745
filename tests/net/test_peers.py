"""Users of the machine on a Unix socket: who gets in without a token, and with which rights.

What needs another user runs as root alone: a child becomes that user, connects, and hands its
socket over; the system tells the daemon who connected.
"""
import contextlib
import os
import socket
import stat

import bounced_pb2 as pb
import pytest
from conftest import SCENES, Framed, blob_name, reload
from test_limits import run

TOKEN = "correct-horse-battery"
STRANGER, GROUP, BESIDES = 54321, 54322, 54323
GLB = (SCENES / "cornell.glb").read_bytes()
needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")


def tokens(tmp_path, text):
    file = tmp_path / "users"
    file.write_text(text)
    file.chmod(0o600)
    return "--token-file", str(file)


def _connect_as(uid, gid, groups, folder, out):
    os.chdir(folder)  # whose parents are root's alone
    os.setgroups(groups)
    os.setgid(gid)
    os.setuid(uid)
    with socket.socket(socket.AF_UNIX) as sock:
        sock.connect("s.sock")
        socket.send_fds(out, [b"x"], [sock.fileno()])


def connect_as(daemon, uid=STRANGER, gid=GROUP, groups=(BESIDES,)):
    """A connection of that user; PermissionError if the socket's file keeps it out."""
    ours, theirs = socket.socketpair()
    child = os.fork()
    if child == 0:
        status = 1
        with contextlib.suppress(BaseException):
            try:
                _connect_as(uid, gid, list(groups), daemon.folder, theirs)
                status = 0
            except PermissionError:
                status = 13
        os._exit(status)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status == 13:
        raise PermissionError
    assert status == 0
    sock = socket.socket(fileno=socket.recv_fds(ours, 1, 1)[1][0])
    sock.settimeout(10)
    ours.close()
    theirs.close()
    return Framed(sock)


def ask(client, **bodies):
    return client.ask(pb.Envelope(**bodies))[0]


def add(client, name):
    client.put_blob(GLB)
    return ask(client, scene_add=pb.SceneAdd(blob=blob_name(GLB), name=name))


# --- the socket's file --------------------------------------------------------------------------


def test_the_socket_is_for_its_own_user_at_first(start):
    daemon = start()
    assert stat.S_IMODE(os.stat(daemon.socket_path).st_mode) == 0o600
    client = daemon.framed()
    assert ask(client, stats=pb.Stats()).HasField("stats_reply")
    client.close()


@pytest.mark.parametrize("words", [("--socket-mode", "0660"), ("--socket-mode=666",)])
def test_the_sockets_mode(start, words):
    daemon = start(*words)
    mode = stat.S_IMODE(os.stat(daemon.socket_path).st_mode)
    assert mode == int(words[-1].removeprefix("--socket-mode="), 8)


@needs_root
def test_the_sockets_group(start):
    daemon = start("--socket-mode", "0660", "--socket-group", str(GROUP))
    assert os.stat(daemon.socket_path).st_gid == GROUP


@pytest.mark.parametrize("words,needle", [
    (["--socket-mode", "0777"], "socket-mode"), (["--socket-mode", "0060"], "socket-mode"),
    (["--socket-mode", "rw"], "socket-mode"), (["--socket-mode", "0661"], "socket-mode"),
    (["--socket-group", "no-such-group"], "no-such-group"),
])
def test_bad_modes_and_groups(words, needle):
    result = run(*words)
    assert result.returncode == 2 and needle in result.stderr


@needs_root
def test_the_files_mode_keeps_others_out(start):
    with pytest.raises(PermissionError):
        connect_as(start())


# --- who is there -------------------------------------------------------------------------------


@needs_root
def test_others_are_refused_by_name(start):
    daemon = start("--socket-mode", "0666")
    client = connect_as(daemon)
    error = client.hello().error
    assert (error.code, error.details.field) == ("forbidden", "uid")
    assert f'"uid:{STRANGER}"' in error.message
    assert client.sock.recv(1) == b""
    # A token that nobody asks for opens nothing.
    assert connect_as(daemon).hello(TOKEN).error.code == "forbidden"


@needs_root
def test_others_show_a_token_where_there_are_tokens(start, tmp_path):
    daemon = start("--socket-mode", "0666", *tokens(tmp_path, TOKEN + " role=read\n"))
    assert connect_as(daemon).hello().error.code == "unauthorized"
    assert connect_as(daemon).hello("not-one-of-theirs").error.code == "unauthorized"
    client = connect_as(daemon)
    assert client.hello(TOKEN).HasField("hello_reply")
    assert ask(client, stats=pb.Stats()).error.code == "forbidden"


@needs_root
@pytest.mark.parametrize("who", ["uid:{0}", "gid:{1}", "gid:{2}", "uid:*"])
def test_a_line_gives_a_user_a_role(start, tmp_path, who):
    line = who.format(STRANGER, GROUP, BESIDES) + " role=read\n"
    daemon = start("--socket-mode", "0666", *tokens(tmp_path, line))
    client = connect_as(daemon)
    assert client.hello().HasField("hello_reply")
    assert ask(client, scene_list=pb.SceneList()).HasField("scene_list_reply")
    answer = ask(client, scene_add=pb.SceneAdd(blob=blob_name(GLB)))
    assert (answer.error.code, answer.error.details.field) == ("forbidden", "role")
    if who != "uid:*":
        assert connect_as(daemon, STRANGER + 9, GROUP + 9, ()).hello().error.code == "unauthorized"
    root = daemon.framed()  # ourselves: everything, without a line
    assert ask(root, stats=pb.Stats()).HasField("stats_reply")


@needs_root
def test_a_line_gives_a_user_scenes_and_quotas(start, tmp_path):
    line = f"uid:{STRANGER} role=edit scenes=theirs/ max_scenes=1\n"
    daemon = start("--socket-mode", "0666", *tokens(tmp_path, line))
    ours = add(daemon.framed(), "ours").scene.id
    client = connect_as(daemon)
    client.hello()
    assert add(client, "ours/b").error.code == "forbidden"
    assert add(client, "theirs/a").scene.id
    answer = add(client, "theirs/b")
    assert (answer.error.code, answer.error.details.field) == ("limit", "max_scenes")
    assert f'"uid:{STRANGER}"' in answer.error.message
    listed = ask(client, scene_list=pb.SceneList()).scene_list_reply.scenes
    assert [scene.name for scene in listed] == ["theirs/a"]
    assert ask(client, scene_get=pb.SceneGet(id=ours)).error.code == "not_found"


@needs_root
def test_the_daemons_own_user_and_root_get_in(start, tmp_path):
    daemon = start("--socket-mode", "0666", *tokens(tmp_path, f"uid:{STRANGER} role=read\n"))
    assert ask(daemon.framed(), stats=pb.Stats()).HasField("stats_reply")
    # And a line of one's own counts before that.
    strict = start(*tokens(tmp_path, "uid:0 role=read\n"))
    assert ask(strict.framed(), stats=pb.Stats()).error.code == "forbidden"


@needs_root
def test_a_line_that_comes_first_counts_after_a_reload(start, tmp_path):
    wide = f"gid:{GROUP} role=edit\n"
    daemon = start("--socket-mode", "0666", *tokens(tmp_path, wide))
    client, other = connect_as(daemon), connect_as(daemon, STRANGER + 9, GROUP, ())
    for one in (client, other):
        assert one.hello().HasField("hello_reply")
    tokens(tmp_path, wide + f"uid:{STRANGER} role=read\n")
    reload(daemon)
    assert client.receive()[0].error.code == "unauthorized"
    assert ask(other, scene_list=pb.SceneList()).HasField("scene_list_reply")
    client = connect_as(daemon)
    client.hello()
    assert ask(client, scene_add=pb.SceneAdd(blob=blob_name(GLB))).error.code == "forbidden"


def test_a_file_of_users_alone_closes_http_and_tcp(start, tmp_path):
    daemon = start(*tokens(tmp_path, f"uid:{STRANGER}\n"))
    assert daemon.request("GET", "/v1/scenes")[0] == 401
    assert daemon.healthy()
    client = daemon.framed(tcp=True, hello=False)
    assert client.hello().error.code == "unauthorized"
    assert "--socket-mode" in daemon.log_path.read_text()  # the file's mode would keep them out
