"""Who may open a page: people at this computer, or with its token those elsewhere; never other pages.

A browser lets any page that it shows send requests to this computer. It says where a request comes from
(``Origin``) and whom it is meant for (``Host``), so that a server can refuse: [RFC6454]_.

.. [RFC6454] A. Barth, The Web Origin Concept, RFC 6454, 2011, Section 7.
"""

import hmac
import ipaddress
import secrets
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

import websockets.asyncio.server as websocket_server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from manikin.errors import InputError
from manikin.viewer import THIS_COMPUTER


class Door:
    """The address of a page, and the rule by which requests are let in.

    A page of this computer alone is for who asks for it by a name of this computer. One that others can reach
    has a token, which is part of its address and is kept by the browser as a cookie. In either case a request
    that another page makes is refused.

    Attributes:
        host: Address that is listened to.
        port: A port that is free.
        token: Secret of a page that others can reach, else None.
    """

    def __init__(self, port: int, host: str = THIS_COMPUTER) -> None:
        """Choose the port, if it is 0, or refuse one that is not free by an InputError, as an address."""
        self.host, self.port = host, _free_port(host, port)
        self.token = None if _is_this_computer(host) else secrets.token_urlsafe(24)

    @property
    def url(self) -> str:
        """Address of the page."""
        if self.token is None:
            return f"http://{self.host}:{self.port}"
        everywhere = self.host in ("0.0.0.0", "::")
        name = socket.gethostname() if everywhere else f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{name}:{self.port}/?token={self.token}"

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Context in which a viser server that starts asks this door about every request."""
        start, watched = websocket_server.serve, False

        def serve(*args: Any, process_request: Any = None, **options: Any) -> Any:
            nonlocal watched
            watched = True

            def answer(connection: Any, request: Request) -> Any:
                refused = self.answer(request)
                return process_request(connection, request) if refused is None else refused

            return start(*args, process_request=answer, **options)

        websocket_server.serve = serve  # type: ignore[assignment, misc]  # viser has no hook of its own
        try:
            yield
        finally:
            websocket_server.serve = start  # type: ignore[misc]
        if not watched:
            raise RuntimeError(
                "the installed viser starts its server in another way, which cannot be watched"
            )

    def answer(self, request: Request) -> Response | None:
        """Refusal of a request, or the answer that makes the browser keep the token; None to let it in."""
        headers = request.headers
        try:
            asked = urlsplit(f"//{headers.get('Host', '')}")
            origin = headers.get("Origin")
            name, foreign = asked.hostname, origin is not None and urlsplit(origin).netloc != asked.netloc
        except ValueError:
            return _refusal("the request names no host")
        if foreign:
            return _refusal("another page asks for this one")
        if self.token is None:
            if name is None or not _is_this_computer(name):
                return _refusal("this page is for this computer; see the option --host")
            return None
        if self._is_token(_cookie(headers.get_all("Cookie"), self._cookie_name)):
            return None
        if not self._is_token(parse_qs(urlsplit(request.path).query).get("token", [""])[0]):
            return _refusal("the token is missing; open the whole address that manikin printed")
        cookie = f"{self._cookie_name}={self.token}; Path=/; HttpOnly; SameSite=Strict"
        return Response(HTTPStatus.FOUND, "Found", Headers({"Location": "/", "Set-Cookie": cookie}), b"")

    def _is_token(self, given: str) -> bool:
        return self.token is not None and hmac.compare_digest(given.encode(), self.token.encode())

    @property
    def _cookie_name(self) -> str:
        # Cookies are for all ports of a host.
        return f"manikin-{self.port}"


def _refusal(reason: str) -> Response:
    headers = Headers({"Content-Type": "text/plain; charset=utf-8"})
    return Response(HTTPStatus.FORBIDDEN, "Forbidden", headers, f"manikin: {reason}\n".encode())


def _cookie(headers: list[str], name: str) -> str:
    """Value of a cookie, or nothing."""
    for header in headers:
        try:
            if (found := SimpleCookie(header).get(name)) is not None:
                return found.value
        except CookieError:
            continue
    return ""


def _is_this_computer(host: str) -> bool:
    """Whether a name or an address is one by which this computer calls itself."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _free_port(host: str, port: int) -> int:
    """Return a port that is free, or refuse: viser would silently take another one."""
    try:
        family = socket.getaddrinfo(host, None)[0][0]
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
            return int(probe.getsockname()[1])
    except socket.gaierror:
        raise InputError(
            f"host {host!r} is not an address; valid: one of this computer, or 0.0.0.0"
        ) from None
    except (OSError, OverflowError) as error:
        problem = getattr(error, "strerror", None) or str(error)
        what = f"port {port} of {host} cannot be used ({problem})"
        raise InputError(f"{what}; valid: a free port, or 0, and an address of this computer") from None
