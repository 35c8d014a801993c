"""Recordings: everything that is needed to repeat a run, and its repetition."""

from flatland.recording.log_file import RecordingError
from flatland.recording.recorder import Recorder
from flatland.recording.replay import Difference, Replay

__all__ = ["Difference", "Recorder", "RecordingError", "Replay"]
