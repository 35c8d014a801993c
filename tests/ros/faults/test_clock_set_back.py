"""Jumps of the machine's clock, back and forth, have no effect on a running node.

A library that is loaded into the process shifts the time of day, and no other clock, as when the
clock of a machine is set.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from programs import run_program
from rosgraph_msgs.msg import Clock

SHIFT = """
#include <cstdint>
#include <cstdlib>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <ctime>
#include <unistd.h>

static const volatile std::int64_t* offset;  // s, in a file shared with the test

__attribute__((constructor)) static void start() {
    const int file = open(std::getenv("CLOCK_OFFSET"), O_RDONLY);
    void* memory = mmap(nullptr, sizeof *offset, PROT_READ, MAP_SHARED, file, 0);
    offset = static_cast<const std::int64_t*>(memory);
    close(file);
}

extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
    const int result = static_cast<int>(syscall(SYS_clock_gettime, clock, now));
    if (offset != nullptr && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
        now->tv_sec += *offset;
    }
    return result;
}

extern "C" time_t time(time_t* result) noexcept {
    timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (result != nullptr) *result = now.tv_sec;
    return now.tv_sec;
}

extern "C" int gettimeofday(timeval* result, void*) noexcept {
    timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    *result = {now.tv_sec, now.tv_nsec / 1000};
    return 0;
}
"""
RATE = 200  # Hz
STEPS = 100
HOUR = 3600  # s


def test_jumps_of_the_clock_do_not_disturb_the_simulation(
    launcher: Any, ros: Any, write_world: Callable[..., Path], tmp_path: Path
) -> None:
    source, library, offset = (tmp_path / name for name in ("shift.cpp", "shift.so", "offset"))
    source.write_text(SHIFT)
    run_program(["g++", "-shared", "-fPIC", "-o", library, source], check=True)
    offset.write_bytes(struct.pack("q", 0))
    launcher.environment = {
        **launcher.environment,
        "LD_PRELOAD": str(library),
        "CLOCK_OFFSET": str(offset),
    }
    server = launcher.server(
        write_world("[{name: first, model: ball.model.yaml}]"), update_rate=RATE
    )
    clock = ros.topic("/clock", Clock)
    last = clock.take(2)[-1].clock.to_nsec()  # The first two may be equal.
    for jump in (-HOUR, 24 * HOUR, -240 * HOUR):
        with offset.open("r+b") as file:
            file.write(struct.pack("q", jump))
        # The stamp of a warning shows that the process sees the new time.
        assert ros.spawn("ball.model.yaml", f"ball{jump}").success
        stamp = float(server.wait_for_line(rf"\[WARN\] \[([0-9.]+),.*ball{jump}.* overlaps")[1])
        assert abs(stamp - time.time() - jump) < HOUR / 2
        # The steps are neither delayed nor made at once: `now` is published after `start`.
        start = time.monotonic()
        now = ros.step()
        while last < now + STEPS * 1e9 / RATE:
            stamp_ns = clock.next().clock.to_nsec()
            assert stamp_ns > last
            last = stamp_ns
        assert time.monotonic() - start > STEPS / RATE / 3
        assert ros.delete(f"ball{jump}").success
    assert "Traceback" not in server.output
    assert server.stop() == 0
