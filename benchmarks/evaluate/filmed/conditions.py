"""Under which conditions a tracker is judged: the sensor, the video, the camera pose's error."""

from __future__ import annotations

from dataclasses import dataclass

from sim.camera.sensor import SensorOptions


@dataclass(frozen=True, slots=True)
class Conditions:
    """Everything between the room and the tracker.

    Attributes:
        lens_size_px: side of each lens's square picture, even.
        noise: pixel noise against that of the simulated sensor; 0 leaves it out.
        drift: how far exposure and colour drift, against the simulated sensor; 0 holds them.
        bitrate_mbps: of the H.264 stream of both lenses at 10 pictures a second.
        pose_error_deg: how far the known camera pose is turned, about a random axis.
        pose_error_cm: how far it is shifted, in a random direction.
    """

    lens_size_px: int = 1440
    noise: float = 1.0
    drift: float = 1.0
    bitrate_mbps: float = 24.0
    pose_error_deg: float = 0.5
    pose_error_cm: float = 1.0

    def sensor(self) -> SensorOptions:
        """The simulated sensor at this noise and drift."""
        usual = SensorOptions()
        return SensorOptions(
            vignetting=usual.vignetting,
            exposure_drift=self.drift * usual.exposure_drift,
            colour_drift=self.drift * usual.colour_drift,
            drift_time_s=usual.drift_time_s,
            read_noise=self.noise * usual.read_noise,
            shot_noise=self.noise * usual.shot_noise,
        )
