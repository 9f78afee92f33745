"""The viewer's files: what they are served as, and to whom."""
import re

import pytest

TYPES = {"/": "text/html", "/viewer.js": "text/javascript", "/viewer.css": "text/css",
         "/icon.svg": "image/svg+xml", "/licences.txt": "text/plain"}


@pytest.mark.parametrize("path,kind", TYPES.items())
def test_types_and_policy(shared, path, kind):
    status, headers, body = shared.request("GET", path)
    assert status == 200 and len(body) == int(headers["Content-Length"]) > 100
    assert headers["Content-Type"].split(";")[0] == kind
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Cache-Control"] == "no-cache"
    policy = dict(part.strip().split(" ", 1) for part in headers["Content-Security-Policy"].split(";"))
    assert policy["default-src"] == "'none'" and policy["frame-ancestors"] == "'none'"
    assert policy["script-src"] == policy["connect-src"] == policy["style-src"] == "'self'"


def test_etag(shared):
    _, headers, body = shared.request("GET", "/viewer.js")
    tag = headers["ETag"]
    assert re.fullmatch('"[0-9a-f]{32}"', tag)
    for held in (tag, f'"other", W/{tag}'):
        status, headers, rest = shared.request("GET", "/viewer.js", headers={"If-None-Match": held})
        assert (status, rest, headers["ETag"]) == (304, b"", tag)
    status, _, again = shared.request("GET", "/viewer.js", headers={"If-None-Match": '"other"'})
    assert (status, again) == (200, body)


def test_head(shared):
    status, headers, body = shared.request("HEAD", "/")
    assert status == 200 and body == b"" and int(headers["Content-Length"]) > 100


def test_page_names_what_there_is(shared):
    _, _, page = shared.request("GET", "/")
    named = re.findall(r'(?:src|href)="([^"#]+)"', page.decode())
    assert {"viewer.js", "viewer.css"} <= set(named)
    for name in named:
        assert shared.request("GET", "/" + name)[0] == 200, name


def test_without_token_but_not_without_host(start):
    daemon = start(token="0123456789abcdef0123")
    assert daemon.request("GET", "/", headers={"Authorization": ""})[0] == 200
    assert daemon.request("GET", "/v1/scenes", headers={"Authorization": ""})[0] == 401
    assert daemon.request("GET", "/", headers={"Host": "elsewhere.example"})[0] == 403
