"""Who may open a page: a browser at this computer, or with the token; no other page, whatever it claims."""

import asyncio
import http.client
from urllib.parse import urlsplit

import pytest

from manikin.errors import InputError

viser = pytest.importorskip("viser")

import websockets  # noqa: E402  # a dependency of viser

from manikin.viewer.door import Door  # noqa: E402
from manikin.viewer.session import ViewerSession  # noqa: E402


@pytest.fixture
def page(finished_run):
    session = ViewerSession(finished_run, Door(0))
    yield session
    session.close()


@pytest.fixture
def open_page(finished_run):
    """A page that others can reach: here this computer by another address is one of them."""
    door = Door(0)
    door.token = "the-token"
    session = ViewerSession(finished_run, door)
    yield session
    session.close()


def get(page, path="/", **headers):
    """Status, headers and body of the answer to a request."""
    connection = http.client.HTTPConnection("127.0.0.1", page.server.get_port(), timeout=10)
    try:
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read()
    finally:
        connection.close()


def joins(page, **headers):
    """Whether a websocket that says it comes from there is let in, and gets the page's messages."""
    port = page.server.get_port()
    host = headers.pop("Host", f"127.0.0.1:{port}")

    async def join():
        connection = websockets.connect(
            f"ws://{host}", host="127.0.0.1", port=port, additional_headers=headers, max_size=None,
            subprotocols=[f"viser-v{viser.__version__}"], proxy=None,
        )  # fmt: skip
        try:
            async with asyncio.timeout(20), connection as opened:
                return len(await opened.recv()) > 0
        except websockets.InvalidStatus as error:
            if error.response.status_code == 403:
                return False
            raise

    return asyncio.run(join())


def test_this_computer_is_let_in_by_its_own_names(page):
    port = page.server.get_port()
    for host in (f"127.0.0.1:{port}", f"localhost:{port}", f"[::1]:{port}", "localhost:9999"):
        assert get(page, Host=host)[0] == 200
        assert joins(page, Host=host, Origin=f"http://{host}")
    assert joins(page)  # a program that is no browser


def test_other_pages_in_the_same_browser_are_refused(page):
    """What a hostile page can make a browser send: its own origin, or its own name for this address."""
    port = page.server.get_port()
    for origin in ("https://example.org", "http://localhost:3000", "http://127.0.0.1", "null"):
        assert not joins(page, Origin=origin)
        assert get(page, Origin=origin)[0] == 403
    rebound = f"example.org:{port}"
    assert not joins(page, Host=rebound, Origin=f"http://{rebound}")
    status, _, text = get(page, Host=rebound)
    assert status == 403
    assert b"this page is for this computer" in text
    assert get(page, Host="")[0] == 403
    assert get(page, Host="[broken")[0] in (400, 403)


def test_others_need_the_token(open_page):
    port = open_page.server.get_port()
    here = f"192.0.2.7:{port}"
    assert get(open_page, Host=here)[0] == 403
    assert get(open_page, "/?token=guess", Host=here)[0] == 403
    assert not joins(open_page, Host=here, Origin=f"http://{here}")
    status, headers, _ = get(open_page, "/?token=the-token", Host=here)
    assert (status, headers["Location"]) == (302, "/")
    cookie = headers["Set-Cookie"].partition(";")[0]
    assert "HttpOnly" in headers["Set-Cookie"]
    assert get(open_page, Host=here, Cookie=cookie)[0] == 200
    assert get(open_page, Host=here, Cookie=cookie.replace("token", "t0ken"))[0] == 403
    assert joins(open_page, Host=here, Origin=f"http://{here}", Cookie=cookie)
    assert not joins(open_page, Host=here, Origin="https://example.org", Cookie=cookie)


def test_a_page_for_others_has_a_new_token_and_that_of_this_computer_has_none():
    tokens = {Door(0, "0.0.0.0").token for _ in range(3)}
    assert len(tokens) == 3
    assert all(len(token) >= 32 for token in tokens)
    assert Door(0).token is None
    door = Door(0, "0.0.0.0")
    assert urlsplit(door.url).query == f"token={door.token}"
    with pytest.raises(InputError, match="valid: one of this computer"):
        Door(0, "no.such.host.invalid")
    with pytest.raises(InputError, match="an address of this computer"):
        Door(0, "192.0.2.7")
