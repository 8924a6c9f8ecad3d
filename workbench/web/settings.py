"""How the pages are served."""

from __future__ import annotations

from dataclasses import dataclass

#: Names of this machine that only it answers to.
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")


@dataclass(frozen=True)
class Settings:
    """Where it listens, and to which names it answers.

    Parameters
    ----------
    host : str
        Address to bind.
    port : int
    allowed_hosts : tuple of str
        Names of this server beyond those of the loopback, without a port.
    """

    host: str = "127.0.0.1"
    port: int = 8765
    allowed_hosts: tuple[str, ...] = ()
    #: What whoever may write has to know; None where nobody may.
    token: str | None = None

    @property
    def anybody_reads(self) -> bool:
        """Whether pages are shown without the token: on this machine alone, or where nobody may write anyway."""
        return self.token is None or self.host in (*LOOPBACK, "::1")

    @property
    def names(self) -> frozenset[str]:
        """The names that a request may be addressed to, in lower case."""
        return frozenset(name.lower() for name in (*LOOPBACK, *self.allowed_hosts))
