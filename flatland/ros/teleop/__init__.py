"""Teleoperation by keyboard."""
