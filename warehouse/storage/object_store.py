"""How a bucket is reached: one set of options, from the environment and from the caller, for every library that asks.

The table format and the file system of pyarrow name the same things differently and read different parts of the
environment; here they get the same. Nothing of it is ever stored.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

#: Names as object stores have them, and what pyarrow calls the same.
_PYARROW = {
    "AWS_ACCESS_KEY_ID": "access_key",
    "AWS_SECRET_ACCESS_KEY": "secret_key",
    "AWS_SESSION_TOKEN": "session_token",
    "AWS_REGION": "region",
    "AWS_ENDPOINT_URL": "endpoint_override",
}
#: Other names that the environment may use for them; the first that is set counts.
_ALSO = {"AWS_ENDPOINT_URL": ("AWS_ENDPOINT_URL_S3",), "AWS_REGION": ("AWS_DEFAULT_REGION",)}

SCHEMES = ("s3", "s3a")


def options_of(given: Mapping[str, str] | None = None, environment: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return the options of an S3 store under the names of the table format.

    Parameters
    ----------
    given : mapping of str, optional
        What the caller says; goes before the environment. Keys in any case.
    environment : mapping of str, optional
        Instead of that of the process.

    Returns
    -------
    dict of str
        Empty where nothing is set: then the libraries look for credentials as they do, such as the role of the machine.

    Examples
    --------
    >>> found = options_of({}, {"AWS_ENDPOINT_URL": "http://127.0.0.1:9000", "AWS_ACCESS_KEY_ID": "me"})
    >>> found["AWS_ALLOW_HTTP"], found["AWS_REGION"], found["AWS_ACCESS_KEY_ID"]
    ('true', 'us-east-1', 'me')
    """
    variables = os.environ if environment is None else environment
    options: dict[str, str] = {}
    for name in _PYARROW:
        value = next((variables[n] for n in (name, *_ALSO.get(name, ())) if variables.get(n)), None)
        if value is not None:
            options[name] = value
    options |= {key.upper(): value for key, value in (given or {}).items()}
    endpoint = options.get("AWS_ENDPOINT_URL")
    if endpoint is not None:
        # a server of one's own has no regions, but the signature wants one; http in its address says that http is meant
        options.setdefault("AWS_REGION", "us-east-1")
        if endpoint.startswith("http://"):
            options.setdefault("AWS_ALLOW_HTTP", "true")
    return options


def file_system(options: Mapping[str, str]) -> Any:
    """Return pyarrow's file system for the same store.

    Parameters
    ----------
    options : mapping of str
        Of `options_of`.

    Raises
    ------
    OSError
        The options contradict each other.
    """
    from pyarrow import fs

    named = {theirs: options[ours] for ours, theirs in _PYARROW.items() if ours in options}
    plain = named.get("endpoint_override", "").startswith("http://")
    return fs.S3FileSystem(**named, scheme="http" if plain else "https")
