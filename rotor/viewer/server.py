"""The server of `rotor view`, for this machine alone: a random token in the address, four files, a websocket for each page.

Requests are refused without the token, with a Host header other than 127.0.0.1 or localhost with this port, and with the Origin of another
server. No path names a file of the disk. Messages are bounded.
"""

from __future__ import annotations

import asyncio
import hmac
import os
import secrets
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import msgspec

from rotor.viewer.assets import MISSING, bokeh_js, page, page_file
from rotor.viewer.service import SEARCH, Service

if TYPE_CHECKING:
    from starlette.applications import Starlette

HOST = "127.0.0.1"
MOST_BYTES = 1 << 20  # of a message
MOST_PAGES = 32
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src data: blob:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class Guard:
    """Check of the requests to the server. port: of its address."""

    def __init__(self, port: int, token: str) -> None:
        self.hosts = {f"{name}:{port}" for name in (HOST, "localhost")}
        self.origins = {f"http://{host}" for host in self.hosts}
        self.token = token

    def refusal(self, headers: Any, token: str, *, from_page: bool) -> str:
        """Reason for which a request is refused; empty for a permitted request. from_page: whether it must state its origin."""
        hosts, origins = headers.getlist("host"), headers.getlist("origin")
        if len(hosts) != 1 or hosts[0] not in self.hosts:
            return "the Host header is not this server"
        if (origins or from_page) and (len(origins) != 1 or origins[0] not in self.origins):
            return "the Origin header is not this server"
        if not hmac.compare_digest(token.encode("utf-8", "replace"), self.token.encode()):
            return "the token is not that of this server"
        return ""


def application(service: Service, guard: Guard) -> Starlette:
    """The application: four files and a websocket below the token. ValueError where the extra `view` is not installed."""
    try:
        from starlette.applications import Starlette
        from starlette.responses import PlainTextResponse, Response
        from starlette.routing import Route, WebSocketRoute
        from starlette.websockets import WebSocket
    except ImportError as error:
        raise ValueError(f"{error.name} is not installed; {MISSING}") from None
    bodies, pages = page_bodies(), Pages(service)

    async def serve(request: Any) -> Response:
        """Serve a file; all refusals look the same."""
        known = bodies.get(request.path_params.get("name", ""))
        if guard.refusal(request.headers, request.path_params["token"], from_page=False) or known is None:
            return PlainTextResponse("not found", status_code=404, headers=HEADERS)
        return Response(known[1], media_type=known[0], headers=HEADERS)

    async def talk(websocket: WebSocket) -> None:
        """Answer the messages of a page."""
        if guard.refusal(websocket.headers, websocket.path_params["token"], from_page=True) or pages.full:
            await websocket.close(1008)
            return
        await websocket.accept()
        await pages.serve(websocket)

    async def nothing(request: Any) -> Response:
        """The answer to every other path."""
        return PlainTextResponse("not found", status_code=404, headers=HEADERS)

    routes = [
        WebSocketRoute("/{token}/socket", talk),
        Route("/{token}/", serve, methods=["GET"]),
        Route("/{token}/{name}", serve, methods=["GET"]),
        Route("/{path:path}", nothing, methods=["GET", "HEAD", "POST", "PUT", "DELETE", "PATCH", "OPTIONS"]),
    ]
    return Starlette(routes=routes)


def page_bodies() -> dict[str, tuple[str, bytes]]:
    """Kind and content of the four files by name; the page has the empty name."""
    shell = page(
        '<link rel="stylesheet" href="page.css">',
        '<script async src="bokeh.js"></script>\n<script type="module" src="page.js"></script>',
    )
    files = {
        "": ("text/html", shell),
        "page.js": ("text/javascript", page_file("page.js")),
        "page.css": ("text/css", page_file("page.css")),
        "bokeh.js": ("text/javascript", bokeh_js()),
    }
    return {name: (kind, text.encode()) for name, (kind, text) in files.items()}


class Pages:
    """The open pages of a session: each message is answered to its page, each change is sent to all."""

    def __init__(self, service: Service) -> None:
        self.service = service
        self.open: dict[Any, asyncio.Lock] = {}
        self.sent = service.session.revision
        self.searches: set[asyncio.Task[None]] = set()

    @property
    def full(self) -> bool:
        """Whether the largest number of pages is open."""
        return len(self.open) >= MOST_PAGES

    async def serve(self, websocket: Any) -> None:
        """Answer the messages of a page until it is closed."""
        from starlette.websockets import WebSocketDisconnect

        self.open[websocket] = asyncio.Lock()
        try:
            while True:
                await self._answer(websocket, await websocket.receive())
        except (WebSocketDisconnect, RuntimeError, OSError):
            pass
        finally:
            del self.open[websocket]

    async def _answer(self, websocket: Any, event: dict[str, Any]) -> None:
        from starlette.websockets import WebSocketDisconnect

        if event["type"] != "websocket.receive":
            raise WebSocketDisconnect
        content = event.get("text") or event.get("bytes") or ""
        if len(content) > MOST_BYTES:
            await websocket.close(1009)
            raise WebSocketDisconnect
        try:
            message = msgspec.json.decode(content)
        except msgspec.DecodeError as error:
            answer = {"error": f"not JSON: {error}"}
            await self._send(websocket, {"re": None, **answer})
            return
        if isinstance(message, dict) and message.get("do") == SEARCH:
            task = asyncio.create_task(self._reply(websocket, message))
            self.searches.add(task)
            task.add_done_callback(self.searches.discard)
        else:
            await self._reply(websocket, message)

    async def _reply(self, websocket: Any, message: Any) -> None:
        """Answer a message; the change is sent to all pages before the answer."""
        answer = await asyncio.to_thread(self.service.answer, message)
        await self._announce()
        await self._send(websocket, {"re": message.get("id") if isinstance(message, dict) else None, **answer})

    async def _announce(self) -> None:
        """Send a changed session to all pages."""
        if self.service.session.revision == self.sent:
            return
        self.sent = self.service.session.revision
        content = {"session": await asyncio.to_thread(self.service.facts)}
        for websocket in list(self.open):
            with suppress(RuntimeError, OSError):
                await self._send(websocket, content)

    async def _send(self, websocket: Any, content: Any) -> None:
        lock = self.open.get(websocket)
        if lock is not None:
            async with lock:
                await websocket.send_text(msgspec.json.encode(content).decode())


class ViewServer:
    """A session served on a port of this machine. address: with the token."""

    def __init__(self, service: Service, port: int = 0, token: str | None = None) -> None:
        try:
            import uvicorn
            import websockets  # noqa: F401  what uvicorn serves websockets with
        except ImportError as error:
            raise ValueError(f"{error.name} is not installed; {MISSING}") from None
        self.token = token or secrets.token_urlsafe(24)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        # a port whose last connection has just ended is free; on Windows the option would share it
        if os.name == "posix":
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self.socket.bind((HOST, port))
        except OSError as error:
            self.socket.close()
            raise ValueError(f"--port {port}: {error.strerror}; another one, or 0 for any that is free") from None
        self.port = int(self.socket.getsockname()[1])
        app = application(service, Guard(self.port, self.token))
        config = uvicorn.Config(
            app, log_level="critical", access_log=False, ws_max_size=MOST_BYTES, ws="websockets-sansio", ws_per_message_deflate=False,
            server_header=False, date_header=False, lifespan="off", timeout_graceful_shutdown=1, proxy_headers=False,
        )  # fmt: skip
        self.server = uvicorn.Server(config)

    @property
    def address(self) -> str:
        """The address of the page."""
        return f"http://{HOST}:{self.port}/{self.token}/"

    def run(self, started: Callable[[str], None]) -> None:
        """Serve until the process is interrupted. started: called with the address when the port listens."""
        self.socket.listen(128)
        started(self.address)
        self.server.run(sockets=[self.socket])

    def run_in_thread(self) -> threading.Thread:
        """Serve in a thread of this process, until `stop`."""
        self.socket.listen(128)
        thread = threading.Thread(target=self.server.run, kwargs={"sockets": [self.socket]}, daemon=True)
        thread.start()
        return thread

    def stop(self) -> None:
        """Stop the server."""
        self.server.should_exit = True
