"""Who can reach the page: whoever reaches its address; it has no password."""

from __future__ import annotations

import ipaddress
from typing import Any


def is_loopback(host: str) -> bool:
    """Whether only programs of this machine can connect to an address."""
    try:
        return host == 'localhost' or ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name; where it leads is for the network to say
        return False


def warning_about(host: str) -> str:
    """Say what it means to serve on an address, empty where it stays on this machine."""
    if is_loopback(host):
        return ''
    return (
        f'panel: warning: --host {host} serves the page to other machines. There is no password and no encryption: '
        'whoever reaches this address can send targets and set parameters of the node. '
        'Safer: leave --host alone, and use ssh -L 8080:127.0.0.1:8080 from the other machine.'
    )


def stay_private(server: Any) -> None:
    """Take viser's public tunnel away: any client may ask for one, whether its button is shown or not."""
    server.request_share_url = lambda *_, **__: None
