# SPDX-License-Identifier: Apache-2.0
"""What is asked of ecorche's speed, a row each: which bench measures it, where it stands in what that bench prints, and its bound."""
import dataclasses
import typing

Figure = typing.Callable[["printed.Printed"], typing.Optional[float]]  # noqa: F821


@dataclasses.dataclass(frozen=True)
class Source:
    """A bench that runs once for all rows that name it."""
    words: str  # bench/NAME/run's, NAME first
    minutes: float  # of one run on two cores
    needs: str = ""  # an option of bench/all that has to be given: `data`, `ozz`


@dataclasses.dataclass(frozen=True)
class Bound:
    work: str
    source: Source
    got: Figure
    asked: float
    unit: str
    least: bool = False  # `asked` is the least that is wanted, not the most
    floor: typing.Optional[Figure] = None  # in the same unit, or where `unit` is a ratio, what it is a ratio to
    peer: typing.Optional[Figure] = None
    of: str = ""  # what floor and peer are
    limit: typing.Optional[Figure] = None  # as `got`, by an experiment that leaves out all that could be quicker
    isolates: str = ""  # what that experiment is

    def holds(self, got):
        return got >= self.asked if self.least else got <= self.asked


def at(first, column, **where):
    return lambda printed: printed.number(first, column, **where)


def ratio(over, under):
    def figure(printed):
        above, below = over(printed), under(printed)
        return above / below if above is not None and below else None
    return figure


def larger(*figures):
    """None unless all are known: a floor that lacks one would be too low."""
    def figure(printed):
        known = [one(printed) for one in figures]
        return None if None in known else max(known)
    return figure


SKIN = Source("runtime --only skin", 0.7)
PROBED = Source("runtime --only probe", 0.7)
VOLUME = Source("runtime --only volume", 1.5)
OZZ = Source("runtime --only peers --ozz OZZ", 2, "ozz")
SERVED = Source("server --only body,organ,posers --seconds 15", 1.2)
CROWD = Source("server --only idle,stalled --seconds 15", 2.2)
SPHERES = Source("server --only region --seconds 10", 0.6)
READY = Source("server --only ready", 0.4)
WIRE = Source("server --only wire --seconds 10", 0.6)
HAPTIC = Source("probe --seconds 10", 1.5)
PAPER = Source("paper --mesher lattice", 0.3)
LARGE = Source("scans --only multilabel", 1.5)
LOSSY = Source("lossy", 0.5)


WALK = "all that the frame reads and writes, in the same order, with no arithmetic at all"


def posed(what, asked):
    """A frame beside the larger of its two floors, on two cores."""
    exact = lambda column: lambda printed: printed.number(what, column, exactly=True, threads=2)  # noqa: E731
    floor = larger(exact("memory ms"), exact("arithmetic ms"))
    return Bound(f"{what}, two cores: over the larger of its floors", SKIN, ratio(exact("median ms"), floor), asked, "x", floor=floor,
                 of="ms: its bytes over the bandwidth, or its arithmetic alone", limit=ratio(exact("walk ms"), floor), isolates=WALK)


def latencies(what, source, first, p50, p99, column=""):
    return [Bound(f"{what}: {name}", source, at(first, f"{column}{name}"), most, "ms") for name, most in (("p50", p50), ("p99", p99))]


def probed(what, first, asked):
    return Bound(what, PROBED, at(first, "median ms", threads=2), asked, "ms")


def beside(what, came):
    p99 = lambda where: ratio(at(f"4 clients, 100 k vertices, as they {where}: {came}", "p99 ms"), first_alone)  # noqa: E731
    return Bound(f"first seconds of {what}: p99 over that of alone", CROWD, p99("come"), 1.2, "x", floor=first_alone, of="ms: alone",
                 limit=p99("come elsewhere"), isolates="they come to another program on the machine, which does no more than accept them and fill their lines")


def first_alone(printed):
    """The quieter of the two rows that measure the same four clients alone."""
    return min(printed.numbers("4 clients, 100 k vertices, alone", "p99 ms"), default=None)


DQS, LBS = (at(f"nodes, {name}", "median ms", threads=2) for name in ("dqs", "lbs"))

BOUNDS = [
    posed("frame, CoR, u16", 1.4),
    posed("frame, CoR, u16 and normals", 1.6),
    Bound("frame, CoR, u16, two cores: times as fast as plain Eigen", SKIN, lambda printed: printed.number("frame, CoR, u16", "plain Eigen", exactly=True, threads=2), 20,
          "x", least=True, peer=at("plain Eigen, CoR", "median ms", threads=2), of="ms: plain Eigen, float32",
          limit=ratio(at("plain Eigen, CoR", "median ms", threads=2), lambda printed: printed.number("frame, CoR, u16", "walk ms", exactly=True, threads=2)),
          isolates=WALK),
    Bound("nodes, two cores: DQS over LBS", SKIN, ratio(DQS, LBS), 1.5, "x", floor=LBS, of="ms: LBS"),
    Bound("nodes, one thread: LBS over ozz-animation, built for this processor", OZZ, at("ozz-animation for this CPU", "ours faster", threads=1), 3, "x", least=True,
          peer=at("ozz-animation for this CPU", "median ms", threads=1), of="ms: ozz-animation, 4 weights"),
    *(Bound(f"region of 256^3, {how}, by tets, two cores", VOLUME, at(f"region of 256^3, {how}", "median ms", threads=2), 6, "ms",
            floor=larger(*(at(f"region of 256^3, {how}", column, threads=2) for column in ("memory ms", "arithmetic ms"))),
            of="ms: its bytes copied, or its samples alone", limit=at(f"region of 256^3, {how}", "arithmetic ms", threads=2),
            isolates="the samples alone: the same voxels read at places that are known") for how in ("8 bit, nearest", "8 bit, trilinear")),
    Bound("the same by spheres, in the server", SPHERES, at("1 client, by spheres", "fps"), 20, "a second", least=True),
    probed("10 000 points, posed to rest", "probe: 10 000 points back, where they were", 2),
    probed("10 000 points, rest to posed", "probe: 10 000 points there, where they went", 1),
    *latencies("whole body streamed, 90 a second", SERVED, "1 client, the whole body, delta u16", 4, 8),
    *latencies("100 k vertices streamed", SERVED, "1 client, 100 k vertices, delta u16", 0.5, 2),
    Bound("64 posers of 33 k vertices: frames of the slowest", SERVED, at("64 clients with their own poses", "fps"), 89.9, "a second", least=True),
    Bound("64 posers of 33 k vertices: p99", SERVED, at("64 clients with their own poses", "p99"), 8, "ms"),
    Bound("one point at 1 kHz beside 90 frames a second, no real-time rights: p99", HAPTIC, at("deltas", "p99", **{"goes first": "probes"}), 1, "ms"),
    Bound("a frame of 16 MB over loopback: p50 over that of gRPC", WIRE, at("gRPC", "ours of their p50"), 0.5, "x", peer=at("gRPC", "p50 ms"), of="ms: gRPC",
          limit=ratio(at("as it lies, over TCP", "p50 ms"), at("gRPC", "p50 ms")), isolates="the posed numbers sent as they lie in memory, over TCP, with no message about them"),
    Bound("listens after its start", READY, at("listens after", "here"), 0.3, "s"),
    Bound("whole preparation, 3.2 M tets: time", PAPER, at("whole", "ours, s"), 5, "s", limit=at("shared evenly", "ours, s"),
          isolates="its own processor seconds, over as many threads: nothing waits for another thread or a file"),
    Bound("whole preparation, 3.2 M tets: memory", PAPER, at("whole", "MiB"), 1024, "MiB"),
    Bound("a CT of 512 x 512 x 700 and its labels, from files to model", LARGE, at("multilabel", "all s"), 30, "s"),
    *(Bound(f"50 ms each way, 1 % lost, {encoding}: p95", LOSSY, at(encoding, "p95 in round trips"), 1.5, "round trips", limit=at("one packet", "p95 in round trips"),
            isolates="each pose answered by one packet, with nothing worked out") for encoding in ("f32", "u16-delta")),
    beside("32 whole bodies that are opened and not read", "32 clients that stop reading"),
    beside("1000 connections", "1000 idle connections"),
]
