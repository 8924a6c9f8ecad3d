"""Reading MCAP: messages a second beside what a user would pick instead, and the memory that a large log takes.

Every measurement runs in a process of its own, after one that compiled the loops, and is the best of several passes.
Seconds are those of the processor: all of it is work of one thread, and what else the machine does is left out.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from benchmarks.ingest.mcap_logs import CHANNELS, IMU_TOPIC, JSON_TOPICS, write_log

#: Wanted: times theirs, or at most times the unpacking alone; megabytes.
WANTED = {"json": 10.0, "cdr": 30.0, "raw": 3.0, "memory": 400.0}
LARGE_BYTES = 1_000_000_000


def ours(path: Path) -> int:
    """Decode every message to canonical channels, a few megabytes at a time."""
    from kempf.pipeline.ingest.log_file import LogFile
    from kempf.pipeline.ingest.mcap.decode import decode
    from kempf.schemas.profile import Source

    count = values = 0
    with path.open("rb") as stream:
        log = LogFile(stream)
        topics = {topic for topic, *_ in (JSON_TOPICS if "json" in path.name else (IMU_TOPIC,))}
        if "all" in path.name:
            topics = {topic for topic, *_ in (*JSON_TOPICS, IMU_TOPIC)}
        mapped = {key: one for key, one in CHANNELS.items() if key.split(".")[0] in topics}
        source = Source.model_validate({"match": "*", "channels": mapped})
        for decoded in decode(path.name, log, source, ["*"]):
            count += len(decoded)
            values += sum(int(channel.present.sum()) for channel in decoded.channels.values())
    assert values == count, "every message gives a value"
    return count


def raw(path: Path) -> int:
    """Find every message, unpacked and checked, without looking into it."""
    from kempf.pipeline.ingest.log_file import LogFile
    from kempf.pipeline.ingest.mcap.container.stream import McapStream

    with path.open("rb") as stream:
        return sum(batch.first.size for batch in McapStream(path.name, LogFile(stream)).batches())


def unpacking(path: Path) -> int:
    """Unpack every chunk and do nothing else; return the bytes."""
    import zstandard
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    with path.open("rb") as stream:
        packed = [r.data for r in StreamReader(stream, emit_chunks=True).records if isinstance(r, Chunk)]
    unpacker = zstandard.ZstdDecompressor()
    begin = process_time()
    size = sum(len(unpacker.decompress(one)) for one in packed)
    unpacking.seconds = process_time() - begin  # type: ignore[attr-defined]
    return size


def mcap_orjson(path: Path) -> int:
    """Iterate with the format's own reader, parse with orjson."""
    import orjson
    from mcap.reader import make_reader

    with path.open("rb") as stream:
        return sum(orjson.loads(message.data)["value"] > -1e9 for _, _, message in make_reader(stream).iter_messages())


def mcap_ros2(path: Path) -> int:
    """Iterate and decode with the format's own ROS 2 package."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return sum(found.decoded_message.angular_velocity.z > -1e9 for found in reader.iter_decoded_messages())


def whole_reading(path: Path) -> int:
    """Read a log as `kempf ingest` does: decoded, checked, as a table, with its ledger."""
    from kempf.pipeline.ingest.log_file import LogFile
    from kempf.schemas.profile import VesselProfile
    from tests.reading import read_log

    profile = VesselProfile.model_validate({"sources": [{"match": "*", "channels": CHANNELS}]})
    with path.open("rb") as stream:
        return read_log(path.name, LogFile(stream), profile).tally.records_kept


def taking_in(path: Path) -> int:
    """Take a log into a warehouse, all of it: `kempf ingest`."""
    from kempf.flows.jobs.ingest.ingest_logs import ingest
    from kempf.schemas.profile import VesselProfile
    from kempf.warehouse.storage.store import Warehouse

    profile = VesselProfile.model_validate({"sources": [{"match": "*", "channels": CHANNELS}]})
    with TemporaryDirectory() as folder:
        (outcome,) = ingest(Warehouse(str(Path(folder) / "w")), [path], "speedy", profile)
    assert outcome.tally is not None, outcome.error
    return outcome.tally.records_read


JOBS: dict[str, Callable[[Path], int]] = {
    job.__name__: job for job in (ours, raw, unpacking, mcap_orjson, mcap_ros2, whole_reading, taking_in)
}


def job(name: str, path: Path, passes: int) -> dict[str, float]:
    """Run a job in this process: messages, best seconds, and the most memory that the process ever had, MB."""
    import resource

    best, count = float("inf"), 0
    for _ in range(passes):
        begin = process_time()
        count = JOBS[name](path)
        best = min(best, getattr(JOBS[name], "seconds", process_time() - begin))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000.0
    return {"count": count, "seconds": best, "peak_mb": peak}


def child(name: str, path: Path, passes: int = 3) -> dict[str, float]:
    """Run a job in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.ingest.mcap_speed", "--job", name, str(path), "--passes", str(passes)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[2])
    if done.returncode:
        raise RuntimeError(done.stderr)
    output: dict[str, float] = json.loads(done.stdout)
    return output


def measure(folder: Path, large_bytes: int) -> dict[str, dict[str, float]]:
    """Write the logs and run every job."""
    logs = {"json": folder / "json.mcap", "cdr": folder / "cdr.mcap", "all": folder / "all.mcap"}
    write_log(logs["json"], JSON_TOPICS, 60_000)
    write_log(logs["cdr"], (IMU_TOPIC,), 150_000)
    write_log(logs["all"], (*JSON_TOPICS, IMU_TOPIC), 40_000)
    for path in logs.values():
        child("ours", path, 1)  # compiles
    found = {
        "json ours": child("ours", logs["json"]),
        "json theirs": child("mcap_orjson", logs["json"]),
        "cdr ours": child("ours", logs["cdr"]),
        "cdr theirs": child("mcap_ros2", logs["cdr"], 1),
        "raw ours": child("raw", logs["all"]),
        "raw unpacking": child("unpacking", logs["all"]),
        "all ours": child("ours", logs["all"]),
        "all whole": child("whole_reading", logs["all"]),
    }
    small = logs["all"].stat().st_size
    large = folder / "all-large.mcap"
    write_log(large, (*JSON_TOPICS, IMU_TOPIC), int(40_000 * large_bytes / small) + 1)
    found["large"] = {**child("ours", large, 1), "bytes": large.stat().st_size}
    child("taking_in", logs["all"], 1)  # compiles
    found["all taken in"] = child("taking_in", logs["all"], 1)
    found["large taken in"] = child("taking_in", large, 1)
    return found


def page(found: dict[str, dict[str, float]]) -> list[str]:
    """Lines of the page."""
    from benchmarks.result_page import table

    def rate(name: str) -> float:
        return found[name]["count"] / found[name]["seconds"] / 1e3

    unpacked = found["raw ours"]["count"] / found["raw unpacking"]["seconds"] / 1e3
    rows = [
        ["five JSON topics", "mcap, orjson", f"{rate('json theirs'):.0f}", f"{rate('json ours'):.0f}",
         f"**{rate('json ours') / rate('json theirs'):.0f} times**", f"at least {WANTED['json']:.0f} times"],
        ["sensor_msgs/Imu in CDR", "mcap-ros2-support", f"{rate('cdr theirs'):.0f}", f"{rate('cdr ours'):.0f}",
         f"**{rate('cdr ours') / rate('cdr theirs'):.0f} times**", f"at least {WANTED['cdr']:.0f} times"],
        ["records, not decoded", "zstd alone", f"{unpacked:.0f}", f"{rate('raw ours'):.0f}",
         f"**{unpacked / rate('raw ours'):.1f} times as long**", f"at most {WANTED['raw']:.0f} times as long"],
    ]  # fmt: skip
    channels = len({mapped["channel"] for mapped in CHANNELS.values()})
    large, taken, short = found["large"], found["large taken in"], found["all taken in"]
    return [
        "Messages of simulated instruments in zstd chunks of about 1 MB with CRCs, which are checked; the others do "
        "not check them. Decoded means: the mapped field of every message as a number in SI units. Rates are by the "
        "processor's time.",
        "",
        *table(["what is read", "beside", "theirs, 1000/s", "ours, 1000/s", "ratio", "wanted"], rows),
        "",
        f"JSON and CDR topics mixed: {rate('all ours'):.0f} thousand messages a second decoded, "
        f"{rate('all whole'):.0f} thousand as a table with all checks and the ledger, as `kempf ingest` reads a log.",
        "",
        f"A log of {large['bytes'] / 1e6:.0f} MB with {large['count'] / 1e6:.1f} million messages, all of them decoded "
        f"a few megabytes at a time: at most **{large['peak_mb']:.0f} MB** of memory (wanted: below "
        f"{WANTED['memory']:.0f}), interpreter and libraries included; a log of "
        f"{found['json ours']['count'] / 1e6:.1f} million messages takes {found['json ours']['peak_mb']:.0f} MB. "
        f"{large['count'] / large['seconds'] / 1e3:.0f} thousand messages a second.",
        "",
        f"`kempf ingest` of the same log, into tables, searched for zigzags and examined: at most "
        f"**{taken['peak_mb']:.0f} MB**, {taken['count'] / taken['seconds'] / 1e3:.0f} thousand messages a second; "
        f"of a log of {short['count'] / 1e6:.1f} million messages {short['peak_mb']:.0f} MB. The log and its table are "
        f"never held; the libraries are, and the series of the {channels} channels, 16 bytes a value: "
        f"{taken['count'] / len(CHANNELS) * channels * 16 / 1e6:.0f} MB, which the search for zigzags and the doctor "
        "look at whole. So this does not stay below the limit that the reader keeps.",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--large-bytes", type=int, default=LARGE_BYTES)
    parser.add_argument("--job", nargs=2, metavar=("NAME", "LOG"), help=argparse.SUPPRESS)
    parser.add_argument("--passes", type=int, default=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.job:
        print(json.dumps(job(options.job[0], Path(options.job[1]), options.passes)))
        return
    from benchmarks.result_page import write

    with TemporaryDirectory() as name:
        found = measure(Path(name), options.large_bytes)
    path = write("ingest.mcap_speed", "Reading MCAP: messages a second, and memory", page(found))
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
