"""Who may open the page: a browser that was told this machine's address, and pages that this server has served.

Any page of the web may ask a browser for a WebSocket to this machine, and its name may lead here. Browsers send the
name in ``Host`` and the page's own address in ``Origin``.
"""

from __future__ import annotations

import http
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from ipaddress import ip_address
from typing import Any
from urllib.parse import urlsplit

from snake_env._extras import extras

with extras():
    import viser  # noqa: F401
    import websockets.asyncio.server
    from websockets.http11 import Response


def admits(headers: Any, served: str) -> bool:
    """Whether a request may pass.

    Args:
        headers: of the request; ``get_all(name)`` gives the values of a header.
        served: interface that serves the page.
    """
    hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(hosts) != 1 or not _is_own(hosts[0], served):
        return False
    return origins in ([], [f"http://{hosts[0]}"])


def _is_own(host: str, served: str) -> bool:
    """Whether a value of ``Host`` is an address of this machine, which no name of somebody else's leads to."""
    try:
        name = urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return False
    if name in ("localhost", served.lower()):
        return True
    try:
        address = ip_address(name)
    except ValueError:
        return not _is_local(served) and name == socket.gethostname().lower()
    return address.is_loopback or not _is_local(served)


def _is_local(served: str) -> bool:
    """Whether only this machine reaches an interface."""
    try:
        return ip_address(served).is_loopback
    except ValueError:
        return served == "localhost"


@contextmanager
def guarded(served: str) -> Iterator[list[str]]:
    """Servers of viser that are made inside answer only requests that are admitted.

    viser has no place for such a check; it starts its server by ``websockets.asyncio.server.serve``.

    Args:
        served: interface that serves the page.

    Yields:
        An entry for each server that is guarded.
    """
    serve, guards = websockets.asyncio.server.serve, []

    def serve_some(*args: Any, process_request: Any, **options: Any) -> Any:
        guards.append(served)
        return serve(*args, process_request=partial(_answer, served, process_request), **options)

    websockets.asyncio.server.serve = serve_some  # type: ignore[assignment,misc]
    try:
        yield guards
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]


def _answer(served: str, process_request: Any, connection: Any, request: Any) -> Any:
    if admits(request.headers, served):
        return process_request(connection, request)
    return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", websockets.Headers(), b"")
