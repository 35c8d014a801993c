"""A planar laser range finder."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from flatland.geometry import FloatArray, Pose, compose
from flatland.physics import RangeFinder, Scan, ScanRequest, scan_all
from flatland.plugin_api.parameters import read_pose
from flatland.plugins._beams import (
    BeamAngles,
    read_layers,
    read_no_hit,
)
from flatland.plugins._range_sensor import RangeSensor
from flatland.values import LaserScan

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flatland.config.reader import YamlReader
    from flatland.timekeeper import Timekeeper

REFLECTANCE_LAYER = "reflectance"


class Laser(RangeSensor):
    """Measures the distance to the nearest fixture along each of its beams.

    Attributes:
        body: The body on which the sensor is mounted.
        angles: Angles of the beams.
        range: Length of a beam [m].
        range_min: Shortest range that is measured [m]; a shorter one is reported as -inf.
        scan_time: Reported time between scans [s].
        time_increment: Reported time between beams [s].
        origin: (x, y, theta) of the sensor in the body frame.
        intensities: Intensities of the last scan computed, shape (n,), float32: 255 for a beam
            whose nearest hit is in the layer `reflectance`; in a world with materials, the
            intensities of `flatland.physics.Scan` for other hits; else 0. Shape (0,) in a world
            without the layer and without materials.
        beam_ends: End point of each beam in the sensor frame [m], shape (n, 2), read-only.
        last_scan: Pose of the sensor in the world frame and ranges [m], shape (n,), of the last
            scan computed; None before the first one, and after a scan of the core for
            `flatland.gym`. The ranges are equal to the emitted ones.
    """

    # The ranges may be in an array of the caller of `compute_scans`, which belongs to no state.
    outside_state: ClassVar[dict[str, Callable[[], object]]] = {"last_scan": lambda: None}

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the output.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: The topic is not a legal name.
        """
        self._read_mounting(config)
        self.angles = BeamAngles.from_config(config)
        self.origin = read_pose(config, "origin")
        self.scan_time, self.time_increment = self._read_times(config)
        noise = self._read_updates(config, "scan")
        # Calls of `compute_ranges` have random numbers of their own, so that they do not change the
        # scans that are emitted.
        self._computed = self._uncounted_stream("compute_ranges")
        self._has_noise = noise is not None
        no_hit = read_no_hit(config, self.range)
        self._mask = read_layers(config, self.world)
        upside_down: bool = config.get("upside_down", "bool", False)
        self._roll = math.pi if upside_down else 0.0
        self.beam_ends = self.angles.end_points(self.range, upside_down)
        self.last_scan: tuple[Pose, FloatArray] | None = None
        reflectance = self.world.collision_filter.layer_id(REFLECTANCE_LAYER)
        self.intensities: FloatArray = _no_intensities()
        self._cast: Scan | None = None  # by `cast_scans`, for the update that follows
        self._finder = RangeFinder(
            self.angles.fan(self.range, upside_down),
            self.range,
            origin=self.origin,
            mask=self._mask,
            reflect_mask=1 << reflectance if reflectance >= 0 else 0,
            range_min=self.range_min,
            no_hit=no_hit,
            noise=noise,
            out_of_range=self._out_of_range,
        )
        output = self.output(config.get("topic", "string", "scan"), LaserScan)
        self._update = self._start(output, cast_scans)
        self.always_publish = config.get("always_publish", "bool", False)

    @property
    def always_publish(self) -> bool:
        """Whether to compute scans that are not wanted; settable."""
        return self._always_publish

    @always_publish.setter
    def always_publish(self, value: bool) -> None:
        self._always_publish = value
        self._update.outputs = None if value else (self._output,)

    def _read_times(self, config: YamlReader) -> tuple[float, float]:
        scan_time, time_increment = (
            config.get(key, "float", 0.0, finite=True, minimum=0)
            for key in ("scan_time", "time_increment")
        )
        # The duration from the first to the last beam; a product of rounded numbers.
        duration = time_increment * (self.angles.count - 1)
        if scan_time and duration > scan_time * (1 + 1e-6):
            raise config.invalid(
                "time_increment",
                f"{self.angles.count} beams must not take longer than the scan_time of "
                f"{scan_time:g} s, got {time_increment:g} s per beam, {duration:g} s in total",
            )
        return scan_time, time_increment

    def _publish(self, timekeeper: Timekeeper) -> None:
        try:
            super()._publish(timekeeper)
        finally:
            self._cast = None

    def _measure(self, stamp: int) -> LaserScan:
        scan = self._cast
        if scan is None:
            scan = self._scan()
        self._keep(scan)
        angles = self.angles
        return LaserScan(
            stamp=stamp,
            frame_id=self.frame_id,
            angle_min=angles.minimum,
            angle_max=angles.maximum,
            angle_increment=angles.increment,
            time_increment=self.time_increment,
            scan_time=self.scan_time,
            range_min=self.range_min,
            range_max=self.range,
            ranges=scan.ranges,
            intensities=self.intensities,
        )

    def compute_ranges(self) -> FloatArray:
        """Computes a scan at the current pose, with noise, and sets `intensities`.

        The noise is a function of the seed and of the number of calls: published scans do not
        depend on calls of this method. See `compute_scans` for many lasers.

        Returns:
            Range of each beam [m], shape (n,), float32, a new array for each call.
        """
        return compute_scans((self,))[0]

    def state(self) -> int | None:
        """Returns the number of random scans that were computed on request, None for 0."""
        return self._computed.updates or None

    @property
    def _is_random(self) -> bool:
        """Whether scans depend on the number of the update: noise, or materials of the world."""
        return self._has_noise or self.world.physics.has_materials

    @property
    def _is_wanted(self) -> bool:
        return self._output.wanted or self._always_publish

    def _keep(self, scan: Scan) -> None:
        """Sets the attributes that describe the last scan."""
        self.last_scan = (scan.pose, scan.ranges)
        self.intensities = _no_intensities() if scan.intensities is None else scan.intensities

    @property
    def finder(self) -> RangeFinder:
        """The beams, for scans in the core."""
        return self._finder

    @property
    def has_noise(self) -> bool:
        """Whether ranges have noise."""
        return self._has_noise

    @property
    def measures_intensities(self) -> bool:
        """Whether scans have intensities, at least in a world without materials."""
        return self.world.collision_filter.layer_id(REFLECTANCE_LAYER) >= 0

    @property
    def next_computed(self) -> tuple[int, int]:
        """Key of the random numbers of the next scan on request, and its number in the stream."""
        return self._computed.key, self._computed.updates + self._has_noise

    def count_computed(self) -> None:
        """Counts a scan on request that the core has computed with the numbers `next_computed`."""
        self._computed.begin_update()

    def cast_without_noise(self) -> tuple[Pose, FloatArray]:
        """Casts the beams from the current pose without changing the state of the laser.

        Returns:
            Pose of the sensor in the world frame, and the exact range of each beam [m],
            shape (n,), float32, NaN for a miss.
        """
        pose = compose(self.body.pose, self.origin)
        fractions, _ = self.world.physics.cast_rays(pose, self.beam_ends, self._mask)
        return pose, fractions * np.float32(self.range)


def compute_scans(
    lasers: Sequence[Laser], out: FloatArray | None = None, num_threads: int = 0
) -> list[FloatArray]:
    """Computes a scan of each of many lasers in one call, on several threads.

    Equal to `[laser.compute_ranges() for laser in lasers]`, bit by bit and for any number of
    threads, but faster. Releases the GIL while it computes more than 2000 beams. If an error is
    raised, nothing has changed.

    Args:
        lasers: The lasers, of one or of several worlds, which must not be stepping.
        out: Array for the ranges, shape (len(lasers), n), float32, C-contiguous, if all lasers have
            n beams. Then the returned arrays, and those in `Laser.last_scan`, are views of its
            rows, which the caller may overwrite later. None for new arrays.
        num_threads: Maximum number of threads; 0 for all processors that are available.

    Returns:
        Range of each beam of each laser [m], shapes (n,), float32.

    Raises:
        TypeError: `out` is not a C-contiguous array of type float32.
        ValueError: `out` has a wrong shape, `num_threads` is negative, or the pose of a body is not
            finite.
        StaleHandleError: The body of a laser was destroyed, or its world is closed.
        WorldLockedError: A world is stepping.
    """
    are_random = [laser._is_random for laser in lasers]
    requests = []
    for laser, is_random in zip(lasers, are_random, strict=True):
        if is_random:
            laser._computed.begin_update()
        stream = laser._computed
        requests.append(ScanRequest(laser._finder, laser.body, stream.key, stream.updates))
    try:
        scans = _perform(requests, out, num_threads)
    except BaseException:
        for laser, is_random in zip(lasers, are_random, strict=True):
            laser._computed.updates -= is_random
        raise
    for laser, scan in zip(lasers, scans, strict=True):
        laser._keep(scan)
    return [scan.ranges for scan in scans]


def cast_scans(lasers: Sequence[Laser]) -> None:
    """Casts the scans of the next update of several lasers in one call of the core.

    The scans are the same as if each laser cast its own in its update.

    Args:
        lasers: The lasers, of one or of several worlds, which must not be stepping.

    Raises:
        ValueError: The pose of a body is not finite.
        StaleHandleError: The body of a laser was destroyed, or its world is closed.
        WorldLockedError: A world is stepping.
    """
    wanted = [laser for laser in lasers if laser._is_wanted]
    requests = [
        ScanRequest(laser._finder, laser.body, laser._noise.key, laser._noise.updates + 1)
        for laser in wanted
    ]
    for laser, scan in zip(wanted, _perform(requests, None, 0), strict=True):
        laser._cast = scan


def _perform(
    requests: Sequence[ScanRequest], out: FloatArray | None, num_threads: int
) -> list[Scan]:
    if len(requests) == 1 and out is None and num_threads >= 0:
        finder, body, stream, update = requests[0]
        return [finder.scan(body, stream, update)]
    return scan_all(requests, out, num_threads)


def _no_intensities() -> FloatArray:
    return np.zeros(0, dtype=np.float32)
