"""Checks of the number and the time of samples, the same for every kind of device."""

from __future__ import annotations

from lsds.testing.bench import Bench

WATCHED_S = 1.0
"""Time for which a device is read, s; chosen."""
OLDEST_S = 0.2
"""Greatest age of the freshest sample of a device, s: the limit of a cell with default options."""
_DRIFT = 0.2
"""Maximum difference of stamped and passed time, as a share of the passed time; chosen."""
_STAMPED_READS = 30
"""Number of reads of a device under the wall clock; chosen."""


def check_number_and_time_go_up_together(bench: Bench) -> None:
    """`seq` and `t_ns` are whole numbers, from zero, that never go back and only go up together."""
    with bench.device() as device:
        last = None
        # Long enough for a counter of one byte to go round; the images of a camera would take too long.
        for sample in bench.samples(device, 4.0 if bench.virtual and bench.kind != "sensor" else 0.5):
            for name in ("seq", "t_ns"):
                value = getattr(sample, name)
                assert type(value) is int, f"{name} is {value!r}, not an int"
            assert sample.seq >= 0, f"seq is {sample.seq}; it counts from zero"
            if last is not None:
                went = f"seq went from {last.seq} to {sample.seq} and t_ns from {last.t_ns} to {sample.t_ns}"
                assert sample.seq >= last.seq, f"{went}: a sequence number went back"
                same = (sample.seq > last.seq) == (sample.t_ns > last.t_ns)
                assert same, f"{went}: number and time must go up together, and only with a new sample"
            last = sample


def check_time_follows_the_clock(bench: Bench) -> None:
    """`t_ns` is on the rig's clock in nanoseconds: not in the future, not old, and as fast as the clock."""
    with bench.device() as device:
        first, begun_ns = bench.read(device), bench.clock.now()
        last, now = first, begun_ns
        ages_ns = []
        # A camera declares how late its images are.
        oldest_s = OLDEST_S + (device.spec.latency_s if bench.kind == "sensor" else 0.0)
        for sample in bench.samples(device, WATCHED_S):
            now, last = bench.clock.now(), sample
            ages_ns.append(now - sample.t_ns)
            ahead_s = (sample.t_ns - now) * 1e-9
            assert ahead_s <= 0, (
                f"a sample from the future: t_ns is {sample.t_ns}, {ahead_s:.3g} s ahead of the clock ({now}); use "
                "context.clock, not the time of day"
            )
        passed_s, stamped_s = (now - begun_ns) * 1e-9, (last.t_ns - first.t_ns) * 1e-9
    assert abs(stamped_s - passed_s) <= _DRIFT * passed_s + 0.1, (
        f"t_ns advanced by {stamped_s:g} s while the clock advanced by {passed_s:g} s; stamp each sample with the "
        "time at which it was taken, in nanoseconds"
    )
    # A clock that begins at zero has no older times at first, and a busy machine delays some reads.
    age_s = min(ages_ns[len(ages_ns) // 2 :]) * 1e-9
    assert age_s < oldest_s, (
        f"samples are {age_s:.3g} s old or older; return the newest, stamped with the time at which it was taken, or "
        "raise StaleData"
    )


def check_new_samples_come(bench: Bench) -> None:
    """New samples arrive, each with a greater `seq`."""
    with bench.device() as device:
        numbers = {sample.seq for sample in bench.samples(device, WATCHED_S)}
        assert len(numbers) >= 2, (
            f"seq was {min(numbers)} in all samples of {WATCHED_S} s; count samples at their source"
        )


def check_read_repeats_the_newest(bench: Bench) -> None:
    """`read` returns the newest sample again if there is no newer one; it does not wait for one."""
    with bench.device() as device:
        first = bench.read(device)
        reads = [device.read() for _ in range(3 if bench.virtual else _STAMPED_READS)]
        if bench.virtual:
            found = [sample.seq for sample in (first, *reads)]
            assert len(set(found)) == 1, f"at one instant read() returned seq {found}; number samples, not reads"
        elif bench.kind == "sensor":
            found = [sample.seq for sample in reads]
            assert len(set(found)) < len(found), (
                f"{len(found)} reads in a row returned {len(found)} frames; return the newest frame at once instead of "
                "waiting for the next"
            )


STAMP_CHECKS = (
    check_number_and_time_go_up_together,
    check_time_follows_the_clock,
    check_new_samples_come,
    check_read_repeats_the_newest,
)
