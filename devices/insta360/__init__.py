"""Insta360 cameras: control over HTTP, live preview over TCP, their files and lens calibration."""
