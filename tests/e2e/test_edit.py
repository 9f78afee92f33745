"""bounce edit, scene log and its like, and watch, against a daemon that is made up."""
import json
import signal
import time

import pytest
from stopwatch import Stopwatch

LAMP = {"message": "a lamp", "ops": [
    {"add_light": {"kind": "spot", "intensity": 5, "color": [1, 0.5, 0]}},
    {"add_node": {"light": -2, "transform": {"translation": [0, 1, 0]}}}]}


def lines(result):
    return [json.loads(line) for line in result.stdout.splitlines()]


def edit(running, *documents, words=()):
    """What bounce edit makes of documents on standard input, texts or objects."""
    process = running.start("edit", "s1", "-", *words, stdin=-1)
    text = "".join(d if isinstance(d, str) else json.dumps(d) for d in documents)
    out, err = process.communicate(text.encode(), timeout=30)
    process.stdout_text, process.stderr_text = out.decode(), err.decode()
    return process


def test_a_file_of_edits(running):
    (running.folder / "lamp.json").write_text(json.dumps(LAMP, indent=2) + "\n")
    result = running("edit", "s1", "lamp.json")
    assert result.returncode == 0, result.stderr
    assert lines(result) == [{"revision": 2, "ids": [7, 8], "invalidates": [], "keeps": [],
                              "flags": []}]
    [asked] = running.asked("edit_batch")
    batch = asked["edit_batch"]
    assert batch["scene"] == "s1" and batch["message"] == "a lamp"
    assert batch["ops"][0]["add_light"]["color"] == [1, 0.5, 0]
    assert batch["ops"][1]["add_node"] == {"light": -2,
                                           "transform": {"translation": [0.0, 1.0, 0.0]}}


def test_a_stream_is_answered_line_by_line(running):
    """Each answer is there before the next document is sent: a script can wait for it."""
    process = running.start("edit", "s1", "-", stdin=-1)
    for number in range(3):
        process.stdin.write(json.dumps({**LAMP, "message": str(number)}).encode() + b"\n\n")
        process.stdin.flush()
        assert json.loads(process.stdout.readline())["revision"] == 2
    process.stdin.close()
    assert process.wait(timeout=10) == 0
    process.stdout.close()
    process.stderr.close()
    assert [e["edit_batch"]["message"] for e in running.asked("edit_batch")] == ["0", "1", "2"]


def test_a_producer_that_pauses_keeps_its_daemon(mode):
    """A daemon hangs up on who is silent for long."""
    process = mode("impatient").start("edit", "s1", "-", stdin=-1)
    for number in range(3):
        time.sleep(1.4)
        process.stdin.write(json.dumps(LAMP).encode()[:20])
        process.stdin.flush()
        time.sleep(1.4)  # in the middle of one, too
        process.stdin.write(json.dumps(LAMP).encode()[20:])
        process.stdin.flush()
        assert process.stdout.readline(), process.stderr.read()
    out, err = process.communicate(timeout=10)
    assert process.returncode == 0 and (out, err) == (b"", b"")


def test_documents_may_touch_and_there_may_be_none(running):
    assert edit(running, LAMP, LAMP).returncode == 0
    assert len(running.asked("edit_batch")) == 2
    nothing = edit(running, " \n")
    assert nothing.returncode == 0 and nothing.stdout_text == ""


def test_the_first_failure_ends_it(running):
    result = edit(running, LAMP, {"message": "refuse", "ops": []}, LAMP)
    assert result.returncode == 4 and len(result.stdout_text.splitlines()) == 1
    assert result.stderr_text.strip() == "bounce: another revision"
    assert len(running.asked("edit_batch")) == 2


def test_keep_going(running):
    result = edit(running, LAMP, {"message": "refuse"}, {"ops": 3}, LAMP, words=["--keep-going"])
    answers = [json.loads(line) for line in result.stdout_text.splitlines()]
    assert [a.get("code", a.get("revision")) for a in answers] == [2, "conflict", "bad_input", 2]
    assert answers[1]["details"] == {"field": "test"} and answers[2]["details"]["field"] == "ops"
    assert result.returncode == 4
    assert "document 2: another revision" in result.stderr_text
    assert len(running.asked("edit_batch")) == 3
    broken = edit(running, LAMP, "{nonsense", LAMP, words=["-k"])
    assert broken.returncode == 4 and len(broken.stdout_text.splitlines()) == 1
    assert "document 2" in broken.stderr_text


def test_a_message_that_is_cut_inside_a_character(running):
    """What is quoted in messages has room for so many bytes."""
    document = {"\N{EURO SIGN}" * 200: 1}
    result = edit(running, document, LAMP, words=["--keep-going"])
    assert result.returncode == 2, result.stderr_text
    [failure, _] = map(json.loads, result.stdout_text.splitlines())
    assert failure["code"] == "usage" and failure["message"].startswith("\N{EURO SIGN}" * 40)
    result = edit(running, document, words=["--json"])
    assert json.loads(result.stdout_text)["details"] == failure["details"]


@pytest.mark.parametrize("document,field,code", [
    ({"opps": []}, "opps", 2), ({"ops": [{}, {"set_lihgt": {}}]}, "ops[1].set_lihgt", 2),
    ({"ops": [{"set_light": {"light": 0, "intensty": 5}}]}, "ops[0].set_light.intensty", 2),
    ({"frame": {"parameters": {"whatever": 1}, "sise": [1, 1]}}, "frame.sise", 2),
    ({"scene": "s2"}, "s2", 2),
    ({"ops": [{"set_light": {"intensity": "5"}}]}, "ops[0].set_light.intensity", 4),
    ("[]", "document 1", 4), ('{"ops": []', "document 1", 4), ('{"ops":[],"ops":[]}', "ops", 4),
    ("3", "document 1", 4), ('{"scene": "\\ud800"}', "document 1", 4),
])
def test_what_is_no_batch_is_not_sent(running, document, field, code):
    result = edit(running, document)
    assert result.returncode == code, result.stderr_text
    assert field in result.stderr_text and len(result.stderr_text.splitlines()) == 1
    assert running.asked("edit_batch") == []


def test_files_that_cannot_be_read(running):
    for name in ("gone.json", "."):
        result = running("edit", "s1", name)
        assert result.returncode == 4 and name in result.stderr


@pytest.mark.parametrize("words", [
    ["edit", "s1"], ["edit"], ["edit", "s1", "-", "more"], ["edit", "s1", "-", "--count", "1"],
    ["scene"], ["scene", "log"], ["scene", "nonsense", "s1"], ["scene", "undo", "s1", "s2"],
    ["scene", "revert", "s1"], ["scene", "name", "s1"], ["scene", "export", "s1"],
    ["scene", "name", "s1", "n", "three"], ["scene", "undo", "s1", "--remove"],
    ["scene", "undo", "s1", "--after", "1"], ["scene", "log", "s1", "--limit", "0"],
    ["scene", "log", "s1", "--environment", "1,1,1"], ["watch", "s1", "s2"],
    ["scene", "log", "s1", "--all"], ["scene", "name", "s1", "n", "--by", "me"],
    ["watch", "--count", "0"], ["scene", "export", "s1", "-", "--json"],
])
def test_usage(running, words):
    result = running(*words)
    assert result.returncode == 2 and result.stderr.startswith("bounce: "), result.stderr
    assert running.asked("hello") == []


def test_undo_redo_commit_revert(running):
    for words, body, asked in (
            (["undo", "s1"], "edit_undo", {"scene": "s1"}),
            (["undo", "s1", "--all"], "edit_undo", {"scene": "s1", "scope": "all"}),
            (["redo", "s1"], "edit_undo", {"scene": "s1", "redo": True}),
            (["redo", "s1", "--by", "Anna"], "edit_undo",
             {"scene": "s1", "redo": True, "by": "Anna"}),
            (["commit", "s1"], "edit_commit", {"scene": "s1"}),
            (["commit", "s1", "--by", "Anna"], "edit_commit", {"scene": "s1", "by": "Anna"}),
            (["revert", "s1", "1", "--by", "A"], "edit_revert",
             {"scene": "s1", "revision": "1", "by": "A"}),
            (["revert", "s1", "12"], "edit_revert", {"scene": "s1", "revision": "12"}),
            (["revert", "s1", "12th"], "edit_revert", {"scene": "s1", "name": "12th"})):
        result = running("scene", *words)
        assert result.returncode == 0 and result.stdout == b"revision 5\n", result.stderr
        assert "a_flag of the edit" in result.stderr
        assert running.asked(body)[-1][body] == asked
    result = running("scene", "undo", "s1", "--json", "--quiet")
    assert json.loads(result.stdout)["revision"] == 5 and result.stderr == ""


def test_names(running):
    for words, asked in ((["lit"], {"name": "lit"}),
                         (["lit", "3"], {"name": "lit", "revision": "3"}),
                         (["lit", "--remove"], {"name": "lit", "remove": True})):
        assert running("scene", "name", "s1", *words).returncode == 0
        assert running.asked("revision_name")[-1]["revision_name"] == {"scene": "s1", **asked}


def test_log(running):
    result = running("scene", "log", "s1", "--after", "0", "--limit", "5")
    assert running.asked("scene_log")[0]["scene_log"] == {"scene": "s1", "after": "0", "limit": 5}
    imported, lamp, undone = result.stdout.decode().splitlines()
    assert imported.split() == ["1", "import", "2023-11-14T22:13:20Z"]
    assert lamp.split(maxsplit=2) == ["2", "edit", "[lit]  a lamp  (light 0, node 3)"]
    assert undone.split() == ["3", "undo", "of", "2", "by", "local", "Anna"]
    running("scene", "log", "s1")
    assert running.asked("scene_log")[1]["scene_log"] == {"scene": "s1"}
    entries = json.loads(running("scene", "log", "s1", "--json").stdout)["entries"]
    assert entries[1]["changes"] == ["light 0", "node 3"]


def test_export(running):
    assert running("scene", "export", "s1", "out.glb").returncode == 0
    assert (running.folder / "out.glb").read_bytes() == b"glTF of the scene"
    assert running("scene", "export", "s1", "-").stdout == b"glTF of the scene"
    assert json.loads(running("scene", "export", "s1", "x.glb", "--json").stdout)["revision"] == 3
    result = running("scene", "export", "s1", "gone/out.glb")
    assert result.returncode == 4 and "gone/out.glb" in result.stderr


def test_watch(running):
    result = running("watch", "s1", "--count", "2")
    assert result.returncode == 0
    assert result.stdout.decode().splitlines() == [
        "s1  edited  revision 2  light 0, node 3", "s1  edited  revision 3  light 0, node 3"]
    assert running.asked("scene_watch")[0]["scene_watch"] == {"scene": "s1"}
    events = lines(running("watch", "--json", "--count", "1"))
    assert [event["revision"] for event in events] == [2]
    assert running.asked("scene_watch")[1]["scene_watch"] == {}


@pytest.fixture
def mode(fake, request):
    """A running daemon in another mode."""
    def start(name):
        fake.mode(name)
        return request.getfixturevalue("running")

    return start


@pytest.mark.parametrize("words,count", [
    (["scene", "log", "s1"], 3), (["watch", "s1", "--count", "2"], 2), (["scenes"], 1),
    (["scene", "undo", "s1"], 2), (["devices"], 1), (["render", "scene:s1", "-o", "x.png"], 4)])
def test_words_of_others_do_nothing_to_a_terminal(mode, words, count):
    result = mode("hostile")(*words)
    said = result.stdout.decode() + result.stderr
    assert result.returncode == 0 and "?[2J??1m?7 edit" in said, said
    assert [c for c in said if c != "\n" and not c.isprintable()] == []
    assert len(said.splitlines()) == count, said


def test_words_of_others_are_whole_in_json(mode):
    run = mode("hostile")
    assert json.loads(run("scene", "log", "s1", "--json").stdout)["entries"][1]["message"] == \
        "a lamp\x1b[2J\x9b1m\n7 edit"


@pytest.mark.parametrize("kind", ["ok", "deaf"])
def test_ctrl_c_ends_a_watch(mode, kind):
    process = mode(kind).start("watch", "s1")
    process.stdout.readline()
    process.stdout.readline()  # the third one never comes
    watch = Stopwatch()
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 130 and watch.own_s() < 2
    process.communicate()


def test_a_daemon_that_goes_ends_a_watch(mode):
    result = mode("close")("watch", "s1")
    assert result.returncode == 7 and len(result.stdout.splitlines()) == 2
    assert "closed the connection" in result.stderr


def test_what_the_daemon_does_not_offer(mode):
    result = edit(mode("unsupported"), LAMP)
    assert result.returncode == 4 and result.stdout_text == ""
    assert result.stderr_text == "bounce: no such request is known\n"
