"""An S3 server in memory, ``python -m tests.scale.s3_server PORT``: moto's S3 by itself.

moto's own command finds out for each request which of two hundred services is meant, writes a line about it and closes
the connection: most of the time of a test in a bucket was that.
"""

from __future__ import annotations

import sys

from moto.moto_server.werkzeug_app import MotoRequestHandler, create_backend_app
from werkzeug.serving import run_simple


class Quiet(MotoRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_request(self, code: int | str = "-", size: int | str = "-") -> None:
        """Say nothing."""


def serve(port: int) -> None:
    run_simple("127.0.0.1", port, create_backend_app("s3"), threaded=True, request_handler=Quiet)


if __name__ == "__main__":
    serve(int(sys.argv[1]))
