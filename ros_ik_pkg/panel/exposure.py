"""Protection of the page, which has no password."""

from __future__ import annotations

import ipaddress
from typing import Any


def is_loopback(host: str) -> bool:
    """Whether only programs of this machine can connect to an address."""
    try:
        return host == 'localhost' or ipaddress.ip_address(host).is_loopback
    except ValueError:  # a host name; the network decides what it resolves to
        return False


def warning_about(host: str) -> str:
    """Return a warning about serving on an address; empty if only this machine can reach it."""
    if is_loopback(host):
        return ''
    return (
        f'panel: warning: --host {host} serves the page to other machines. There is no password and no encryption: '
        'everybody who reaches this address can send targets and set parameters of the node. '
        'Safer: leave --host alone, and use ssh -L 8080:127.0.0.1:8080 from the other machine.'
    )


def stay_private(server: Any) -> None:
    """Disable viser's public tunnel, which any client could request even if its button is hidden."""
    server.request_share_url = lambda *_, **__: None
