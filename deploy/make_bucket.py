"""Make the bucket that KEMPF_WAREHOUSE names, on the server at AWS_ENDPOINT_URL; one that is there stays as it is."""

from __future__ import annotations

import os

from pyarrow import fs

endpoint = os.environ["AWS_ENDPOINT_URL"]
bucket = os.environ["KEMPF_WAREHOUSE"].removeprefix("s3://").partition("/")[0]
store = fs.S3FileSystem(
    access_key=os.environ["AWS_ACCESS_KEY_ID"],
    secret_key=os.environ["AWS_SECRET_ACCESS_KEY"],
    endpoint_override=endpoint,
    scheme=endpoint.partition(":")[0],
    region=os.environ.get("AWS_REGION", "us-east-1"),
    allow_bucket_creation=True,
)
store.create_dir(bucket)
